// The odometry page: a dropped tachometer recording gets the same computation and charts as on the command line.

import { put } from "./dom.js";
import { SlideView } from "./slide_view.js";
import { send, withToken } from "./server.js";
import { LANGUAGE, say } from "./words.js";

/** The largest recording that the server accepts. */
const LARGEST = 64 * 1024 * 1024;

export function odometryPage(root) {
  const $ = (selector) => root.querySelector(selector);
  const place = $("#drop");
  const slide = new SlideView(root);
  /** The last vehicle file and the recording. */
  let [vehicle, recording] = [];

  async function take(files) {
    const given = [...files];
    const described = given.find(({ name }) => /\.toml$/i.test(name));
    if (described) {
      vehicle = await described.text();
      put($("#vehicle"), say("vehicle-is", described.name));
      $("#vehicle").hidden = false;
    }
    recording = given.find((file) => file !== described) ?? recording;
    if (recording) await walk(recording);
    else if (described) put($("#answer"), say("recording-wanted", described.name));
  }

  async function walk(file) {
    if (file.size > LARGEST) return put($("#answer"), say("too-large", file.name, Math.round(file.size / 1e6)));
    put($("#answer"), say("walking-file", file.name));
    try {
      const wished = new URLSearchParams({ language: LANGUAGE, ...(vehicle && { vehicle }) });
      const { page } = await send(`/api/odometry/${encodeURIComponent(file.name)}?${wished}`, file);
      $("#result").hidden = false;
      $("#result").title = say("odometry-of", file.name);
      $("#result").src = withToken(page);
      put($("#answer"), say("odometry-of", file.name));
    } catch (error) {
      $("#result").hidden = true;
      put($("#answer"), error.message);
    }
  }

  $("#file").addEventListener("change", (event) => take(event.target.files));
  place.addEventListener("dragover", (event) => {
    event.preventDefault();
    place.classList.add("over");
  });
  place.addEventListener("dragleave", () => place.classList.remove("over"));
  place.addEventListener("drop", (event) => {
    event.preventDefault();
    place.classList.remove("over");
    take(event.dataTransfer.files);
  });
  return { close: () => slide.close() };
}
