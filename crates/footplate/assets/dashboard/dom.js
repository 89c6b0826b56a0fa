// Short functions that build pages.

import { rounded } from "./chart.js";

/** An element with its properties and children. */
export function make(name, properties = {}, ...inside) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (key === "class") made.className = value;
    else if (key.includes("-")) made.setAttribute(key, value);
    else made[key] = value;
  }
  made.append(...inside.map(prose));
  return made;
}

/** A text, in which commands and names of buttons stand between backticks, as one node; other nodes as they are. */
function prose(text) {
  const parts = typeof text === "string" ? text.split("`") : [];
  if (parts.length < 2) return text;
  return make("span", {}, ...parts.map((part, at) => (at % 2 ? make("code", {}, part) : part)));
}

const SVG = "http://www.w3.org/2000/svg";

/** A part of a drawing, appended to another one. */
export function svg(name, attributes, parent) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  parent?.append(made);
  return made;
}

/** Replaces the text of an element, unless it is the same. */
export function put(element, text) {
  const node = prose(String(text ?? ""));
  if (element.textContent !== (node.textContent ?? node)) element.replaceChildren(node);
}

/** A number in the reader's language, with a true minus. */
export const shown = (value, digits = 0) => rounded(value, digits);
/** The same with a sign. */
export const signed = (value, digits = 0) => (value > 0 ? "+" : "") + shown(value, digits);
