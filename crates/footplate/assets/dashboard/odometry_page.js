// A recording of a tachometer, dropped here: the same walk and the same charts as on the command line.

import { put } from "./dom.js";
import { SlideView } from "./slide_view.js";
import { send, withToken } from "./server.js";
import { LANGUAGE, say } from "./words.js";

/** The largest recording that the server takes. */
const LARGEST = 64 * 1024 * 1024;

export function odometryPage(root) {
  const $ = (selector) => root.querySelector(selector);
  const place = $("#drop");
  const slide = new SlideView(root);

  async function walk(file) {
    if (!file) return;
    if (file.size > LARGEST) return put($("#answer"), say("too-large", file.name, Math.round(file.size / 1e6)));
    put($("#answer"), say("walking-file", file.name));
    try {
      const { page } = await send(`/api/odometry/${encodeURIComponent(file.name)}?language=${LANGUAGE}`, file);
      $("#result").hidden = false;
      $("#result").title = say("odometry-of", file.name);
      $("#result").src = withToken(page);
      put($("#answer"), say("odometry-of", file.name));
    } catch (error) {
      $("#result").hidden = true;
      put($("#answer"), error.message);
    }
  }

  $("#file").addEventListener("change", (event) => walk(event.target.files[0]));
  place.addEventListener("dragover", (event) => {
    event.preventDefault();
    place.classList.add("over");
  });
  place.addEventListener("dragleave", () => place.classList.remove("over"));
  place.addEventListener("drop", (event) => {
    event.preventDefault();
    place.classList.remove("over");
    walk(event.dataTransfer.files[0]);
  });
  return { close: () => slide.close() };
}
