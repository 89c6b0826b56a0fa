// The period that the charts of a page show: the newest seconds, or a moment at which they were paused.

import { put, shown } from "./dom.js";
import { say } from "./words.js";

/** The shortest period that can be chosen by dragging (s). */
const SHORTEST_S = 1;

export class TimeWindow {
  #slider; #told; #live; #select; #changed; #first = 0; #last = 0;
  /** The end of the period while it is paused. */
  #until;
  /** Its length, if it was chosen by dragging (s). */
  #width;

  /** `changed` is called when the reader chooses another period. */
  constructor(root, changed) {
    const $ = (selector) => root.querySelector(selector);
    [this.#slider, this.#told, this.#live, this.#select, this.#changed] = [$("#until"), $("#until-told"), $("#live"), $("#window"), changed];
    this.#slider.addEventListener("input", () => this.#stop(Number(this.#slider.value)));
    this.#live.addEventListener("click", () => this.#stop(this.#until === undefined ? this.#last : undefined));
    this.#select.addEventListener("change", () => {
      this.#width = undefined;
      this.#stop(this.#until);
    });
  }

  get isLive() {
    return this.#until === undefined;
  }

  /** Shows this period of time (s). */
  select(from, to) {
    if (to - from >= SHORTEST_S) this.#stop(Math.min(to, this.#last), to - from);
  }

  /** Stops at a time, or goes on with `undefined`. */
  #stop(until, width = this.#width) {
    [this.#until, this.#width] = [until, until === undefined ? undefined : width];
    this.#tell();
    this.#changed();
  }

  /** The data reaches from `first` to `last` now. */
  holds(first, last) {
    [this.#first, this.#last] = [first, last];
    // Data is kept for five minutes: a period that has left it is over.
    if (this.#until !== undefined && this.#until < first) this.#stop(undefined);
    this.#tell();
  }

  #tell() {
    const until = this.#until ?? this.#last;
    this.#slider.min = String(this.#first);
    this.#slider.max = String(this.#last);
    this.#slider.value = String(until);
    put(this.#told, this.isLive ? say("now") : say("ago", shown(this.#last - until)));
    this.#live.setAttribute("aria-pressed", String(this.isLive));
  }

  /** The ends of the period (s). */
  ends() {
    const last = this.#until ?? this.#last;
    const width = this.#width ?? Number(this.#select.value);
    const from = Math.max(this.#first, last - width);
    return [from, Math.max(last, from + width)];
  }
}
