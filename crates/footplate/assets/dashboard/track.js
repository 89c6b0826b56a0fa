// Draws the track: edges, sensors, turnout positions and trains.

import { svg } from "./dom.js";
import { cut, between, lengthOf, nearest, written } from "./plan_curve.js";
import { planOf } from "./plan.js";
import { placeOf } from "./places.js";
import { Signals, showsSignals } from "./signals.js";
import { say } from "./words.js";

/** Width of a letter in a name, in units of the drawing. */
const LETTER = 1.25;
/** The reach of a click (units of the drawing), and the drawn length of a turnout's blade. */
const REACH = 8;
const TOUCH = 2.6;
const BLADE = 5;
/** Where a click means a turnout, as a part of its blades. */
const PRESSED_AT = 0.4;
/** Units of the longer side of a drawing, on a small and on a large screen. */
const LEAST_WIDE = 105;
const MOST_WIDE = 160;
/** The number of train colours. */
export const COLOURS = 6;

/** Whether places are named after a node. */
const isNamed = ({ kind, is_boundary: isBoundary }) => kind === "contact" || isBoundary;

/** The colour of the train at a place of the list. */
export const colourOf = (place) => `var(--t${place % COLOURS})`;

export class Track {
  #nodes; #edges; #plan; #blades = []; #contacts = new Map(); #blocks; #layer; #truth; #numbers; #trains = new Map(); #unit; #picked; #turnouts = new Map(); #signals;

  constructor(drawing, layout) {
    this.#nodes = new Map(layout.nodes.map((node) => [node.id, node]));
    this.#edges = new Map(layout.edges.map((edge) => [edge.id, edge]));
    this.#plan = planOf(layout);
    const all = [...this.#plan.points.values(), ...[...this.#plan.rails.values()].flat()];
    const [left, right, top, foot] = [0, 0, 1, 1].map((axis, nth) => Math[nth % 2 ? "max" : "min"](...all.map((point) => point[axis])));
    const side = Math.max(right - left, foot - top) || 1;
    // On a phone, names are larger so that they can be read.
    this.#unit = side / Math.min(Math.max((drawing.clientWidth || MOST_WIDE) / 4, LEAST_WIDE), MOST_WIDE);
    const margin = side * 0.05;
    this.whole = [left - margin, top - margin, right - left + 2 * margin, foot - top + 2 * margin];
    // Patterns of broken lines.
    drawing.style.setProperty("--unit", `${this.#unit}px`);
    drawing.style.aspectRatio = `${this.whole[2]} / ${this.whole[3]}`;
    const rails = svg("g", {}, drawing);
    this.#blocks = new Map(layout.blocks.map(({ name, detector }) => [detector, { name, rails: [] }]));
    for (const edge of layout.edges) {
      if (edge.id % 2) continue;
      const rail = svg("path", { d: written(this.#curve(edge.id)), class: "rail", "stroke-width": this.#unit * 0.7 }, rails);
      this.#blocks.get(edge.block)?.rails.push({ rail, edge });
      if (!edge.zone) continue;
      rail.classList.add("restricted");
      svg("title", {}, rail).textContent = say("zone", edge.zone.name, edge.zone.max_mm_s);
    }
    for (const tracks of layout.crossings) this.#cross(tracks.map(({ edge, offset_mm: mm }) => this.point(edge, mm)), rails);
    this.#bladesOf(layout, svg("g", {}, drawing));
    this.#truth = svg("g", {}, drawing);
    this.#layer = svg("g", {}, drawing);
    this.#signals = new Signals(this.#edges, this.#nodes, (id) => this.#curve(id), this.#unit, svg("g", {}, drawing));
    this.#mark(layout.nodes, svg("g", {}, drawing));
    // The train number must be readable over anything.
    this.#numbers = svg("g", {}, drawing);
    this.#picked = svg("path", { class: "picked", "stroke-width": this.#unit * 0.5 }, drawing);
    this.#picked.style.display = "none";
  }

  /** The curve of an edge, in its own direction. */
  #curve(id) {
    const rail = this.#plan.rails.get(id >> 1) ?? [];
    return id % 2 ? rail.toReversed() : rail;
  }

  /** Marks a level crossing on both of its tracks; where they are drawn apart, a broken line says that they cross. */
  #cross([one, other], layer) {
    const arm = this.#unit * 1.2;
    const mark = ([x, y]) => `M${x - arm} ${y - arm}L${x + arm} ${y + arm}M${x - arm} ${y + arm}L${x + arm} ${y - arm}`;
    svg("path", { d: mark(one) + mark(other), class: "crossing", "stroke-width": this.#unit * 0.5 }, layer);
    const between = svg("path", { d: written([one, other]), class: "crossing apart", "stroke-width": this.#unit * 0.4 }, layer);
    svg("title", {}, between).textContent = say("crossing");
  }

  /** Each turnout shows the leg that is set. */
  #bladesOf(layout, layer) {
    for (const edge of layout.edges) {
      const from = this.#nodes.get(edge.from);
      if (!edge.leg || from.kind !== "branch") continue;
      const curve = this.#curve(edge.id);
      const long = curve.slice(1).reduce((sum, [x, y], nth) => sum + Math.hypot(x - curve[nth][0], y - curve[nth][1]), 0);
      const blade = cut(curve, 0, Math.min(0.5, BLADE * this.#unit / (long || 1)));
      const path = svg("path", { d: written(blade), class: "blade", "stroke-width": this.#unit * 1.1 }, layer);
      this.#blades.push({ path, turnout: from.number, leg: edge.leg });
      // Between the blades: the two turnouts of a slip have their toes in one point.
      const [x, y] = between(blade, PRESSED_AT);
      const [x2, y2] = this.#turnouts.get(from.number) ?? [x, y];
      this.#turnouts.set(from.number, [(x + x2) / 2, (y + y2) / 2]);
    }
  }

  #mark(nodes, marks) {
    const named = new Map();
    for (const node of nodes) {
      if (!isNamed(node) && node.kind !== "branch") continue;
      const point = this.#plan.points.get(placeOf(node.id));
      const key = point.join();
      const [x, y] = point;
      if (isNamed(node)) {
        const spot = this.#contacts.get(`at ${key}`) ?? this.#spot(node, point, marks);
        this.#contacts.set(`at ${key}`, spot);
        if (node.number != null) this.#contacts.set(node.number, spot);
      }
      const text = isNamed(node) ? node.name : `⟨${node.number}⟩`;
      named.set(key, { x, y, rank: isNamed(node) ? 0 : 1, texts: [...(named.get(key)?.texts ?? []), text] });
    }
    for (const [detector, { name, rails }] of this.#blocks) {
      const [longest] = rails.map(({ edge }) => edge).sort((one, other) => other.length_mm - one.length_mm);
      const [x, y] = this.point(longest.id, longest.length_mm / 2);
      // Towards the middle of the drawing, where the rail does not cross the name.
      const [dx, dy] = [this.whole[0] + this.whole[2] / 2 - x, this.whole[1] + this.whole[3] / 2 - y];
      const [across, down] = [dx, dy].map((part) => part / (Math.hypot(dx, dy) || 1));
      const half = name.length * LETTER / 2;
      named.set(`block ${detector}`, { x: x + this.#unit * across * (half + 1.2), y: y + this.#unit * (2.2 * down + 2), rank: 2, texts: [name] });
    }
    // Sensors first: places are named after them.
    const ranked = [...named.values()].sort((one, other) => one.rank - other.rank);
    const taken = [];
    for (const { x, y, rank, texts } of ranked) {
      const text = texts.join(" ");
      const half = text.length * this.#unit * LETTER / 2;
      const [dx, dy] = this.#room(x, y, half, taken);
      taken.push([x + dx - half, x + dx + half, y + dy]);
      const name = svg("text", { x: x + dx, y: y + dy, "font-size": this.#unit * 2, "stroke-width": this.#unit * 0.5, class: rank === 2 ? "name of-block" : "name" }, marks);
      name.textContent = text;
    }
  }

  /** The mark of a sensor, or of the boundary of a block: an insulated joint. */
  #spot({ id, is_boundary: isBoundary }, [x, y], marks) {
    const stroke = { "stroke-width": this.#unit * 0.4 };
    if (!isBoundary) return svg("circle", { cx: x, cy: y, r: this.#unit * 0.9, class: "contact", ...stroke }, marks);
    const leaving = [...this.#edges.values()].find(({ from }) => from === id || from === (id ^ 1));
    const [one, other] = this.#curve(leaving.id);
    const long = Math.hypot(other[0] - one[0], other[1] - one[1]) || 1;
    const [dx, dy] = [other[0] - one[0], other[1] - one[1]].map((part) => 1.4 * this.#unit * part / long);
    return svg("path", { d: `M${x - dy} ${y + dx}L${x + dy} ${y - dx}`, class: "contact", "stroke-width": this.#unit * 0.8 }, marks);
  }

  /** The place for a name of this width: above its point, or where it covers no other name. */
  #room(x, y, half, taken) {
    const aside = half + this.#unit * 1.2;
    const places = [[0, -1.4], [0, 2.7], [aside, 0.6], [-aside, 0.6], [0, -3.6], [0, 4.9], [aside, -1.6], [-aside, -1.6], [aside, 2.9], [-aside, 2.9], [0, -5.8], [0, 7.1]]
      .map(([dx, dy]) => [dx, dy * this.#unit]);
    const isFree = ([dx, dy]) => taken.every(([left, right, foot]) =>
      x + dx + half < left || x + dx - half > right || Math.abs(y + dy - foot) > this.#unit * 2);
    return places.find(isFree) ?? places[0];
  }

  #part(edge, mm) {
    return edge.length_mm > 0 ? Math.min(Math.max(mm / edge.length_mm, 0), 1) : 0;
  }

  /** The point of an edge at an offset. */
  point(id, mm) {
    const edge = this.#edges.get(id);
    return edge && between(this.#curve(id), this.#part(edge, mm));
  }

  #path(spans) {
    const path = spans.map(({ edge: id, from_mm, to_mm }) => {
      const edge = this.#edges.get(id);
      return edge ? written(cut(this.#curve(id), this.#part(edge, from_mm), this.#part(edge, to_mm))) : "";
    }).join("");
    return path || "M0 0";
  }

  /** Shows a picture. */
  show(picture) {
    for (const blade of this.#blades) {
      const lies = picture.turnouts[blade.turnout];
      const look = lies ? lies === blade.leg ? "set" : "away" : "unknown";
      if (look === blade.look) continue;
      blade.look = look;
      blade.path.setAttribute("class", `blade ${look}`);
    }
    for (const [key, spot] of this.#contacts) {
      if (typeof key === "string") spot.classList.remove("passed", "failed");
    }
    for (const number of Object.keys(picture.passed)) this.#contacts.get(Number(number))?.classList.add("passed");
    for (const number of picture.ignored) this.#contacts.get(number)?.classList.add("failed");
    for (const [detector, block] of this.#blocks) {
      const state = picture.blocks?.[detector];
      if (state === block.state) continue;
      for (const { rail } of block.rails) {
        rail.classList.remove(block.state);
        if (state) rail.classList.add(state);
        rail.setAttribute("stroke-width", this.#unit * (state === "occupied" ? 1.3 : 0.7));
      }
      block.state = state;
    }
    this.#signals.show(picture, showsSignals());
    picture.trains.forEach((train, place) => this.#train(train, place));
    for (const [number, { parts }] of this.#trains) {
      if (picture.trains.some(({ train }) => train === number)) continue;
      Object.values(parts).forEach((part) => part.remove());
      this.#trains.delete(number);
    }
  }

  /** Outlines where the simulated trains really are; without trains, removes the outlines. */
  truth(trains) {
    this.#truth.replaceChildren(...trains.map(({ body }) => svg("path", { class: "truth", d: this.#path(body), "stroke-width": this.#unit * 3.4 })));
  }

  #partsOf(train, place) {
    const stroke = colourOf(place);
    const wide = this.#unit;
    const parts = {
      held: svg("path", { class: "held", stroke, "stroke-width": wide * 2.6 }, this.#layer),
      haze: svg("path", { class: "haze", stroke, "stroke-width": wide * 3 }, this.#layer),
      rests: svg("path", { class: "rests", stroke, "stroke-width": wide * 2 }, this.#layer),
      body: svg("path", { class: "body", stroke, "stroke-width": wide * 1.6 }, this.#layer),
      target: svg("circle", { class: "target", stroke, "stroke-width": wide * 0.4, r: wide * 1.2 }, this.#layer),
      number: svg("text", { class: "number", "font-size": wide * 2.4, "stroke-width": wide * 0.6 }, this.#numbers),
    };
    parts.number.textContent = String(train.train);
    const made = { parts, drawn: {} };
    this.#trains.set(train.train, made);
    return made;
  }

  #train(train, place) {
    const { parts, drawn } = this.#trains.get(train.train) ?? this.#partsOf(train, place);
    // Most elements do not change from one picture to the next.
    for (const name of ["held", "haze", "body", "rests"]) {
      const spans = JSON.stringify(train[name]);
      if (drawn[name] === spans) continue;
      drawn[name] = spans;
      parts[name].setAttribute("d", this.#path(train[name]));
    }
    const target = train.target && this.point(train.target.edge, train.target.offset_mm);
    parts.target.style.display = target ? "" : "none";
    if (target) {
      parts.target.setAttribute("cx", target[0]);
      parts.target.setAttribute("cy", target[1]);
    }
    const last = train.body.at(-1);
    const front = last && this.point(last.edge, last.to_mm);
    drawn.body_spans = train.body;
    parts.number.style.display = front ? "" : "none";
    if (front) {
      parts.number.setAttribute("x", front[0]);
      parts.number.setAttribute("y", front[1] + this.#unit * 3.4);
    }
  }

  /** Marks the selected place; `null` removes the mark. */
  pick(place) {
    const [, name, mm] = /^(.+?)(?:\+(\d+)mm)?$/.exec(place ?? "") ?? [];
    const from = [...this.#edges.values()].find((edge) => this.#nodes.get(edge.from).name === name);
    const at = from && this.point(from.id, Number(mm ?? 0));
    this.#picked.style.display = at ? "" : "none";
    if (at) this.#picked.setAttribute("d", `M${at[0] - this.#unit * 1.6} ${at[1]}h${this.#unit * 3.2}M${at[0]} ${at[1] - this.#unit * 1.6}v${this.#unit * 3.2}`);
  }

  /** The object at a point of the drawing: a train, a turnout, or a place in both directions. */
  meant(point) {
    const touches = (other) => other && Math.hypot(point[0] - other[0], point[1] - other[1]) < this.#unit * TOUCH;
    for (const [train, { drawn }] of this.#trains) {
      const under = (drawn.body_spans ?? []).some(({ edge, from_mm, to_mm }) => touches(this.point(edge, (from_mm + to_mm) / 2)) || touches(this.point(edge, to_mm)));
      if (under) return { train };
    }
    let turnout;
    for (const [number, at] of this.#turnouts) {
      const away = Math.hypot(point[0] - at[0], point[1] - at[1]);
      if (away < this.#unit * TOUCH && (!turnout || away < turnout.away)) turnout = { number, away };
    }
    const places = this.nearest(point);
    // A sensor beside a turnout has the same reach as the turnout.
    if (turnout && !(places && places.away < this.#unit && places.mm[0] === 0)) return { turnout: turnout.number };
    return places ? { places: places.names, block: places.block } : {};
  }

  /** The place nearest to a point of the drawing, named in both directions: after the last sensor before it. */
  nearest(point) {
    const found = [];
    for (const edge of this.#edges.values()) {
      const from = this.#nodes.get(edge.from);
      if (!from || !isNamed(from)) continue;
      const curve = this.#curve(edge.id);
      const { away, part } = nearest(curve, point);
      // A click on the mark of a sensor means the sensor.
      const mm = part * lengthOf(curve) < this.#unit ? 0 : Math.round(part * edge.length_mm);
      found.push({ away, rail: edge.id >> 1, name: from.name, mm, block: this.#blocks.get(edge.block)?.name });
    }
    found.sort((one, other) => one.away - other.away || one.mm - other.mm);
    const [best] = found;
    if (!best || best.away > this.#unit * REACH) return undefined;
    const same = found.filter(({ away, name }) => away - best.away < this.#unit * 0.01 && name !== undefined).slice(0, 2);
    const names = same.map(({ name, mm }) => (mm > 0 ? `${name}+${mm}mm` : name));
    return { away: best.away, mm: same.map(({ mm }) => mm), names, block: best.block };
  }
}
