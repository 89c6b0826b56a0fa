// Alarms in the reader's language, and the newest of them on every page until somebody has looked.

import { put } from "./dom.js";
import { say } from "./words.js";

/** What went otherwise than it should have is no news after so long (s); danger stays until somebody looks. */
const WARNED_S = 30;

/** Whether the pages have a sentence for an alarm; what they do not know they show as it was said. */
const sentence = ({ what, blanks, text }) => {
  const word = `alarm-${what}`;
  const said = say(word, ...blanks);
  return said === word ? text : said;
};

/** An alarm as a sentence, with the train that it is about. */
export const told = (alarm) => (alarm.train == null ? sentence(alarm) : `${say("train", alarm.train)}: ${sentence(alarm)}`);

/** Alarms that nothing has ended. */
export function standing(alarms) {
  const open = new Map();
  for (const alarm of alarms) {
    const about = String(alarm.train);
    open.delete(about);
    if (alarm.grade !== "over") open.set(about, alarm);
  }
  return [...open.values()];
}

/** The newest danger that nobody has seen on the page of health, or else the newest warning, in the frame of all pages. */
export class Alarmed {
  #place; #live; #seen = 0; #page;

  constructor(place, live) {
    this.#place = place;
    this.#live = live;
    live.addEventListener("alarm", () => this.#show());
    live.addEventListener("picture", () => { if (!place.hidden) this.#show(); });
    live.addEventListener("anew", () => { this.#seen = 0; this.#show(); });
  }

  /** Another page is open. */
  turn(page) {
    this.#page = page;
    this.#show();
  }

  #show() {
    if (this.#page === "health") this.#seen = this.#live.alarms.length;
    const now = this.#live.picture?.t_s ?? 0;
    const news = standing(this.#live.alarms.slice(this.#seen)).filter(({ grade, t_s }) => grade === "danger" || now - t_s < WARNED_S);
    const newest = news.findLast(({ grade }) => grade === "danger") ?? news.at(-1);
    this.#place.hidden = !newest;
    if (newest) {
      put(this.#place.firstElementChild, told(newest));
      this.#place.className = `state ${newest.grade === "danger" ? "red" : "amber"}`;
    }
  }
}
