// The buttons of saved schedules beside the track: a set of turnouts, a train that is sent somewhere, or a whole evening.

import { make, put } from "./dom.js";
import { ask, get } from "./server.js";
import { logged, say } from "./words.js";

/** Longer than between the clicks of a double click (ms). */
const DOUBLE_CLICK_MS = 500;

export class RouteButtons {
  #place; #answer; #buttons = new Map();

  constructor(place, answer) {
    [this.#place, this.#answer] = [place, answer];
    this.#load();
  }

  async #load() {
    let saved = [];
    try {
      saved = (await get("/api/schedules")).schedules.filter(({ is_button: isButton }) => isButton);
    } catch {
      // A calibration has no schedules; the state of the connection shows a lost server.
    }
    this.#place.hidden = saved.length === 0;
    this.#buttons = new Map(saved.map((schedule) => [schedule.name, this.#button(schedule)]));
    this.#place.replaceChildren(...this.#buttons.values());
  }

  #button({ name, lines }) {
    const made = make("button", { type: "button", title: lines.join("\n"), "aria-pressed": "false" }, name);
    made.addEventListener("click", async () => {
      const ends = made.getAttribute("aria-pressed") === "true";
      made.disabled = true;
      this.#answer.className = "answer";
      put(this.#answer, say(ends ? "schedule-ends" : "schedule-begins", name));
      try {
        await ask(`/api/schedules/${ends ? "end" : "run"}`, { name });
      } catch ({ message }) {
        this.#answer.className = "answer bad";
        put(this.#answer, message);
      }
      // The second click of a double click would end what the first one began.
      setTimeout(() => (made.disabled = false), DOUBLE_CLICK_MS);
    });
    return made;
  }

  show({ schedules }) {
    for (const [name, button] of this.#buttons) {
      const runs = schedules.some((one) => one.name === name && !one.is_over);
      if (button.getAttribute("aria-pressed") !== String(runs)) button.setAttribute("aria-pressed", String(runs));
    }
    for (const { name, refused, is_over: isOver } of schedules) {
      const why = Object.values(refused)[0];
      if (isOver && why && this.#buttons.has(name) && this.#answer.textContent === say("schedule-begins", name)) {
        this.#answer.className = "answer bad";
        put(this.#answer, say("refused", logged(why)));
      }
    }
  }
}
