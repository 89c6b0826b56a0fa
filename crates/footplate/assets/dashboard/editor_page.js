// The editor: draws a layout from the pieces of a track system, and saves it as a layout file.

import { make, put, shown, svg } from "./dom.js";
import { Draft } from "./draft.js";
import { arcOf, LIBRARIES } from "./pieces.js";
import { written } from "./plan_curve.js";
import { ask } from "./server.js";
import { colourOf } from "./track.js";
import { View } from "./view.js";
import { say } from "./words.js";

const KEPT_AS = "draft";
/** The least area shown (mm), and the reach of a click. */
const LEAST_SHOWN = 1200;
const TOUCH = 40;
/** The program checks the file when the drawing has rested for this time. */
const CHECKED_AFTER_MS = 300;
const START = { x: 0, y: 0, heading: 0, ends: [] };

function kept() {
  try {
    return JSON.parse(localStorage.getItem(KEPT_AS)) ?? {};
  } catch {
    return {};
  }
}

export function editorPage(root, live) {
  const $ = (selector) => root.querySelector(selector);
  const before = kept();
  const draft = Draft.of(before.draft);
  let side = -1;
  /** The place of the next piece, or the selected joint. */
  let chosen = draft.joints().find(({ ends }) => ends.length === 1) ?? START;
  const drawing = $("#draft");
  const whole = [0, 0, 0, 0];
  measure();
  const view = new View(drawing, whole, press);

  function measure() {
    const points = [...draft.pieces.flatMap((piece) => draft.curves(piece).flat()), [0, 0]];
    const [xs, ys] = [0, 1].map((axis) => points.map((point) => point[axis]));
    const [wide, high] = [xs, ys].map((all) => Math.max(Math.max(...all) - Math.min(...all), LEAST_SHOWN / (all === ys ? 2 : 1)));
    const [x, y] = [xs, ys].map((all) => (Math.max(...all) + Math.min(...all)) / 2);
    whole.splice(0, 4, x - wide / 2 - 100, y - high / 2 - 100, wide + 200, high + 200);
  }

  const isOpen = () => chosen === START ? draft.pieces.length === 0 : chosen.ends.length === 1;
  const isSame = (one, other) => Math.hypot(one.x - other.x, one.y - other.y) < 1;

  function draw() {
    drawing.replaceChildren();
    const sections = draft.sections();
    for (const [nth, { pieces, isWatched }] of sections.entries()) {
      for (const curve of pieces.flatMap((piece) => (isWatched ? draft.curves(draft.pieces[piece]) : []))) svg("path", { d: written(curve), class: "held", stroke: colourOf(nth), "stroke-width": 60 }, drawing);
    }
    for (const piece of draft.pieces) {
      for (const curve of draft.curves(piece)) svg("path", { d: written(curve), class: "rail", "stroke-width": 12 }, drawing);
    }
    for (const joint of draft.joints()) {
      if (joint.ends.length === 2 && draft.has("boundaries", joint)) {
        const [dx, dy] = [30 * Math.cos(joint.heading), 30 * Math.sin(joint.heading)];
        svg("path", { d: `M${joint.x - dy} ${joint.y + dx}L${joint.x + dy} ${joint.y - dx}`, class: "joint boundary", "stroke-width": 12 }, drawing);
        continue;
      }
      const isSensor = draft.has("sensors", joint);
      const word = isSensor ? "sensor" : joint.ends.length === 1 ? "open" : "joined";
      svg("circle", { cx: joint.x, cy: joint.y, r: word === "joined" ? 9 : 16, class: `joint ${word}`, "stroke-width": 5 }, drawing);
    }
    const [x, y] = [chosen.x, chosen.y];
    if (isOpen()) {
      const [dx, dy] = [Math.cos(chosen.heading), Math.sin(chosen.heading)];
      svg("path", { d: `M${x - dy * 26} ${y + dx * 26}L${x + dx * 52} ${y + dy * 52}L${x + dy * 26} ${y - dx * 26}Z`, class: "next" }, drawing);
    } else {
      svg("circle", { cx: x, cy: y, r: 28, class: "picked", "stroke-width": 6 }, drawing);
    }
    const problems = draft.problems();
    const toml = draft.toml($("#draft-name").value);
    $("#draft-says").replaceChildren(...problems.map(({ word, blanks, isError }) => make("li", { class: isError ? "danger" : word === "draft-gap" ? "warning" : "over" }, say(word, ...blanks))));
    $("#draft-save").disabled = !toml;
    $("#draft-use").disabled = !toml;
    $("#draft-toml").textContent = toml ?? "";
    $("#draft-written").hidden = !toml;
    $("#draft-undo").disabled = !draft.canUndo;
    $("#draft-redo").disabled = !draft.canRedo;
    $("#draft-remove").disabled = chosen.ends.length === 0;
    for (const [kind, id] of [["sensors", "draft-sensor"], ["boundaries", "draft-boundary"]]) {
      $(`#${id}`).disabled = chosen.ends.length !== 2;
      put($(`#${id}`), say(chosen.ends.length === 2 && draft.has(kind, chosen) ? `${id}-not` : id));
    }
    $("#draft-number-of").hidden = chosen.ends.length !== 2 || !draft.has("sensors", chosen);
    $("#draft-number").value = draft.numberOf(chosen) ?? "";
    listBlocks(sections);
    if (toml !== checked) check(toml);
    for (const button of $("#pieces").querySelectorAll("button")) button.disabled = !isOpen();
    put($("#draft-next"), say(isOpen() ? "draft-next" : "draft-joint"));
    try {
      localStorage.setItem(KEPT_AS, JSON.stringify({ draft: draft.kept, name: $("#draft-name").value, library: $("#library").value }));
    } catch {
      // A browser without storage starts with an empty draft next time.
    }
  }

  let listed;
  /** The blocks between boundaries, to be named and numbered. */
  function listBlocks(sections) {
    if (JSON.stringify(sections) === listed) return;
    listed = JSON.stringify(sections);
    $("#draft-blocks").hidden = sections.length === 0;
    $("#block-rows").replaceChildren(...sections.map((section, nth) => {
      const field = (word, value, more) => {
        const input = make("input", { value, autocomplete: "off", disabled: !section.isWatched, ...more });
        return [input, make("label", {}, make("span", {}, say(word)), input)];
      };
      const [name, named] = field("draft-block-name", section.name, { maxLength: 32 });
      const [number, numbered] = field("draft-block-number", String(section.number), { type: "number", min: 0, max: 65535 });
      const watched = make("input", { type: "checkbox", checked: section.isWatched });
      const row = make("div", { class: "does fields", role: "group", "aria-label": section.name }, named, numbered, make("label", { class: "check" }, watched, say("draft-block-watched")));
      row.style.borderLeft = `0.4rem solid ${section.isWatched ? colourOf(nth) : "transparent"}`;
      row.addEventListener("change", () => {
        draft.describe(section, { name: name.value.trim() || section.name, number: Number(number.value) || 0, isWatched: watched.checked });
        draw();
      });
      return row;
    }));
  }

  /** What the program says of the file, as `footplate layout check` does. */
  let checked;
  async function check(toml) {
    checked = toml;
    $("#draft-refused").replaceChildren();
    await new Promise((passed) => { setTimeout(passed, CHECKED_AFTER_MS); });
    if (!toml || toml !== checked) return;
    try {
      await ask("/api/layout/check", { toml });
    } catch ({ message }) {
      if (toml !== checked) return;
      $("#draft-refused").replaceChildren(make("li", { class: "danger" }, message));
      $("#draft-use").disabled = true;
    }
  }

  function goesOn(next) {
    const joints = draft.joints();
    chosen = next ?? joints.find((joint) => isSame(joint, chosen)) ?? joints.findLast(({ ends }) => ends.length === 1) ?? joints.at(-1) ?? START;
    measure();
    view.all();
    draw();
  }

  function press([x, y]) {
    const away = (joint) => Math.hypot(joint.x - x, joint.y - y);
    const [nearest] = draft.joints().sort((one, other) => away(one) - away(other));
    if (!nearest || away(nearest) > TOUCH) return;
    chosen = nearest;
    draw();
  }

  function lay(piece) {
    const port = piece.kind === "turnout" ? Number($("#joined-at").value) : 0;
    goesOn(draft.lay(piece, side, port, chosen));
  }

  function list() {
    const size = ({ mm, radius, angle }) => [radius && `${radius} mm`, angle && `${angle}°`, mm && `${mm} mm`].filter(Boolean).join(", ");
    const button = (piece) => {
      const made = make("button", { type: "button", title: piece.radius ? say("draft-arc", shown(arcOf(piece), 1)) : "" }, make("b", {}, piece.name), make("small", {}, size(piece)));
      made.addEventListener("click", () => lay(piece));
      return made;
    };
    const has = (kind) => LIBRARIES[$("#library").value].some((piece) => piece.kind === kind);
    const groups = ["straight", "curve", "turnout", "crossing", "slip"].filter(has).map((kind) => make("div", { role: "group", "aria-label": say(`draft-${kind}s`) },
      make("h3", {}, say(`draft-${kind}s`)), kind === "slip" ? make("p", { class: "quiet" }, say("draft-slip-about")) : "", make("div", { class: "does" }, ...LIBRARIES[$("#library").value].filter((piece) => piece.kind === kind).map(button))));
    $("#pieces").replaceChildren(...groups);
  }

  function hand(to) {
    side = to;
    for (const [id, own] of [["#hand-left", -1], ["#hand-right", 1]]) $(id).setAttribute("aria-pressed", String(own === side));
  }

  function save() {
    const address = URL.createObjectURL(new Blob([$("#draft-toml").textContent], { type: "application/toml" }));
    const name = $("#draft-name").value.trim().toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "") || "layout";
    make("a", { href: address, download: `${name}.toml` }).click();
    setTimeout(() => URL.revokeObjectURL(address), 1000);
    put($("#draft-saved"), say("draft-saved", `${name}.toml`));
  }

  /** Takes the drawing as the layout of the set-up. */
  async function use() {
    try {
      live.setUp = await ask("/api/setup", { drawn: { toml: $("#draft-toml").textContent } });
      location.hash = "#/setup/trains";
    } catch (error) {
      put($("#draft-saved"), error.message);
    }
  }

  $("#library").append(...Object.keys(LIBRARIES).map((name) => new Option(name, name)));
  if (Object.hasOwn(LIBRARIES, before.library)) $("#library").value = before.library;
  $("#joined-at").append(...["draft-toe", "draft-straight-leg", "draft-curved-leg"].map((word, port) => new Option(say(word), String(port))));
  $("#draft-name").value = before.name ?? say("draft-unnamed");
  $("#library").addEventListener("change", () => { list(); draw(); });
  $("#draft-name").addEventListener("input", draw);
  $("#hand-left").addEventListener("click", () => hand(-1));
  $("#hand-right").addEventListener("click", () => hand(1));
  $("#draft-undo").addEventListener("click", () => { draft.undo(); goesOn(); });
  $("#draft-redo").addEventListener("click", () => { draft.redo(); goesOn(); });
  $("#draft-clear").addEventListener("click", () => { draft.clear(); goesOn(START); });
  $("#draft-sensor").addEventListener("click", () => { draft.toggle("sensors", chosen); draw(); });
  $("#draft-boundary").addEventListener("click", () => { draft.toggle("boundaries", chosen); draw(); });
  $("#draft-number").addEventListener("change", ({ target: { value } }) => { draft.number(chosen, value === "" ? undefined : Number(value)); draw(); });
  $("#draft-remove").addEventListener("click", () => {
    draft.remove(Math.max(...chosen.ends.map(({ piece }) => piece)));
    goesOn();
  });
  $("#draft-save").addEventListener("click", save);
  $("#draft-use").hidden = live.setUp.mode !== "setting-up";
  $("#draft-use").addEventListener("click", use);
  hand(side);
  list();
  draw();
  return {};
}
