// Draws the track: edges, sensors, turnout positions and trains.

import { cut, between, nearest, written } from "./plan_curve.js";
import { planOf } from "./plan.js";
import { placeOf } from "./places.js";
import { say } from "./words.js";

const SVG = "http://www.w3.org/2000/svg";
/** Width of a letter in a name, in units of the drawing. */
const LETTER = 1.12;
/** The reach of a click (units of the drawing), and the drawn length of a turnout's blade. */
const REACH = 8;
const TOUCH = 2.6;
const BLADE = 5;
/** Units of the longer side of a drawing, on a small and on a large screen. */
const LEAST_WIDE = 105;
const MOST_WIDE = 160;
/** The number of train colours. */
export const COLOURS = 6;

function element(name, attributes, parent) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  parent?.append(made);
  return made;
}

/** The colour of the train at a place of the list. */
export const colourOf = (place) => `var(--t${place % COLOURS})`;

export class Track {
  #nodes; #edges; #plan; #blades = []; #contacts = new Map(); #layer; #truth; #numbers; #trains = new Map(); #unit; #picked; #turnouts = new Map();

  constructor(svg, layout) {
    this.#nodes = new Map(layout.nodes.map((node) => [node.id, node]));
    this.#edges = new Map(layout.edges.map((edge) => [edge.id, edge]));
    this.#plan = planOf(layout);
    const all = [...this.#plan.points.values(), ...[...this.#plan.rails.values()].flat()];
    const [left, right, top, foot] = [0, 0, 1, 1].map((axis, nth) => Math[nth % 2 ? "max" : "min"](...all.map((point) => point[axis])));
    const side = Math.max(right - left, foot - top) || 1;
    // On a phone, names are larger so that they can be read.
    this.#unit = side / Math.min(Math.max((svg.clientWidth || MOST_WIDE) / 4, LEAST_WIDE), MOST_WIDE);
    const margin = side * 0.05;
    this.whole = [left - margin, top - margin, right - left + 2 * margin, foot - top + 2 * margin];
    svg.style.aspectRatio = `${this.whole[2]} / ${this.whole[3]}`;
    const rails = element("g", {}, svg);
    for (const edge of layout.edges) {
      if (edge.id % 2) continue;
      const rail = element("path", { d: written(this.#curve(edge.id)), class: "rail", "stroke-width": this.#unit * 0.7 }, rails);
      if (!edge.zone) continue;
      rail.classList.add("restricted");
      element("title", {}, rail).textContent = say("zone", edge.zone.name, edge.zone.max_mm_s);
    }
    this.#bladesOf(layout, element("g", {}, svg));
    this.#truth = element("g", {}, svg);
    this.#layer = element("g", {}, svg);
    this.#mark(layout.nodes, element("g", {}, svg));
    // The train number must be readable over anything.
    this.#numbers = element("g", {}, svg);
    this.#picked = element("path", { class: "picked", "stroke-width": this.#unit * 0.5 }, svg);
    this.#picked.style.display = "none";
  }

  /** The curve of an edge, in its own direction. */
  #curve(id) {
    const rail = this.#plan.rails.get(id >> 1) ?? [];
    return id % 2 ? rail.toReversed() : rail;
  }

  /** Each turnout shows the leg that is set. */
  #bladesOf(layout, layer) {
    for (const edge of layout.edges) {
      const from = this.#nodes.get(edge.from);
      if (!edge.leg || from.kind !== "branch") continue;
      const curve = this.#curve(edge.id);
      const long = curve.slice(1).reduce((sum, [x, y], nth) => sum + Math.hypot(x - curve[nth][0], y - curve[nth][1]), 0);
      const blade = cut(curve, 0, Math.min(0.5, BLADE * this.#unit / (long || 1)));
      const path = element("path", { d: written(blade), class: "blade", "stroke-width": this.#unit * 1.1 }, layer);
      this.#blades.push({ path, turnout: from.number, leg: edge.leg });
      this.#turnouts.set(from.number, this.#plan.points.get(placeOf(edge.from)));
    }
  }

  #mark(nodes, marks) {
    const named = new Map();
    for (const node of nodes) {
      if (node.kind !== "contact" && node.kind !== "branch") continue;
      const point = this.#plan.points.get(placeOf(node.id));
      const key = point.join();
      const [x, y] = point;
      if (node.kind === "contact") {
        let spot = this.#contacts.get(`at ${key}`);
        if (!spot) {
          spot = element("circle", { cx: x, cy: y, r: this.#unit * 0.9, class: "contact", "stroke-width": this.#unit * 0.4 }, marks);
          element("title", {}, spot);
          this.#contacts.set(`at ${key}`, spot);
        }
        this.#contacts.set(node.number, spot);
        this.#contacts.set(`named ${node.name}`, spot);
      }
      const text = node.kind === "contact" ? node.name : `⟨${node.number}⟩`;
      named.set(key, { x, y, kind: node.kind, texts: [...(named.get(key)?.texts ?? []), text] });
    }
    // Sensors first: places are named after them.
    const [contacts, others] = [[], []];
    for (const name of named.values()) (name.kind === "contact" ? contacts : others).push(name);
    const taken = [];
    for (const { x, y, texts } of [...contacts, ...others]) {
      const text = texts.join(" ");
      const half = text.length * this.#unit * LETTER / 2;
      const [dx, dy] = this.#room(x, y, half, taken);
      taken.push([x + dx - half, x + dx + half, y + dy]);
      const name = element("text", { x: x + dx, y: y + dy, "font-size": this.#unit * 2, "stroke-width": this.#unit * 0.5, class: "name" }, marks);
      name.textContent = text;
    }
  }

  /** The place for a name of this width: above its point, or where it covers no other name. */
  #room(x, y, half, taken) {
    const aside = half + this.#unit * 1.2;
    const places = [[0, -1.4], [0, 2.7], [aside, 0.6], [-aside, 0.6], [0, -3.2], [0, 4.5]]
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
      if (typeof key === "string") spot.classList.remove("passed");
    }
    for (const number of Object.keys(picture.passed)) {
      this.#contacts.get(Number(number))?.classList.add("passed");
      this.#contacts.get(Number(number))?.classList.remove("failed");
    }
    picture.trains.forEach((train, place) => this.#train(train, place));
    for (const [number, { parts }] of this.#trains) {
      if (picture.trains.some(({ train }) => train === number)) continue;
      Object.values(parts).forEach((part) => part.remove());
      this.#trains.delete(number);
    }
  }

  /** Marks a sensor that missed a detection, until its next one. */
  fails(name) {
    this.#contacts.get(`named ${name}`)?.classList.add("failed");
  }

  /** Outlines where the simulated trains really are; without trains, removes the outlines. */
  truth(trains) {
    this.#truth.replaceChildren(...trains.map(({ body }) => element("path", { class: "truth", d: this.#path(body), "stroke-width": this.#unit * 3.4 })));
  }

  #partsOf(train, place) {
    const stroke = colourOf(place);
    const wide = this.#unit;
    const parts = {
      held: element("path", { class: "held", stroke, "stroke-width": wide * 2.6 }, this.#layer),
      haze: element("path", { class: "haze", stroke, "stroke-width": wide * 3 }, this.#layer),
      rests: element("path", { class: "rests", stroke, "stroke-width": wide * 2 }, this.#layer),
      body: element("path", { class: "body", stroke, "stroke-width": wide * 1.6 }, this.#layer),
      target: element("circle", { class: "target", stroke, "stroke-width": wide * 0.4, r: wide * 1.2 }, this.#layer),
      number: element("text", { class: "number", "font-size": wide * 2.4, "stroke-width": wide * 0.6 }, this.#numbers),
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
    return places ? { places: places.names } : {};
  }

  /** The place nearest to a point of the drawing, named in both directions: after the last sensor before it. */
  nearest(point) {
    const found = [];
    for (const edge of this.#edges.values()) {
      const from = this.#nodes.get(edge.from);
      if (from?.kind !== "contact") continue;
      const { away, part } = nearest(this.#curve(edge.id), point);
      found.push({ away, rail: edge.id >> 1, name: from.name, mm: Math.round(part * edge.length_mm) });
    }
    found.sort((one, other) => one.away - other.away || one.mm - other.mm);
    const [best] = found;
    if (!best || best.away > this.#unit * REACH) return undefined;
    const same = found.filter(({ away, name }) => away - best.away < this.#unit * 0.01 && name !== undefined).slice(0, 2);
    const names = same.map(({ name, mm }) => (mm > 0 ? `${name}+${mm}mm` : name));
    return { away: best.away, mm: same.map(({ mm }) => mm), names };
  }
}
