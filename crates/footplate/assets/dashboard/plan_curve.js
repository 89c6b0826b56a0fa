// Curves of the drawing, as lists of points.

/** Points per curve. */
const POINTS = 25;

/** From a point and direction (rad) to another: an arc if there is one, otherwise a curve near it. */
export function bezier(from, leaves, to, arrives) {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const chord = Math.hypot(dx, dy);
  if (chord === 0) return [from, to];
  const direction = Math.atan2(dy, dx);
  // The handle of an arc of twice this angle; limited to 120°, beyond which it grows without bound.
  const handle = (angle) => 2 * chord / (3 * (1 + Math.max(Math.cos(angle - direction), -0.5)));
  const [one, other] = [handle(leaves), handle(arrives)];
  const first = [from[0] + one * Math.cos(leaves), from[1] + one * Math.sin(leaves)];
  const second = [to[0] - other * Math.cos(arrives), to[1] - other * Math.sin(arrives)];
  return Array.from({ length: POINTS }, (_, nth) => {
    const [t, u] = [nth / (POINTS - 1), 1 - nth / (POINTS - 1)];
    return [0, 1].map((axis) => u ** 3 * from[axis] + 3 * u * u * t * first[axis] + 3 * u * t * t * second[axis] + t ** 3 * to[axis]);
  });
}

const apart = (one, other) => Math.hypot(other[0] - one[0], other[1] - one[1]);

/** The length of a curve. */
export const lengthOf = (points) => points.slice(1).reduce((sum, point, nth) => sum + apart(points[nth], point), 0);

/** The point at a part of a curve's length. */
export const between = (points, part) => cut(points, part, part)[0];

/** A curve from one part of its length to another. */
export function cut(points, from, to) {
  const whole = lengthOf(points);
  const [low, high] = [from * whole, to * whole];
  const found = [];
  let distance = 0;
  for (const [nth, point] of points.entries()) {
    if (nth === 0) {
      if (low <= 0) found.push(point);
      continue;
    }
    const before = points[nth - 1];
    const step = apart(before, point);
    const at = (where) => [0, 1].map((axis) => before[axis] + (point[axis] - before[axis]) * (step > 0 ? (where - distance) / step : 0));
    if (distance < low && low <= distance + step) found.push(at(low));
    if (low < distance + step && distance + step < high) found.push(point);
    if (distance < high && high <= distance + step) found.push(at(high));
    distance += step;
  }
  return found.length > 0 ? found : [points.at(-1)];
}

/** The point of a curve nearest to a given point, as a part of its length, and its distance. */
export function nearest(points, [x, y]) {
  const whole = lengthOf(points) || 1;
  let best = { away: Infinity, part: 0 };
  let distance = 0;
  for (const [nth, [x2, y2]] of points.entries()) {
    if (nth === 0) continue;
    const [x1, y1] = points[nth - 1];
    const square = (x2 - x1) ** 2 + (y2 - y1) ** 2;
    const part = square > 0 ? Math.min(Math.max(((x - x1) * (x2 - x1) + (y - y1) * (y2 - y1)) / square, 0), 1) : 0;
    const away = Math.hypot(x - x1 - part * (x2 - x1), y - y1 - part * (y2 - y1));
    if (away < best.away) best = { away, part: (distance + part * Math.sqrt(square)) / whole };
    distance += Math.sqrt(square);
  }
  return best;
}

/** A curve as SVG path data. */
export const written = (points) => points.map(([x, y], nth) => `${nth ? "L" : "M"}${x.toFixed(2)} ${y.toFixed(2)}`).join("");
