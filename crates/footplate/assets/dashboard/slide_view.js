// A simulated slide, live: both wheel speeds, the estimate of the odometer, and the truth.

import { colour, line } from "./chart.js";
import { LiveChart } from "./charts.js";
import { put, shown, signed } from "./dom.js";
import { get, withToken } from "./server.js";
import { say } from "./words.js";

/** The scenarios that the pages have words for. In the first, both wheels slide, touch and lock. */
const OFFERED = ["S2", "S3", "S5", "S8", "S1", "S1b", "S4", "S6", "S7"];
/** Height of the strips with the state of each wheel, as a part of the chart. */
const STRIP = 0.035;
const STATES = { spin: "second", slide: "red", excluded: "amber" };

export class SlideView {
  #root; #charts = []; #events; #rows = []; #marks = [[], []]; #train; #inside = 0;

  constructor(root) {
    this.#root = root;
    const $ = (selector) => root.querySelector(selector);
    $("#slide").replaceChildren(...OFFERED.map((name) => new Option(say(`slide-${name}`), name)));
    $("#watch-slide").addEventListener("submit", (event) => {
      event.preventDefault();
      this.#begin($("#slide").value, $("#slide-seed").value, $("#slide-speed").value);
    });
    $("#slide-end").addEventListener("click", () => this.#end());
    const x = { label: say("axis-run"), unit: "s", digits: 2 };
    const range = { x: { range: () => [0, this.#train?.duration_s ?? 30] } };
    const bound = (label, unit) => ({ ...line(label, "quiet", unit, 2), width: 1 });
    const column = (of) => this.#rows.map(of);
    // Scaled to the speeds: a bound that is wide at first would flatten all else.
    const fastest = () => 1.3 * Math.max(1, ...this.#rows.flatMap(({ speed, true_speed: truth, wheels: [one, other] }) => [speed, truth ?? 0, one ?? 0, other ?? 0]));
    this.#add("slide-speed", () => ({
      name: say("chart-slide-speed"), x, y: say("axis-run-speed"), height: 340, range: { ...range, y: { range: () => [0, fastest()] } }, zooms: false, below: [this.#strips()],
      series: [
        bound(say("at-most"), "m/s"), bound(say("at-least"), "m/s"), line(say("wheel-1"), "second", "m/s", 2), line(say("wheel-2"), "third", "m/s", 2),
        line(say("estimated"), "first", "m/s", 2), { ...line(say("in-truth"), "text", "m/s", 2), dash: [6, 4] },
        { ...bound(say("guaranteed-at-most"), "m/s"), dash: [2, 3] }, { ...bound(say("guaranteed-at-least"), "m/s"), dash: [2, 3] },
      ],
      bands: [{ series: [1, 2], fill: colour("band") }],
    }), () => [column(({ t_s }) => t_s), column((row) => row.confidence_speed_high), column((row) => row.confidence_speed_low), column((row) => row.wheels[0]),
      column((row) => row.wheels[1]), column((row) => row.speed), column((row) => row.true_speed), column((row) => row.guaranteed_speed_high),
      column((row) => row.guaranteed_speed_low)]);
    this.#add("slide-distance", () => ({
      name: say("chart-slide-distance"), x, y: say("axis-beyond-truth"), height: 200, range, zooms: false, zero: true,
      series: [bound(say("at-most"), "m"), bound(say("at-least"), "m"), line(say("estimated"), "first", "m", 2)],
      bands: [{ series: [1, 2], fill: colour("band") }],
    }), () => [column(({ t_s }) => t_s), column((row) => row.confidence_beyond_high), column((row) => row.confidence_beyond_low), column((row) => row.beyond)]);
  }

  #add(name, options, data) {
    this.#charts.push({ chart: new LiveChart(this.#root.querySelector(`figure[data-chart="${name}"]`), options, data()), data });
  }

  #put(selector, text) {
    put(this.#root.querySelector(selector), text);
  }

  /** Intervals in which wheels slip, slide or are excluded: the first wheelset at the top of the chart, the second below it. */
  #strips() {
    return (u) => {
      const { ctx, bbox } = u;
      ctx.save();
      for (const [wheel, marks] of this.#marks.entries()) {
        for (const { from, to, state } of marks) {
          const left = u.valToPos(from, "x", true);
          ctx.fillStyle = colour(STATES[state]);
          ctx.fillRect(left, bbox.top + 1.4 * wheel * STRIP * bbox.height, Math.max(u.valToPos(to, "x", true) - left, 2), STRIP * bbox.height);
        }
      }
      ctx.restore();
    };
  }

  async #begin(name, seed, speed) {
    this.#end();
    this.#put("#slide-answer", say("slide-begins"));
    const address = `/api/slides/${encodeURIComponent(name)}?seed=${encodeURIComponent(seed)}&speed=${encodeURIComponent(speed)}`;
    const events = new EventSource(withToken(address));
    this.#events = events;
    this.#root.querySelector("#slide-end").hidden = false;
    const heard = (kind, does) => events.addEventListener(kind, (event) => does.call(this, JSON.parse(event.data)));
    heard("train", this.#opens);
    heard("rows", this.#goesOn);
    heard("score", this.#ends);
    // A rejected stream does not contain its reason: fetch it as text.
    events.addEventListener("error", () => {
      if (events.readyState !== EventSource.CLOSED) return;
      this.#end();
      get(address).catch((error) => this.#put("#slide-answer", error.message));
    });
  }

  /** The run begins, or restarts after the connection was lost. */
  #opens(train) {
    this.#train = train;
    [this.#rows, this.#marks, this.#inside] = [[], [[], []], 0];
    this.#root.querySelector("#sliding").hidden = false;
    this.#put("#slide-score", "");
    this.#put("#slide-answer", say("slide-runs", train.scenario, train.seed, shown(train.duration_s)));
  }

  #goesOn({ rows }) {
    for (const row of rows) {
      const since = this.#rows.at(-1)?.t_s ?? row.t_s;
      this.#rows.push(row);
      this.#inside += row.guaranteed_speed_low <= row.true_speed && row.true_speed <= row.guaranteed_speed_high;
      for (const [wheel, state] of row.states.entries()) {
        if (!(state in STATES)) continue;
        const last = this.#marks[wheel].at(-1);
        if (last && last.state === state && last.to === since) last.to = row.t_s;
        else this.#marks[wheel].push({ from: since, to: row.t_s, state });
      }
    }
    const now = this.#rows.at(-1);
    if (!now) return;
    const half = Math.max(now.confidence_speed_high - now.speed, now.speed - now.confidence_speed_low);
    this.#put("#slide-time", `${shown(now.t_s, 1)} s`);
    this.#put("#slide-estimate", `${shown(now.speed, 2)} m/s (${shown(now.confidence_speed_low, 2)} … ${shown(now.confidence_speed_high, 2)})`);
    this.#root.querySelector("#slide-estimate").dataset.half = half.toFixed(3);
    this.#put("#slide-truth", now.true_speed == null ? "–" : `${shown(now.true_speed, 2)} m/s`);
    const wheel = (place) => `${now.wheels[place] == null ? "–" : shown(now.wheels[place], 2)} m/s, ${say(`wheel-${now.states[place]}`)}`;
    this.#put("#slide-wheel-1", wheel(0));
    this.#put("#slide-wheel-2", wheel(1));
    this.#put("#slide-beyond", now.beyond == null ? "–" : `${signed(now.beyond, 2)} m (${signed(now.confidence_beyond_low, 2)} … ${signed(now.confidence_beyond_high, 2)})`);
    this.#put("#slide-inside", say("periods-inside", this.#inside, this.#rows.length));
    this.#charts.forEach(({ chart, data }) => chart.set(data()));
  }

  #ends(score) {
    this.#end();
    const words = [say(score.holds ? "bounds-held" : "bounds-left"), say("score-speed", shown(score.speed_rms_m_s, 3), shown(score.speed_max_m_s, 2)),
      say("score-distance", signed(score.distance_end_m, 2), shown(score.confidence_distance_width_m, 1))];
    if (score.detect_delay_s != null) words.push(say("score-noticed", shown(score.detect_delay_s, 2)));
    this.#put("#slide-score", words.join(" "));
  }

  #end() {
    this.#events?.close();
    this.#root.querySelector("#slide-end").hidden = true;
  }

  /** The view was closed. */
  close() {
    this.#end();
    this.#charts.forEach(({ chart }) => chart.close());
  }
}
