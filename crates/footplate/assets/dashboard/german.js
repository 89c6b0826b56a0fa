// The words of the pages in German.

export const GERMAN = {
  // the frame
  "connecting": "verbindet …", "connected": "live", "lost": "Verbindung verloren, neuer Versuch", "pages": "Seiten",
  "halt": "Nothalt", "halt-hint": "oder die Leertaste: alle Züge stehen, Strom aus",
  "halt-asked": "Nothalt verlangt, noch nicht bestätigt",
  "halt-taken": "allen Zügen ist Halt befohlen, der Strom geht aus",
  "halt-failed": "der Nothalt wurde NICHT angenommen: {0}",
  "chart-keys": "Pfeiltasten gehen die Werte entlang.", "skip": "Zur Seite",

  // layout
  "layout": "Anlage", "zoom": "Vergrößerung", "zoom-in": "Größer", "zoom-out": "Kleiner", "zoom-all": "Alles",
  "track": "Die Anlage mit ihren Zügen; auf das Gleis drücken, um einen Ort zu nennen",
  "pick-hint": "Auf das Gleis drücken, um einen Ort zu nennen.", "picked": "{0}: unten einen Zug wählen", "trains": "Züge",
  "said": "Gesagt", "order": "Auftrag", "send": "Senden", "speed": "Tempo", "at": "bei", "busy": "beschäftigt mit", "rests": "hält bei",
  "nowhere": "niemand weiß, wo", "stop": "Halt", "stop-here": "Halt bei {0}", "step": "Stufe", "set": "Fahren",
  "none": "Hier wird kein Zug gefahren.", "gap": "{0} Zeilen wurden verpasst", "unread": "kann nicht gesendet werden: {0}",
  "step-of": "Stufe von Zug {0}", "at-step": "Stufe {0}", "train": "Zug {0}",

  // a train
  "no-such-train": "Zug {0} wird hier nicht gefahren.", "sent": "gesendet: {0}", "refused": "abgelehnt: {0}",
  "picked-for": "{0}: Zug {1} dort anhalten oder rechtzeitig ankommen lassen", "drive": "Fahren",
  "if-stopped": "bei Halt jetzt", "rest-way": "steht {0} ± {1} mm weiter, bei {2}, in {3} s", "at-rest": "steht",
  "due": "nächster Kontakt", "due-in": "{0} in {1} s ± {2} ms", "found": "gefunden", "reverse": "Wenden",
  "slower": "Eine Stufe langsamer", "faster": "Eine Stufe schneller", "hold": "Halten", "hold-speed": "Tempo, das zu halten ist (mm/s)",
  "follow": "Folgen", "leader": "Zug, dem zu folgen ist", "gap-behind": "Sekunden dahinter", "arrive": "Ankommen",
  "arrive-at": "Ort der Ankunft", "arrive-in": "in (s)", "move": "Vorrücken", "move-way": "Weg (mm)",
  "window": "Gezeigte Zeit", "last-30": "30 Sekunden", "last-60": "1 Minute", "last-300": "5 Minuten",
  "over-time": "Über der Zeit", "predictions": "Vorhersagen", "contact": "Kontakt", "time-s": "Zeit (s)",
  "late-ms": "später (ms)", "beside-mm": "daneben (mm)", "mean-speed": "Mittel (mm/s)", "missed": "verpasst", "stops": "Anhalten",
  "note-speed": "Geschätztes Tempo mit seinem 95-%-Band; Punkte: mittleres Tempo zwischen zwei Kontakten, allein aus Länge und Uhr. Gestrichelt: eine andere Stufe wurde befohlen.",
  "note-sure": "Getönt: wo der Zug neben der Schätzung sein kann, 95 %. Punkte: wo er war, als ein Kontakt es sagte.",
  "note-way": "Der Weg, seit der Zug gefunden wurde, und die Kontakte darauf.",
  "note-late": "Wie viel später als vorhergesagt jeder Kontakt schloss, mit dem vorher genannten 95-%-Intervall.",
  "note-stops": "Der Weg bis zum Stand nach Tempo, 95 % der Halte getönt; Punkte: Stufen, von denen Halte gemessen sind, mit dem, was davon nicht bekannt ist. Senkrecht: das Tempo jetzt.",
  "chart-speed": "Tempo über der Zeit", "chart-sure": "Wie sicher der Ort ist", "chart-way": "Weg über der Zeit",
  "chart-late": "Vorhersagefehler über der Zeit", "chart-stops": "Anhalteweg nach Tempo",
  "axis-time": "Zeit seit Beginn der Sitzung (s)", "axis-speed": "Tempo (mm/s)", "axis-sure": "daneben (mm)",
  "axis-way": "Weg (m)", "axis-late": "später (ms)", "axis-from-speed": "Tempo (mm/s)", "axis-stop": "Weg bis zum Stand (mm)",
  "band-95": "95 %", "estimated": "geschätzt", "mean-between": "zwischen Kontakten", "at-contact": "an einem Kontakt",
  "later": "später", "stop-95": "95 % der Halte", "stop-way": "Weg bis zum Stand", "stop-measured": "gemessen",
  "stops-made": "Gemachte Halte", "order-given": "Auftrag", "rests-at": "steht bei", "error-mm": "daneben (mm)", "promised": "versprochen (mm)",
  "truth-mm": "in Wahrheit (mm)", "did-stop": "Halt", "did-move": "Vorrücken", "did-arrive": "Ankunft", "did-speed": "Tempo",
  "did-reverse": "Wenden", "did-hold": "Halten", "did-follow": "Folgen",
};
