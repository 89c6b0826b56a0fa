// The remedy of an alarm, on the layout page: the position of a lost train, or another route for a blocked one.

import { described, guides } from "./alarms.js";
import { make, put } from "./dom.js";
import { get } from "./server.js";
import { say } from "./words.js";

export class Guide {
  #place; #live; #train; #track; #give; #shown = "";

  /** `give` sends a command and shows its result in the element that it receives. */
  constructor(place, live, train, track, give) {
    [this.#place, this.#live, this.#train, this.#track, this.#give] = [place, live, train, track, give];
  }

  /** Shows the steps for the present state of the train; nothing if it needs none. */
  show(picture) {
    const own = picture.trains.find(({ train }) => train === this.#train);
    const alarm = picture.alarms.find((one) => one.train === this.#train && guides(one));
    const kind = alarm ? guides(alarm) : own && !own.at ? "place" : undefined;
    const key = `${kind} ${alarm?.id} ${alarm?.what} ${alarm?.blanks}`;
    if (key === this.#shown) return;
    this.#shown = key;
    if (this.#place.hidden === false && !kind) this.#track.truth([]);
    this.#place.hidden = !kind;
    if (!kind) return;
    const answer = make("output", { class: "answer", role: "status" });
    this.#place.replaceChildren(
      make("h3", {}, alarm ? described(alarm) : say("guide-unknown", this.#train)),
      kind === "place" ? this.#toPlace(answer) : this.#toRoute(alarm, answer), answer);
  }

  #button(text, line, answer) {
    const made = make("button", { type: "button" }, text);
    made.addEventListener("click", () => this.#give(line, answer));
    return made;
  }

  /** Says where the train is, or has it creep to a sensor. */
  #toPlace(answer) {
    const steps = make("ol", {}, make("li", {}, say("guide-look")), make("li", {}, say("guide-click", this.#train)),
      make("li", {}, say("guide-find"), " ", this.#button(say("find-train", this.#train), `find ${this.#train}`, answer)));
    if (this.#live.setUp?.offers_truth) steps.firstElementChild.append(" ", this.#truth(answer));
    return steps;
  }

  /** In a simulation there is no track to look at: the program shows where the train really is. */
  #truth(answer) {
    const shows = make("button", { type: "button", id: "show-truth" }, say("show-truth"));
    shows.addEventListener("click", async () => {
      try {
        const trains = await get("/api/truth");
        this.#track.truth(trains);
        const own = trains.find(({ train }) => train === this.#train);
        if (!own?.at) return put(answer, say("truth-off", this.#train));
        const uses = this.#button(say("put-there", this.#train, own.at), `place ${this.#train} at ${own.at}`, answer);
        uses.id = "use-truth";
        shows.parentElement.querySelector("#use-truth")?.remove();
        shows.after(" ", uses);
        put(answer, say("truth-at", this.#train, own.at));
      } catch ({ message }) {
        put(answer, message);
      }
    });
    return shows;
  }

  /** Reverses the blocked train or one that blocks it, or sends it elsewhere. */
  #toRoute({ what, blanks }, answer) {
    const trains = this.#live.picture.trains.map(({ train }) => train);
    const named = (blanks[0] ?? "").split(", ").map(Number).filter((train) => trains.includes(train) && train !== this.#train);
    // Beside a crossing every command to run would be refused.
    const held = this.#live.picture.crossings_held?.find((pair) => pair.trains.includes(this.#train));
    if (held) return make("ol", {}, make("li", {}, say("crossing-held", ...held.trains, held.at[0])));
    const others = what === "diverged" || what === "track-ends" ? [] : named;
    return make("ol", {}, make("li", {}, say("guide-reverse"), " ", ...[this.#train, ...others].flatMap((train) =>
      [this.#button(say("reverse-train", train), `reverse ${train}`, answer), " "])),
    make("li", {}, say("guide-elsewhere", this.#train)), make("li", {}, say("guide-by-hand")));
  }
}
