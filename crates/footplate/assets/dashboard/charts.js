// Live charts, drawn with the code of the reports, and drawn again when colours or widths change.

import { chart, colour, rounded } from "./chart.js";
import { make } from "./dom.js";
import { say } from "./words.js";

/** Error bars of a chart: points by series, each in its colour. */
export const barsOf = (points, series) => series.map(([, name], place) => [points[place], name]);

/** A series of bars. */
export const upright = (label, name) => ({
  label, stroke: colour(name), fill: colour(name), width: 0, points: { show: false }, paths: uPlot.paths.bars({ size: [0.9, 60] }),
  value: (_, value) => (value == null ? "–" : rounded(value, 0)),
});

/** The height of a line of text in a saved picture, in pixels of the page. */
const TEXT_LINE = 20;

/** A field of a table. */
const field = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

const dark = matchMedia("(prefers-color-scheme: dark)");

export class LiveChart {
  #figure; #options; #u; #data; #watch; #again; #onPick;

  /**
   * `options` makes the options of a chart in the current colours; `data` is the initial data; `onPick` receives the value of the x
   * axis that is clicked.
   */
  constructor(figure, options, data, onPick) {
    this.#figure = figure;
    this.#options = options;
    this.#data = data;
    this.#onPick = onPick;
    this.#draw();
    const { name } = options();
    const saves = (word, text, does) => {
      const made = make("button", { type: "button", class: "csv", "aria-label": say(word, name), title: say(word, name) }, text);
      made.addEventListener("click", does);
      return made;
    };
    (figure.querySelector("figcaption") ?? figure).append(make("span", { class: "saves" }, saves("chart-csv", "CSV", () => this.#save()), saves("chart-png", "PNG", () => this.#draws())));
    let width = figure.clientWidth;
    this.#watch = new ResizeObserver(() => {
      if (figure.clientWidth === width) return;
      width = figure.clientWidth;
      const padding = 2 * parseFloat(getComputedStyle(figure).paddingLeft);
      this.#u.setSize({ width: width - padding, height: this.#u.height });
    });
    this.#watch.observe(figure);
    this.#again = () => this.#draw();
    dark.addEventListener("change", this.#again);
  }

  #draw() {
    this.#u?.destroy();
    const u = chart(this.#figure, { keys: say("chart-keys"), ...this.#options(), data: this.#data });
    // Without a cursor the legend has no values.
    for (const series of u.series) {
      const { value } = series;
      series.value = (of, at, ...more) => (at == null ? "" : value(of, at, ...more));
    }
    u.setLegend({ idx: null });
    if (this.#onPick) u.over.addEventListener("click", ({ offsetX }) => this.#onPick(u.posToVal(offsetX, "x")));
    this.#u = u;
  }

  /** Draws the same data again, for marks that have moved. */
  redraw() {
    this.#u.redraw(false);
  }

  /** Replaces the data. The part that a reader has zoomed to stays. */
  set(data) {
    const { min, max } = this.#u.scales.x;
    const isZoomed = this.#options().zooms !== false && (min > this.#data[0][0] || max < this.#data[0].at(-1));
    this.#data = data;
    this.#u.setData(data, !isZoomed);
    if (isZoomed) this.#u.redraw();
  }

  /** Saves the values that are drawn as a table: a column for the x axis, and one for each series. */
  #save() {
    const { name, x, y } = this.#options();
    const columns = this.#u.series.map(({ label }, nth) => field(nth === 0 ? x.label : [label, y].filter(Boolean).join("; ")));
    const rows = Array.from(this.#u.data[0], (_, nth) => this.#u.data.map((column) => column[nth] ?? "").join(","));
    this.#hand(new Blob([[columns.join(","), ...rows, ""].join("\n")], { type: "text/csv" }), name, "csv");
  }

  /** Saves the chart as a picture, with its name and what its colours mean. */
  #draws() {
    const { name } = this.#options();
    const { ctx: { canvas: drawn } } = this.#u;
    const line = TEXT_LINE * devicePixelRatio;
    const canvas = make("canvas", { width: drawn.width, height: drawn.height + 2 * line });
    const ctx = canvas.getContext("2d");
    ctx.fillStyle = colour("card");
    ctx.fillRect(0, 0, canvas.width, canvas.height);
    ctx.drawImage(drawn, 0, line);
    ctx.fillStyle = colour("text");
    ctx.font = `${0.7 * line}px system-ui, sans-serif`;
    ctx.fillText(name, line / 2, 0.75 * line);
    let x = line / 2;
    for (const { label, stroke, class: own } of this.#u.series.slice(1)) {
      if (own === "unlisted") continue;
      ctx.fillStyle = typeof stroke === "function" ? stroke(this.#u) : stroke;
      ctx.fillRect(x, drawn.height + 1.3 * line, line / 2, line / 2);
      ctx.fillStyle = colour("text");
      ctx.fillText(label, x + 0.7 * line, drawn.height + 1.75 * line);
      x += ctx.measureText(label).width + 1.6 * line;
    }
    canvas.toBlob((picture) => this.#hand(picture, name, "png"));
  }

  #hand(blob, name, kind) {
    const address = URL.createObjectURL(blob);
    make("a", { href: address, download: `${name.toLowerCase().replace(/[^a-z0-9äöüß]+/g, "-")}.${kind}` }).click();
    setTimeout(() => URL.revokeObjectURL(address), 1000);
  }

  close() {
    this.#watch.disconnect();
    dark.removeEventListener("change", this.#again);
    this.#figure.querySelector(".saves").remove();
    this.#u.destroy();
  }
}
