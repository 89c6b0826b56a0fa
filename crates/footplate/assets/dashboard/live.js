// The live data of the session for all pages: pictures and events.

import { get, withToken } from "./server.js";
import { say } from "./words.js";

/** The most lines, detections and orders kept: as many as the server keeps. */
const KEPT = 4000;

/** Interval between attempts to listen again after the server refused (ms). */
const AGAIN_MS = 3000;

/** After this time without a picture the server is asked whether it is there, and its answer awaited as long (ms). */
const SILENT_MS = 6000;

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
  #session; #last = -1; #drawing = false; #heardAt = 0;

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

  /**
   * Whether an event is new. Its id contains its session and its number: `1700000000-12`. A connection that the browser did not
   * renew by itself begins with those that are here already.
   */
  #isNew({ lastEventId }) {
    const at = lastEventId.lastIndexOf("-");
    const [session, number] = [lastEventId.slice(0, at), Number(lastEventId.slice(at + 1))];
    if (this.#session !== undefined && session !== this.#session) {
      [this.lines, this.passed, this.ended, this.alarms] = [[], [], [], []];
      this.#last = -1;
      this.#say("anew");
    }
    this.#session = session;
    if (number <= this.#last) return false;
    this.#last = number;
    return true;
  }

  /** A line that is cut, or a server without power, ends no connection by itself. */
  async #check(events) {
    if (document.hidden || performance.now() - this.#heardAt < SILENT_MS) return;
    this.#heardAt = performance.now();
    try {
      await fetch(withToken("/api/layout"), { signal: AbortSignal.timeout(SILENT_MS) });
    } catch {
      if (events.readyState === EventSource.CLOSED) return;
      events.close();
      this.#stands("lost");
      this.#listen();
    }
  }

  #listen() {
    const events = new EventSource(withToken("/api/events"));
    this.#heardAt = performance.now();
    const check = setInterval(() => (events.readyState === EventSource.CLOSED ? clearInterval(check) : this.#check(events)), AGAIN_MS);
    events.addEventListener("open", () => this.#stands("connected"));
    events.addEventListener("error", () => {
      this.#stands("lost");
      // A browser connects again after a broken connection, but not after an answer with a status.
      if (events.readyState === EventSource.CLOSED) setTimeout(() => this.#listen(), AGAIN_MS);
    });
    events.addEventListener("picture", (event) => {
      this.#heardAt = performance.now();
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
      if (!this.#isNew(event)) return;
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
