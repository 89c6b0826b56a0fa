// What the pages say, in the reader's language.

const ENGLISH = {
  "connecting": "connecting …", "connected": "live", "lost": "connection lost, trying again",
  "halt": "Emergency stop", "halt-hint": "or the space bar: all trains stand, power off",
  "halt-asked": "emergency stop asked for, not confirmed yet", "halt-taken": "all trains were told to stand, and the power goes off",
  "halt-failed": "the emergency stop was NOT taken: {0}", "layout": "Layout", "zoom": "Zoom", "zoom-in": "Zoom in",
  "zoom-out": "Zoom out", "zoom-all": "All", "track": "The layout with its trains; press on the track to name a place",
  "pick-hint": "Press on the track to name a place.", "picked": "{0}: choose a train below", "trains": "Trains",
  "said": "Said", "order": "Order", "send": "Send", "speed": "speed", "at": "at", "busy": "busy with", "rests": "will rest",
  "nowhere": "nobody knows where", "stop": "Stop", "stop-here": "Stop at {0}", "step": "Step", "set": "Set",
  "hold": "Hold", "none": "No train is driven here.", "gap": "{0} lines were missed", "unread": "cannot be sent: {0}",
  "step-of": "Step of train {0}", "at-step": "step {0}",
};

const GERMAN = {
  "connecting": "verbindet …", "connected": "live", "lost": "Verbindung verloren, neuer Versuch",
  "halt": "Nothalt", "halt-hint": "oder die Leertaste: alle Züge stehen, Strom aus",
  "halt-asked": "Nothalt verlangt, noch nicht bestätigt", "halt-taken": "allen Zügen ist Halt befohlen, der Strom geht aus",
  "halt-failed": "der Nothalt wurde NICHT angenommen: {0}", "layout": "Anlage", "zoom": "Vergrößerung", "zoom-in": "Größer",
  "zoom-out": "Kleiner", "zoom-all": "Alles", "track": "Die Anlage mit ihren Zügen; auf das Gleis drücken, um einen Ort zu nennen",
  "pick-hint": "Auf das Gleis drücken, um einen Ort zu nennen.", "picked": "{0}: unten einen Zug wählen", "trains": "Züge",
  "said": "Gesagt", "order": "Auftrag", "send": "Senden", "speed": "Tempo", "at": "bei", "busy": "beschäftigt mit", "rests": "hält bei",
  "nowhere": "niemand weiß, wo", "stop": "Halt", "stop-here": "Halt bei {0}", "step": "Stufe", "set": "Fahren",
  "hold": "Halten", "none": "Hier wird kein Zug gefahren.", "gap": "{0} Zeilen wurden verpasst", "unread": "kann nicht gesendet werden: {0}",
  "step-of": "Stufe von Zug {0}", "at-step": "Stufe {0}",
};

const isGerman = navigator.language.toLowerCase().startsWith("de");
const WORDS = isGerman ? GERMAN : ENGLISH;

/** A text with its blanks filled in. */
export function say(word, ...blanks) {
  return (WORDS[word] ?? word).replace(/\{(\d)\}/g, (_, place) => String(blanks[Number(place)] ?? ""));
}

/** Puts every text of the page in place. */
export function translate(root) {
  document.documentElement.lang = isGerman ? "de" : "en";
  for (const element of root.querySelectorAll("[data-word]")) element.textContent = say(element.dataset.word);
  for (const element of root.querySelectorAll("[data-label]")) {
    element.setAttribute("aria-label", say(element.dataset.label));
  }
}
