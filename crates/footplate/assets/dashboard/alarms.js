// Alarms on every page, in the reader's language: one for each cause, with a remedy, until it is over or the operator ends it.

import { make, put } from "./dom.js";
import { say } from "./words.js";

/** Warnings are hidden after this time (s); dangers stay. */
const WARNED_S = 30;
/** A picture this long after an alarm (s) shows its effect. */
const KNOWS_S = 1;
/** The most alarms shown in the frame, and on a phone; the health page has all of them. */
const SHOWN = 3;
const phone = matchMedia("(max-width: 40rem)");

/** Alarms that end when the position of the train is known again: the operator can enter it. */
const OF_POSITION = new Set(["lost", "needs-person", "stands-lost", "mishap-lost", "held-as-unknown"]);
/** Alarms whose train may be elsewhere than estimated: the operator can enter its position. */
const OF_PLACE = new Set([...OF_POSITION, "stands-elsewhere", "stands-untimely", "mishap-moved"]);
/** Alarms that end when the train is commanded to run again. */
const OF_RUNNING = new Set(["diverged", "diverged-and-others", "track-ends", "held-back"]);

/** Whether the pages have a sentence for an alarm; otherwise its English text is shown. */
const sentence = ({ what, blanks, text }) => {
  const word = `alarm-${what}`;
  const said = say(word, ...blanks);
  return said === word ? text : said;
};

/** An alarm as a sentence that begins with its train. */
export const described = (alarm) => (alarm.train == null ? sentence(alarm) : `${say("train", alarm.train)}: ${sentence(alarm)}`);

const isOfLine = ({ what }) => what.startsWith("line-");

/** The cause of an alarm. All alarms of a lost train are one cause; alarms of the link and of sensors are one each. */
function causeOf({ train, what, blanks }) {
  if (OF_POSITION.has(what)) return `${train} position`;
  return `${train} ${what} ${train == null ? blanks.join() : ""}`;
}

/** An alarm that needs the operator is not replaced by one that does not. */
const weight = (alarm) => (alarm ? (alarm.grade === "danger") + (alarm.what === "needs-person") : 0);

/** Whether a picture shows that an alarm is over. */
function isOver({ what, train, t_s: since }, picture) {
  const own = picture?.trains.find((one) => one.train === train);
  if (!own || picture.t_s < since + KNOWS_S) return false;
  return (OF_POSITION.has(what) && own.at !== null) || (OF_RUNNING.has(what) && own.step > 0 && own.at !== null);
}

/** The active alarms, the newest of each cause: dangers first. */
function standing(alarms, picture) {
  const open = new Map();
  for (const alarm of alarms) {
    if (alarm.grade === "over") {
      for (const [cause, one] of open) {
        if (one.train === alarm.train && isOfLine(one) === isOfLine(alarm)) open.delete(cause);
      }
      continue;
    }
    const cause = causeOf(alarm);
    if (weight(alarm) < weight(open.get(cause))) continue;
    open.delete(cause);
    open.set(cause, alarm);
  }
  const news = [...open.values()].filter((alarm) => !isOver(alarm, picture));
  const now = picture?.t_s ?? 0;
  const dangers = news.filter(({ grade }) => grade === "danger");
  return [...dangers.reverse(), ...news.filter(({ grade, t_s }) => grade === "warning" && now - t_s < WARNED_S).reverse()];
}

/** The remedy of an alarm, as a link. */
function action({ what, train }) {
  if (train != null && OF_PLACE.has(what)) return make("a", { class: "button", href: `#/layout/${train}` }, say("act-place", train));
  if (train != null) return make("a", { class: "button", href: `#/train/${train}` }, say("act-train", train));
  return make("a", { class: "button", href: "#/health" }, say(what.startsWith("line-") ? "act-line" : "act-health"));
}

/** The alarms in the frame of all pages. Dispatches `alarms` with the number of dangers. */
export class Alarmed extends EventTarget {
  /** The number of active dangers. */
  dangers = 0;
  #place; #live; #ended = new Set(); #drawn = "";

  constructor(place, live) {
    super();
    this.#place = place;
    this.#live = live;
    live.addEventListener("alarm", () => this.#show());
    for (const [target, what] of [[window, "hashchange"], [phone, "change"]]) {
      target.addEventListener(what, () => { this.#drawn = ""; this.#show(); });
    }
    live.addEventListener("picture", () => { if (!place.hidden) this.#show(); });
    live.addEventListener("anew", () => { this.#ended.clear(); this.#show(); });
  }

  #key = ({ t_s, what, train }) => `${t_s} ${what} ${train}`;

  #show() {
    const open = standing(this.#live.alarms, this.#live.picture).filter((alarm) => !this.#ended.has(this.#key(alarm)));
    // Unchanged text is not written again, so that screen readers do not repeat it.
    const drawn = open.map(this.#key).join();
    if (drawn === this.#drawn) return;
    this.#drawn = drawn;
    this.dangers = open.filter(({ grade }) => grade === "danger").length;
    this.#place.hidden = open.length === 0;
    const shown = phone.matches ? 1 : SHOWN;
    const more = open.length - shown;
    this.#place.replaceChildren(...open.slice(0, shown).map((alarm) => this.#row(alarm)),
      ...(more > 0 ? [make("a", { href: "#/health" }, say("more-alarms", more))] : []));
    this.dispatchEvent(new Event("alarms"));
  }

  #row(alarm) {
    const end = make("button", { type: "button", class: "small", "aria-label": say("end-alarm-of", described(alarm)) }, say("end-alarm"));
    end.addEventListener("click", () => {
      this.#ended.add(this.#key(alarm));
      this.#show();
    });
    const acts = action(alarm);
    const row = make("p", { class: `alarm ${alarm.grade}` }, make("span"), ...(acts.hash === location.hash ? [] : [acts]), end);
    put(row.firstElementChild, described(alarm));
    return row;
  }
}
