// The live page: what the server sends is shown, and what people want is sent.

import { Track, colourOf } from "./track.js";
import { View } from "./view.js";
import { say, translate } from "./words.js";

/** Lines that are kept on the page. */
const LINES_SHOWN = 400;

const $ = (id) => document.getElementById(id);
const token = new URLSearchParams(location.search).get("token");
let track, place;
let newest, drawing = false;

translate(document);

async function ask(path, body) {
  const headers = { "Content-Type": "application/json", ...(token && { Authorization: `Bearer ${token}` }) };
  const answer = await fetch(path, { method: "POST", headers, body: JSON.stringify(body) });
  const said = await answer.json().catch(() => ({}));
  if (!answer.ok) throw new Error(said.error ?? answer.statusText);
}

async function order(line) {
  $("answer").textContent = "";
  try {
    await ask("/api/orders", { line });
    return true;
  } catch (error) {
    $("answer").textContent = say("unread", error.message);
    return false;
  }
}

async function halt() {
  const banner = $("halted");
  banner.hidden = false;
  banner.textContent = say("halt-asked");
  try {
    await ask("/api/emergency-stop", {});
    banner.textContent = say("halt-taken");
  } catch (error) {
    banner.textContent = say("halt-failed", error.message);
  }
}

$("halt").addEventListener("click", halt);
document.addEventListener("keydown", (event) => {
  const writes = event.target.closest?.("input, textarea, select, button");
  if (event.code === "Space" && !writes && !event.repeat) {
    event.preventDefault();
    halt();
  }
});

$("order").addEventListener("submit", async (event) => {
  event.preventDefault();
  const field = $("line");
  if (field.value.trim() && (await order(field.value))) field.value = "";
});

const cards = new Map();

function card(train, nth) {
  const made = document.createElement("article");
  made.className = "train";
  made.style.borderLeftColor = colourOf(nth);
  made.innerHTML = `<h3></h3><dl><dt></dt><dd></dd><dt></dt><dd></dd><dt></dt><dd></dd></dl>
    <div class="does"><button type="button"></button><button type="button"></button>
    <label></label><input type="number" min="0" max="126" inputmode="numeric"><button type="button"></button></div>`;
  made.querySelector("h3").textContent = String(train.train);
  const [at, speed, busy] = made.querySelectorAll("dd");
  ["at", "speed", "busy"].forEach((word, i) => { made.querySelectorAll("dt")[i].textContent = say(word); });
  const [stop, stopHere, set] = made.querySelectorAll("button");
  const [label, step] = [made.querySelector("label"), made.querySelector("input")];
  step.id = `step-${train.train}`;
  label.htmlFor = step.id;
  label.textContent = say("step");
  step.setAttribute("aria-label", say("step-of", train.train));
  step.value = String(train.step);
  stop.textContent = say("stop");
  set.textContent = say("set");
  stop.addEventListener("click", () => order(`stop ${train.train}`));
  set.addEventListener("click", () => order(`speed ${train.train} ${step.value}`));
  stopHere.addEventListener("click", () => place && order(`stop ${train.train} at ${place}`));
  $("trains").append(made);
  const parts = { at, speed, busy, stopHere };
  cards.set(train.train, parts);
  return parts;
}

function put(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

function show() {
  drawing = false;
  const picture = newest;
  track.show(picture);
  picture.trains.forEach((train, nth) => {
    const parts = cards.get(train.train) ?? card(train, nth);
    put(parts.at, train.at ? `${train.at} ± ${train.half_mm.toFixed(0)} mm` : say("nowhere"));
    const speed = `${train.speed_mm_per_s.toFixed(0)} ± ${train.speed_half_mm_per_s.toFixed(0)} mm/s`;
    put(parts.speed, `${speed}, ${say("at-step", train.step)}`);
    const rests = train.promise_mm;
    const ends = rests ? ` (${say("rests")} ${rests[1].toFixed(0)} … ${rests[2].toFixed(0)} mm)` : "";
    put(parts.busy, train.doing ? train.doing + ends : "–");
    parts.stopHere.disabled = !place;
    put(parts.stopHere, say("stop-here", place ?? "…"));
  });
  if (picture.trains.length === 0) put($("trains"), say("none"));
}

function write(text) {
  const list = $("said");
  const atEnd = list.scrollTop + list.clientHeight >= list.scrollHeight - 8;
  const line = document.createElement("li");
  line.textContent = text;
  list.append(line);
  while (list.childElementCount > LINES_SHOWN) list.firstElementChild.remove();
  if (atEnd) list.scrollTop = list.scrollHeight;
}

function state(word, colour) {
  const shown = $("connection");
  shown.className = `state ${colour}`;
  shown.textContent = say(word);
}

function listen() {
  const events = new EventSource(token ? `/api/events?token=${encodeURIComponent(token)}` : "/api/events");
  events.addEventListener("open", () => state("connected", "green"));
  events.addEventListener("error", () => state("lost", "red"));
  events.addEventListener("picture", (event) => {
    newest = JSON.parse(event.data);
    // One drawing a frame, of the newest picture.
    if (newest && !drawing) {
      drawing = true;
      requestAnimationFrame(show);
    }
  });
  events.addEventListener("line", (event) => write(JSON.parse(event.data).text));
  events.addEventListener("gap", (event) => write(say("gap", event.data)));
}

async function begin() {
  const headers = token ? { Authorization: `Bearer ${token}` } : {};
  const layout = await (await fetch("/api/layout", { headers })).json();
  $("layout-name").textContent = layout.name;
  const svg = $("track");
  track = new Track(svg, layout);
  const view = new View(svg, track.whole, (point) => {
    place = track.nearest(point);
    $("picked").textContent = place ? say("picked", place) : say("pick-hint");
  });
  $("zoom-in").addEventListener("click", () => view.zoom(0.7));
  $("zoom-out").addEventListener("click", () => view.zoom(1.4));
  $("zoom-all").addEventListener("click", () => view.all());
  listen();
}

begin().catch(() => {
  state("lost", "red");
  setTimeout(() => location.reload(), 3000);
});
