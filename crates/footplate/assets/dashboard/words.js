// What the pages say, in the reader's language.

import { ENGLISH } from "./english.js";
import { GERMAN } from "./german.js";

const isGerman = navigator.language.toLowerCase().startsWith("de");
const WORDS = isGerman ? GERMAN : ENGLISH;

/** A text with its blanks filled in. */
export function say(word, ...blanks) {
  return (WORDS[word] ?? word).replace(/\{(\d)\}/g, (_, place) => String(blanks[Number(place)] ?? ""));
}

/** Puts every text of a part of the page in place. */
export function translate(root) {
  document.documentElement.lang = isGerman ? "de" : "en";
  for (const element of root.querySelectorAll("[data-word]")) element.textContent = say(element.dataset.word);
  for (const element of root.querySelectorAll("[data-label]")) {
    element.setAttribute("aria-label", say(element.dataset.label));
  }
}
