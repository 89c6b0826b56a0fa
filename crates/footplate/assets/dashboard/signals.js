// Signals without wires: at each end of a block and at each turnout, what the reservation of a train allows it.

import { svg } from "./dom.js";

const KEPT_AS = "signals";
/** Beyond a border, track that is reserved at this distance (mm) is reserved past it. */
const PAST_MM = 1;
/** The most edges that one train's authority is followed over: more than a lap of any layout in use. */
const MOST_EDGES = 200;

/** Whether the reader wants to see signals. */
export function showsSignals() {
  try {
    return localStorage.getItem(KEPT_AS) === "shown";
  } catch {
    return false;
  }
}

export function chooseSignals(isShown) {
  try {
    localStorage.setItem(KEPT_AS, isShown ? "shown" : "hidden");
  } catch {
    // A browser without storage hides them next time.
  }
}

export class Signals {
  #edges; #nodes; #layer; #unit; #signals = new Map();

  /** `curve` returns the drawn points of an edge in its own direction. */
  constructor(edges, nodes, curve, unit, layer) {
    [this.#edges, this.#nodes, this.#layer, this.#unit] = [edges, nodes, layer, unit];
    for (const edge of edges.values()) {
      const { kind, is_boundary: isBoundary } = nodes.get(edge.to);
      if (!isBoundary && kind !== "branch" && kind !== "merge" || edge.length_mm === 0) continue;
      const [[x1, y1], [x2, y2]] = curve(edge.id).slice(-2);
      const long = Math.hypot(x2 - x1, y2 - y1) || 1;
      this.#signals.set(edge.id, { at: [x2, y2], ahead: [(x2 - x1) / long, (y2 - y1) / long] });
    }
  }

  /** A bar beside the track for stop, an arrow in the direction of travel for proceed. */
  #draw({ at: [x, y], ahead: [dx, dy] }, isProceed) {
    const point = (ahead, right) => `${(x + this.#unit * (ahead * dx - right * dy)).toFixed(2)} ${(y + this.#unit * (ahead * dy + right * dx)).toFixed(2)}`;
    return isProceed ? `M${point(-6, 1.1)}L${point(-6, 2.9)}L${point(-4.2, 2)}Z` : `M${point(-5.2, 1)}L${point(-5.2, 3)}L${point(-4.6, 3)}L${point(-4.6, 1)}Z`;
  }

  /** The edges at whose ends a signal shows proceed: the train may run over its reservation past them. */
  #proceeds({ trains, turnouts }) {
    const proceeds = new Set();
    for (const { body, held, doing, step } of trains) {
      let edge = doing || step > 0 ? this.#edges.get(body.at(-1)?.edge) : undefined;
      for (let count = 0; edge && count < MOST_EDGES; count++) {
        const { kind, number } = this.#nodes.get(edge.to);
        const next = [...this.#edges.values()].find(({ from, leg }) => from === edge.to && (kind !== "branch" || leg === turnouts[number]));
        if (!next || !reserves(held, next)) break;
        proceeds.add(edge.id);
        edge = next;
      }
    }
    return proceeds;
  }

  show(picture, isShown) {
    this.#layer.style.display = isShown ? "" : "none";
    if (!isShown) return;
    const proceeds = this.#proceeds(picture);
    for (const [id, signal] of this.#signals) {
      const isProceed = proceeds.has(id);
      if (signal.isProceed === isProceed) continue;
      signal.isProceed = isProceed;
      signal.path ??= svg("path", {}, this.#layer);
      signal.path.setAttribute("class", `signal ${isProceed ? "proceed" : "stop"}`);
      signal.path.setAttribute("d", this.#draw(signal, isProceed));
    }
  }
}

/** Whether the beginning of an edge is reserved. Reservations are written for the first edge of each pair. */
function reserves(held, { id, length_mm: mm }) {
  const past = Math.min(PAST_MM, mm / 2);
  const at = id % 2 ? mm - past : past;
  return held.some(({ edge, from_mm: from, to_mm: to }) => edge >> 1 === id >> 1 && from <= at && at <= to);
}
