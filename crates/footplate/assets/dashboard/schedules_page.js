// The page of schedules: scripts that are saved, run beside the operator, and show how far they are.

import { make, put } from "./dom.js";
import { ask, get } from "./server.js";
import { logged, say } from "./words.js";

/** The marks of lines: what they are is also said in words for screen readers. */
const MARKS = { done: "✓", active: "▶", refused: "✗", next: "·", later: " " };

/** Longer schedules show their lines only while they run. */
const SHORT = 8;

/** What has become of a line of a schedule that runs or has run. */
function lineState({ active, next, refused, is_over: isOver }, nth) {
  if (refused[nth] !== undefined) return "refused";
  if (active.includes(nth)) return "active";
  if (nth === next) return active.length ? "later" : "next";
  return isOver || next === null || nth < next ? "done" : "later";
}

export function schedulesPage(root, live) {
  const $ = (selector) => root.querySelector(selector);
  const cards = new Map();
  let saved = [], unsaved = "";

  const button = (text, does, more = {}) => {
    const made = make("button", { type: "button", ...more }, text);
    made.addEventListener("click", does);
    return made;
  };
  const answer = (text, isBad = false) => {
    $("#schedule-answer").classList.toggle("bad", isBad);
    put($("#schedule-answer"), text);
  };
  async function request(path, body, done) {
    try {
      const { schedules } = await ask(path, body);
      if (schedules) list(schedules);
      answer(done ?? "");
    } catch ({ message }) {
      answer(message, true);
    }
  }

  function card(schedule) {
    const { name, lines, rounds, is_button: isButton } = schedule;
    const rows = lines.map((text) => make("li", {}, make("span", { class: "mark", "aria-hidden": "true" }), make("code", {}, text), make("span", { class: "quiet" })));
    const progress = make("p", { class: "quiet", role: "status" });
    const runs = button(say("schedule-run"), () => request("/api/schedules/run", { name }), { "data-run": name });
    const ends = button(say("schedule-end"), () => request("/api/schedules/end", { name }), { "data-end": name });
    const made = make("article", { class: "card schedule" }, make("h3", {}, name),
      make("p", { class: "quiet" }, [rounds == null ? say("schedule-endless") : rounds === 1 ? say("schedule-once") : say("schedule-rounds", rounds), isButton ? say("schedule-is-button") : ""].filter(Boolean).join(" · ")),
      make("div", { class: "does" }, runs, ends, button(say("schedule-edit"), () => edit(schedule)),
        button(say("schedule-delete"), () => request("/api/schedules/delete", { name }, say("schedule-deleted", name)))),
      progress, make("details", { open: lines.length <= SHORT }, make("summary", {}, say("schedule-commands", lines.length)), make("ol", {}, ...rows)));
    const one = { made, rows, progress, runs, ends };
    cards.set(name, one);
    return made;
  }

  function list(schedules) {
    saved = schedules;
    cards.clear();
    $("#schedules").replaceChildren(...saved.map(card));
    unsaved = "";
    $("#no-schedule").hidden = saved.length > 0;
    if (live.picture) show(live.picture);
  }

  function show({ schedules: states }) {
    for (const [name, { rows, progress, runs, ends }] of cards) {
      const state = states.find((one) => one.name === name);
      const isRunning = Boolean(state && !state.is_over);
      if (isRunning && !runs.disabled) rows[0].closest("details").open = true;
      runs.disabled = isRunning;
      ends.disabled = !isRunning;
      put(progress, !state ? "" : isRunning ? say(state.rounds == null || state.rounds > 1 ? "schedule-round" : "schedule-runs", state.round, state.rounds ?? "∞")
        : say(Object.keys(state.refused).length ? "schedule-over-short" : "schedule-over"));
      rows.forEach((row, nth) => {
        const is = state ? lineState(state, nth) : "later";
        if (row.dataset.state === is) return;
        row.dataset.state = is;
        put(row.firstElementChild, MARKS[is]);
        put(row.lastElementChild, is === "refused" ? ` ${say("refused", logged(state.refused[nth]))}` : state && is !== "later" ? ` ${say(`line-${is}`)}` : "");
      });
    }
    showUnsaved(states.filter(({ name, is_over: isOver }) => !isOver && !cards.has(name)).map(({ name }) => name));
    choices(live.picture);
  }

  /** What runs and is not saved can be ended, too: it was deleted meanwhile, or another program began it. */
  function showUnsaved(names) {
    if (names.join("\n") === unsaved) return;
    unsaved = names.join("\n");
    document.querySelectorAll("#schedules [data-unsaved]").forEach((made) => made.remove());
    $("#schedules").append(...names.map((name) => make("article", { class: "card schedule", "data-unsaved": name }, make("h3", {}, name),
      make("div", { class: "does" }, button(say("schedule-end"), () => request("/api/schedules/end", { name }), { "data-end": name })))));
  }

  /** The trains of the session, and the sensors of the layout, as choices. */
  function choices({ trains, turnouts }) {
    listTurnouts(turnouts);
    const select = $("#stop-train");
    const numbers = trains.map(({ train }) => String(train));
    if ([...select.options].map(({ value }) => value).join() === numbers.join()) return;
    select.replaceChildren(...trains.map(({ train }) => new Option(live.called(train), String(train))));
  }
  $("#stop-place").append(...live.layout.nodes.filter(({ kind }) => kind === "contact").map(({ name }) => new Option(name, name)));

  const written = () => $("#schedule-lines").value.split("\n").map((line) => line.trimEnd());
  function append(lines) {
    const before = $("#schedule-lines").value.trimEnd();
    $("#schedule-lines").value = [...(before ? [before] : []), ...lines].join("\n");
  }

  function edit({ name, lines, rounds, is_button: isButton }) {
    $("#schedule-name").value = name;
    $("#schedule-lines").value = lines.join("\n");
    $("#schedule-endless").checked = rounds == null;
    $("#schedule-rounds").value = String(rounds ?? 1);
    $("#schedule-rounds").disabled = rounds == null;
    $("#schedule-button").checked = isButton;
    $("#schedule-name").focus();
  }

  $("#add-stop").addEventListener("submit", (event) => {
    event.preventDefault();
    const [train, beyond, seconds] = [$("#stop-train").value, Number($("#stop-beyond").value), Number($("#stop-wait").value)];
    const place = $("#stop-place").value + (beyond ? `${beyond > 0 ? "+" : ""}${beyond}mm` : "");
    append([`go ${train} to ${place}`, `wait ${train} at rest`, ...(seconds > 0 ? [`wait ${seconds}s`] : [])]);
  });
  $("#add-turnouts").addEventListener("click", () => {
    const chosen = [...$("#turnout-boxes").querySelectorAll("input:checked")].map(({ value }) => value);
    const known = chosen.filter((number) => live.picture?.turnouts[number]);
    if (known.length === 0) return answer(say("schedule-no-turnout"), true);
    answer("");
    append(known.map((number) => `turnout ${number} ${live.picture.turnouts[number]}`));
    $("#schedule-button").checked = true;
  });

  /** The turnouts with their positions, to choose from. */
  const boxes = new Map();
  function listTurnouts(turnouts) {
    for (const [number, lies] of Object.entries(turnouts)) {
      if (!boxes.has(number)) {
        const text = make("span");
        $("#turnout-boxes").append(make("label", { class: "check" }, make("input", { type: "checkbox", value: number }), text));
        boxes.set(number, text);
      }
      put(boxes.get(number), say("turnout-short", number, say(lies ? `leg-${lies}` : "leg-unknown")));
    }
  }
  $("#schedule-endless").addEventListener("change", ({ target }) => { $("#schedule-rounds").disabled = target.checked; });
  $("#schedule-form").addEventListener("submit", (event) => {
    event.preventDefault();
    const name = $("#schedule-name").value.trim();
    const lines = written();
    while (lines.length && !lines.at(-1)) lines.pop();
    request("/api/schedules", { name, lines, rounds: $("#schedule-endless").checked ? null : Number($("#schedule-rounds").value), is_button: $("#schedule-button").checked }, say("schedule-saved", name));
  });

  get("/api/schedules").then(({ schedules }) => list(schedules), ({ message }) => answer(message, true));
  return { picture: show };
}
