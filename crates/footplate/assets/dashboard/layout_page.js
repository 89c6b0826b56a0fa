// The layout with all trains, what is said, and a line to write orders in.

import { make, put, signed } from "./dom.js";
import { order } from "./server.js";
import { PickTrack } from "./pick_track.js";
import { colourOf } from "./track.js";
import { say } from "./words.js";

/** Lines that are shown. */
const LINES_SHOWN = 400;

export function layoutPage(root, live) {
  const $ = (selector) => root.querySelector(selector);
  const cards = new Map();
  const picked = $("#picked");
  const track = new PickTrack($("#track"), live.layout, (place) => {
    picked.textContent = place ? say("picked", place) : say("pick-hint");
  });
  const zones = new Map(live.layout.edges.filter((edge) => edge.zone).map(({ zone }) => [zone.name, say("zone", zone.name, zone.max_mm_s)]));
  $("#zones").hidden = zones.size === 0;
  $("#zones").textContent = say("zones", [...zones.values()].join("; "));
  $("#zoom-in").addEventListener("click", () => track.view.zoom(0.7));
  $("#zoom-out").addEventListener("click", () => track.view.zoom(1.4));
  $("#zoom-all").addEventListener("click", () => track.view.all());

  async function give(line) {
    $("#answer").textContent = "";
    try {
      await order(line);
      return true;
    } catch (error) {
      $("#answer").textContent = say("unread", error.message);
      return false;
    }
  }

  $("#order").addEventListener("submit", async (event) => {
    event.preventDefault();
    const field = $("#line");
    if (field.value.trim() && (await give(field.value))) field.value = "";
  });

  function card(train, nth) {
    const id = `step-${train.train}`;
    const [at, speed, busy] = [make("dd"), make("dd"), make("dd")];
    const button = (word, does, more) => {
      const made = make("button", { type: "button", ...more }, say(word));
      made.addEventListener("click", does);
      return made;
    };
    const step = make("input", { id, type: "number", min: 0, max: 126, inputMode: "numeric", value: String(train.step), "aria-label": say("step-of", train.train) });
    const stopHere = button("stop-here", () => track.place && give(`stop ${train.train} at ${track.place}`));
    const made = make("article", { class: "train" },
      make("h3", {}, make("a", { href: `#/train/${train.train}` }, say("train", train.train))),
      make("dl", {}, make("dt", {}, say("at")), at, make("dt", {}, say("speed")), speed, make("dt", {}, say("busy")), busy),
      make("div", { class: "does" },
        button("stop", () => give(`stop ${train.train}`)), stopHere,
        make("label", { htmlFor: id }, say("step")), step,
        button("set", () => give(`speed ${train.train} ${step.value}`))));
    made.style.borderLeftColor = colourOf(nth);
    if (cards.size === 0) $("#trains").replaceChildren();
    $("#trains").append(made);
    const parts = { made, at, speed, busy, stopHere };
    cards.set(train.train, parts);
    return parts;
  }

  function show(picture) {
    track.show(picture);
    picture.trains.forEach((train, nth) => {
      const parts = cards.get(train.train) ?? card(train, nth);
      put(parts.at, train.at ? `${train.at} ± ${train.half_mm.toFixed(0)} mm` : say("nowhere"));
      const speed = train.at ? `${train.speed_mm_per_s.toFixed(0)} ± ${train.speed_half_mm_per_s.toFixed(0)} mm/s, ` : "";
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
    }
    if (picture.trains.length === 0) put($("#trains"), say("none"));
  }

  function write(text) {
    const list = $("#said");
    const atEnd = list.scrollTop + list.clientHeight >= list.scrollHeight - 8;
    list.append(make("li", {}, text));
    while (list.childElementCount > LINES_SHOWN) list.firstElementChild.remove();
    if (atEnd) list.scrollTop = list.scrollHeight;
  }

  for (const { text } of live.lines.slice(-LINES_SHOWN)) write(text);
  return {
    picture: show,
    line: ({ text }) => write(text),
    gap: (count) => write(say("gap", count)),
    anew: () => $("#said").replaceChildren(),
  };
}
