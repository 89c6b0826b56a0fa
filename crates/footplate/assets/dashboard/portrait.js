// The pictures that an owner gives to trains. They stay in this browser.

import { make } from "./dom.js";
import { say } from "./words.js";

/** The larger side of a kept picture (pixels): twice its size on the page. */
const SIDE = 240;
const QUALITY = 0.8;
const keyOf = (train) => `portrait-${train}`;

function kept(train) {
  try {
    return localStorage.getItem(keyOf(train));
  } catch {
    // A browser without storage shows no pictures.
    return null;
  }
}

/** The picture of a train; nothing without one. */
export function portrait(train) {
  const src = kept(train);
  return src ? [make("img", { class: "portrait", src, alt: "" })] : [];
}

/** Reads a picture, and keeps a small copy of it. */
async function keep(train, file) {
  const picture = await createImageBitmap(file);
  const scale = Math.min(1, SIDE / Math.max(picture.width, picture.height));
  const canvas = make("canvas", { width: Math.round(picture.width * scale), height: Math.round(picture.height * scale) });
  canvas.getContext("2d").drawImage(picture, 0, 0, canvas.width, canvas.height);
  localStorage.setItem(keyOf(train), canvas.toDataURL("image/jpeg", QUALITY));
}

/** The picture of a train in a place of its page, with what chooses or removes it. */
export function showPortrait(place, train) {
  const answer = make("output", { class: "answer bad", role: "status" });
  const file = make("input", { type: "file", accept: "image/*" });
  file.addEventListener("change", async () => {
    try {
      await keep(train, file.files[0]);
      showPortrait(place, train);
    } catch {
      answer.textContent = say("portrait-unread");
    }
  });
  const chooses = make("label", {}, make("span", {}, say(kept(train) ? "portrait-other" : "portrait-choose")), file);
  const removes = make("button", { type: "button" }, say("portrait-remove"));
  removes.addEventListener("click", () => {
    localStorage.removeItem(keyOf(train));
    showPortrait(place, train);
  });
  place.replaceChildren(...portrait(train), chooses, ...(kept(train) ? [removes] : []), answer);
}
