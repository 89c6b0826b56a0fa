// The track as it is drawn: rails, contacts, turnouts as they lie, and trains on them.

import { say } from "./words.js";

const SVG = "http://www.w3.org/2000/svg";
/** How wide a letter of a name is, in units of the drawing. */
const LETTER = 0.95;
/** Trains have so many colours. */
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
  #nodes = new Map(); #edges = new Map(); #legs = []; #contacts = new Map(); #layer; #numbers; #trains = new Map(); #unit; #picked;

  constructor(svg, layout) {
    const drawn = layout.nodes.filter((node) => node.point);
    for (const node of layout.nodes) this.#nodes.set(node.id, node);
    const xs = drawn.map((node) => node.point[0]);
    const ys = drawn.map((node) => node.point[1]);
    const [left, top] = [Math.min(...xs), Math.min(...ys)];
    const [width, height] = [Math.max(...xs) - left || 1, Math.max(...ys) - top || 1];
    const side = Math.max(width, height);
    this.#unit = side / 160;
    const margin = side * 0.04;
    this.whole = [left - margin, top - margin, width + 2 * margin, height + 2 * margin];
    svg.style.aspectRatio = `${this.whole[2]} / ${this.whole[3]}`;
    const rails = element("g", { "stroke-width": this.#unit * 0.5 }, svg);
    for (const edge of layout.edges) {
      const ends = [this.#nodes.get(edge.from)?.point, this.#nodes.get(edge.to)?.point];
      if (!ends[0] || !ends[1]) continue;
      this.#edges.set(edge.id, { ...edge, ends });
      if (edge.id % 2) continue;
      const line = element("line", { x1: ends[0][0], y1: ends[0][1], x2: ends[1][0], y2: ends[1][1], class: edge.zone ? "rail restricted" : "rail" }, rails);
      if (edge.zone) element("title", {}, line).textContent = say("zone", edge.zone.name, edge.zone.max_mm_s);
      for (const id of [edge.id, edge.id + 1]) {
        const one = layout.edges[id];
        const from = one && this.#nodes.get(one.from);
        if (one?.leg && from?.kind === "branch") this.#legs.push({ line, turnout: from.number, leg: one.leg });
      }
    }
    this.#layer = element("g", {}, svg);
    const marks = element("g", {}, svg);
    this.#mark(drawn, marks);
    // Which train it is has to be read whatever lies there.
    this.#numbers = element("g", {}, svg);
    this.#picked = element("path", { class: "picked", "stroke-width": this.#unit * 0.5 }, svg);
    this.#picked.style.display = "none";
  }

  #mark(drawn, marks) {
    const named = new Map();
    for (const node of drawn) {
      if (node.kind !== "contact" && node.kind !== "branch") continue;
      const key = node.point.join();
      const [x, y] = node.point;
      if (node.kind === "contact") {
        let spot = this.#contacts.get(`at ${key}`);
        if (!spot) {
          spot = element("circle", { cx: x, cy: y, r: this.#unit * 0.7, class: "contact" }, marks);
          this.#contacts.set(`at ${key}`, spot);
        }
        this.#contacts.set(node.number, spot);
      }
      const text = node.kind === "contact" ? node.name : `⟨${node.number}⟩`;
      named.set(key, { x, y, kind: node.kind, texts: [...(named.get(key)?.texts ?? []), text] });
    }
    // Contacts first: they are what people name places by.
    const [contacts, others] = [[], []];
    for (const name of named.values()) (name.kind === "contact" ? contacts : others).push(name);
    const written = [];
    for (const { x, y, texts } of [...contacts, ...others]) {
      const text = texts.join(" ");
      const half = text.length * this.#unit * LETTER / 2;
      const [dx, dy] = this.#room(x, y, half, written);
      written.push([x + dx - half, x + dx + half, y + dy]);
      const name = element("text", { x: x + dx, y: y + dy, "font-size": this.#unit * 1.7, "stroke-width": this.#unit * 0.5, class: "name" }, marks);
      name.textContent = text;
    }
  }

  /** Where a name so wide goes beside its point: above it, or where no other name is in the way. */
  #room(x, y, half, written) {
    const aside = half + this.#unit * 1.2;
    const places = [[0, -1.1], [0, 2.4], [aside, 0.6], [-aside, 0.6], [0, -2.9], [0, 4.2]]
      .map(([dx, dy]) => [dx, dy * this.#unit]);
    const isFree = ([dx, dy]) => written.every(([left, right, foot]) =>
      x + dx + half < left || x + dx - half > right || Math.abs(y + dy - foot) > this.#unit * 1.7);
    return places.find(isFree) ?? places[0];
  }

  /** The point of an edge at an offset. */
  point(id, mm) {
    const edge = this.#edges.get(id);
    if (!edge) return undefined;
    const part = edge.length_mm > 0 ? Math.min(Math.max(mm / edge.length_mm, 0), 1) : 0;
    const [[x1, y1], [x2, y2]] = edge.ends;
    return [x1 + (x2 - x1) * part, y1 + (y2 - y1) * part];
  }

  #path(spans) {
    let path = "";
    for (const { edge, from_mm, to_mm } of spans) {
      const [one, other] = [this.point(edge, from_mm), this.point(edge, to_mm)];
      if (one && other) path += `M${one[0].toFixed(2)} ${one[1].toFixed(2)}L${other[0].toFixed(2)} ${other[1].toFixed(2)}`;
    }
    return path || "M0 0";
  }

  /** Shows one moment. */
  show(picture) {
    for (const { line, turnout, leg } of this.#legs) {
      const lies = picture.turnouts[turnout];
      line.classList.toggle("away", Boolean(lies) && lies !== leg);
    }
    for (const [key, spot] of this.#contacts) {
      if (typeof key === "string") spot.classList.remove("passed");
    }
    for (const number of Object.keys(picture.passed)) this.#contacts.get(Number(number))?.classList.add("passed");
    picture.trains.forEach((train, place) => this.#train(train, place));
    for (const [number, parts] of this.#trains) {
      if (picture.trains.some(({ train }) => train === number)) continue;
      Object.values(parts).forEach((part) => part.remove());
      this.#trains.delete(number);
    }
  }

  #train(train, place) {
    let parts = this.#trains.get(train.train);
    if (!parts) {
      const stroke = colourOf(place);
      const wide = this.#unit;
      parts = {
        held: element("path", { class: "held", stroke, "stroke-width": wide * 1.2 }, this.#layer),
        haze: element("path", { class: "haze", stroke, "stroke-width": wide * 3 }, this.#layer),
        rests: element("path", { class: "rests", stroke, "stroke-width": wide * 2 }, this.#layer),
        body: element("path", { class: "body", stroke, "stroke-width": wide * 1.4 }, this.#layer),
        target: element("circle", { class: "target", stroke, "stroke-width": wide * 0.4, r: wide * 1.2 }, this.#layer),
        number: element("text", { class: "number", "font-size": wide * 2.4, "stroke-width": wide * 0.6 }, this.#numbers),
      };
      parts.number.textContent = String(train.train);
      this.#trains.set(train.train, parts);
    }
    parts.held.setAttribute("d", this.#path(train.held));
    parts.haze.setAttribute("d", this.#path(train.haze));
    parts.body.setAttribute("d", this.#path(train.body));
    parts.rests.setAttribute("d", this.#path(train.rests));
    const target = train.target && this.point(train.target.edge, train.target.offset_mm);
    parts.target.style.display = target ? "" : "none";
    if (target) {
      parts.target.setAttribute("cx", target[0]);
      parts.target.setAttribute("cy", target[1]);
    }
    const last = train.body.at(-1);
    const front = last && this.point(last.edge, last.to_mm);
    parts.number.style.display = front ? "" : "none";
    if (front) {
      parts.number.setAttribute("x", front[0]);
      parts.number.setAttribute("y", front[1] + this.#unit * 3.2);
    }
  }

  /** Marks the place that was picked; none if there is none. */
  pick(place) {
    const [, name, mm] = /^(.+?)(?:\+(\d+)mm)?$/.exec(place ?? "") ?? [];
    const from = [...this.#edges.values()].find((edge) => this.#nodes.get(edge.from).name === name);
    const at = from && this.point(from.id, Number(mm ?? 0));
    this.#picked.style.display = at ? "" : "none";
    if (at) this.#picked.setAttribute("d", `M${at[0] - this.#unit * 1.6} ${at[1]}h${this.#unit * 3.2}M${at[0]} ${at[1] - this.#unit * 1.6}v${this.#unit * 3.2}`);
  }

  /** The place nearest to a point of the drawing, as the prompt names it: from the last contact before it. */
  nearest([x, y]) {
    let best;
    for (const edge of this.#edges.values()) {
      const [[x1, y1], [x2, y2]] = edge.ends;
      const square = (x2 - x1) ** 2 + (y2 - y1) ** 2;
      const part = square > 0 ? Math.min(Math.max(((x - x1) * (x2 - x1) + (y - y1) * (y2 - y1)) / square, 0), 1) : 0;
      const away = Math.hypot(x - x1 - part * (x2 - x1), y - y1 - part * (y2 - y1));
      if (this.#nodes.get(edge.from)?.kind !== "contact") continue;
      if (!best || away < best.away - 1e-9) best = { away, name: this.#nodes.get(edge.from).name, mm: Math.round(part * edge.length_mm) };
    }
    if (!best || best.away > this.#unit * 8) return undefined;
    return best.mm > 0 ? `${best.name}+${best.mm}mm` : best.name;
  }
}
