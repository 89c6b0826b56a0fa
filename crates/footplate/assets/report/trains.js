// Draws the charts of a train report from the data in the page, with the functions of chart.js.

const report = JSON.parse(document.getElementById("report").textContent);
const trains = new Map(report.trains.map((train) => [String(train.calibration.train), train]));

const APPROACHES = [
  ["below", pick("reached from below", "von unten erreicht"), "first", -0.12],
  ["above", pick("reached from above", "von oben erreicht"), "second", 0.12],
  ["unknown", pick("side not recorded", "Seite nicht aufgezeichnet"), "third", 0],
];
/** What the train was doing when the forecast was made. */
const PHASES = pick({
  steady: "steady running", first_lap: "first run over this hop or at this step", change: "changing speed",
}, {
  steady: "gleichmäßige Fahrt", first_lap: "erste Fahrt über diesen Abschnitt oder bei dieser Stufe", change: "Tempowechsel",
});
/** Labels of axes and lines. */
const [LAW, SENSOR, SPEED] = pick(["law", "sensor", "speed (mm/s)"], ["Gesetz", "Rückmelder", "Tempo (mm/s)"]);

function speeds(figure, train) {
  const all = train.calibration.steps.filter(({ speed }) => speed.measurements > 1);
  const parts = APPROACHES.map(([approach, label, name, shift]) => {
    const own = all.filter((speed) => speed.approach.toLowerCase() === approach);
    const points = own.map(({ step, speed }) => ({ x: step + shift, y: speed.value, dy: speed.uncertainty }));
    const told = new Map(points.map(({ x, dy }, place) =>
      [x, `± ${rounded(dy, 1)}, ${own[place].speed.measurements} ${pick("detections", "Meldungen")}`]));
    return { label, name, points, told };
  }).filter(({ points }) => points.length > 0);
  const data = uPlot.join(parts.map(({ points }) => [points.map(({ x }) => x), points.map(({ y }) => y)]));
  const steps = all.map(({ step }) => step);
  chart(figure, {
    name: pick("Speed by throttle step", "Tempo je Fahrstufe"),
    x: { label: pick("throttle step", "Fahrstufe"), unit: "", digits: 0 }, y: SPEED, data, ticks: [1, 2, 5],
    range: { x: { range: [Math.min(...steps) - 0.6, Math.max(...steps) + 0.6] }, y: { range: (_, __, high) => [0, high * 1.08] } },
    series: parts.map(({ label, name, told }) => dots(label, name, "mm/s", 1, told)),
    bars: parts.map(({ points, name }) => [points, name]),
  });
}

function change(figure, train) {
  const key = `change-${train.calibration.train}`;
  const choice = document.createElement("p");
  choice.className = "pick";
  const label = document.createElement("label");
  label.textContent = pick("Change shown ", "Gezeigter Wechsel ");
  const select = document.createElement("select");
  train.changes.forEach(({ steps: [from, to], recording, run }, place) => select.add(new Option(
    pick(`step ${from} to ${to}, ${recording} run ${run}`, `Stufe ${from} auf ${to}, ${recording} Fahrt ${run}`), place,
  )));
  select.value = figure.dataset.shown ?? train.changes.length - 1;
  label.append(select);
  choice.append(label);
  figure.append(choice);
  select.addEventListener("change", () => {
    figure.dataset.shown = select.value;
    redraw(figure);
    figure.querySelector("select").focus();
  });

  const shown = train.changes[select.value];
  const { contacts } = shown;
  const times = contacts.map(({ time_s }) => time_s);
  const told = new Map(contacts.map(({ time_s, told_by }) => [time_s, told_by]));
  const x = { label: pick("since the command (s)", "seit dem Befehl (s)"), unit: "s", digits: 2 };
  // All four charts share one x range; a zoomed range is taken as it is.
  const [begins, ends] = [shown.time_s[0], shown.time_s.at(-1)];
  const whole = [begins - 0.02 * (ends - begins), ends + 0.02 * (ends - begins)];
  const range = { x: { range: (u, low, high) => (low <= u.data[0][0] && high >= u.data[0].at(-1) ? whole : [low, high]) } };
  const curve = (values) => [shown.time_s, values];
  chart(figure, {
    name: pick("Distance since the command", "Weg seit dem Befehl"), x, y: pick("distance (mm)", "Weg (mm)"), sync: key, range,
    data: uPlot.join([curve(shown.way_mm), [times, contacts.map(({ way_mm }) => way_mm)]]),
    series: [line(LAW, "first", "mm", 0), dots(SENSOR, "second", "mm", 0, told)],
    bars: [[contacts.map(({ time_s, way_mm, doubt_s }) => ({ x: time_s, y: way_mm, dx: doubt_s })), "second"]],
  });
  const beyond = pick("beyond the law", "jenseits des Gesetzes");
  const reach = 1.15 * Math.max(5, ...contacts.map(({ residual_mm, doubt_mm }) => Math.abs(residual_mm) + doubt_mm));
  chart(figure, {
    name: pick("Residuals of the sensors", "Restabweichungen der Rückmelder"), x, y: pick("residual (mm)", "Restabweichung (mm)"), sync: key, height: STRIP, zero: true,
    range: { ...range, y: { range: [-reach, reach] } },
    data: [times, contacts.map(({ residual_mm }) => residual_mm)],
    series: [dots(beyond, "second", "mm", 1, told)],
    bars: [[contacts.map(({ time_s, residual_mm, doubt_mm }) => ({ x: time_s, y: residual_mm, dy: doubt_mm })), "second"]],
  });
  const means = contacts.filter(({ mean_speed }) => mean_speed);
  chart(figure, {
    name: pick("Speed since the command", "Tempo seit dem Befehl"), x, y: SPEED, sync: key, height: STRIP, range,
    data: uPlot.join([curve(shown.speed_mm_s), [means.map(({ mean_speed }) => mean_speed[0]), means.map(({ mean_speed }) => mean_speed[1])]]),
    series: [line(LAW, "first", "mm/s", 0), dots(pick("mean between two sensors", "Mittel zwischen zwei Rückmeldern"), "second", "mm/s", 0)],
  });
  chart(figure, {
    name: pick("Acceleration since the command", "Beschleunigung seit dem Befehl"), x, y: pick("acceleration (mm/s²)", "Beschleunigung (mm/s²)"), sync: key, height: STRIP, range, zero: true,
    data: curve(shown.acceleration_mm_s2), series: [line(LAW, "first", "mm/s²", 0)],
  });
}

function forecasts(figure, train) {
  const points = train.forecasts.filter(({ late_ms }) => late_ms != null);
  if (points.length === 0) {
    figure.append(pick("There are no forecasts yet.", "Es gibt noch keine Vorhersagen."));
    return;
  }
  const numbers = points.map((_, place) => place + 1);
  const told = new Map(points.map(({ sensor, step, phase, recording, line: row }, place) =>
    [place + 1, `${sensor} ${pick("at step", "bei Stufe")} ${step}, ${PHASES[phase]}, ${recording}:${row}`]));
  for (const [late, half, unit] of [["late_mm", "half_90_mm", "mm"], ["late_ms", "half_90_ms", "ms"]]) {
    const values = points.map((point) => point[late]);
    const widths = points.map((point) => point[half]);
    // An outlier must not flatten the rest: the axis contains 98 of 100.
    const sizes = points.map((point) => Math.max(Math.abs(point[late]), point[half])).sort((a, b) => a - b);
    const reach = 1.2 * sizes[Math.floor(0.98 * (sizes.length - 1))];
    const digits = unit === "mm" ? 1 : 0;
    const upper = { ...line(pick("90 % interval", "90-%-Intervall"), "band", unit, digits), width: 1, value: (_, value) => (value == null ? "–" : `± ${rounded(value, digits)} ${unit}`) };
    const lower = { ...upper, class: "unlisted" };
    const later = dots(pick("later", "später"), "first", unit, digits, unit === "mm" ? told : undefined);
    chart(figure, {
      name: pick(`Forecast error in ${unit}`, `Vorhersagefehler in ${unit}`), zero: true, sync: `forecasts-${train.calibration.train}`, height: unit === "mm" ? HEIGHT : STRIP + 30,
      x: { label: pick("forecast number", "Nummer der Vorhersage"), unit: "", digits: 0 }, y: `${pick("later than forecast", "später")} (${unit})`, ticks: [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000],
      range: { y: { range: [-reach, reach] } }, data: [numbers, widths, widths.map((width) => -width), values],
      series: [upper, lower, { ...later, points: { ...later.points, size: 6 } }],
      bands: [{ series: [1, 2], fill: colour("band") }],
    });
  }
}

function stops(figure, train) {
  const taped = train.calibration.stops;
  const points = taped.map((stop) => ({ x: stop.speed_mm_per_s, y: stop.distance_mm, dy: stop.uncertainty_mm }));
  const told = new Map(taped.map(({ step, speed_mm_per_s, uncertainty_mm }) =>
    [speed_mm_per_s, `± ${rounded(uncertainty_mm, 0)}, ${pick("step", "Stufe")} ${step}`]));
  points.sort((one, other) => one.x - other.x);
  const model = train.stop_curve;
  const fastest = Math.max(...points.map(({ x }) => x), ...model.map(([speed]) => speed));
  const furthest = Math.max(...points.map(({ y, dy }) => y + dy), ...model.map(([, way]) => way));
  chart(figure, {
    name: pick("Stopping distance by speed", "Anhalteweg nach Tempo"),
    x: { label: pick("speed before the stop (mm/s)", "Tempo vor dem Halt (mm/s)"), unit: "mm/s", digits: 0 }, y: pick("distance (mm)", "Weg (mm)"),
    range: { x: { range: [0, fastest] }, y: { range: [0, 1.05 * furthest] } },
    data: uPlot.join([[model.map(([speed]) => speed), model.map(([, way]) => way)], [points.map(({ x }) => x), points.map(({ y }) => y)]]),
    series: [line(pick("motion model", "Fahrmodell"), "first", "mm", 0), dots(pick("tape", "Maßband"), "second", "mm", 0, told)],
    bars: [[points, "second"]],
  });
}

const KINDS = { speeds, change, forecasts, stops };

drawFigures((figure) => KINDS[figure.dataset.chart](figure, trains.get(figure.dataset.train)));
