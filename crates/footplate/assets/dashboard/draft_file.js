// The text of a layout file from a drawing: sensors, boundaries, turnouts and open ends are its nodes; the pieces between them form its
// edges. Where two edges run over one crossing, the file says so. A slip is two turnouts, joined at their toes in its middle.

import { arcOf, halfOfSlip } from "./pieces.js";

/** Standard deviation of a catalogue length with its joint (mm). */
const LENGTH_UNCERTAINTY_MM = 1;
const S88_INPUTS = 16;
const S88_MODULES = "ABCDE";

const quoted = (text) => JSON.stringify(text.replace(/[\u0000-\u001f\u007f]/g, " ").trim() || "my layout");
const point = ({ x, y }) => `[${Math.round(x)}, ${Math.round(y)}]`;

export class DraftFile {
  #draft; #name; #joints; #jointOf = new Map(); #sensors = []; #boundaries = []; #turnouts = []; #ends = []; #sections;

  constructor(draft, name) {
    [this.#draft, this.#name, this.#joints] = [draft, name, draft.joints()];
    for (const joint of this.#joints) for (const { piece, port } of joint.ends) this.#jointOf.set(`${piece} ${port}`, joint);
    for (const joint of this.#joints) {
      if (joint.ends.length === 1) {
        joint.end = this.#ends.push(joint);
      } else if (draft.has("sensors", joint)) {
        const input = 2 * this.#sensors.length;
        const named = (nth) => `${S88_MODULES[Math.floor(input / S88_INPUTS)]}${input % S88_INPUTS + nth}`;
        joint.names = [named(1), named(2)];
        joint.number = draft.numberOf(joint);
        this.#sensors.push(joint);
      } else if (draft.has("boundaries", joint)) {
        const nth = 2 * this.#boundaries.push(joint);
        joint.names = [`P${nth - 1}`, `P${nth}`];
      }
    }
    this.#sections = draft.sections();
    for (const [piece, laid] of draft.pieces.entries()) {
      const number = this.#turnouts.length + 1;
      const [straight, curved] = ["straight", "curved"].map((leg, nth) => ({ port: nth + 1, leg, mm: nth ? arcOf(laid) : laid.mm }));
      if (laid.kind === "turnout") this.#turnouts.push({ piece, number, at: this.#jointOf.get(`${piece} 0`), toe: 0, legs: [straight, curved] });
      if (laid.kind !== "slip") continue;
      const [one, other] = [0, 1].map((port) => this.#jointOf.get(`${piece} ${port}`));
      const at = { x: (one.x + other.x) / 2, y: (one.y + other.y) / 2 };
      // Each end has a leg on either track; the first track is straight.
      for (const end of [0, 1]) {
        const legs = [{ ...straight, port: end, mm: halfOfSlip(laid) }, { ...curved, port: end + 2, mm: halfOfSlip(laid) }];
        this.#turnouts.push({ piece, number: number + end, at, partner: number + 1 - end, legs });
      }
    }
  }

  /**
   * Leaves a piece through an end, after `mm` so far, over the middle of the crossings `crossed`: the node that is reached, with its name
   * from this side, and the distance.
   */
  #reach(piece, port, mm, crossed = []) {
    const joint = this.#jointOf.get(`${piece} ${port}`);
    if (joint.end) return { name: `EX${joint.end}`, mm, crossed };
    const isFirst = joint.ends[0].piece === piece && joint.ends[0].port === port;
    if (joint.names) return { name: joint.names[isFirst ? 0 : 1], mm, crossed };
    const next = joint.ends[isFirst ? 1 : 0];
    return this.#through(next.piece, next.port, mm, crossed);
  }

  /** Enters a piece through an end. */
  #through(piece, port, mm, crossed = []) {
    const laid = this.#draft.pieces[piece];
    // Opposite ends of a crossing are neighbours in the list.
    if (laid.kind === "crossing") return this.#reach(piece, port ^ 1, mm + laid.mm, [...crossed, { piece, mm: mm + laid.mm / 2 }]);
    if (laid.kind === "straight" || laid.kind === "curve") return this.#reach(piece, 1 - port, mm + (laid.kind === "straight" ? laid.mm : arcOf(laid)), crossed);
    for (const { number, toe, legs } of this.#turnouts.filter((one) => one.piece === piece)) {
      if (port === toe) return { name: `BR${number}`, mm, crossed };
      const own = legs.find((leg) => leg.port === port);
      if (own) return { name: `MR${number} ${own.leg}`, mm: mm + own.mm, crossed };
    }
    throw new Error(`no end ${port} at piece ${piece}`);
  }

  /** Every path out of a node, by the name of the node in this direction, and its name in the other direction. */
  #paths() {
    const paths = [];
    for (const { ends: [one, other], names: [ahead, back] } of [...this.#sensors, ...this.#boundaries]) {
      paths.push({ from: ahead, back, ...this.#through(other.piece, other.port, 0) });
      paths.push({ from: back, back: ahead, ...this.#through(one.piece, one.port, 0) });
    }
    for (const { piece, number, toe, partner, legs } of this.#turnouts) {
      paths.push({ from: `MR${number}`, back: `BR${number}`, ...(partner ? { name: `BR${partner}`, mm: 0, crossed: [] } : this.#reach(piece, toe, 0)) });
      for (const { leg, port, mm } of legs) paths.push({ from: `BR${number} ${leg}`, back: `MR${number} ${leg}`, ...this.#reach(piece, port, mm) });
    }
    for (const joint of this.#ends) {
      const [{ piece, port }] = joint.ends;
      paths.push({ from: `EN${joint.end}`, back: `EX${joint.end}`, ...this.#through(piece, port, 0) });
    }
    return paths;
  }

  /** The block that a train comes into on a piece; empty where no detector is. */
  #block({ piece }) {
    const { isWatched, name } = this.#sections.find(({ pieces }) => pieces.includes(piece));
    return isWatched ? quoted(name) : '""';
  }

  text() {
    const written = new Set();
    const edges = [], crossed = new Map();
    for (const { from, back, name, mm, crossed: over } of this.#paths()) {
      // Each edge is found from both of its ends.
      if (written.has(`${from} ${name}`)) continue;
      written.add(`${from} ${name}`);
      const other = this.#paths().find((path) => path.back === name && path.name === back);
      if (other) written.add(`${other.from} ${other.name}`);
      edges.push(`  { from = "${from}", to = "${name}", mm = ${mm.toFixed(1)} },`);
      for (const at of over) crossed.set(at.piece, [...(crossed.get(at.piece) ?? []), `{ from = "${from}", to = "${name}", mm = ${at.mm.toFixed(1)} }`]);
    }
    const list = (key, rows) => (rows.length > 0 ? [`${key} = [`, ...rows, "]"] : []);
    return [
      "format = 1", `name = ${quoted(this.#name)}`, 'about = "Drawn with the editor of the dashboard from catalogue pieces."',
      `length_uncertainty_mm = ${LENGTH_UNCERTAINTY_MM}`, 'length_origin = "catalogue lengths of the pieces"', "",
      ...list("sensors", this.#sensors.map((joint) => `  { names = ["${joint.names.join('", "')}"],${joint.number === undefined ? "" : ` number = ${joint.number},`} at = ${point(joint)} },`)),
      ...list("blocks", this.#sections.filter(({ isWatched }) => isWatched).map(({ name, number }) => `  { name = ${quoted(name)}, number = ${number} },`)),
      ...list("boundaries", this.#boundaries.map((joint) => `  { names = ["${joint.names.join('", "')}"], enters = [${this.#block(joint.ends[1])}, ${this.#block(joint.ends[0])}], at = ${point(joint)} },`)),
      ...list("turnouts", this.#turnouts.map(({ number, at }) => `  { number = ${number}, names = ["BR${number}", "MR${number}"], at = ${point(at)} },`)),
      ...list("ends", this.#ends.map((joint) => `  { names = ["EN${joint.end}", "EX${joint.end}"], at = ${point(joint)} },`)),
      ...list("edges", edges),
      ...list("crossings", [...crossed.values()].filter(({ length }) => length === 2).map((tracks) => `  { tracks = [${tracks.join(", ")}] },`)), "",
    ].join("\n");
  }
}
