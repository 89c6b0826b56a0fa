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

/** A field of a table. */
const field = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

const dark = matchMedia("(prefers-color-scheme: dark)");

export class LiveChart {
  #figure; #options; #u; #data; #watch; #again;

  /** `options` makes the options of a chart in the current colours; `data` is the initial data. */
  constructor(figure, options, data) {
    this.#figure = figure;
    this.#options = options;
    this.#data = data;
    this.#draw();
    const { name } = options();
    const saves = make("button", { type: "button", class: "csv", "aria-label": say("chart-csv", name), title: say("chart-csv", name) }, "CSV");
    saves.addEventListener("click", () => this.#save());
    (figure.querySelector("figcaption") ?? figure).append(saves);
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
    this.#u = chart(this.#figure, { keys: say("chart-keys"), ...this.#options(), data: this.#data });
  }

  set(data) {
    this.#data = data;
    this.#u.setData(data);
  }

  /** Saves the values that are drawn as a table: a column for the x axis, and one for each series. */
  #save() {
    const { name, x, y } = this.#options();
    const columns = this.#u.series.map(({ label }, nth) => field(nth === 0 ? x.label : [label, y].filter(Boolean).join("; ")));
    const rows = Array.from(this.#u.data[0], (_, nth) => this.#u.data.map((column) => column[nth] ?? "").join(","));
    const address = URL.createObjectURL(new Blob([[columns.join(","), ...rows, ""].join("\n")], { type: "text/csv" }));
    make("a", { href: address, download: `${name.toLowerCase().replace(/[^a-z0-9äöüß]+/g, "-")}.csv` }).click();
    setTimeout(() => URL.revokeObjectURL(address), 1000);
  }

  close() {
    this.#watch.disconnect();
    dark.removeEventListener("change", this.#again);
    this.#figure.querySelector(".csv")?.remove();
    this.#u.destroy();
  }
}
