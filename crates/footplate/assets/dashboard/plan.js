// The drawing of a layout: curves through the points of its file, or a generated drawing if the file has none.

import { planWithoutPoints } from "./plan_without_points.js";
import { bezier, between, lengthOf } from "./plan_curve.js";
import { placeOf, senseOf } from "./places.js";

/** Edges that would bend more than this at an end are drawn with a kink there, like the plan (rad). */
const MOST_BEND = 1.75;
/** An edge that would turn back at an end does not follow its points (rad). */
const TURNS_BACK = 2.7;
/** A plan is to scale if this share of its edges has the length of the distance between their points, within 2 %. */
const STRAIGHT_SHARE = 0.3;
const TO_SCALE = 1.02;
/** Two points do not determine an edge that bends more than half round between them. */
const LEAST_STRAIGHT = 0.62;
/** The weight of a bent edge for the direction at its ends, relative to a straight one. */
const BENDS_LESS = 8;
/** Edges nearer to each other than this part of the drawing look like one line. */
const ONE_LINE = 0.004;

/**
 * A drawn layout: `points` by place, and by the number of each edge pair the points of its curve, in the direction of the even
 * edge.
 */
export function planOf(layout) {
  return planOfPoints(layout) ?? planWithoutPoints(layout);
}

/** The drawing by the points of the file; `null` if they omit a place, put two edges onto one line, or do not determine an edge. */
function planOfPoints(layout) {
  const points = new Map(layout.nodes.filter(({ point }) => point).map(({ id, point }) => [placeOf(id), point]));
  const places = new Set(layout.nodes.map(({ id }) => placeOf(id)));
  const ends = new Set(layout.nodes.filter(({ kind }) => kind === "end").map(({ id }) => placeOf(id)));
  if ([...places].some((place) => !points.has(place) && !ends.has(place))) return undefined;
  const straight = straightness(layout, points);
  const headings = headingsAt(layout, points, straight);
  setEnds(layout, points, headings);
  const rails = new Map();
  for (const edge of layout.edges) {
    if (edge.id % 2) continue;
    const [from, to] = [points.get(placeOf(edge.from)), points.get(placeOf(edge.to))];
    if (!from || !to) return undefined;
    const chord = Math.atan2(to[1] - from[1], to[0] - from[0]);
    const leaves = along(headings, edge.from) ?? chord;
    const arrives = along(headings, edge.to) ?? chord;
    const apart = Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (apart > 0 && straight(edge.length_mm, apart) < LEAST_STRAIGHT) return undefined;
    const bends = [leaves, arrives].map((heading) => turn(heading, chord));
    if (apart > 0 && Math.max(...bends) > TURNS_BACK) return undefined;
    const [first, last] = [leaves, arrives].map((heading, nth) => (bends[nth] > MOST_BEND ? chord : heading));
    rails.set(edge.id >> 1, bezier(from, first, to, last));
  }
  return haveOneLine([...rails.values()]) ? undefined : { points, rails };
}

const turn = (one, other) => Math.abs(Math.atan2(Math.sin(one - other), Math.cos(one - other)));

/** The direction of the track at a node, as a train passes it. */
function along(headings, node) {
  const heading = headings.get(placeOf(node));
  return heading === undefined ? undefined : heading + (senseOf(node) < 0 ? Math.PI : 0);
}

/**
 * How straight each edge is, if the points are to scale: 1 if it is as long as the distance between its points, less if it bends.
 * Unknown if the plan is not to scale.
 */
function straightness(layout, points) {
  const ratios = layout.edges.flatMap(({ from, to, length_mm: mm }) => {
    const [one, other] = [points.get(placeOf(from)), points.get(placeOf(to))];
    const apart = one && other ? Math.hypot(one[0] - other[0], one[1] - other[1]) : 0;
    return apart > 0 && mm > 0 ? [mm / apart] : [];
  });
  const scale = Math.min(...ratios);
  const isToScale = ratios.filter((ratio) => ratio < scale * TO_SCALE).length > ratios.length * STRAIGHT_SHARE;
  return (mm, apart) => (isToScale && mm > 0 ? Math.min(scale * apart / mm, 1) : 1);
}

/** The track is straight through each place: its direction follows from the neighbours, weighted by nearness and straightness. */
function headingsAt(layout, points, straight) {
  const sums = new Map();
  for (const edge of layout.edges) {
    const [from, to] = [points.get(placeOf(edge.from)), points.get(placeOf(edge.to))];
    if (!from || !to) continue;
    const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    const square = dx * dx + dy * dy;
    if (square === 0) continue;
    // The straight leg continues the track.
    const weight = senseOf(edge.from) * (edge.leg === "curved" ? 0.3 : 1) * straight(edge.length_mm, Math.sqrt(square)) ** BENDS_LESS / square;
    const sum = sums.get(placeOf(edge.from)) ?? [0, 0];
    sums.set(placeOf(edge.from), [sum[0] + dx * weight, sum[1] + dy * weight]);
  }
  return new Map([...sums].filter(([, [x, y]]) => x || y).map(([place, [x, y]]) => [place, Math.atan2(y, x)]));
}

/** Ends without a point: a short distance beyond their neighbour, beside the straight leg. */
function setEnds(layout, points, headings) {
  const lengths = layout.edges.flatMap(({ from, to }) => {
    const [one, other] = [points.get(placeOf(from)), points.get(placeOf(to))];
    return one && other ? [Math.hypot(one[0] - other[0], one[1] - other[1])] : [];
  }).sort((one, other) => one - other);
  const length = lengths[lengths.length >> 1] ?? 1;
  for (const { from, to, leg } of layout.edges) {
    if (points.has(placeOf(to)) || !points.has(placeOf(from))) continue;
    const [x, y] = points.get(placeOf(from));
    const heading = (along(headings, from) ?? 0) + (leg === "curved" ? 0.35 : 0);
    points.set(placeOf(to), [x + length * Math.cos(heading), y + length * Math.sin(heading)]);
    headings.set(placeOf(to), (along(headings, from) ?? 0) + (senseOf(to) < 0 ? Math.PI : 0));
  }
}

/** Whether any two edges overlap. */
function haveOneLine(rails) {
  const all = rails.flat();
  const side = Math.max(...[0, 1].map((axis) => Math.max(...all.map((point) => point[axis])) - Math.min(...all.map((point) => point[axis]))));
  const near = (point, rail) => rail.some((other) => Math.hypot(point[0] - other[0], point[1] - other[1]) < side * ONE_LINE);
  // Turnouts in one place have edges of zero length between them.
  const drawn = rails.filter((rail) => lengthOf(rail) > 2 * side * ONE_LINE);
  const looks = drawn.map((rail) => [0.3, 0.5, 0.7].map((part) => between(rail, part)));
  return drawn.some((_, nth) => drawn.some((other, place) => place !== nth && looks[nth].every((point) => near(point, other))));
}
