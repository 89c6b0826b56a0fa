// Draws the charts of an odometry run from the data in the page, with the functions of chart.js.

const report = JSON.parse(document.getElementById("report").textContent);
/** The run shown. */
let run = report.runs[0];
const SYNC = "odometry";
/** The most rows of the table of intervals: it is meant to be read. */
const LISTED = 200;
/** Height of the strip of states, as a part of the axis that shows 100 %. */
const STRIP_OF = 0.09;

const WORDS = pick({
  spin: "slips", slide: "slides", excluded: "not believed",
  one_slip: "one slips or slides", degraded: "degraded", correction: "correction", ambiguous: "ambiguous",
}, {
  spin: "schleudert", slide: "gleitet", excluded: "nicht geglaubt",
  one_slip: "einer gleitet oder schleudert", degraded: "beeinträchtigt", correction: "Korrektur", ambiguous: "mehrdeutig",
});
const PLACES = pick(
  { wheel_1: "wheelset 1", wheel_2: "wheelset 2", mode: "mode" },
  { wheel_1: "Radsatz 1", wheel_2: "Radsatz 2", mode: "Betriebsart" },
);
/** Labels of axes and lines. */
const [TIME, SPEED, ESTIMATE, AT_MOST, AT_LEAST, GUARANTEED] = pick(
  ["time since the first period (s)", "speed (m/s)", "estimate", "at most", "at least", "guaranteed"],
  ["Zeit seit der ersten Periode (s)", "Tempo (m/s)", "Schätzung", "höchstens", "mindestens", "garantiert"],
);

const time = () => ({
  label: TIME,
  value: (_, value) => {
    if (value == null) return "–";
    return `${rounded(value, 2)} s${run.begin_s === 0 ? "" : ` (t_s ${rounded(run.begin_s + value, 2)})`}`;
  },
});

/** The intervals marked at a time. */
const markedAt = (place, at) => run.marks[place].find(([from, to]) => from < at && at <= to)?.[2];

/** Shades intervals between two heights of a chart, 0 at its top and 1 at its bottom, with a solid bar at their upper edge. */
function shade(stretches, top, foot, alpha = 0.2) {
  return (u) => {
    const { ctx, bbox } = u;
    const bar = 5 * devicePixelRatio;
    const [y, height] = [bbox.top + top * bbox.height, (foot - top) * bbox.height];
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const [from, to, what] of stretches) {
      const left = u.valToPos(from, "x", true);
      // Even the shortest interval is visible.
      const width = Math.max(u.valToPos(to, "x", true) - left, 2 * devicePixelRatio);
      ctx.fillStyle = colour(what);
      ctx.globalAlpha = alpha;
      ctx.fillRect(left, y, width, height);
      ctx.globalAlpha = 1;
      ctx.fillRect(left, y, width, Math.min(bar, height));
    }
    ctx.restore();
  };
}

/** The legend of the marks that occur. */
function key(figure, places) {
  const there = new Set(places.flatMap((place) => run.marks[place].map(([, , what]) => what)));
  if (there.size === 0) return;
  const list = document.createElement("ul");
  list.className = "key";
  list.setAttribute("aria-label", pick("Legend of the marks", "Legende der Marken"));
  for (const what of Object.keys(WORDS).filter((word) => there.has(word))) {
    const swatch = document.createElement("span");
    swatch.className = "swatch";
    swatch.style.background = `var(--${what})`;
    const item = document.createElement("li");
    item.append(swatch, WORDS[what]);
    list.append(item);
  }
  figure.append(list);
}

/** Describes a chart in words below it, for screen readers. */
function say(figure, text) {
  const said = document.createElement("p");
  said.className = "said";
  said.textContent = text;
  figure.append(said);
  for (const u of drawn.get(figure)) u.over.setAttribute("aria-description", text);
}

const known = (values) => (values ?? []).filter((value) => value != null);
const least = (values) => known(values).reduce((one, other) => Math.min(one, other), Infinity);
const greatest = (values) => known(values).reduce((one, other) => Math.max(one, other), -Infinity);
const span = (values, unit, digits) => `${rounded(least(values), digits)} ${pick("to", "bis")} ${rounded(greatest(values), digits)} ${unit}`;
/** The probability of the intervals, as `--confidence` said, as it stands before "interval". */
const percent = () => pick(`${run.confidence_pct} %`, `${run.confidence_pct.replace(".", ",")}-%`);
const bound = (label, unit, digits) => ({ ...line(label, "quiet", unit, digits), width: 1 });
const dashed = (series) => ({ ...series, dash: [6, 4] });

function speed(figure, lines) {
  const { speed_m_s, confidence_speed_low_m_s, confidence_speed_high_m_s, true_speed_m_s } = lines;
  chart(figure, {
    name: pick(`Speed with its ${percent()} interval (shaded) and its guaranteed bounds (dashed)`, `Tempo mit seinem ${percent()}-Intervall (getönt) und seinen garantierten Grenzen (gestrichelt)`), x: time(), y: SPEED, sync: SYNC,
    data: [run.time_s, confidence_speed_high_m_s, confidence_speed_low_m_s, speed_m_s, lines.guaranteed_speed_high_m_s, lines.guaranteed_speed_low_m_s, ...(true_speed_m_s ? [true_speed_m_s] : [])],
    series: [
      bound(AT_MOST, "m/s", 2), bound(AT_LEAST, "m/s", 2), line(ESTIMATE, "first", "m/s", 2),
      dashed(bound(`${AT_MOST} (${GUARANTEED})`, "m/s", 2)), dashed(bound(`${AT_LEAST} (${GUARANTEED})`, "m/s", 2)),
      ...(true_speed_m_s ? [dashed(line(pick("true", "wahr"), "truth", "m/s", 2))] : []),
    ],
    bands: [{ series: [1, 2], fill: colour("band") }],
    // Scaled to the speeds: bounds that are wide for a moment, as in the first period, would flatten all else.
    range: { y: { range: [Math.min(0, 1.3 * least(speed_m_s)), 1.3 * Math.max(1, greatest(speed_m_s), greatest(true_speed_m_s))] } },
  });
  const widths = known(confidence_speed_high_m_s.map((high, place) => (high == null ? null : high - confidence_speed_low_m_s[place]))).sort((one, other) => one - other);
  const [goes, apart] = [span(speed_m_s, "m/s", 2), rounded(widths[Math.floor(widths.length / 2)] ?? 0, 2)];
  say(figure, pick(`The estimate ranges from ${goes}; its ${percent()} interval is ${apart} m/s wide in the median.`, `Die Schätzung reicht von ${goes}; ihr ${percent()}-Intervall ist im Median ${apart} m/s breit.`));
}

function wheels(figure, { speed_m_s, wheel_1_m_s, wheel_2_m_s }) {
  const wheel = (place, name) => ({
    ...line(PLACES[place], name, "m/s", 2), spanGaps: false,
    value: (u, value, _, index) => {
      if (value == null) return "–";
      const mark = markedAt(place, u.data[0][index]);
      return `${rounded(value, 2)} m/s${mark ? ` (${WORDS[mark]})` : ""}`;
    },
  });
  const none = run.time_s.map(() => null);
  chart(figure, {
    name: pick("Speed of each wheel", "Tempo jedes Rades"), x: time(), y: SPEED, sync: SYNC,
    below: [shade(run.marks.wheel_1, 0, 0.5), shade(run.marks.wheel_2, 0.5, 1)],
    data: [run.time_s, wheel_1_m_s ?? none, wheel_2_m_s ?? none, speed_m_s],
    series: [wheel("wheel_1", "second"), wheel("wheel_2", "third"), { ...line(ESTIMATE, "first", "m/s", 2), width: 1.5 }],
  });
  key(figure, ["wheel_1", "wheel_2"]);
  const told = ["wheel_1", "wheel_2"].map((place) => `${PLACES[place]} ${stretchesOf(place)}`);
  say(figure, `${pick("Marks", "Marken")}: ${told.join("; ")}.`);
}

/** How often and how long a state is marked, in words. */
function stretchesOf(place) {
  const marks = run.marks[place];
  if (marks.length === 0) return place === "mode" ? pick("always normal", "immer normal") : pick("always rolls", "rollt immer");
  const kinds = [...new Set(marks.map(([, , what]) => what))];
  return kinds.map((kind) => {
    const own = marks.filter(([, , what]) => what === kind);
    const lasts = own.reduce((sum, [from, to]) => sum + to - from, 0);
    const often = own.length === 1 ? pick("once", "einmal") : `${own.length} ${pick("times", "Mal")}`;
    return pick(`${WORDS[kind]} ${often}, for ${rounded(lasts, 1)} s`, `${WORDS[kind]} ${often}, ${rounded(lasts, 1)} s lang`);
  }).join(", ");
}

function shares(figure, { share_1, share_1_and_2 }) {
  const per_cent = (values) => values.map((value) => (value == null ? null : 100 * value));
  const [first, both] = [per_cent(share_1), per_cent(share_1_and_2)];
  const part = (label, name, value) => ({
    ...line(label, name, "%", 0), width: 1.5,
    value: (_, __, ___, index) => {
      const found = index == null ? null : value(index);
      return found == null || Number.isNaN(found) ? "–" : `${rounded(found, 0)} %`;
    },
  });
  const mode = (u, _, __, index) => WORDS[markedAt("mode", u.data[0][index ?? 0])] ?? "normal";
  chart(figure, {
    name: pick("Shares of the wheels and of the virtual sensor, and the mode", "Anteile der Räder und des virtuellen Sensors, und die Betriebsart"), x: time(), y: pick("share (%)", "Anteil (%)"), sync: SYNC, height: STRIP + 30,
    range: { y: { range: [0, 100 / (1 - STRIP_OF)] } },
    below: [shade(run.marks.mode, 0, STRIP_OF - 0.02, 1)],
    data: [run.time_s, run.time_s.map(() => 100), both, first, run.time_s.map(() => null)],
    series: [
      part(pick("virtual sensor", "virtueller Sensor"), "first", (index) => 100 - both[index]),
      part(PLACES.wheel_2, "third", (index) => both[index] - first[index]),
      { ...part(PLACES.wheel_1, "second", (index) => first[index]), fill: `color-mix(in srgb, ${colour("second")} 25%, transparent)` },
      { ...line(PLACES.mode, "quiet", "", 0), value: mode },
    ],
    bands: [["first", [1, 2]], ["third", [2, 3]]].map(([name, pair]) => (
      { series: pair, fill: `color-mix(in srgb, ${colour(name)} 25%, transparent)` }
    )),
  });
  key(figure, ["mode"]);
  say(figure, `${PLACES.mode}: ${stretchesOf("mode")}.`);
}

function distance(figure, lines) {
  const { error_m, confidence_error_low_m, confidence_error_high_m, width_m, over_m, under_m } = lines;
  if (error_m) {
    chart(figure, {
      name: pick(`Distance error, with its ${percent()} interval (shaded) and its guaranteed bounds (dashed)`, `Fehler des Weges, mit seinem ${percent()}-Intervall (getönt) und seinen garantierten Grenzen (gestrichelt)`), x: time(), y: pick("distance error (m)", "Fehler des Weges (m)"), sync: SYNC, zero: true,
      data: [run.time_s, confidence_error_high_m, confidence_error_low_m, error_m, lines.guaranteed_error_high_m, lines.guaranteed_error_low_m],
      series: [
        bound(AT_MOST, "m", 2), bound(AT_LEAST, "m", 2), line(ESTIMATE, "first", "m", 2),
        dashed(bound(`${AT_MOST} (${GUARANTEED})`, "m", 2)), dashed(bound(`${AT_LEAST} (${GUARANTEED})`, "m", 2)),
      ],
      bands: [{ series: [1, 2], fill: colour("band") }],
    });
    const [goes, bounds] = [span(error_m, "m", 2), `${rounded(least(confidence_error_low_m), 2)} ${pick("to", "bis")} ${rounded(greatest(confidence_error_high_m), 2)} m`];
    say(figure, pick(`The error ranges from ${goes}; its ${percent()} interval from ${bounds}.`, `Der Fehler reicht von ${goes}; sein ${percent()}-Intervall von ${bounds}.`));
    return;
  }
  chart(figure, {
    name: pick(`Width of the ${percent()} interval of the distance, and guaranteed amounts of over- and under-reading`, `Breite des ${percent()}-Intervalls des Weges, und garantierte Beträge von Über- und Unterlesen`), x: time(), y: pick("distance (m)", "Weg (m)"), sync: SYNC,
    data: [run.time_s, width_m, over_m, under_m],
    series: [line(pick("width of the interval", "Breite des Intervalls"), "first", "m", 2), line(pick("over-read by at most", "zu lang um höchstens"), "second", "m", 2), line(pick("under-read by at most", "zu kurz um höchstens"), "third", "m", 2)],
  });
  const last = (values) => rounded(known(values).at(-1) ?? 0, 2);
  const [wide, over, under] = [width_m, over_m, under_m].map(last);
  say(figure, pick(
    `At the end the interval is ${wide} m wide; the distance is over-read by at most ${over} m and under-read by at most ${under} m.`,
    `Am Ende ist das Intervall ${wide} m breit; der Weg ist höchstens um ${over} m zu lang und um ${under} m zu kurz gelesen.`,
  ));
}

function acceleration(figure, { accel_m_s2, measured_accel_m_s2, effort }) {
  const measured = measured_accel_m_s2 && { ...line(pick("accelerometer", "Beschleunigungsmesser"), "third", "m/s²", 2), width: 1, spanGaps: false };
  chart(figure, {
    name: pick("Acceleration", "Beschleunigung"), x: time(), y: pick("acceleration (m/s²)", "Beschleunigung (m/s²)"), sync: SYNC, height: STRIP + 30, zero: true,
    data: [run.time_s, ...(measured ? [measured_accel_m_s2] : []), accel_m_s2],
    series: [...(measured ? [measured] : []), line(ESTIMATE, "first", "m/s²", 2)],
  });
  if (effort) {
    chart(figure, {
      name: pick("Effort", "Befehl"), x: time(), y: pick("effort (%)", "Befehl (%)"), sync: SYNC, height: STRIP - 30, zero: true,
      range: { y: { range: [-105, 105] } },
      data: [run.time_s, effort.map((part) => (part == null ? null : 100 * part))],
      series: [line(pick("effort", "Befehl"), "second", "%", 0)],
    });
  }
  const recorded = [measured && pick("an accelerometer", "ein Beschleunigungsmesser"), effort && pick("the command", "der Befehl")].filter(Boolean).join(pick(" and ", " und "));
  const goes = span(accel_m_s2, "m/s²", 2);
  say(figure, pick(
    `The estimate ranges from ${goes}. ${recorded ? `Recorded beside it: ${recorded}.` : "Neither an accelerometer nor the command was recorded."}`,
    `Die Schätzung reicht von ${goes}. ${recorded ? `Daneben aufgezeichnet: ${recorded}.` : "Weder ein Beschleunigungsmesser noch der Befehl ist aufgezeichnet."}`,
  ));
}

/** The table of all marked intervals. */
function listMarks() {
  const marks = Object.keys(PLACES).flatMap((place) => run.marks[place].map((mark) => [place, ...mark]));
  marks.sort(([, one], [, other]) => one - other);
  const holder = document.getElementById("marks");
  holder.replaceChildren();
  if (marks.length === 0) return;
  const details = document.createElement("details");
  const summary = document.createElement("summary");
  const shown = marks.length > LISTED ? pick(`, the first ${LISTED}`, `, die ersten ${LISTED}`) : "";
  summary.textContent = pick(`Marks of ${run.name} as a table (${marks.length}${shown})`, `Marken von ${run.name} als Tabelle (${marks.length}${shown})`);
  const wide = document.createElement("div");
  wide.className = "wide";
  const table = document.createElement("table");
  const row = (tag, cells) => {
    const tr = document.createElement("tr");
    cells.forEach((text, place) => {
      const cell = document.createElement(tag);
      cell.textContent = text;
      if (tag === "th") cell.scope = "col";
      if (place > 1) cell.className = "number";
      tr.append(cell);
    });
    return tr;
  };
  table.createTHead().append(row("th", pick(["of", "what", "from s", "to s"], ["von", "was", "von s", "bis s"])));
  const body = table.createTBody();
  for (const [place, from, to, what] of marks.slice(0, LISTED)) {
    body.append(row("td", [PLACES[place], WORDS[what], rounded(from, 2), rounded(to, 2)]));
  }
  wide.append(table);
  details.append(summary, wide);
  holder.append(details);
}

function offerRuns() {
  const pick = document.getElementById("pick");
  const select = pick.querySelector("select");
  report.runs.forEach(({ name }, place) => select.add(new Option(name, place)));
  pick.hidden = report.runs.length < 2;
  select.addEventListener("change", () => {
    run = report.runs[select.value];
    figures.forEach(redraw);
    listMarks();
  });
}

const KINDS = { speed, wheels, shares, distance, acceleration };

offerRuns();
listMarks();
drawFigures((figure) => {
  if (run.time_s.length > 0) KINDS[figure.dataset.chart](figure, run.lines);
  else figure.append(pick("The run has no period.", "Die Fahrt hat keine Periode."));
});
