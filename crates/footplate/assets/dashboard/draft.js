// A layout that is being drawn: pieces joined end to end, sensors and boundaries of blocks on joints.

import { DraftFile } from "./draft_file.js";

/** Ends join within this distance (mm) and angle (rad): the error of rounded lengths. */
const JOINS_MM = 3;
const JOINS_RAD = 0.06;
/** Open ends within this distance that do not join are an unintended gap (mm). */
const GAP_MM = 60;
/** Sensors have two inputs each: five S88 modules of 16 contacts. */
const MOST_SENSORS = 40;

const MARKS = ["sensors", "boundaries"];
/** The turnouts that a piece is. */
const TURNOUTS_OF = { turnout: 1, slip: 2 };
const EMPTY = { pieces: [], sensors: [], boundaries: [], blocks: [] };
const isAt = (joint, { x, y }) => Math.hypot(joint.x - x, joint.y - y) < JOINS_MM;

const turned = (one, other) => Math.abs(Math.atan2(Math.sin(one - other), Math.cos(one - other)));

/** Whether a block was described by the piece of this pose: two pieces may begin at one joint. */
const isSamePose = (pose, block) => isAt(pose, block) && turned(pose.heading, block.heading) < JOINS_RAD;

/** The ends of a piece and their directions, relative to its first end. `side`: −1 left, +1 right. */
function endsOf({ kind, mm, radius, angle, side = 1 }) {
  const bend = (angle ?? 0) * Math.PI / 180;
  const first = { x: 0, y: 0, heading: Math.PI };
  const straight = { x: mm, y: 0, heading: 0 };
  const curved = { x: radius * Math.sin(bend), y: side * radius * (1 - Math.cos(bend)), heading: side * bend };
  if (kind === "straight") return [first, straight];
  if (kind === "crossing" || kind === "slip") {
    // The other track crosses the middle.
    const [dx, dy] = [mm / 2 * Math.cos(bend), side * mm / 2 * Math.sin(bend)];
    return [first, straight, { x: mm / 2 - dx, y: -dy, heading: Math.PI + side * bend }, { x: mm / 2 + dx, y: dy, heading: side * bend }];
  }
  return kind === "curve" ? [first, curved] : [first, straight, curved];
}

function at({ x, y, heading }, local) {
  const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
  return { x: x + local.x * cos - local.y * sin, y: y + local.x * sin + local.y * cos, heading: heading + local.heading };
}

export class Draft {
  /**
   * `pieces`: the pieces with their places; `sensors`, `boundaries`: joints, by their point; `blocks`: what is known of a section, by
   * the point of one of its pieces.
   */
  #now = EMPTY; #before = []; #undone = [];

  static of(kept) {
    const draft = new Draft();
    if (Array.isArray(kept?.pieces) && Array.isArray(kept?.sensors)) draft.#now = { ...EMPTY, ...kept };
    return draft;
  }

  get kept() { return this.#now; }
  get canUndo() { return this.#before.length > 0; }
  get canRedo() { return this.#undone.length > 0; }
  get pieces() { return this.#now.pieces; }

  #change(change) {
    this.#before.push(this.#now);
    this.#undone = [];
    this.#now = { ...this.#now, ...change };
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

  clear() { this.#change(EMPTY); }

  /** Lays a piece with one of its ends at an outward-facing place; returns the joint of its next open end. */
  lay(piece, side, port, place) {
    const laid = { ...piece, side };
    const local = endsOf(laid)[port];
    const heading = place.heading + Math.PI - local.heading;
    const turn = at({ x: 0, y: 0, heading }, local);
    laid.pose = { x: place.x - turn.x, y: place.y - turn.y, heading };
    this.#change({ pieces: [...this.pieces, laid] });
    const nth = this.pieces.length - 1;
    const open = this.joints().filter((joint) => joint.ends.length === 1 && joint.ends[0].piece === nth);
    return open.find((joint) => joint.ends[0].port === (port === 0 ? 1 : 0)) ?? open[0];
  }

  remove(nth) {
    this.#change({ pieces: this.pieces.filter((_, place) => place !== nth) });
    const joints = this.joints();
    const isLeft = (mark) => joints.some((joint) => isAt(joint, mark));
    for (const kind of MARKS) this.#now[kind] = this.#now[kind].filter(isLeft);
  }

  /** Puts a mark of a kind, `sensors` or `boundaries`, on a joint of two pieces, or removes it. */
  toggle(kind, joint) {
    const had = this.has(kind, joint);
    const rest = Object.fromEntries(MARKS.map((other) => [other, this.#now[other].filter((mark) => !isAt(joint, mark))]));
    this.#change(had ? rest : { ...rest, [kind]: [...rest[kind], { x: joint.x, y: joint.y }] });
  }

  /** States the number under which a sensor reports both directions; without one each direction has its own. */
  number(joint, number) {
    this.#change({ sensors: this.#now.sensors.map((mark) => (isAt(joint, mark) ? { x: mark.x, y: mark.y, number } : mark)) });
  }

  numberOf = (joint) => this.#now.sensors.find((mark) => isAt(joint, mark))?.number;

  has = (kind, joint) => this.#now[kind].some((mark) => isAt(joint, mark));

  /** The sections between boundaries, each with its pieces, and with name and number of its block; none without a boundary. */
  sections() {
    const joints = this.joints();
    if (!joints.some((joint) => this.has("boundaries", joint))) return [];
    const section = this.pieces.map((_, nth) => nth);
    const rename = (from, to) => section.forEach((name, nth) => { if (name === from) section[nth] = to; });
    for (const joint of joints) {
      const [one, other] = joint.ends;
      if (other && !this.has("boundaries", joint)) rename(section[other.piece], section[one.piece]);
    }
    const first = 2 * this.#now.sensors.length;
    return [...new Set(section)].map((name, nth) => {
      const pieces = this.pieces.flatMap((_, piece) => (section[piece] === name ? [piece] : []));
      const known = this.#now.blocks.find((block) => pieces.some((piece) => isSamePose(this.pieces[piece].pose, block)));
      return { pieces, isWatched: true, name: `Block ${nth + 1}`, number: first + nth, ...known };
    });
  }

  /** States name and number of the block of a section, or that it has no detector. */
  describe({ pieces }, what) {
    const { x, y, heading } = this.pieces[pieces[0]].pose;
    const others = this.#now.blocks.filter((block) => !pieces.some((piece) => isSamePose(this.pieces[piece].pose, block)));
    this.#change({ blocks: [...others, { ...what, x, y, heading }] });
  }

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
    const ends = endsOf(piece).map(({ x, y }) => [x, y]);
    const across = ends.slice(2);
    // Between the ends of different tracks, with both tracks as tangents.
    const bent = ([x1, y1], [x2, y2]) => Array.from({ length: 13 }, (_, nth) => {
      const [t, u] = [nth / 12, 1 - nth / 12];
      return [u * u * x1 + t * u * piece.mm + t * t * x2, u * u * y1 + t * t * y2];
    });
    const [a, c, b, d] = ends;
    const curves = piece.kind === "slip" ? [line, across, bent(a, d), bent(b, c)]
      : { straight: [line], curve: [arc], turnout: [line, arc], crossing: [line, across] }[piece.kind];
    return curves.map((curve) => curve.map(([x, y]) => { const point = at(piece.pose, { x, y, heading: 0 }); return [point.x, point.y]; }));
  }

  /** The mistakes of the draft: keys of sentences with their values. `isError` prevents saving. */
  problems() {
    const joints = this.joints();
    const problems = [];
    const marked = (kind) => joints.filter((joint) => joint.ends.length === 2 && this.has(kind, joint)).length;
    const [sensors, boundaries] = MARKS.map(marked);
    if (this.pieces.length === 0) return [{ isError: true, word: "draft-empty", blanks: [] }];
    if (sensors + boundaries === 0) problems.push({ isError: true, word: "draft-no-sensor", blanks: [] });
    if (sensors > MOST_SENSORS) problems.push({ isError: true, word: "draft-too-many", blanks: [MOST_SENSORS] });
    const open = joints.filter(({ ends }) => ends.length === 1);
    for (const [nth, one] of open.entries()) {
      for (const other of open.slice(nth + 1)) {
        const gap = Math.hypot(one.x - other.x, one.y - other.y);
        if (gap < GAP_MM && one.ends[0].piece !== other.ends[0].piece) problems.push({ word: "draft-gap", blanks: [gap.toFixed(0)], at: one });
      }
    }
    problems.push({ word: "draft-ends", blanks: [open.length, this.pieces.reduce((sum, { kind }) => sum + (TURNOUTS_OF[kind] ?? 0), 0), sensors, this.sections().filter(({ isWatched }) => isWatched).length] });
    return problems;
  }

  /** The layout file; nothing while there are errors. */
  toml(name) {
    return this.problems().some(({ isError }) => isError) ? undefined : new DraftFile(this, name).text();
  }
}
