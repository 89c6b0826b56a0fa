// The emergency stop: always there, one key, and never shown as more certain than it is.

import { ask, get } from "./server.js";
import { say } from "./words.js";

/** Between two looks at what the station was told (ms). */
const LOOKED_EVERY_MS = 1000;
const banner = document.getElementById("halted");
/** An emergency stop of this page that the line has not been seen to carry yet. */
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

/** Whoever took the power: as long as it is off, every page says so, and how sure that is. */
async function look() {
  let power;
  try {
    ({ power } = await get("/api/line"));
  } catch {
    // The state of the connection says so; what the banner says stays.
    return;
  }
  if (power && !power.is_on) {
    asked = false;
    tell(power.has_answered ? "halt-heard" : "halt-told");
  } else if (!asked) {
    banner.hidden = true;
  }
}

document.getElementById("halt").addEventListener("click", halt);
document.addEventListener("keydown", (event) => {
  // Where somebody writes or presses a button, the space bar is theirs.
  const writes = event.target.closest?.("input:not([type=range]), textarea, select, button, summary");
  if (event.code === "Space" && !writes && !event.repeat) {
    event.preventDefault();
    halt();
  }
});
setInterval(look, LOOKED_EVERY_MS);
