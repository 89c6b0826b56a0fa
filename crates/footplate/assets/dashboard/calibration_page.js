// The calibration page: the current model, the calibration from all recordings, and the measurements behind a value.

import { colour, dots, line, rounded } from "./chart.js";
import { LiveChart, barsOf } from "./charts.js";
import { make, put, shown, signed } from "./dom.js";
import { ask, get } from "./server.js";
import { LANGUAGE, logged, say } from "./words.js";

const SIDES = [["below", "first", -0.12], ["above", "second", 0.12], ["unknown", "third", 0]];
/** Interval between two requests for a changed model (ms). */
const LOOKED_EVERY_MS = 2000;
/** One standard deviation as a part of half a 95 % interval. */
const SIGMA = 1 / 1.959964;

/** The current experiment, in the reader's language. */
export function aboutCalibration({ trial, phase }) {
  if (!trial) return say(`phase-${phase || "finding"}`);
  const { what, step, side, run_s: run } = trial;
  return say(`trial-${what}`, step, side && say(`trial-from-${side}`), run && shown(run, 1));
}

export function calibrationPage(root, live, number) {
  const $ = (selector) => root.querySelector(selector);
  const select = $("#train");
  const charts = [];
  let train = number && Number(number);
  let model, report, timer;

  const add = (name, options, data) => {
    const chart = new LiveChart($(`figure[data-chart="${name}"]`), options, data());
    charts.push({ chart, data });
  };
  const draw = () => charts.forEach(({ chart, data }) => chart.set(data()));

  /** Points of all steps, one series for each approach. */
  function sides(points, bars) {
    return () => {
      const all = points();
      const parts = SIDES.map(([side, , shift], place) => {
        const own = all.filter((point) => point.side === side).sort((one, other) => one.step - other.step);
        bars[place].splice(0, bars[place].length, ...own.map(({ step, value, half }) => ({ x: step + shift, y: value, dy: half })));
        return [own.map(({ step }) => step + shift), own.map(({ value }) => value)];
      });
      return uPlot.join(parts);
    };
  }
  const bySide = (unit) => SIDES.map(([side, name]) => dots(say(`from-${side}`), name, unit, 0));
  /** From zero to the end of the highest bar. */
  const upright = (bars) => ({
    y: { range: () => [0, 1.06 * Math.max(100, ...bars.flat().map(({ y, dy }) => y + dy))] }, x: { range: () => [0, (model?.highest ?? 14) + 0.6] },
  });

  const speedBars = [[], [], []];
  add("speeds", () => ({
    name: say("chart-speeds"), x: { label: say("axis-step"), unit: "", digits: 0 }, y: say("axis-speed"), ticks: [1, 2, 5], range: upright(speedBars),
    zooms: false, series: bySide("mm/s"), bars: barsOf(speedBars, SIDES),
  }), sides(() => (model?.steps ?? []).filter(({ uses, contacts }) => uses !== "unreliable" && (uses === "moves" || contacts > 0))
    .map((step) => ({ step: step.step, side: step.approach, value: step.speed_mm_per_s, half: step.speed_half_mm_per_s })), speedBars));
  const stopBars = [[], [], []];
  add("stops-by-step", () => ({
    name: say("chart-stops-by-step"), x: { label: say("axis-step"), unit: "", digits: 0 }, y: say("axis-stop"), ticks: [1, 2, 5], range: upright(stopBars),
    zooms: false, series: bySide("mm"), bars: barsOf(stopBars, SIDES),
  }), sides(() => (model?.steps ?? []).filter(({ uses }) => uses === "moves")
    .map((step) => ({ step: step.step, side: step.approach, value: step.stop_mm, half: step.stop_half_mm })), stopBars));
  const storedBars = [[], [], []];
  add("stored", () => ({
    name: say("chart-stored"), x: { label: say("axis-step"), unit: "", digits: 0 }, y: say("axis-speed"), ticks: [1, 2, 5], range: upright(storedBars),
    zooms: false, series: bySide("mm/s"), bars: barsOf(storedBars, SIDES),
  }), sides(() => (report?.calibration.steps ?? []).filter(({ speed }) => speed.measurements > 1)
    .map(({ step, approach, speed }) => ({ step, side: approach.toLowerCase(), value: speed.value, half: speed.uncertainty / SIGMA })), storedBars));

  const change = () => report?.changes[Number($("#change").value)];
  const contactBars = [];
  add("law", () => ({
    name: say("chart-law"), x: { label: say("axis-since"), unit: "s", digits: 2 }, y: say("axis-speed"), zooms: false,
    series: [line(say("law"), "first", "mm/s", 0), dots(say("mean-between"), "second", "mm/s", 0)],
  }), () => {
    const { time_s = [], speed_mm_s = [], contacts = [] } = change() ?? {};
    const means = contacts.filter(({ mean_speed: mean }) => mean).map(({ mean_speed: mean }) => mean);
    return uPlot.join([[time_s, speed_mm_s], [means.map(([at]) => at), means.map(([, speed]) => speed)]]);
  });
  add("beyond", () => ({
    name: say("chart-beyond"), x: { label: say("axis-since"), unit: "s", digits: 2 }, y: say("axis-beyond"), height: 180, zero: true, zooms: false,
    range: { y: { range: () => { const most = 1.15 * Math.max(10, ...contactBars.map(({ y, dy }) => Math.abs(y) + dy)); return [-most, most]; } } },
    series: [dots(say("beyond-law"), "second", "mm", 1)], bars: [[contactBars, "second"]],
  }), () => {
    const contacts = change()?.contacts ?? [];
    contactBars.splice(0, contactBars.length, ...contacts.map(({ time_s, residual_mm, doubt_mm }) => ({ x: time_s, y: residual_mm, dy: doubt_mm / SIGMA })));
    return [contacts.map(({ time_s }) => time_s), contacts.map(({ residual_mm }) => residual_mm)];
  });

  function table() {
    const rows = (model?.steps ?? []).filter(({ uses, contacts }) => uses === "moves" || contacts > 0).map((step) => make("tr", {},
      make("th", { scope: "row", class: "number" }, String(step.step)),
      make("td", {}, say(`side-${step.approach}`)),
      make("td", { class: "number" }, `${shown(step.speed_mm_per_s, 1)} ± ${shown(step.speed_half_mm_per_s, 1)}`),
      make("td", { class: "number" }, String(step.contacts)),
      make("td", { class: "number" }, `${shown(step.stop_mm)} ± ${shown(step.stop_half_mm)}`),
      make("td", { class: "number" }, shown(step.stop_doubt_half_mm)),
      make("td", { class: "number" }, shown(step.stop_s, 1)),
      make("td", { class: "number" }, String(step.stops)),
      make("td", {}, whyButton(`SPEED:${step.step}`))));
    $("#steps").replaceChildren(...rows);
  }

  function whyButton(of) {
    const button = make("button", { type: "button", "aria-label": say("why-of", of) }, say("why"));
    button.addEventListener("click", () => why(of));
    return button;
  }

  function laws() {
    const found = report?.calibration.laws ?? [];
    $("#laws").replaceChildren(...found.map((law) => make("li", {},
      `${say(`law-${law.direction.toLowerCase()}`)}: ${law.best.name}, ${shown(law.best.pace.value, 2)} ± ${shown(law.best.pace.uncertainty, 2)} ${law.best.pace.unit}, `
      + say("law-from", law.changes, shown(law.best.held_out_mm)), " ", whyButton(law.direction.toLowerCase() === "up" ? "LAW:up" : "LAW:down"))));
    const before = $("#change").value;
    $("#change").replaceChildren(...(report?.changes ?? []).map(({ steps: [from, to], recording, run }, place) =>
      new Option(say("change-of", from, to, logged(recording), run), place)));
    if (before) $("#change").value = before;
    $("#changes").hidden = !report?.changes.length;
  }

  /** The measurements behind a value, each with its mark. */
  async function why(of) {
    const place = $("#why");
    place.hidden = false;
    $("#why-of").value = of;
    put($("#why-answer"), "");
    let listings;
    try {
      listings = await get(`/api/trains/${train}/why/${encodeURIComponent(of)}`);
    } catch (error) {
      $("#listings").replaceChildren();
      put($("#why-answer"), error.message);
      return;
    }
    $("#listings").replaceChildren(...listings.map(({ number: named, columns, measurements }) => {
      const title = logged(named);
      const rows = measurements.map((measurement) => {
        const event = /^event (\d+)/.exec(measurement.told_by ?? "")?.[1];
        const button = event && make("button", { type: "button", "aria-label": say("exclude-event", event) }, say("exclude"));
        button?.addEventListener("click", () => mark([Number(event)], "excluded", () => why(of)));
        return make("tr", {}, ...columns.map((column) => make("td", { class: typeof measurement[column] === "number" ? "number" : "" },
          measurement[column] == null ? "–" : typeof measurement[column] === "number" ? rounded(measurement[column], 4).replace(/[.,]?0+$/, "") : column === "use" ? say(`use-${measurement[column]}`) : measurement[column])), make("td", {}, button ?? ""));
      });
      const head = make("tr", {}, ...columns.map((column) => make("th", { scope: "col" }, say(`column-${column}`))), make("th", { scope: "col" }, say("thinks")));
      return make("div", { class: "wide", tabIndex: 0, role: "region", "aria-label": title }, make("table", {}, make("caption", {}, title), make("thead", {}, head), make("tbody", {}, ...rows)));
    }));
    place.scrollIntoView({ block: "nearest" });
  }

  async function mark(events, as, then) {
    const reason = $("#reason").value.trim();
    if (!reason) {
      put($("#why-answer"), say("reason-first"));
      $("#reason").focus();
      return;
    }
    try {
      await ask("/api/marks", { events, mark: as, reason });
      put($("#why-answer"), say(as, events.join(", ")));
      await Promise.all([then(), marks(), stored()]);
    } catch (error) {
      put($("#why-answer"), error.message);
    }
  }

  async function marks() {
    const list = await get("/api/marks");
    $("#marks").replaceChildren(...list.map(({ event, what, recording, reason }) => {
      const button = make("button", { type: "button", "aria-label": say("restore-event", event) }, say("restore"));
      button.addEventListener("click", () => mark([event], "restored", () => why($("#why-of").value)));
      return make("li", {}, `${event}: ${what} (${recording}), ${reason} `, button);
    }));
    $("#marked").hidden = list.length === 0;
  }

  async function look() {
    if (!train) return;
    try {
      model = await get(`/api/trains/${train}/model`);
      put($("#answer"), "");
    } catch (error) {
      model = undefined;
      put($("#answer"), error.message);
    }
    table();
    draw();
  }

  async function stored() {
    if (!train) return;
    try {
      report = await get(`/api/trains/${train}/calibration?language=${LANGUAGE}`);
      put($("#stored-answer"), "");
    } catch (error) {
      report = undefined;
      put($("#stored-answer"), error.message);
    }
    $("#of-store").hidden = !report;
    laws();
    draw();
  }

  function turnTo(next) {
    train = next;
    look();
    stored();
    marks().catch(() => {
      // The answer may come after the page was left.
      const list = $("#marked");
      if (list) list.hidden = true;
    });
  }

  select.addEventListener("change", () => { location.hash = `#/calibration/${select.value}`; });
  $("#change").addEventListener("change", draw);
  $("#ask").addEventListener("submit", (event) => {
    event.preventDefault();
    why($("#why-of").value.trim());
  });
  timer = setInterval(look, LOOKED_EVERY_MS);
  if (train) turnTo(train);

  return {
    picture(picture) {
      const there = picture.trains.map((one) => String(one.train));
      if ([...select.options].map((option) => option.value).join() !== there.join()) {
        select.replaceChildren(...there.map((one) => new Option(say("train", one), one)));
        if (train) select.value = String(train);
      }
      if (!train && there.length > 0) turnTo(Number(there[0]));
      progress(picture.calibration);
    },
    close() {
      clearInterval(timer);
      charts.forEach(({ chart }) => chart.close());
    },
  };

  /** The calibration in progress. */
  function progress(now) {
    $("#progress").hidden = !now;
    if (!now) return;
    put($("#about"), aboutCalibration(now));
    put($("#because"), !now.experiment ? "–" : now.gain == null ? say("because-untried") : say("because-most", shown(now.takes_s), shown(now.gain, 1)));
    put($("#left"), say("left-of", shown(now.left_s), shown(now.elapsed_s + now.left_s)));
    $("#elapsed").max = now.elapsed_s + now.left_s;
    $("#elapsed").value = now.elapsed_s;
    put($("#expected"), now.expected ? say("expected-at", now.expected.step, shown(now.expected.stop_within_mm), signed(now.expected.speed_within_percent, 1).replace("+", "")) : "–");
  }
}
