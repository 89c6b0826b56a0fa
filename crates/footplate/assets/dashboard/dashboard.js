// The frame of the pages: navigation, the data of the open page, and the state of the connection.

import "./halt.js";
import { Alarmed } from "./alarms.js";
import { make } from "./dom.js";
import { calibrationPage } from "./calibration_page.js";
import { editorPage } from "./editor_page.js";
import { healthPage } from "./health_page.js";
import { layoutPage } from "./layout_page.js";
import { Live } from "./live.js";
import { odometryPage } from "./odometry_page.js";
import { get } from "./server.js";
import { recordingsPage } from "./recordings_page.js";
import { schedulesPage } from "./schedules_page.js";
import { setupPage } from "./setup_page.js";
import { trainPage } from "./train_page.js";
import { say, translate } from "./words.js";

/** Interval between attempts to reach the server (ms). */
const AGAIN_MS = 3000;
/** Interval between two looks at who serves a railway that was set up here, and while another program takes over (ms). */
const MODE_MS = [3000, 300];
/** The pages that need no session. */
const WITHOUT_SESSION = ["setup", "editor"];
const PAGES = {
  layout: layoutPage, train: trainPage, calibration: calibrationPage, health: healthPage, recordings: recordingsPage, odometry: odometryPage,
  editor: editorPage, schedules: schedulesPage, setup: setupPage,
};
/** The header says how far the session is on disk when that is further back than this (s): a usual commit takes 0.02 s. */
const LATE_ON_DISK_S = 1;
const COLOURS = { connecting: "amber", connected: "green", lost: "red" };

const $ = (id) => document.getElementById(id);
const live = new Live();
const alarmed = new Alarmed($("alarmed"), live);
let open;

/** The page in the address, and its subject. */
function wanted() {
  const [name, what] = location.hash.replace(/^#\/?/, "").split("/");
  if (live.setUp.mode === "setting-up" && !WITHOUT_SESSION.includes(name)) return ["setup"];
  return Object.hasOwn(PAGES, name) && (name !== "setup" || live.setUp.mode !== "fixed") ? [name, what] : ["layout"];
}

function turn() {
  open?.close?.();
  const [name, what] = wanted();
  const page = $("page");
  page.replaceChildren($(`${name}-page`).content.cloneNode(true));
  page.dataset.page = name;
  translate(page);
  open = PAGES[name](page, live, what);
  if (live.picture) open.picture?.(live.picture);
  const here = `#/${name === "train" ? `train/${what}` : name}`;
  for (const link of $("pages").querySelectorAll("a")) {
    if (link.hash === here) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  scrollToOwn();
}

/** On a phone the links are wider than the screen. */
function scrollToOwn() {
  const own = $("pages").querySelector("[aria-current]");
  if (own) $("pages").scrollLeft = own.offsetLeft - ($("pages").clientWidth - own.offsetWidth) / 2;
}

/** A link for every train of the session. */
function links({ trains }) {
  const there = [...$("pages").querySelectorAll("[data-train]")].map((link) => link.dataset.train);
  if (there.join() === trains.map(({ train }) => train).join()) return;
  $("pages").querySelectorAll("[data-train]").forEach((link) => link.remove());
  let after = $("pages").querySelector("a");
  for (const { train } of trains) {
    const link = make("a", { href: `#/train/${train}`, "data-train": String(train) }, live.called(train));
    if (location.hash === link.hash) link.setAttribute("aria-current", "page");
    after.after(link);
    after = link;
  }
  scrollToOwn();
}

/** The state of the connection, with the number of alarms. */
function state() {
  const shown = $("connection");
  const isAlarmed = live.state === "connected" && alarmed.dangers > 0;
  shown.className = `state ${isAlarmed ? "red" : COLOURS[live.state]}`;
  shown.textContent = isAlarmed ? say("connected-alarmed", alarmed.dangers) : say(live.state);
}

/** How far the session is on disk, when that lags: in few words, which do not move what is below the header. */
function written({ t_s, written_until_s }) {
  const behind = written_until_s == null ? 0 : t_s - written_until_s;
  $("written").hidden = behind < LATE_ON_DISK_S;
  $("written").textContent = behind < LATE_ON_DISK_S ? "" : say("written-until", behind.toFixed(0));
}

/** Opens the pages again once another program serves them: the set-up, a calibration, or another session with its own layout. */
async function followMode() {
  const { instance } = await get("/api/setup").catch(() => ({}));
  if (instance && instance !== live.setUp.instance) location.reload();
  else setTimeout(followMode, MODE_MS[live.awaitsMode || live.state === "lost" ? 1 : 0]);
}

async function begin() {
  translate(document);
  live.setUp = await get("/api/setup");
  const { mode } = live.setUp;
  $("setup-link").hidden = mode === "fixed";
  setTimeout(followMode, MODE_MS[1]);
  if (mode === "setting-up") {
    document.body.classList.add("setting-up");
    $("connection").hidden = true;
    // The page stays the set-up when another program takes over.
    if (wanted()[0] === "setup" && !location.hash.startsWith("#/setup")) history.replaceState(null, "", "#/setup");
  } else {
    await live.begin();
    $("layout-name").textContent = live.layout.name;
  }
  turn();
  addEventListener("hashchange", () => {
    turn();
    $("page").focus({ preventScroll: true });
    scrollTo(0, 0);
  });
  live.addEventListener("picture", ({ detail }) => links(detail));
  live.addEventListener("picture", ({ detail }) => written(detail));
  live.addEventListener("state", state);
  alarmed.addEventListener("alarms", state);
  for (const kind of ["picture", "line", "passed", "ended", "alarm", "gap", "anew"]) {
    live.addEventListener(kind, ({ detail }) => open[kind]?.(detail));
  }
}

// Browsers keep pages only of secure origins: of this machine, not of another one over plain HTTP.
if ("serviceWorker" in navigator) {
  navigator.serviceWorker.register("worker.js").then(() => navigator.serviceWorker.ready).then(({ active }) => {
    const loaded = performance.getEntriesByType("resource").map(({ name }) => name);
    active.postMessage([`${location.origin}/`, `${location.origin}/index.html`, ...loaded]);
  }).catch(() => {});
}

begin().catch(() => {
  live.state = "lost";
  state();
  setTimeout(() => location.reload(), AGAIN_MS);
});
