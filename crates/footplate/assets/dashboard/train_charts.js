// The charts of one train: speed, distance, position uncertainty, prediction errors and stopping distance.

import { colour, dots, line } from "./chart.js";
import { LiveChart } from "./charts.js";
import { get } from "./server.js";
import { TimeWindow } from "./time_window.js";
import { say } from "./words.js";

/** Samples kept: as many as the server keeps, five minutes at 10 Hz. */
const KEPT = 3000;
/** Interval between samples (s). */
const EVERY_S = 0.1;
/** A gap this long (s) is requested again. */
const HOLE_S = 1;
/** Interval between two drawings of a chart (ms). */
const DRAWN_EVERY_MS = 200;
const STRIP = 180;
/** Commands nearer to each other than this (pixels) are marked once, by the last of them. */
const CLOSE = 34;

const COLUMNS = ["t_s", "step", "speed_mm_per_s", "speed_half_mm_per_s", "way_mm", "half_mm"];

/** Marks the times at which a step was commanded. */
function steps(history) {
  return (u) => {
    const { ctx, bbox } = u;
    const { t_s: times, step } = history;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.strokeStyle = colour("quiet");
    ctx.fillStyle = colour("text");
    ctx.font = `${12 * devicePixelRatio}px system-ui, sans-serif`;
    ctx.setLineDash([3 * devicePixelRatio, 3 * devicePixelRatio]);
    let taken = Infinity;
    for (let i = times.length - 1; i > 0; i--) {
      if (step[i] === step[i - 1]) continue;
      const x = Math.round(u.valToPos(times[i], "x", true));
      // A train that holds a speed gets a command a second: lines that follow closely would cover the chart.
      if (x + CLOSE * devicePixelRatio > taken) continue;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      ctx.fillText(`→ ${step[i]}`, x + 3 * devicePixelRatio, bbox.top + 12 * devicePixelRatio);
      taken = x;
    }
    ctx.restore();
  };
}

export class TrainCharts {
  highest;
  #root; #live; #train; #history = Object.fromEntries(COLUMNS.map((name) => [name, []]));
  #window; #charts = []; #passed; #stops; #speed; #timer; #asked = false; #fresh = false;

  constructor(root, live, train) {
    [this.#root, this.#live, this.#train] = [root, live, train];
    this.#passed = live.passed.filter((passed) => passed.train === train);
    this.#window = new TimeWindow(root, () => { this.#fresh = true; });
    this.#load();
    this.#build();
    this.#timer = setInterval(() => this.#draw(), DRAWN_EVERY_MS);
  }

  /** Adds a sample. */
  goesOn(time, { step, speed_mm_per_s, speed_half_mm_per_s, way_mm, half_mm, at }) {
    this.#speed = at ? speed_mm_per_s : undefined;
    const last = this.#history.t_s.at(-1);
    if (last !== undefined && time < last + EVERY_S && time >= last) return;
    if (last !== undefined && (time > last + HOLE_S || time < last)) return this.#load();
    const known = at != null;
    const values = [time, step, known ? speed_mm_per_s : null, known ? speed_half_mm_per_s : null, way_mm, half_mm];
    COLUMNS.forEach((name, place) => {
      this.#history[name].push(values[place]);
      if (this.#history[name].length > KEPT) this.#history[name].shift();
    });
    this.#fresh = true;
  }

  passed(passed) {
    this.#passed.push(passed);
    // What is older than the history is not shown any more.
    const [begins] = this.#history.t_s;
    const kept = this.#passed.findIndex(({ t_s: at }) => at >= begins);
    if (kept > 0) this.#passed.splice(0, kept);
    this.#fresh = true;
    this.#knows();
  }

  anew() {
    this.#passed = [];
    this.#load();
  }

  close() {
    clearInterval(this.#timer);
    this.#charts.forEach(({ chart }) => chart.close());
  }

  async #load() {
    if (this.#asked) return;
    this.#asked = true;
    try {
      Object.assign(this.#history, await get(`/api/trains/${this.#train}/history`));
      await this.#knows();
    } catch {
      // A train that is not part of the session has no history; the page says so.
    }
    this.#asked = false;
    this.#fresh = true;
  }

  async #knows() {
    const model = await get(`/api/trains/${this.#train}/model`);
    this.highest = model.highest;
    this.#stops = model.steps.filter((step) => step.uses !== "unreliable").sort((a, b) => a.speed_mm_per_s - b.speed_mm_per_s);
    this.#fresh = true;
  }

  /** The 97th percentile of the values shown: outliers must not flatten the rest. */
  #most(times, sizes, least) {
    const [from, to] = this.#window.ends();
    const seen = sizes.filter((size, i) => size != null && times[i] >= from && times[i] <= to).sort((one, other) => one - other);
    return 1.2 * Math.max(least, seen[Math.floor(0.97 * (seen.length - 1))] ?? 0);
  }

  /** The ends of an axis that is symmetric about zero. */
  #reach(times, sizes, least) {
    const most = this.#most(times, sizes, least);
    return [-most, most];
  }

  #build() {
    const x = { label: say("axis-time"), unit: "s", digits: 1 };
    const range = { x: { range: () => this.#window.ends() } };
    const selects = (from, to) => this.#window.select(from, to);
    const sync = `train-${this.#train}`;
    const band = (label, unit, digits) => [
      { ...line(label, "band-edge", unit, digits), width: 1 },
      { ...line(label, "band-edge", unit, digits), width: 1, class: "unlisted" },
    ];
    const shade = () => [{ series: [1, 2], fill: colour("band") }];
    const marks = [steps(this.#history)];
    const add = (name, options, data) => {
      const figure = this.#root.querySelector(`figure[data-chart="${name}"]`);
      const chart = new LiveChart(figure, options, data());
      this.#charts.push({ chart, data });
    };
    add("speed", () => ({
      name: say("chart-speed"), x, y: say("axis-speed"), sync, range: { ...range, y: { range: () => [0, this.#most(this.#history.t_s, this.#history.speed_mm_per_s, 60)] } },
      zooms: false, selects, below: marks, bands: shade(),
      series: [...band(say("band-95"), "mm/s", 0), line(say("estimated"), "first", "mm/s", 0), dots(say("mean-between"), "second", "mm/s", 0)],
    }), () => {
      const { t_s: t, speed_mm_per_s: v, speed_half_mm_per_s: half } = this.#history;
      const means = this.#passed.filter(({ mean }) => mean).map(({ mean }) => mean);
      const edge = (sign) => v.map((value, i) => (value == null ? null : Math.max(value + sign * half[i], 0)));
      return uPlot.join([[t, edge(1), edge(-1), v], [means.map(([at]) => at), means.map(([, speed]) => speed)]]);
    });
    add("sure", () => ({
      name: say("chart-sure"), x, y: say("axis-sure"), sync, height: STRIP, zero: true, zooms: false, selects, below: marks, bands: shade(),
      range: { ...range, y: { range: () => {
        const { t_s: t, half_mm: half } = this.#history;
        const own = this.#passed.filter(({ short_mm }) => short_mm != null);
        return this.#reach([...t, ...own.map(({ t_s }) => t_s)], [...half, ...own.map(({ short_mm }) => Math.abs(short_mm))], 10);
      } } },
      series: [...band(say("band-95"), "mm", 0), dots(say("at-contact"), "second", "mm", 1)],
    }), () => {
      const { t_s: t, half_mm: half } = this.#history;
      const own = this.#passed.filter(({ short_mm }) => short_mm != null);
      return uPlot.join([[t, half, half.map((value) => (value == null ? null : -value))], [own.map(({ t_s }) => t_s), own.map(({ short_mm }) => -short_mm)]]);
    });
    add("way", () => ({
      name: say("chart-way"), x, y: say("axis-way"), sync, height: STRIP, range, zooms: false, selects, below: marks,
      series: [line(say("estimated"), "first", "m", 2), dots(say("contact"), "second", "m", 2)],
    }), () => {
      const { t_s: t, way_mm: distance } = this.#history;
      const m = (mm) => (mm == null ? null : mm / 1000);
      return uPlot.join([[t, distance.map(m)], [this.#passed.map(({ t_s }) => t_s), this.#passed.map(({ way_mm }) => m(way_mm))]]);
    });
    const late = [];
    add("late", () => ({
      name: say("chart-late"), x, y: say("axis-late"), sync, height: STRIP, zero: true, zooms: false, selects, bars: [[late, "first"]],
      range: { ...range, y: { range: () => this.#reach(late.map(({ x: at }) => at), late.map(({ y, dy }) => Math.abs(y) + dy), 50) } },
      series: [dots(say("later"), "first", "ms", 0)],
    }), () => {
      const own = this.#passed.filter(({ late_ms }) => late_ms != null);
      late.splice(0, late.length, ...own.map(({ t_s, late_ms, late_half_ms }) => ({ x: t_s, y: late_ms, dy: late_half_ms })));
      return [own.map(({ t_s }) => t_s), own.map(({ late_ms }) => late_ms)];
    });
    const bars = [];
    add("stops", () => ({
      name: say("chart-stops"), x: { label: say("axis-from-speed"), unit: "mm/s", digits: 0 }, y: say("axis-stop"), zooms: false,
      range: { x: { range: (_, __, high) => [0, Math.max(100, 1.05 * (high ?? 0))] }, y: { range: (_, __, high) => [0, Math.max(100, 1.1 * (high ?? 0))] } },
      below: [(u) => this.#now(u)], bars: [[bars, "second"]], bands: shade(),
      series: [...band(say("stop-95"), "mm", 0), line(say("stop-way"), "first", "mm", 0), dots(say("stop-measured"), "second", "mm", 0)],
    }), () => {
      const own = this.#stops ?? [];
      const measured = own.filter(({ stops }) => stops > 0);
      bars.splice(0, bars.length, ...measured.map((step) => ({ x: step.speed_mm_per_s, y: step.stop_mm, dy: step.stop_doubt_half_mm })));
      const at = (of) => own.map(of);
      return [
        at((step) => step.speed_mm_per_s), at((step) => step.stop_mm + step.stop_half_mm), at((step) => Math.max(step.stop_mm - step.stop_half_mm, 0)),
        at((step) => step.stop_mm), at((step) => (step.stops > 0 ? step.stop_mm : null)),
      ];
    });
  }

  /** Marks the current speed in the chart of stops. */
  #now(u) {
    if (!this.#speed) return;
    const x = Math.round(u.valToPos(this.#speed, "x", true));
    const { ctx, bbox } = u;
    ctx.save();
    ctx.strokeStyle = colour("second");
    ctx.lineWidth = 2 * devicePixelRatio;
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    ctx.restore();
  }

  #draw() {
    if (!this.#fresh) return;
    this.#fresh = false;
    const { t_s: times } = this.#history;
    this.#window.holds(times[0] ?? 0, times.at(-1) ?? 0);
    for (const { chart, data } of this.#charts) chart.set(data());
  }
}
