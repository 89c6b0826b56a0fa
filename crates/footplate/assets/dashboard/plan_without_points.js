// Draws a layout whose file has no points: its longest circuit as an oval, or its longest line as a straight, and every other
// track beside it.

import { bezier } from "./plan_curve.js";
import { placeOf, senseOf } from "./places.js";

/** The least drawn length of an edge, as a part of all edges. */
const LEAST_PART = 0.02;
/** The distance between parallel tracks, as a part of the main line. */
const GAP_PART = 0.03;
/** Each straight of the oval, as a part of its circumference. */
const STRAIGHT_PART = 0.32;
/** The weight of a curved leg's length in the search for the main line, which prefers straight legs. */
const CURVED_COUNTS = 0.8;
/** The most paths tried for the main line: enough for any layout drawn by hand. */
const MOST_TRIED = 60_000;
/** Points per edge: at least 25, and 160 for the whole circuit. */
const POINTS = 25;
const POINTS_ROUND = 160;
/** The least drawn length of a dead end, in track distances, so that it lies beside its turnout and not on it. */
const LEAST_GAPS = 5;

export function planWithoutPoints(layout) {
  return new Drawing(layout).plan();
}

class Drawing {
  #edges; #leaving = new Map(); #least; #points = new Map(); #rails = new Map(); #spots = new Map(); #base; #lanes = new Map();

  constructor(layout) {
    this.#edges = layout.edges;
    this.#least = LEAST_PART * layout.edges.reduce((sum, { length_mm: mm }) => sum + mm, 0) / 2 || 1;
    for (const edge of layout.edges) {
      const leaving = this.#leaving.get(edge.from) ?? [];
      // The straight leg first: the main line follows it if both are equally long.
      this.#leaving.set(edge.from, edge.leg === "curved" ? [...leaving, edge] : [edge, ...leaving]);
    }
  }

  plan() {
    let top = 0;
    // Track that is not connected is drawn below.
    for (let start = this.#unplaced(); start !== undefined; start = this.#unplaced()) {
      const main = this.#mainLine(start);
      if (main.path.length === 0) { this.#points.set(placeOf(start), [0, top]); continue; }
      this.#lanes = new Map();
      this.#base = new Base(main.path.map((edge) => this.#long(edge)), main.isRound);
      this.#base.top = top;
      this.#placeMain(main);
      for (let track = this.#nextTrack(); track; track = this.#nextTrack()) this.#placeTrack(track);
      top = Math.max(...[...this.#rails.values()].flat().map(([, y]) => y)) + 4 * this.#base.gap;
    }
    return { points: this.#points, rails: this.#rails };
  }

  #long = (edge) => Math.max(edge.length_mm, this.#least);

  #unplaced() {
    const edge = this.#edges.find(({ id }) => !this.#rails.has(id >> 1));
    return edge?.from;
  }

  /** The longest path that passes no place twice: a circuit, if one is at least half as long as the longest line. */
  #mainLine(start) {
    const [round, line] = [{ long: 0, path: [], isRound: true }, { long: 0, path: [], isRound: false }];
    let tried = 0;
    const most = () => tried > MOST_TRIED;
    const walk = (first, node, seen, path, long) => {
      tried += 1;
      if (long > line.long + 1e-6) Object.assign(line, { long, path: [...path] });
      for (const edge of this.#leaving.get(node) ?? []) {
        if (most()) return;
        const further = long + this.#long(edge) * (this.#isCurved(edge) ? CURVED_COUNTS : 1);
        if (edge.to === first && further > round.long + 1e-6) Object.assign(round, { long: further, path: [...path, edge] });
        if (seen.has(placeOf(edge.to))) continue;
        seen.add(placeOf(edge.to));
        path.push(edge);
        walk(first, edge.to, seen, path, further);
        path.pop();
        seen.delete(placeOf(edge.to));
      }
    };
    const joined = this.#joined(start);
    // Ends first: a line runs from one end to another.
    const starts = [...joined].sort((one, other) => this.#arriving(one) - this.#arriving(other));
    for (const node of starts) {
      if (most()) break;
      walk(node, node, new Set([placeOf(node)]), [], 0);
    }
    return round.long > line.long / 2 ? round : line;
  }

  /** Whether an edge begins or ends at the curved leg of a turnout. */
  #isCurved = (edge) => edge.leg === "curved" || this.#edges[edge.id ^ 1]?.leg === "curved";

  #arriving = (node) => (this.#leaving.get(node ^ 1) ?? []).length;

  #joined(start) {
    const found = new Set([start, start ^ 1]);
    for (const node of found) {
      for (const edge of this.#leaving.get(node) ?? []) { found.add(edge.to); found.add(edge.to ^ 1); }
    }
    return found;
  }

  #placeMain({ path, isRound }) {
    let at = 0;
    for (const edge of path) {
      this.#spot(edge.from, at, 0, 1);
      this.#draw(edge, this.#base.curve(at, at + this.#long(edge), () => 0));
      at += this.#long(edge);
      if (!isRound) this.#spot(edge.to, at, 0, 1);
    }
  }

  /** Puts a place on a lane, where a train that passes this node runs along the main line (`sense` +1) or against it. */
  #spot(node, at, lane, sense) {
    const [x, y] = this.#base.point(at, lane);
    this.#points.set(placeOf(node), [x, y]);
    this.#spots.set(placeOf(node), { at, lane, sense: sense * senseOf(node) });
  }

  #draw(edge, points) {
    this.#rails.set(edge.id >> 1, edge.id % 2 ? points.toReversed() : points);
  }

  /** The next track that begins at a drawn place: the shortest first, so that inner tracks lie inside. */
  #nextTrack() {
    let best;
    for (const edge of this.#edges) {
      if (this.#rails.has(edge.id >> 1) || !this.#spots.has(placeOf(edge.from))) continue;
      const track = this.#track(edge);
      if (!best || track.order < best.order) best = track;
    }
    return best;
  }

  /** Follows the straight legs from an edge to a drawn place or to an end. */
  #track(first) {
    const edges = [first];
    const seen = new Set([placeOf(first.from)]);
    for (let edge = first; !this.#spots.has(placeOf(edge.to));) {
      seen.add(placeOf(edge.to));
      const next = (this.#leaving.get(edge.to) ?? []).find((one) => !this.#rails.has(one.id >> 1) && !seen.has(placeOf(one.to)));
      if (!next) break;
      edges.push(next);
      edge = next;
    }
    const [from, last] = [this.#spots.get(placeOf(first.from)), edges.at(-1).to];
    const to = this.#spots.get(placeOf(last));
    const leaves = from.sense * senseOf(first.from);
    const long = edges.reduce((sum, edge) => sum + this.#long(edge), 0);
    const span = to ? this.#base.ahead(from.at, to.at, leaves) : Math.max(long, LEAST_GAPS * this.#base.gap);
    const isBeside = !to || (leaves === to.sense * senseOf(last) && span > 0 && span < 0.8 * this.#base.long);
    return { edges, from, to, leaves, long, span, isBeside, order: (isBeside ? 0 : 1e9) + span + (to ? 0 : this.#base.long) };
  }

  #placeTrack(track) {
    const { edges, from, to, leaves, long, span, isBeside } = track;
    if (!isBeside) return this.#placeAcross(track);
    const isCrossover = to && edges.length === 1 && to.lane !== from.lane;
    const lane = isCrossover ? to.lane : this.#freeLane(from.lane, from.at, from.at + leaves * span);
    const ramp = isCrossover ? 1 : Math.min(to ? 0.4 : 0.7, 3.5 * this.#base.gap / span);
    const soft = (part) => { const t = Math.min(Math.max(part, 0), 1); return t * t * (3 - 2 * t); };
    const laneAt = (at) => {
      const part = leaves * (at - from.at) / span;
      const out = from.lane + (lane - from.lane) * soft(part / ramp);
      return to && !isCrossover ? out + (to.lane - lane) * soft((part - 1 + ramp) / ramp) : out;
    };
    let distance = 0;
    for (const edge of edges) {
      const [start, end] = [distance, distance + this.#long(edge)].map((mm) => from.at + leaves * span * mm / long);
      this.#draw(edge, this.#base.curve(start, end, laneAt));
      if (!this.#spots.has(placeOf(edge.to))) this.#spot(edge.to, end, laneAt(end), leaves);
      distance += this.#long(edge);
    }
  }

  /** A track that leads back or across: one curve with its places along it. */
  #placeAcross({ edges, from, to, leaves, long }) {
    const [start, end] = [this.#base.point(from.at, from.lane), this.#base.point(to.at, to.lane)];
    const facing = (spot, sense) => this.#base.heading(spot.at) + (sense < 0 ? Math.PI : 0);
    const curve = bezier(start, facing(from, leaves), end, facing(to, to.sense * senseOf(edges.at(-1).to)));
    let distance = 0;
    for (const edge of edges) {
      const parts = [distance / long, (distance + this.#long(edge)) / long];
      const points = Array.from({ length: POINTS }, (_, nth) => pointOf(curve, parts[0] + (parts[1] - parts[0]) * nth / (POINTS - 1)));
      this.#draw(edge, points);
      if (!this.#spots.has(placeOf(edge.to))) {
        this.#points.set(placeOf(edge.to), points.at(-1));
        // Tracks that begin here lie beside the main line as if this place did.
        this.#spots.set(placeOf(edge.to), { at: from.at + leaves * (distance + this.#long(edge)), lane: from.lane, sense: leaves * senseOf(edge.to) });
      }
      distance += this.#long(edge);
    }
  }

  /** The nearest lane that is free from one place to another. */
  #freeLane(lane, from, to) {
    const [low, high] = [Math.min(from, to), Math.max(from, to)];
    const out = Math.sign(lane) || 1;
    for (let aside = 1; ; aside += 1) {
      for (const found of [lane + out * aside, lane - out * aside]) {
        if (Math.round(found) === 0 || !this.#base.hasRoom(found)) continue;
        const key = Math.round(found);
        const taken = this.#lanes.get(key) ?? [];
        if (taken.some((one) => this.#base.meet(one, [low, high]))) continue;
        this.#lanes.set(key, [...taken, [low, high]]);
        return key;
      }
    }
  }
}

const pointOf = (curve, part) => {
  const at = Math.min(Math.max(part, 0), 1) * (curve.length - 1);
  const nth = Math.min(Math.floor(at), curve.length - 2);
  return [0, 1].map((axis) => curve[nth][axis] + (curve[nth + 1][axis] - curve[nth][axis]) * (at - nth));
};

/** The main line: an oval, run clockwise, or a straight line. Lanes are counted to its right. */
class Base {
  top = 0; long; gap; #isRound; #straight; #radius; #shift = 0;

  constructor(lengths, isRound) {
    this.long = lengths.reduce((sum, mm) => sum + mm, 0);
    this.gap = GAP_PART * this.long;
    this.#isRound = isRound;
    this.#straight = STRAIGHT_PART * this.long;
    this.#radius = (this.long - 2 * this.#straight) / (2 * Math.PI);
    if (isRound) this.#turnTo(lengths);
  }

  /** Rotates the oval so that most of its places lie on the straights. */
  #turnTo(lengths) {
    let at = 0;
    const places = lengths.map((mm) => { const here = at; at += mm; return here; });
    let best = -1;
    for (let nth = 0; nth < 48; nth += 1) {
      const shift = this.long * nth / 48;
      // A place in the middle of a straight counts more than one at its end.
      const score = places.reduce((sum, place) => {
        const on = (place + shift) % (this.long / 2) / this.#straight;
        return sum + (on <= 1 ? 1 - 0.5 * Math.abs(on - 0.5) : 0);
      }, 0);
      if (score > best + 1e-9) [best, this.#shift] = [score, shift];
    }
  }

  hasRoom = (lane) => !this.#isRound || lane * this.gap < 0.75 * this.#radius;

  /** The distance from one place to another in a direction. */
  ahead(from, to, sense) {
    const span = sense * (to - from);
    return this.#isRound ? ((span % this.long) + this.long) % this.long : span;
  }

  meet([low, high], [from, to]) {
    const turns = this.#isRound ? [-2, -1, 0, 1, 2] : [0];
    return turns.some((turn) => from + turn * this.long < high && to + turn * this.long > low);
  }

  #at(distance) {
    if (!this.#isRound) return { point: [distance, 0], heading: 0 };
    const at = (((distance + this.#shift) % this.long) + this.long) % this.long;
    const [straight, radius, half] = [this.#straight, this.#radius, this.long / 2];
    const isBack = at >= half;
    const on = isBack ? at - half : at;
    let [x, y, heading] = [on, 0, 0];
    if (on > straight) {
      heading = (on - straight) / radius;
      [x, y] = [straight + radius * Math.sin(heading), radius * (1 - Math.cos(heading))];
    }
    return isBack ? { point: [straight - x, 2 * radius - y], heading: heading + Math.PI } : { point: [x, y], heading };
  }

  heading = (distance) => this.#at(distance).heading;

  point(distance, lane) {
    const { point: [x, y], heading } = this.#at(distance);
    const aside = lane * this.gap;
    return [x - aside * Math.sin(heading), this.top + y + aside * Math.cos(heading)];
  }

  curve(from, to, laneAt) {
    const length = Math.max(POINTS, Math.ceil(POINTS_ROUND * Math.abs(to - from) / this.long));
    return Array.from({ length }, (_, nth) => {
      const at = from + (to - from) * nth / (length - 1);
      return this.point(at, laneAt(at));
    });
  }
}
