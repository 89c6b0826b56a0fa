// The layout page: track and trains, messages, and a command line.

import { make, put, signed } from "./dom.js";
import { Guide } from "./guide.js";
import { RouteButtons } from "./route_buttons.js";
import { order } from "./server.js";
import { PickTrack } from "./pick_track.js";
import { portrait } from "./portrait.js";
import { SCALES, chooseScale, kmPerHour, scale } from "./scale.js";
import { chooseSignals, showsSignals } from "./signals.js";
import { colourOf } from "./track.js";
import { logged, say } from "./words.js";

/** The most lines shown. */
const LINES_SHOWN = 400;

/** `about`: the train whose position the operator is asked for. */
export function layoutPage(root, live, about) {
  const $ = (selector) => root.querySelector(selector);
  const cards = new Map();
  const picked = $("#picked");
  const here = $("#here");
  /** The train that clicks on the track apply to. */
  let taken;
  const sought = about === undefined ? undefined : Number(about);
  /** The turnout that was clicked last. */
  let thrown;
  const track = new PickTrack($("#track"), live.layout, showPlace, ({ train, turnout }) => (train === undefined ? pressed(turnout) : take(train)));

  const button = (word, does, more) => {
    const made = make("button", { type: "button", ...more }, say(word));
    made.addEventListener("click", does);
    return made;
  };
  /** `undoes` returns the command that takes this one back, if there is one. */
  const orderButton = (text, line, undoes = () => undefined) => {
    const made = make("button", { type: "button" }, text);
    made.addEventListener("click", () => give(line(), $("#here-answer"), undoes()));
    return made;
  };
  const ofTrain = (train) => live.picture?.trains.find((one) => one.train === train);

  function take(train) {
    taken = train;
    for (const [number, { made, takes }] of cards) {
      made.classList.toggle("taken", number === taken);
      takes.setAttribute("aria-pressed", String(number === taken));
    }
    if (track.place) return showPlace(track.place);
    put(picked, say(taken === sought ? "place-hint" : "taken", train));
  }

  /** The commands that are possible at a place. */
  function showPlace(place) {
    thrown = undefined;
    put($("#here-answer"), "");
    picked.textContent = !place ? say("pick-hint") : track.block ? say("picked-in", place, track.block) : say("picked", place);
    here.hidden = !place || taken === undefined;
    if (here.hidden) return;
    const at = () => track.place;
    $("#here-does").replaceChildren(
      orderButton(say("stop-train-here", taken), () => `stop ${taken} at ${at()}`),
      orderButton(say("go-train-here", taken), () => `go ${taken} to ${at()}`),
      orderButton(say("put-train-here", taken), () => `place ${taken} at ${at()}`, () => ofTrain(taken)?.at && `place ${taken} at ${ofTrain(taken).at}`));
    if (taken === sought) $("#here-does").prepend($("#here-does").lastElementChild);
    if (!track.other) return;
    $("#here-does").append(button("other-direction", () => { track.turn(); showPlace(track.place); }, { title: track.other }));
  }

  const guide = sought === undefined ? undefined : new Guide($("#guide"), live, sought, track, give);

  const routes = new RouteButtons($("#routes"), $("#routes-answer"));

  const leg = (lies) => say(lies ? `leg-${lies}` : "leg-unknown");
  const stands = (turnout, lies) => (lies ? say("turnout-is", turnout, leg(lies)) : say("turnout-unknown", turnout));
  const other = (lies) => (lies === "straight" ? "curved" : "straight");

  /** Throws a turnout whose position is known; asks for the position of any other. */
  function pressed(turnout) {
    thrown = turnout;
    const lies = live.picture?.turnouts[turnout];
    here.hidden = false;
    put($("#here-answer"), "");
    const throws = (to) => orderButton(say(`throw-${to}`), () => `turnout ${turnout} ${to}`, () => lies && `turnout ${turnout} ${lies}`);
    $("#here-does").replaceChildren(...(lies ? [throws(other(lies))] : [throws("straight"), throws("curved")]));
    put(picked, stands(turnout, lies));
    if (lies) give(`turnout ${turnout} ${other(lies)}`, $("#here-answer"), `turnout ${turnout} ${lies}`);
  }

  /** The turnouts as a list, for keyboard and screen reader. */
  const turnouts = new Map();
  function listTurnouts(picture) {
    for (const [number, lies] of Object.entries(picture.turnouts)) {
      if (!turnouts.has(number)) {
        turnouts.set(number, { button: button("", () => pressed(Number(number))) });
        $("#turnout-list").append(turnouts.get(number).button);
        $("#turnouts").hidden = false;
        // Trains are sent nowhere over a turnout of unknown position.
        $("#turnouts").open ||= !lies;
      }
      const one = turnouts.get(number);
      if (one.lies === lies) continue;
      one.lies = lies;
      put(one.button, say("turnout-short", number, leg(lies)));
      if (Number(number) !== thrown) continue;
      put(picked, stands(number, lies));
      const throws = orderButton(say(`throw-${other(lies)}`), () => `turnout ${number} ${other(lies)}`);
      if (lies) $("#here-does").replaceChildren(throws);
    }
  }

  /** The blocks as a list, for screen readers. */
  const blocks = live.layout.blocks.map(({ name, detector }) => ({ name, detector, row: make("li") }));
  $("#block-list").append(...blocks.map(({ row }) => row));
  const { nodes } = live.layout;
  const has = { blocks: blocks.length > 0, crossings: live.layout.crossings.length > 0, turnouts: nodes.some(({ kind }) => kind === "branch"), sensors: nodes.some(({ kind, is_boundary: isBoundary }) => kind === "contact" && !isBoundary) };
  for (const [what, is] of Object.entries(has)) for (const part of root.querySelectorAll(`.of-${what}`)) part.hidden = !is;

  const scales = $("#scale");
  scales.append(...Object.keys(SCALES).sort((one, other) => SCALES[other] - SCALES[one]).map((name) => new Option(`${name} (1:${SCALES[name]})`, name)));
  scales.value = scale();
  scales.addEventListener("change", () => chooseScale(scales.value));
  $("#signals").checked = showsSignals();
  $("#signals").addEventListener("change", ({ target }) => chooseSignals(target.checked));
  const zones = new Map(live.layout.edges.filter((edge) => edge.zone).map(({ zone }) => [zone.name, say("zone", zone.name, zone.max_mm_s)]));
  $("#zones").hidden = zones.size === 0;
  $("#zones span").textContent = say("zones", [...zones.values()].join("; "));
  $("#zoom-in").addEventListener("click", () => track.view.zoom(0.7));
  $("#zoom-out").addEventListener("click", () => track.view.zoom(1.4));
  $("#zoom-all").addEventListener("click", () => track.view.all());

  $("#all-straight").addEventListener("click", () => give("turnout all straight", $("#turnouts-answer")));

  /** The command that takes the last one back. */
  let undo;
  function offerUndo(answer) {
    if (!undo) return;
    const line = undo;
    answer.append(" ", button("undo", () => give(line, answer), { class: "small", title: line }));
  }

  /** Sends a command; the result is shown beside the control. */
  async function give(line, answer, undoes) {
    undo = undefined;
    answer.className = "answer";
    put(answer, say("sent", line));
    try {
      await order(line);
      undo = undoes;
      offerUndo(answer);
      return true;
    } catch (error) {
      answer.className = "answer bad";
      put(answer, say("unread", error.message));
      return false;
    }
  }

  $("#order").addEventListener("submit", async (event) => {
    event.preventDefault();
    const field = $("#line");
    const line = field.value;
    // What was written while the answer was on its way stays.
    if (line.trim() && (await give(line, $("#answer"))) && field.value === line) field.value = "";
  });

  $("#commands").addEventListener("click", () => give("help", $("#answer")));

  function card(train, nth) {
    const id = `step-${train.train}`;
    const [at, speed, busy] = [make("dd"), make("dd"), make("dd")];
    const answer = make("output", { class: "answer", role: "status" });
    const step = make("input", { id, type: "number", min: 0, max: 126, inputMode: "numeric", value: String(train.step), "aria-label": say("step-of", train.train) });
    const stopHere = button("stop-here", () => track.place && give(`stop ${train.train} at ${track.place}`, answer));
    const takes = button("take", () => take(train.train), { "aria-pressed": "false" });
    const made = make("article", { class: "train" }, ...portrait(train.train),
      make("h3", {}, make("a", { href: `#/train/${train.train}` }, live.called(train.train))),
      make("dl", {}, make("dt", {}, say("at")), at, make("dt", {}, say("speed")), speed, make("dt", {}, say("busy")), busy),
      make("div", { class: "does" },
        button("stop", () => give(`stop ${train.train}`, answer)), stopHere,
        make("span", { class: "together" }, make("label", { htmlFor: id }, say("step")), step,
          button("set", () => give(`speed ${train.train} ${step.value}`, answer, `speed ${train.train} ${ofTrain(train.train).step}`))), takes),
      answer);
    made.style.borderLeftColor = colourOf(nth);
    if (cards.size === 0) $("#trains").replaceChildren();
    $("#trains").append(made);
    const parts = { made, at, speed, busy, stopHere, takes, answer };
    cards.set(train.train, parts);
    if (train.train === (sought ?? taken ?? train.train)) take(train.train);
    return parts;
  }

  function show(picture) {
    track.show(picture);
    guide?.show(picture);
    routes.show(picture);
    listTurnouts(picture);
    put($("#crossings-held"), (picture.crossings_held ?? []).map(({ trains, at }) => say("crossing-held", ...trains, at[0])).join(" "));
    for (const { name, detector, row } of blocks) put(row, say("block-is", name, say(`block-${picture.blocks?.[detector] ?? "unknown"}`)));
    picture.trains.forEach((train, nth) => {
      const parts = cards.get(train.train) ?? card(train, nth);
      put(parts.at, train.at ? `${train.at} ± ${train.half_mm.toFixed(0)} mm` : say("nowhere"));
      const speed = train.at ? `${train.speed_mm_per_s.toFixed(0)} ± ${train.speed_half_mm_per_s.toFixed(0)} mm/s (${kmPerHour(train.speed_mm_per_s)}), ` : "";
      put(parts.speed, speed + say("at-step", train.step));
      const rests = train.promise_mm;
      const ends = rests ? ` (${say("rests")} ${signed(rests[1])} … ${signed(rests[2])} mm)` : "";
      put(parts.busy, train.doing ? train.doing + ends : "–");
      parts.stopHere.disabled = !track.place;
      put(parts.stopHere, say("stop-here", track.place ?? "…"));
    });
    for (const [train, { made }] of cards) {
      if (picture.trains.some((one) => one.train === train)) continue;
      made.remove();
      cards.delete(train);
      if (taken === train) taken = undefined;
    }
    if (picture.trains.length === 0) put($("#trains"), say("none"));
  }

  function write(text) {
    const list = $("#said");
    const atEnd = list.scrollTop + list.clientHeight >= list.scrollHeight - 8;
    const lines = logged(text).split("\n");
    // The list of commands says what each of them does.
    list.append(lines.length === 1 ? make("li", {}, lines[0]) : make("li", { class: "listing" }, ...lines.flatMap((line) => {
      const [command, meaning = ""] = line.split(/(?<=\S) {2,}/);
      return [make("b", {}, command), make("span", {}, meaning)];
    })));
    while (list.childElementCount > LINES_SHOWN) list.firstElementChild.remove();
    if (atEnd) list.scrollTop = list.scrollHeight;
  }

  for (const { text } of live.lines.slice(-LINES_SHOWN)) write(text);
  return {
    picture: show,
    line: ({ text }) => write(text),
    ended({ train, command, refused }) {
      const answer = cards.get(train)?.answer ?? $("#here-answer");
      if (refused) {
        answer.className = "answer bad";
        put(answer, say("refused", logged(refused)));
      } else if (command === "turnout" && answer.textContent) {
        put(answer, say("done"));
        offerUndo(answer);
      }
    },
    gap: (count) => write(say("gap", count)),
    anew: () => $("#said").replaceChildren(),
  };
}
