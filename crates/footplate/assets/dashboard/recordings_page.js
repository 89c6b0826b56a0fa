// The recordings page: lists sessions, replays one with a slider, and compares two.

import { aboutCalibration } from "./calibration_page.js";
import { colour, dots, line } from "./chart.js";
import { LiveChart } from "./charts.js";
import { make, put, shown, signed } from "./dom.js";
import { get } from "./server.js";
import { COLOURS, Track } from "./track.js";
import { View } from "./view.js";
import { logged, say } from "./words.js";

/** Lines shown around the selected time. */
const LINES = 8;
/** Replay speeds over real time. */
const SPEEDS = [0.5, 1, 2, 4, 10, 30];
const USUAL_SPEED = 4;
/** The charts share their time axis, cursor and zoom. */
const SYNC = "recordings";

/** One session on the page: its track, and its state at a time. */
class Walked {
  #root; #track; #pictures; #lines; passed;

  constructor(root, name, { layout, pictures, happened }) {
    this.#root = root;
    this.#pictures = pictures;
    const of = (kind) => happened.filter((one) => one.kind === kind).map(({ what }) => what);
    this.#lines = of("line");
    this.passed = of("passed");
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    svg.setAttribute("class", "track-view");
    svg.setAttribute("role", "img");
    svg.setAttribute("tabindex", "0");
    svg.setAttribute("aria-label", say("walked-track", name));
    root.replaceChildren(make("h3", {}, name), svg, make("p", { class: "where" }), make("ol", { class: "said" }));
    this.#track = new Track(svg, layout);
    new View(svg, this.#track.whole, () => {});
  }

  /** The time from the first picture to the last (s). */
  get lasts() {
    return this.#pictures.at(-1).t_s - this.#pictures[0].t_s;
  }

  /** Shows the time `at` after the first picture. */
  show(time) {
    const at = this.#pictures[0].t_s + time;
    let [low, high] = [0, this.#pictures.length - 1];
    while (low < high) {
      const middle = Math.ceil((low + high) / 2);
      if (this.#pictures[middle].t_s <= at) low = middle;
      else high = middle - 1;
    }
    const picture = this.#pictures[low];
    this.#track.show(picture);
    const where = picture.trains.map((train) => `${say("train", train.train)}: ${train.at ? `${train.at} ± ${shown(train.half_mm)} mm, ${shown(train.speed_mm_per_s)} mm/s` : say("nowhere")}${train.doing ? ` (${train.doing})` : ""}`);
    if (picture.calibration) where.push(aboutCalibration(picture.calibration));
    put(this.#root.querySelector(".where"), where.join("; "));
    const said = this.#lines.filter(({ t_s }) => t_s <= at).slice(-LINES).map(({ text }) => make("li", {}, logged(text)));
    this.#root.querySelector(".said").replaceChildren(...said);
  }

  /** The speed of each train by time since the first picture. */
  speeds() {
    const begins = this.#pictures[0].t_s;
    const trains = [...new Set(this.#pictures.flatMap((picture) => picture.trains.map(({ train }) => train)))];
    const times = this.#pictures.map(({ t_s }) => t_s - begins);
    const speeds = trains.map((train) => [train, times, this.#pictures.map((picture) => {
      const own = picture.trains.find((one) => one.train === train);
      return own?.at ? own.speed_mm_per_s : null;
    })]);
    // A train that was never located has none.
    return speeds.filter(([, , values]) => values.some((value) => value != null));
  }

  /** Detections by time since the first picture, with their prediction errors. */
  errors() {
    const begins = this.#pictures[0].t_s;
    return this.passed.filter(({ short_mm }) => short_mm != null).map(({ t_s, short_mm, late_ms, late_half_ms }) => ({ at: t_s - begins, mm: -short_mm, inside: Math.abs(late_ms) <= late_half_ms }));
  }
}

export function recordingsPage(root, live, number) {
  const $ = (selector) => root.querySelector(selector);
  const shownSessions = new Map();
  let charts = [], playing, list = [], opened = 0;
  const slider = $("#time");
  const speed = $("#played");
  speed.append(...SPEEDS.map((times) => new Option(`${times} ×`, String(times))));
  speed.value = String(USUAL_SPEED);

  function show() {
    const time = Number(slider.value);
    put($("#time-told"), `${shown(time, 1)} s`);
    for (const walked of shownSessions.values()) walked.show(time);
    for (const chart of charts) chart.redraw();
  }

  /** The time shown, in all charts. */
  function mark(u) {
    const at = u.valToPos(Number(slider.value), "x", true);
    u.ctx.save();
    u.ctx.strokeStyle = colour("text");
    u.ctx.lineWidth = 1.5 * devicePixelRatio;
    u.ctx.beginPath();
    u.ctx.moveTo(at, u.bbox.top);
    u.ctx.lineTo(at, u.bbox.top + u.bbox.height);
    u.ctx.stroke();
    u.ctx.restore();
  }

  /** Goes to a time that was clicked in a chart. */
  function pick(time) {
    slider.value = String(time);
    show();
  }

  function draw() {
    charts.splice(0).forEach((chart) => chart.close());
    const x = { label: say("axis-session"), unit: "s", digits: 1 };
    // Both charts begin and end with the slider.
    const spread = (series) => uPlot.join([...series, [[0, Number(slider.max)], [null, null]]]).slice(0, series.length + 1);
    const all = [...shownSessions.entries()].map(([name, walked]) => [name, walked.errors()]);
    $("#walked").hidden = all.length === 0;
    // A calibration predicts no detections.
    const predicts = all.some(([, own]) => own.length > 0);
    $('[data-chart="recorded"]').hidden = $("#compared").hidden = !predicts;
    const speeds = [...shownSessions.entries()].flatMap(([name, walked]) => walked.speeds().map(([train, times, values]) => [`${say("train", train)}, ${name}`, times, values, name]));
    if (speeds.length > 0) {
      charts.push(new LiveChart($('[data-chart="recorded-speed"]'), () => ({
        name: say("chart-recorded-speed"), x, y: say("axis-speed"), sync: SYNC, below: [mark],
        series: speeds.map(([name], place) => line(name, `t${place % COLOURS}`, "mm/s", 0)),
      }), spread(speeds.map(([, times, values]) => [times, values])), pick));
    }
    if (!predicts) return;
    charts.push(new LiveChart($('[data-chart="recorded"]'), () => ({
      name: say("chart-recorded"), x, y: say("axis-sure"), zero: true, sync: SYNC, below: [mark],
      // Each session in the colour of its first train.
      series: all.map(([name]) => dots(name, `t${Math.max(speeds.findIndex(([, , , of]) => of === name), 0) % COLOURS}`, "mm", 1)),
    }), spread(all.map(([, own]) => [own.map(({ at }) => at), own.map(({ mm }) => mm)])), pick));
    $("#figures").replaceChildren(...all.map(([name, own]) => {
      const rms = Math.sqrt(own.reduce((sum, { mm }) => sum + mm * mm, 0) / Math.max(own.length, 1));
      const mean = own.reduce((sum, { mm }) => sum + mm, 0) / Math.max(own.length, 1);
      const inside = own.filter((one) => one.inside).length;
      return make("tr", {}, make("th", { scope: "row" }, name), make("td", { class: "number" }, String(own.length)),
        make("td", { class: "number" }, own.length ? shown(rms, 1) : "–"), make("td", { class: "number" }, own.length ? signed(mean, 1) : "–"),
        make("td", { class: "number" }, own.length ? `${shown((100 * inside) / own.length)} %` : "–"));
    }));
  }

  async function open() {
    stop();
    // Two ticks in quick succession open twice: only the last one counts.
    opened += 1;
    const own = opened;
    const wanted = [...root.querySelectorAll("#recordings input:checked")].map(({ value }) => Number(value));
    put($("#answer"), say("walking"));
    shownSessions.clear();
    $("#sessions").replaceChildren();
    try {
      for (const recording of wanted) {
        const { name } = list.find((one) => one.recording === recording);
        const walked = await get(`/api/recordings/${recording}/pictures`);
        if (own !== opened) return;
        const place = make("article", { class: "session" });
        $("#sessions").append(place);
        shownSessions.set(logged(name), new Walked(place, logged(name), walked));
      }
      put($("#answer"), "");
    } catch (error) {
      if (own !== opened) return;
      put($("#answer"), error.message);
    }
    slider.max = String(Number(Math.max(0, ...[...shownSessions.values()].map((walked) => walked.lasts)).toFixed(1)));
    slider.value = "0";
    draw();
    show();
  }

  function stop() {
    clearInterval(playing);
    playing = undefined;
    put($("#play"), say("play"));
  }

  $("#play").addEventListener("click", () => {
    if (playing) return stop();
    put($("#play"), say("pause"));
    let last = performance.now();
    playing = setInterval(() => {
      const now = performance.now();
      slider.value = String(Number(slider.value) + Number(speed.value) * (now - last) / 1000);
      last = now;
      show();
      if (Number(slider.value) >= Number(slider.max)) stop();
    }, 50);
  });
  slider.addEventListener("input", show);

  async function begin() {
    try {
      list = (await get("/api/recordings")).reverse();
    } catch (error) {
      put($("#answer"), error.message);
      return;
    }
    $("#recordings").replaceChildren(...list.map((one) => {
      const box = make("input", { type: "checkbox", value: String(one.recording), disabled: one.machines.length === 0, checked: String(one.recording) === number });
      box.addEventListener("change", () => {
        const checked = [...root.querySelectorAll("#recordings input:checked")];
        // Two sessions can be compared; a third replaces the earlier one.
        if (checked.length > 2) checked.find((other) => other !== box).checked = false;
        open();
      });
      return make("tr", {}, make("th", { scope: "row" }, make("label", {}, box, ` ${logged(one.name)}`)), make("td", {}, one.layout),
        make("td", { class: "number" }, String(one.events)), make("td", { class: "number" }, String(one.excluded)), make("td", {}, one.machines.length ? one.machines.map((kind) => say(`machine-${kind}`)).join(", ") : "–"));
    }));
    put($("#answer"), list.length ? say("choose-two") : say("no-recordings"));
    if (root.querySelector("#recordings input:checked")) open();
  }

  begin();
  return {
    close() {
      opened += 1;
      stop();
      charts.forEach((chart) => chart.close());
    },
  };
}
