// The emergency stop: on all pages, by one key, and never shown as more certain than it is.

import { ask, get, order } from "./server.js";
import { say } from "./words.js";

/** Interval between two requests for the power state (ms). */
const LOOKED_EVERY_MS = 1000;
const banner = document.getElementById("halted");
const powerOn = document.getElementById("power-on");
/** An emergency stop of this page that the link has not confirmed yet. */
let asked = false;

function tell(word, ...blanks) {
  const text = say(word, ...blanks);
  banner.hidden = false;
  if (banner.textContent !== text) banner.textContent = text;
}

export async function halt() {
  asked = true;
  tell("halt-asked");
  try {
    await ask("/api/emergency-stop", {});
    tell("halt-taken");
  } catch (error) {
    tell("halt-failed", error.message);
  }
  setTimeout(look, LOOKED_EVERY_MS / 2);
}

/** How certain it is that the track has no power: most stations report it, a 6051 only answers. */
function wordOf({ has_answered: hasAnswered, reports_power: reportsPower, reported }) {
  if (!reportsPower) return hasAnswered ? "halt-heard" : "halt-told";
  if (reported === true) return "halt-still-on";
  return reported === false ? "halt-confirmed" : "halt-told";
}

/** While the track power is off, every page shows it and how certain that is, whatever switched it off. */
async function look() {
  let power;
  try {
    ({ power } = await get("/api/line"));
  } catch {
    // The state of the connection shows the failure; the banner keeps its text.
    return;
  }
  const isOff = power && !power.is_on;
  const wentOff = power?.is_on && power.reported === false;
  powerOn.hidden = !isOff && !wentOff;
  if (isOff) {
    asked = false;
    tell(wordOf(power));
  } else if (wentOff) {
    asked = false;
    tell("halt-went-off");
  } else if (!asked) {
    banner.hidden = true;
  }
}

document.getElementById("halt").addEventListener("click", halt);
powerOn.addEventListener("click", () => order("power on").then(look, ({ message }) => tell("power-failed", message)));
document.addEventListener("keydown", (event) => {
  // In a text field or on a button, the space bar has its usual function.
  const writes = event.target.closest?.("input:not([type=range]), textarea, select, button, summary");
  if (event.code === "Space" && !writes && !event.repeat && !document.body.classList.contains("setting-up")) {
    event.preventDefault();
    halt();
  }
});
setInterval(() => document.body.classList.contains("setting-up") || look(), LOOKED_EVERY_MS);
