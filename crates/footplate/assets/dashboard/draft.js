// A layout that is being drawn: pieces joined end to end, sensors on joints, and its text as a layout file.

import { arcOf } from "./pieces.js";

/** Ends join within this distance (mm) and angle (rad): the error of rounded lengths. */
const JOINS_MM = 3;
const JOINS_RAD = 0.06;
/** Open ends within this distance that do not join are an unintended gap (mm). */
const GAP_MM = 60;
/** Standard deviation of a catalogue length with its joint (mm). */
const LENGTH_UNCERTAINTY_MM = 1;
const S88_INPUTS = 16;
const S88_MODULES = "ABCDE";

const turned = (one, other) => Math.abs(Math.atan2(Math.sin(one - other), Math.cos(one - other)));

/** The ends of a piece and their directions, relative to its first end. `side`: −1 left, +1 right. */
function endsOf({ kind, mm, radius, angle, side = 1 }) {
  const bend = (angle ?? 0) * Math.PI / 180;
  const first = { x: 0, y: 0, heading: Math.PI };
  const straight = { x: mm, y: 0, heading: 0 };
  const curved = { x: radius * Math.sin(bend), y: side * radius * (1 - Math.cos(bend)), heading: side * bend };
  if (kind === "straight") return [first, straight];
  return kind === "curve" ? [first, curved] : [first, straight, curved];
}

function at({ x, y, heading }, local) {
  const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
  return { x: x + local.x * cos - local.y * sin, y: y + local.x * sin + local.y * cos, heading: heading + local.heading };
}

export class Draft {
  /** `pieces`: the pieces with their places; `sensors`: the joints with sensors, by their point. */
  #now = { pieces: [], sensors: [] }; #before = []; #undone = [];

  static of(kept) {
    const draft = new Draft();
    if (Array.isArray(kept?.pieces) && Array.isArray(kept?.sensors)) draft.#now = kept;
    return draft;
  }

  get kept() { return this.#now; }
  get canUndo() { return this.#before.length > 0; }
  get canRedo() { return this.#undone.length > 0; }
  get pieces() { return this.#now.pieces; }

  #change(pieces, sensors) {
    this.#before.push(this.#now);
    this.#undone = [];
    this.#now = { pieces, sensors };
  }

  undo() {
    if (!this.canUndo) return;
    this.#undone.push(this.#now);
    this.#now = this.#before.pop();
  }

  redo() {
    if (!this.canRedo) return;
    this.#before.push(this.#now);
    this.#now = this.#undone.pop();
  }

  clear() { this.#change([], []); }

  /** Lays a piece with one of its ends at an outward-facing place; returns the joint of its next open end. */
  lay(piece, side, port, place) {
    const laid = { ...piece, side };
    const local = endsOf(laid)[port];
    const heading = place.heading + Math.PI - local.heading;
    const turn = at({ x: 0, y: 0, heading }, local);
    laid.pose = { x: place.x - turn.x, y: place.y - turn.y, heading };
    this.#change([...this.pieces, laid], this.#now.sensors);
    const nth = this.pieces.length - 1;
    const open = this.joints().filter((joint) => joint.ends.length === 1 && joint.ends[0].piece === nth);
    return open.find((joint) => joint.ends[0].port === (port === 0 ? 1 : 0)) ?? open[0];
  }

  remove(nth) {
    const pieces = this.pieces.filter((_, place) => place !== nth);
    this.#change(pieces, this.#now.sensors);
    const joints = this.joints();
    this.#now.sensors = this.#now.sensors.filter((sensor) => joints.some((joint) => isAt(joint, sensor)));
  }

  /** Puts a sensor on a joint of two pieces, or removes it. */
  toggleSensor(joint) {
    const rest = this.#now.sensors.filter((sensor) => !isAt(joint, sensor));
    this.#change(this.pieces, rest.length < this.#now.sensors.length ? rest : [...rest, { x: joint.x, y: joint.y }]);
  }

  sensorAt = (joint) => this.#now.sensors.findIndex((sensor) => isAt(joint, sensor));

  ends = (piece) => endsOf(piece).map((end) => at(piece.pose, end));

  /** Every place where pieces end: an open end, or two that are joined. */
  joints() {
    const found = [];
    for (const [piece, laid] of this.pieces.entries()) {
      for (const [port, end] of this.ends(laid).entries()) {
        const joined = found.find((joint) => joint.ends.length === 1 && Math.hypot(joint.x - end.x, joint.y - end.y) < JOINS_MM
          && turned(joint.heading, end.heading + Math.PI) < JOINS_RAD);
        if (joined) joined.ends.push({ piece, port });
        else found.push({ ...end, ends: [{ piece, port }] });
      }
    }
    return found;
  }

  /** The curves of a piece, as points. */
  curves(piece) {
    const line = [[0, 0], [piece.mm, 0]];
    const bend = (piece.angle ?? 0) * Math.PI / 180;
    const arc = Array.from({ length: 13 }, (_, nth) => {
      const part = bend * nth / 12;
      return [piece.radius * Math.sin(part), (piece.side ?? 1) * piece.radius * (1 - Math.cos(part))];
    });
    const curves = { straight: [line], curve: [arc], turnout: [line, arc] }[piece.kind];
    return curves.map((curve) => curve.map(([x, y]) => { const point = at(piece.pose, { x, y, heading: 0 }); return [point.x, point.y]; }));
  }

  /** The mistakes of the draft: keys of sentences with their values. `isError` prevents saving. */
  problems() {
    const joints = this.joints();
    const problems = [];
    const onJoints = this.#now.sensors.filter((sensor) => joints.some((joint) => joint.ends.length === 2 && isAt(joint, sensor)));
    if (this.pieces.length === 0) return [{ isError: true, word: "draft-empty", blanks: [] }];
    if (onJoints.length === 0) problems.push({ isError: true, word: "draft-no-sensor", blanks: [] });
    if (this.#now.sensors.length > S88_INPUTS * S88_MODULES.length / 2) problems.push({ isError: true, word: "draft-too-many", blanks: [S88_INPUTS * S88_MODULES.length / 2] });
    const open = joints.filter(({ ends }) => ends.length === 1);
    for (const [nth, one] of open.entries()) {
      for (const other of open.slice(nth + 1)) {
        const gap = Math.hypot(one.x - other.x, one.y - other.y);
        if (gap < GAP_MM && one.ends[0].piece !== other.ends[0].piece) problems.push({ word: "draft-gap", blanks: [gap.toFixed(0)], at: one });
      }
    }
    problems.push({ word: "draft-ends", blanks: [open.length, this.pieces.filter(({ kind }) => kind === "turnout").length, onJoints.length] });
    return problems;
  }

  /** The layout file; `null` while there are errors. */
  toml(name) {
    return this.problems().some(({ isError }) => isError) ? undefined : new Written(this, name).text();
  }
}

const isAt = (joint, { x, y }) => Math.hypot(joint.x - x, joint.y - y) < JOINS_MM;
const quoted = (text) => JSON.stringify(text.replace(/[\u0000-\u001f\u007f]/g, " ").trim() || "my layout");
const point = ({ x, y }) => `[${Math.round(x)}, ${Math.round(y)}]`;

/** The text of a layout file. Sensors, turnouts and open ends are its nodes; the pieces between them form its edges. */
class Written {
  #draft; #name; #joints; #jointOf = new Map(); #sensors = []; #turnouts = []; #ends = [];

  constructor(draft, name) {
    [this.#draft, this.#name, this.#joints] = [draft, name, draft.joints()];
    for (const joint of this.#joints) for (const { piece, port } of joint.ends) this.#jointOf.set(`${piece} ${port}`, joint);
    for (const joint of this.#joints) {
      if (joint.ends.length === 1) {
        joint.end = this.#ends.push(joint);
      } else if (draft.sensorAt(joint) >= 0) {
        const input = 2 * this.#sensors.length;
        const named = (nth) => `${S88_MODULES[Math.floor(input / S88_INPUTS)]}${input % S88_INPUTS + nth}`;
        joint.sensor = [named(1), named(2)];
        this.#sensors.push(joint);
      }
    }
    for (const [piece, laid] of draft.pieces.entries()) {
      if (laid.kind === "turnout") this.#turnouts.push({ piece, number: this.#turnouts.length + 1, toe: this.#jointOf.get(`${piece} 0`) });
    }
  }

  /** Leaves a piece through an end, after `mm` so far: the node that is reached, the distance, and its name from this side. */
  #reach(piece, port, mm) {
    const joint = this.#jointOf.get(`${piece} ${port}`);
    if (joint.end) return { name: `EX${joint.end}`, mm };
    const isFirst = joint.ends[0].piece === piece && joint.ends[0].port === port;
    if (joint.sensor) return { name: joint.sensor[isFirst ? 0 : 1], mm };
    const next = joint.ends[isFirst ? 1 : 0];
    return this.#through(next.piece, next.port, mm);
  }

  /** Enters a piece through an end. */
  #through(piece, port, mm) {
    const laid = this.#draft.pieces[piece];
    if (laid.kind !== "turnout") return this.#reach(piece, 1 - port, mm + (laid.kind === "straight" ? laid.mm : arcOf(laid)));
    const { number } = this.#turnouts.find((one) => one.piece === piece);
    if (port === 0) return { name: `BR${number}`, mm };
    return port === 1 ? { name: `MR${number} straight`, mm: mm + laid.mm } : { name: `MR${number} curved`, mm: mm + arcOf(laid) };
  }

  /** Every path out of a node, by the name of the node in this direction, and its name in the other direction. */
  #paths() {
    const paths = [];
    for (const joint of this.#sensors) {
      const [one, other] = joint.ends;
      paths.push({ from: joint.sensor[0], back: joint.sensor[1], ...this.#through(other.piece, other.port, 0) });
      paths.push({ from: joint.sensor[1], back: joint.sensor[0], ...this.#through(one.piece, one.port, 0) });
    }
    for (const { piece, number } of this.#turnouts) {
      const laid = this.#draft.pieces[piece];
      paths.push({ from: `MR${number}`, back: `BR${number}`, ...this.#reach(piece, 0, 0) });
      paths.push({ from: `BR${number} straight`, back: `MR${number} straight`, ...this.#reach(piece, 1, laid.mm) });
      paths.push({ from: `BR${number} curved`, back: `MR${number} curved`, ...this.#reach(piece, 2, arcOf(laid)) });
    }
    for (const joint of this.#ends) {
      const [{ piece, port }] = joint.ends;
      paths.push({ from: `EN${joint.end}`, back: `EX${joint.end}`, ...this.#through(piece, port, 0) });
    }
    return paths;
  }

  text() {
    const written = new Set();
    const edges = [];
    for (const { from, back, name, mm } of this.#paths()) {
      // Each edge is found from both of its ends.
      if (written.has(`${from} ${name}`)) continue;
      written.add(`${from} ${name}`);
      const other = this.#paths().find((path) => path.back === name && path.name === back);
      if (other) written.add(`${other.from} ${other.name}`);
      edges.push(`  { from = "${from}", to = "${name}", mm = ${mm.toFixed(1)} },`);
    }
    const list = (key, rows) => (rows.length > 0 ? [`${key} = [`, ...rows, "]"] : []);
    return [
      "format = 1", `name = ${quoted(this.#name)}`, 'about = "Drawn with the editor of the dashboard from catalogue pieces."',
      `length_uncertainty_mm = ${LENGTH_UNCERTAINTY_MM}`, 'length_origin = "catalogue lengths of the pieces"', "",
      ...list("sensors", this.#sensors.map((joint) => `  { names = ["${joint.sensor.join('", "')}"], at = ${point(joint)} },`)),
      ...list("turnouts", this.#turnouts.map(({ number, toe }) => `  { number = ${number}, names = ["BR${number}", "MR${number}"], at = ${point(toe)} },`)),
      ...list("ends", this.#ends.map((joint) => `  { names = ["EN${joint.end}", "EX${joint.end}"], at = ${point(joint)} },`)),
      ...list("edges", edges), "",
    ].join("\n");
  }
}
