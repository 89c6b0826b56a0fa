// The health page: prediction errors, drift, alarms, and the timing of link and control loop.

import { described, news } from "./alarms.js";
import { colour, dots } from "./chart.js";
import { LiveChart, upright } from "./charts.js";
import { make, put, shown, signed } from "./dom.js";
import { get } from "./server.js";
import { say } from "./words.js";
import { COLOURS } from "./track.js";

/** Interval between two requests for the timing (ms). */
const LOOKED_EVERY_MS = 2000;
/** The most bars of a histogram. */
const BARS = 40;
/** The most alarms listed. */
const LISTED = 100;
/** No share is shown for fewer predictions. */
const FEW = 20;

/** Counts in bars of equal width, between the least value and the 99.5th percentile. */
function histogram({ bins, count }) {
  let seen = 0;
  const most = bins.find(([, , n]) => (seen += n) >= 0.995 * count)?.[1] ?? 1;
  const least = bins[0]?.[0] ?? 0;
  const width = (most - least) / BARS || 1;
  const counts = new Array(BARS).fill(0);
  for (const [from, to, n] of bins) {
    // A bin may overlap two bars: its counts are divided evenly.
    for (let bar = 0; bar < BARS; bar++) {
      const [low, high] = [Math.max(from, least + bar * width), Math.min(to, least + (bar + 1) * width)];
      if (high > low) counts[bar] += n * (high - low) / (to - from);
    }
  }
  return [counts.map((_, bar) => least + (bar + 0.5) * width), counts];
}

export function healthPage(root, live) {
  const $ = (selector) => root.querySelector(selector);
  const charts = [];
  let order = [];
  let line;

  const trains = () => [...new Set(live.passed.map(({ train }) => train))].sort((one, other) => one - other);
  const known = (train) => live.passed.filter((passed) => passed.train === train && passed.late_ms != null);

  function build() {
    charts.splice(0).forEach(({ chart }) => chart.close());
    order = trains();
    const add = (name, options, data) => {
      charts.push({ chart: new LiveChart($(`figure[data-chart="${name}"]`), options, data()), data });
    };
    const x = { label: say("axis-time"), unit: "s", digits: 1 };
    const series = (unit, digits) => (order.length ? order : [0]).map((train, place) => dots(say("train", train), `t${place % COLOURS}`, unit, digits));
    const joined = (value) => () => uPlot.join((order.length ? order : [0]).map((train) => {
      const own = known(train).filter((passed) => value(passed) != null);
      return [own.map(({ t_s }) => t_s), own.map(value)];
    }));
    const about = (least, value) => ({ y: { range: () => {
      const sizes = live.passed.map(value).filter((size) => size != null).map(Math.abs).sort((one, other) => one - other);
      const most = 1.2 * Math.max(least, sizes[Math.floor(0.98 * (sizes.length - 1))] ?? 0);
      return [-most, most];
    } } });
    const inDoubts = ({ late_ms: late, late_half_ms: half }) => (late == null ? null : late / half);
    const beside = ({ short_mm: short }) => (short == null ? null : -short);
    add("errors", () => ({ name: say("chart-errors"), x, sync: "health", y: say("axis-sure"), zero: true, range: about(10, beside), series: series("mm", 1) }), joined(beside));
    add("doubts", () => ({
      name: say("chart-doubts"), x, sync: "health", y: say("axis-doubts"), height: 200, zero: true, range: about(1.5, inDoubts), series: series("", 2),
      below: [(u) => {
        const [top, foot] = [u.valToPos(1, "y", true), u.valToPos(-1, "y", true)];
        u.ctx.save();
        u.ctx.fillStyle = colour("band");
        u.ctx.fillRect(u.bbox.left, top, u.bbox.width, foot - top);
        u.ctx.restore();
      }],
    }), joined(inDoubts));
    const times = (name, of) => add(name, () => ({
      name: say(`chart-${name}`), x: { label: say("axis-ms"), unit: "ms", digits: 2 }, y: say("axis-count"), height: 200, zooms: false,
      range: { y: { range: (_, __, high) => [0, Math.max(1, 1.08 * (high ?? 0))] } }, series: [upright(say("times"), "first")],
    }), () => (line?.[of].count ? histogram(line[of]) : [[0, 1], [0, 0]]));
    times("poll", "poll_period");
    times("first-byte", "first_byte");
    times("turn", "loop_turn");
  }

  function table() {
    const rows = trains().map((train) => {
      const own = known(train);
      const inside = own.filter(({ late_ms, late_half_ms }) => Math.abs(late_ms) <= late_half_ms).length;
      const rms = Math.sqrt(own.reduce((sum, { short_mm: short }) => sum + (short ?? 0) ** 2, 0) / Math.max(own.length, 1));
      const mean = own.reduce((sum, { short_mm: short }) => sum - (short ?? 0), 0) / Math.max(own.length, 1);
      const drift = own.at(-1)?.drift ?? 0;
      const level = make("meter", { min: 0, max: 1, low: 0.5, high: 0.8, optimum: 0, value: drift, "aria-label": say("drift-of", train, shown(100 * drift)) });
      return make("tr", {},
        make("th", { scope: "row" }, make("a", { href: `#/train/${train}` }, live.called(train))),
        make("td", { class: "number" }, String(own.length)),
        make("td", { class: "number" }, own.length ? shown(rms, 1) : "–"),
        make("td", { class: "number" }, own.length ? signed(mean, 1) : "–"),
        make("td", { class: "number" }, own.length >= FEW ? `${shown((100 * inside) / own.length)} %` : say("too-few")),
        make("td", {}, level, ` ${shown(100 * drift)} %`));
    });
    $("#fares").replaceChildren(...rows);
  }

  function alarms() {
    const rows = live.alarms.slice(-LISTED).reverse().map((alarm) => make("li", { class: alarm.grade },
      make("span", { class: "quiet" }, `${shown(alarm.t_s, 1)} s `), news(alarm)));
    $("#alarms").replaceChildren(...rows);
  }

  let listed;
  /** The alarms that are active now, with how long and how often. */
  function active({ alarms: open }) {
    const key = JSON.stringify(open.map(({ id, count, what }) => [id, count, what]));
    if (key === listed) return;
    listed = key;
    $("#no-alarm").hidden = open.length > 0;
    $("#active-alarms").replaceChildren(...open.map((alarm) => make("li", { class: alarm.grade }, described(alarm),
      make("span", { class: "quiet" }, ` ${say(alarm.count > 1 ? "alarm-since-often" : "alarm-since", shown(alarm.since_s, 1), alarm.count)}`))));
  }

  const quantiles = ({ count, median_ms: median, p95_ms: p95, p99_ms: p99, longest_ms: longest }) =>
    (count ? say("quantiles", count, ...[median, p95, p99, longest].map((ms) => shown(ms, ms < 0.1 ? 3 : ms < 10 ? 2 : 1))) : say("none-yet"));

  async function look() {
    try {
      line = await get("/api/line");
    } catch {
      // The state of the connection shows the failure already.
      return;
    }
    // Another page may be open by now.
    if (!$("#poll")) return;
    for (const [place, of] of [["poll", "poll_period"], ["first-byte", "first_byte"], ["turn", "loop_turn"]]) put($(`#${place}`), quantiles(line[of]));
    charts.forEach(({ chart, data }) => chart.set(data()));
  }

  build();
  table();
  alarms();
  look();
  const timer = setInterval(look, LOOKED_EVERY_MS);
  return {
    picture: active,
    passed() {
      if (trains().join() !== order.join()) build();
      table();
    },
    alarm: alarms,
    anew() { build(); table(); alarms(); },
    close() {
      clearInterval(timer);
      charts.forEach(({ chart }) => chart.close());
    },
  };
}
