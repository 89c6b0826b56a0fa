// Small words for what a page is made of.

/** An element with its properties and what is in it. */
export function make(name, properties = {}, ...inside) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (key === "class") made.className = value;
    else if (key.includes("-")) made.setAttribute(key, value);
    else made[key] = value;
  }
  made.append(...inside);
  return made;
}

/** Writes a text where another one stood, and nothing where it stood already. */
export function put(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** A number with a true minus. */
export const shown = (value, digits = 0) => value.toFixed(digits).replace("-", "−").replace(/^−(0(\.0*)?)$/, "$1");
/** The same with its sign. */
export const signed = (value, digits = 0) => (value > 0 ? "+" : "") + shown(value, digits);
