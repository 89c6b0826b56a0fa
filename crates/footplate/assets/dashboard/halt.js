// The emergency stop: always there, one key, and never shown as more certain than it is.

import { ask } from "./server.js";
import { say } from "./words.js";

const banner = document.getElementById("halted");

export async function halt() {
  banner.hidden = false;
  banner.textContent = say("halt-asked");
  try {
    await ask("/api/emergency-stop", {});
    banner.textContent = say("halt-taken");
  } catch (error) {
    banner.textContent = say("halt-failed", error.message);
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
