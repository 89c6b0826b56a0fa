// A track drawing with zoom and pan on which trains, turnouts and places can be clicked.

import { Track } from "./track.js";
import { View } from "./view.js";

export class PickTrack {
  /** The selected place, as the prompt names it, its name in the other direction, and its block. */
  place; other; block; view; #track;

  /** `onPick` receives places; `onMeant` receives trains and turnouts, if given. */
  constructor(svg, layout, onPick, onMeant) {
    this.#track = new Track(svg, layout);
    this.view = new View(svg, this.#track.whole, (point) => {
      const meant = onMeant ? this.#track.meant(point) : { places: this.#track.nearest(point)?.names };
      this.block = meant.block;
      if (meant.train !== undefined || meant.turnout !== undefined) return onMeant(meant);
      [this.place, this.other] = meant.places ?? [];
      this.#track.pick(this.place);
      onPick(this.place);
    });
  }

  /** The selected place, named in the other direction. */
  turn() {
    if (this.other) [this.place, this.other] = [this.other, this.place];
  }

  show(picture) {
    this.#track.show(picture);
  }

  /** Outlines where trains really are. */
  truth(trains) {
    this.#track.truth(trains);
  }
}
