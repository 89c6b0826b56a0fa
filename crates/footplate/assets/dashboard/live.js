// The live data of the session for all pages: pictures and events.

import { get, withToken } from "./server.js";
import { say } from "./words.js";

/** The most lines, detections and orders kept: as many as the server keeps. */
const KEPT = 4000;

/** Interval between attempts to listen again after the server refused (ms). */
const AGAIN_MS = 3000;

/** Appends to a list of limited length. */
function keep(list, item) {
  list.push(item);
  if (list.length > KEPT) list.splice(0, list.length - KEPT);
}

/**
 * Dispatches `state` (with `connecting`, `connected` or `lost`), `picture`, `line`, `passed`, `ended`, `alarm`, `gap`, and `anew`
 * when another session has begun and earlier data is void.
 */
export class Live extends EventTarget {
  /** Who serves the pages, and whether another program is about to. */
  setUp; awaitsMode = false;
  layout; picture; state = "connecting"; lines = []; passed = []; ended = []; alarms = [];
  #session; #drawing = false;

  /** A train with the name that its owner gave it in the set-up. */
  called(train) {
    const name = this.setUp?.trains.find(({ address }) => address === train)?.name;
    return name ? `${say("train", train)} · ${name}` : say("train", train);
  }

  async begin() {
    this.layout = await get("/api/layout");
    this.#listen();
  }

  #say(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }

  #stands(state) {
    this.state = state;
    this.#say("state", state);
  }

  /** The id of an event contains its session and its number: `1700000000-12`. */
  #isOf({ lastEventId }) {
    const session = lastEventId.slice(0, lastEventId.lastIndexOf("-"));
    if (this.#session !== undefined && session !== this.#session) {
      [this.lines, this.passed, this.ended, this.alarms] = [[], [], [], []];
      this.#say("anew");
    }
    this.#session = session;
  }

  #listen() {
    const events = new EventSource(withToken("/api/events"));
    events.addEventListener("open", () => this.#stands("connected"));
    events.addEventListener("error", () => {
      this.#stands("lost");
      // A browser connects again after a broken connection, but not after an answer with a status.
      if (events.readyState === EventSource.CLOSED) setTimeout(() => this.#listen(), AGAIN_MS);
    });
    events.addEventListener("picture", (event) => {
      this.picture = JSON.parse(event.data);
      // One drawing per frame, of the newest picture.
      if (!this.picture || this.#drawing) return;
      this.#drawing = true;
      requestAnimationFrame(() => {
        this.#drawing = false;
        this.#say("picture", this.picture);
      });
    });
    const happens = (kind, list) => events.addEventListener(kind, (event) => {
      this.#isOf(event);
      const what = JSON.parse(event.data);
      keep(this[list], what);
      this.#say(kind, what);
    });
    happens("line", "lines");
    happens("passed", "passed");
    happens("ended", "ended");
    happens("alarm", "alarms");
    events.addEventListener("gap", (event) => this.#say("gap", event.data));
  }
}
