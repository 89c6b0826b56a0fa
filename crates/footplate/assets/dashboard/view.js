// Zoom and pan of a drawing, by mouse, wheel, touch and keys.

/** The largest zoom, as a part of the whole drawing. */
const NEAREST = 1 / 40;

export class View {
  #svg; #whole; #box; #fingers = new Map(); #moved = 0; #onPress;

  /** `whole`: x, y, width and height of the whole drawing. `onPress` receives clicks, in the drawing's units. */
  constructor(svg, whole, onPress) {
    this.#svg = svg;
    this.#whole = whole;
    this.#onPress = onPress;
    this.all();
    svg.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(event.deltaY * 0.0015), this.point(event));
    }, { passive: false });
    svg.addEventListener("pointerdown", (event) => {
      svg.setPointerCapture(event.pointerId);
      this.#fingers.set(event.pointerId, [event.clientX, event.clientY]);
      if (this.#fingers.size === 1) this.#moved = 0;
    });
    svg.addEventListener("pointermove", (event) => this.#pull(event));
    svg.addEventListener("pointerup", (event) => this.#release(event, true));
    svg.addEventListener("pointercancel", (event) => this.#release(event, false));
    svg.addEventListener("keydown", (event) => this.#key(event));
  }

  /** Shows the whole drawing. */
  all() {
    this.#box = [...this.#whole];
    this.#show();
  }

  /** Scales the visible area by `times` about a point. */
  zoom(times, about = this.#middle()) {
    const [x, y, width, height] = this.#box;
    const least = this.#whole[2] * NEAREST;
    const wider = Math.min(Math.max(width * times, least), this.#whole[2] * 1.5) / width;
    this.#box = [about[0] - (about[0] - x) * wider, about[1] - (about[1] - y) * wider, width * wider, height * wider];
    this.#show();
  }

  /** The place of an event, in the drawing's units. */
  point(event) {
    const matrix = this.#svg.getScreenCTM();
    if (!matrix) return this.#middle();
    const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
    return [x, y];
  }

  #middle() {
    const [x, y, width, height] = this.#box;
    return [x + width / 2, y + height / 2];
  }

  #show() {
    this.#svg.setAttribute("viewBox", this.#box.map((number) => number.toFixed(2)).join(" "));
  }

  #shift(dx, dy) {
    this.#box[0] -= dx;
    this.#box[1] -= dy;
    this.#show();
  }

  #pull(event) {
    const before = this.#fingers.get(event.pointerId);
    if (!before) return;
    const scale = this.#svg.getScreenCTM()?.a ?? 1;
    const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
    this.#moved += Math.hypot(dx, dy);
    const others = [...this.#fingers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
    this.#fingers.set(event.pointerId, [event.clientX, event.clientY]);
    if (others.length === 0) {
      this.#shift(dx / scale, dy / scale);
      return;
    }
    const apart = (at) => Math.hypot(at[0] - others[0][0], at[1] - others[0][1]);
    const now = apart([event.clientX, event.clientY]);
    if (now > 1) this.zoom(apart(before) / now);
  }

  #release(event, isUp) {
    const isPress = isUp && this.#fingers.size === 1 && this.#moved < 6;
    this.#fingers.delete(event.pointerId);
    if (isPress) this.#onPress(this.point(event));
  }

  #key(event) {
    const step = this.#box[2] / 12;
    const moves = { ArrowLeft: [step, 0], ArrowRight: [-step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
    if (moves[event.key]) this.#shift(...moves[event.key]);
    else if (event.key === "+") this.zoom(0.8);
    else if (event.key === "-") this.zoom(1.25);
    else if (event.key === "0") this.all();
    else return;
    event.preventDefault();
  }
}
