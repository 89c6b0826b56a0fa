// Alarms on every page, in the reader's language: the server keeps one for each cause until it is over or the operator ends it.

import { make, put, shown } from "./dom.js";
import { ask, order } from "./server.js";
import { logged, say } from "./words.js";

/** The most alarms shown in the frame, and on a phone; the health page has all of them. */
const SHOWN = 3;
const phone = matchMedia("(max-width: 40rem)");

/** Alarms whose train is lost, or may be elsewhere than estimated: the layout page leads to its position. */
const OF_PLACE = new Set(["lost", "needs-person", "held-as-unknown", "stands-lost", "stands-elsewhere", "stands-untimely", "stands-misses", "stands-stalled", "mishap-lost", "mishap-moved"]);
/** Alarms of a blocked train: the layout page offers other routes. */
const OF_ROUTE = new Set(["deadlock", "deadlocked", "track-reserved", "diverged", "diverged-and-others", "track-ends"]);
/** Alarms of a train whose model is wrong. */
const OF_MODEL = new Set(["promises-broken", "drifts-slower", "drifts-faster", "stands-slower", "stands-faster", "stands-distrusted"]);

/** Alarms whose values are sentences of the server, or commands. */
const OF_SENTENCES = new Set(["line-says", "not-sent", "unconfirmed"]);

/** A value of an alarm: numbers with decimals in the reader's language. */
const ofReader = (blank) => (/^-?\d+\.\d+$/.test(blank) ? shown(Number(blank), blank.split(".")[1].length) : blank);

/** Whether the pages have a sentence for an alarm; otherwise its text is shown as in the log. */
const sentence = ({ what, blanks, text }) => {
  const word = `alarm-${what}`;
  const said = say(word, ...(OF_SENTENCES.has(what) ? blanks.map(logged) : blanks.map(ofReader)));
  return said === word ? logged(text) : said;
};

/** An alarm as a sentence that begins with its train. */
export const described = (alarm) => (alarm.train == null ? sentence(alarm) : `${say("train", alarm.train)}: ${sentence(alarm)}`);

/** News of alarms as a sentence: an alarm that ends keeps its own. */
export const news = (alarm) => (alarm.grade === "over" && alarm.id != null ? say("alarm-over", described(alarm)) : described(alarm));

/** What the layout page offers for an alarm: to say where its train is, or to find another route for it. */
export const guides = ({ what, train }) => (train == null ? undefined : OF_PLACE.has(what) ? "place" : OF_ROUTE.has(what) ? "route" : undefined);

const link = (href, text) => make("a", { class: "button", href }, text);

/** The remedy of an alarm, as a link or a button; `fails` receives the reason if a command is refused. */
function remedy(alarm, fails) {
  const { what, train, blanks } = alarm;
  const orders = (text, line) => {
    const made = make("button", { type: "button" }, text);
    made.addEventListener("click", () => order(line).catch(({ message }) => fails(message)));
    return made;
  };
  const guide = guides(alarm);
  if (guide) return link(`#/layout/${train}`, say(`act-${guide}`, train));
  if (what === "power-off" || what === "line-power-lost" || what === "line-restarted") return orders(say("act-power"), "power on");
  if (what === "lies-curved") return orders(say("act-straight", blanks[0]), `turnout ${blanks[0]} straight`);
  if (what === "lies-straight") return orders(say("act-curved", blanks[0]), `turnout ${blanks[0]} curved`);
  if (OF_MODEL.has(what)) return link("#/calibration", say("act-model"));
  if (train != null) return link(`#/train/${train}`, say("act-train", train));
  return link("#/health", say(what.startsWith("line-") ? "act-line" : "act-health"));
}

/** The alarms in the frame of all pages. Dispatches `alarms` when they change. */
export class Alarmed extends EventTarget {
  /** The number of active dangers. */
  dangers = 0;
  #place; #live; #drawn = "";

  constructor(place, live) {
    super();
    this.#place = place;
    this.#live = live;
    for (const [target, what] of [[window, "hashchange"], [phone, "change"]]) {
      target.addEventListener(what, () => { this.#drawn = ""; this.#show(); });
    }
    live.addEventListener("picture", () => this.#show());
  }

  #show() {
    const open = this.#live.picture?.alarms ?? [];
    // Unchanged text is not written again, so that screen readers do not repeat it.
    const drawn = open.map(({ id, what, blanks }) => [id, what, ...blanks].join(" ")).join("\n");
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
    const text = make("span");
    const fails = (why) => put(text, `${described(alarm)} (${say("refused", why)})`);
    const end = make("button", { type: "button", class: "small", "aria-label": say("end-alarm-of", described(alarm)) }, say("end-alarm"));
    end.addEventListener("click", () => {
      // The next picture removes the row.
      end.disabled = true;
      ask(`/api/alarms/${alarm.id}/end`, {}).catch(({ message }) => {
        end.disabled = false;
        fails(message);
      });
    });
    const acts = remedy(alarm, fails);
    put(text, described(alarm));
    return make("p", { class: `alarm ${alarm.grade}` }, text, ...(acts.hash === location.hash ? [] : [acts]), end);
  }
}
