// Common code of all charts: colours, axes, legends, and redrawing when the page changes. uPlot draws
// lines; error bars are drawn here.

/** Height of a chart in pixels; strips below a chart are lower. */
const HEIGHT = 280;
const STRIP = 190;
/** Pixels between two ticks of a vertical axis, in a strip and in a chart. */
const [TIGHT, ROOMY] = [18, 30];
/** The charts drawn so far, by figure, to be removed when colours change. Figures of closed pages are not kept. */
const drawn = new WeakMap();

/** The text in the page's language. */
const pick = (english, german) => (document.documentElement.lang === "de" ? german : english);
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
/** The decimal sign of the page's language in a number that is written with a point. */
const localised = (text) => (document.documentElement.lang === "de" ? text.replace(".", ",") : text);
/** A number in the page's language, with a true minus. */
const rounded = (value, digits) => localised(value.toFixed(digits).replace("-", "−").replace(/^−(0(\.0*)?)$/, "$1"));
const withUnit = (unit, digits) => (_, value) => (value == null ? "–" : `${rounded(value, digits)} ${unit}`);

/** Error bars on both axes: { x, y, dx, dy }, one standard deviation each. */
function errorBars(points, name) {
  return (u) => {
    const { ctx, bbox } = u;
    const cap = 3 * devicePixelRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.strokeStyle = colour(name);
    ctx.lineWidth = 1.5 * devicePixelRatio;
    ctx.beginPath();
    for (const { x, y, dx, dy } of points) {
      const [cx, cy] = [u.valToPos(x, "x", true), u.valToPos(y, "y", true)];
      if (dy) {
        const [low, high] = [u.valToPos(y - dy, "y", true), u.valToPos(y + dy, "y", true)];
        ctx.moveTo(cx, low); ctx.lineTo(cx, high);
        ctx.moveTo(cx - cap, low); ctx.lineTo(cx + cap, low);
        ctx.moveTo(cx - cap, high); ctx.lineTo(cx + cap, high);
      }
      if (dx) {
        const [left, right] = [u.valToPos(x - dx, "x", true), u.valToPos(x + dx, "x", true)];
        ctx.moveTo(left, cy); ctx.lineTo(right, cy);
        ctx.moveTo(left, cy - cap); ctx.lineTo(left, cy + cap);
        ctx.moveTo(right, cy - cap); ctx.lineTo(right, cy + cap);
      }
    }
    ctx.stroke();
    ctx.restore();
  };
}

/** A horizontal line at zero. */
function zeroLine(u) {
  const y = Math.round(u.valToPos(0, "y", true));
  if (y < u.bbox.top || y > u.bbox.top + u.bbox.height) return;
  u.ctx.save();
  u.ctx.strokeStyle = colour("quiet");
  u.ctx.setLineDash([4 * devicePixelRatio, 4 * devicePixelRatio]);
  u.ctx.beginPath();
  u.ctx.moveTo(u.bbox.left, y);
  u.ctx.lineTo(u.bbox.left + u.bbox.width, y);
  u.ctx.stroke();
  u.ctx.restore();
}

const line = (label, name, unit, digits) => ({
  label, stroke: colour(name), width: 2, pxAlign: 0, spanGaps: true, points: { show: false }, value: withUnit(unit, digits),
});
/** Points without a line; `told` gives the text of a point by its x. */
const dots = (label, name, unit, digits, told = new Map()) => ({
  label, stroke: colour(name), paths: () => null, snaps: true,
  points: { show: true, size: 7, fill: colour(name), stroke: colour("card"), width: 1 },
  value: (u, value, _, index) => {
    if (value == null) return "–";
    const more = told.get(u.data[0][index]);
    return `${rounded(value, digits)} ${unit}${more ? ` (${more})` : ""}`;
  },
});

/** The index of the nearest value of a series: points lie far between the samples of a curve. */
function nearest(u, series, index) {
  const values = u.data[series];
  if (!u.series[series].snaps || values[index] != null) return index;
  for (let away = 1; away < values.length; away++) {
    if (values[index - away] != null) return index - away;
    if (values[index + away] != null) return index + away;
  }
  return index;
}

function axis(label, more) {
  const font = "12px system-ui, sans-serif";
  return {
    label, stroke: colour("text"), font, labelFont: font, labelSize: 22, size: more?.vertical ? 58 : 40,
    grid: { stroke: colour("line"), width: 1 }, ticks: { stroke: colour("line"), width: 1 },
    values: (_, splits) => splits.map((value) => (value == null ? "" : localised(String(value).replace("-", "−")))),
    ...more,
  };
}

/** The charts that share the x axis of this one. */
const together = (u) => (u.cursor.sync.key == null ? [u] : uPlot.sync(u.cursor.sync.key).plots);

/** Moves the cursor of this chart, and of those that share its x axis, to a value. */
function pointAt(u, index) {
  const top = u.bbox.height / 2 / devicePixelRatio;
  for (const one of together(u)) one.setCursor({ left: one.valToPos(u.data[0][index], "x"), top });
}

/** Zooms this chart, and those that share its x axis, about the cursor; 2 shows twice the range. */
function zoom(u, part) {
  const { min, max } = u.scales.x;
  const at = u.cursor.idx == null ? (min + max) / 2 : u.data[0][u.cursor.idx];
  const [low, high] = [at - part * (at - min), at + part * (max - at)];
  const [first, last] = [u.data[0][0], u.data[0].at(-1)];
  for (const one of together(u)) one.setScale("x", { min: Math.max(low, first), max: Math.min(high, last) });
}

const keysSaid = () => pick(
  "Arrow keys move along the values, plus and minus zoom, Escape shows all.",
  "Pfeiltasten gehen die Werte entlang, Plus und Minus vergrößern, Escape zeigt alles.",
);

/** Passes on the range that was dragged over, and removes its mark. */
function selected(u, selects) {
  const { left, width } = u.select;
  if (width <= 0) return;
  selects(u.posToVal(left, "x"), u.posToVal(left + width, "x"));
  u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
}

function onKey(u, event, zooms) {
  const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
  const part = { "+": 0.5, "=": 0.5, "-": 2 }[event.key];
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (step) {
    const last = u.data[0].length - 1;
    pointAt(u, Math.min(Math.max((u.cursor.idx ?? (step > 0 ? -1 : last + 1)) + step, 0), last));
  } else if (part && zooms) {
    zoom(u, part);
  } else if (event.key === "Escape" && zooms) {
    for (const one of together(u)) one.setData(one.data, true);
  } else {
    return;
  }
  event.preventDefault();
}

/**
 * Puts a chart into a figure; `below` draws between grid and lines. The chart can be zoomed unless its range is fixed; `selects` then
 * receives the range of the x axis over which the reader drags.
 */
function chart(figure, {
  name, x, y, series, data, height = HEIGHT, bars = [], zero = false, sync, range, bands, ticks, below = [], zooms = true, selects, keys = keysSaid(),
}) {
  const draw = bars.map(([points, colourName]) => errorBars(points, colourName));
  const u = new uPlot({
    // Whole pixels would turn a gentle slope into stairs.
    pxAlign: 0,
    width: figure.clientWidth - 2 * parseFloat(getComputedStyle(figure).paddingLeft), height,
    cursor: {
      dataIdx: nearest, y: false, drag: { x: zooms || Boolean(selects), y: false, setScale: zooms }, points: { size: 9 },
      ...(sync && { sync: { key: sync, scales: ["x", null] } }),
    },
    legend: { live: true },
    scales: { x: { time: false, ...range?.x }, y: { ...range?.y } },
    axes: [axis(x.label, { incrs: ticks }), axis(y, { vertical: true, space: height < HEIGHT ? TIGHT : ROOMY })],
    // The x axis is no series: its value stands in the legend only while the cursor is in the chart.
    series: [{ label: x.label.split(" (")[0], class: "of-axis", value: (u, value, ...more) => (value == null ? "" : (x.value ?? withUnit(x.unit, x.digits))(u, value, ...more)) }, ...series],
    bands,
    hooks: { drawAxes: [...below, ...(zero ? [zeroLine] : [])], draw, setSelect: selects ? [(u) => selected(u, selects)] : [] },
  }, data, figure);
  u.over.tabIndex = 0;
  u.over.setAttribute("role", "application");
  u.over.setAttribute("aria-label", `${name}. ${keys}`);
  u.over.addEventListener("keydown", (event) => onKey(u, event, zooms));
  // Charts that were destroyed are not kept.
  drawn.set(figure, [...(drawn.get(figure) ?? []).filter(({ root }) => root.isConnected), u]);
  return u;
}

/** The function that draws the charts of a figure. */
let drawFigure;

function redraw(figure) {
  for (const u of drawn.get(figure) ?? []) u.destroy();
  drawn.set(figure, []);
  for (const child of [...figure.children].slice(1)) child.remove();
  drawFigure(figure);
}

const figures = [...document.querySelectorAll("figure[data-chart]")];
const widths = new Map();
const watch = new ResizeObserver((entries) => {
  for (const { target, contentRect } of entries) {
    if (widths.get(target) === contentRect.width) continue;
    widths.set(target, contentRect.width);
    for (const u of drawn.get(target) ?? []) u.setSize({ width: contentRect.width, height: u.height });
  }
});

/** Draws all figures, and again when width, colours or medium change. */
function drawFigures(draw) {
  drawFigure = draw;
  for (const figure of figures) {
    redraw(figure);
    watch.observe(figure);
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => figures.forEach(redraw));
  addEventListener("beforeprint", () => {
    document.documentElement.dataset.paper = "";
    figures.forEach(redraw);
  });
  addEventListener("afterprint", () => {
    delete document.documentElement.dataset.paper;
    figures.forEach(redraw);
  });
}
