// A drawn track on which trains, turnouts and places can be picked, with zoom and pan.

import { Track } from "./track.js";
import { View } from "./view.js";

export class PickTrack {
  /** The place that was picked last, as the prompt names it, and how it is called in the other direction. */
  place; other; view; #track;

  /** `onPick` hears of places; `onMeant` of trains and turnouts, if it is given. */
  constructor(svg, layout, onPick, onMeant) {
    this.#track = new Track(svg, layout);
    this.view = new View(svg, this.#track.whole, (point) => {
      const meant = onMeant ? this.#track.meant(point) : { places: this.#track.nearest(point)?.names };
      if (meant.train !== undefined || meant.turnout !== undefined) return onMeant(meant);
      [this.place, this.other] = meant.places ?? [];
      this.#track.pick(this.place);
      onPick(this.place);
    });
  }

  /** The same place for a train that passes it in the other direction. */
  turn() {
    if (this.other) [this.place, this.other] = [this.other, this.place];
  }

  show(picture) {
    this.#track.show(picture);
  }

  fails(name) {
    this.#track.fails(name);
  }
}
