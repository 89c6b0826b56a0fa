// A drawn track on which a place can be picked, with zoom and pan.

import { Track } from "./track.js";
import { View } from "./view.js";

export class PickTrack {
  /** The place that was picked last, as the prompt names it. */
  place; view; #track;

  constructor(svg, layout, onPick) {
    this.#track = new Track(svg, layout);
    this.view = new View(svg, this.#track.whole, (point) => {
      this.place = this.#track.nearest(point);
      this.#track.pick(this.place);
      onPick(this.place);
    });
  }

  show(picture) {
    this.#track.show(picture);
  }
}
