// The texts of the pages, in the reader's language.

import { put } from "./dom.js";
import { ENGLISH } from "./english.js";
import { GERMAN } from "./german.js";
import { logInGerman } from "./german_log.js";
import { inGerman } from "./german_report.js";

const isGerman = navigator.language.toLowerCase().startsWith("de");
const WORDS = isGerman ? GERMAN : ENGLISH;
/** The reader's language, as requested from the server. */
export const LANGUAGE = isGerman ? "de" : "en";

/** A text with its values filled in. */
export function say(word, ...blanks) {
  return (WORDS[word] ?? word).replace(/\{(\d)\}/g, (_, place) => String(blanks[Number(place)] ?? ""));
}

/** A report of another verb in the reader's language. */
export const inOwnLanguage = (report) => (isGerman ? inGerman(report) : report);

/** A line of the log in the reader's language. */
export const logged = (line) => (isGerman ? logInGerman(line) : line);

/** Fills in all texts of a part of the page. */
export function translate(root) {
  document.documentElement.lang = LANGUAGE;
  for (const element of root.querySelectorAll("[data-word]")) put(element, say(element.dataset.word));
  for (const element of root.querySelectorAll("[data-label]")) {
    element.setAttribute("aria-label", say(element.dataset.label));
  }
}
