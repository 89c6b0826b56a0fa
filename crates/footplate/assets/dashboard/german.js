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

  // calibration
  "calibration": "Kalibrierung", "of-train": "Zug", "driven-with": "Womit er gefahren wird",
  "note-driven-with": "Das Modell, das den Zug jetzt fährt; es lernt, während er fährt. Intervalle sind 95 %.",
  "note-speeds": "Gleichmäßiges Tempo je Stufe, nach der Seite, von der die Stufe erreicht wurde.",
  "note-stops-by-step": "Der Weg bis zum Stand von jeder Stufe, mit dem Intervall, in dem 95 von 100 Halten enden.",
  "reached-from": "erreicht von", "side-below": "unten", "side-above": "oben", "contacts": "Kontakte", "not-known": "davon unbekannt (mm)",
  "in-s": "in (s)", "stops-count": "Halte", "why": "Warum?", "why-of": "Warum ist {0} so?", "in-store": "Was alle Aufzeichnungen sagen",
  "note-store": "Errechnet aus allem, was der Speicher von diesem Zug hat, ohne das Ausgeschlossene, mit demselben Abgleich wie `footplate calibrate --store`.",
  "note-stored": "Gleichmäßiges Tempo je Stufe mit seinem 95-%-Intervall.", "change-shown": "Gezeigter Tempowechsel",
  "note-law": "Das Gesetz dieses Wechsels und die mittleren Tempi zwischen Kontakten.", "note-beyond": "Wie weit Kontakte jenseits des Gesetzes liegen, mit 95 % dessen, was davon nicht bekannt ist.",
  "law": "Gesetz", "law-up": "beim Schnellerwerden", "law-down": "beim Langsamerwerden", "law-from": "aus {0} Wechseln, Fehler an Zurückgehaltenem {1} mm",
  "why-so": "Warum ist diese Zahl so?", "number-asked": "Zahl", "reason": "Grund, um auszuschließen oder zurückzuholen", "reason-first": "Erst einen Grund schreiben.",
  "exclude": "Ausschließen", "restore": "Zurückholen", "exclude-event": "Ereignis {0} ausschließen", "restore-event": "Ereignis {0} zurückholen", "thinks": "Marke",
  "excluded": "ausgeschlossen: Ereignis {0}; es bleibt im Speicher und kann zurückgeholt werden", "restored": "zurückgeholt: Ereignis {0}", "marked": "Von Menschen ausgeschlossen",
  "under-way": "Eine Kalibrierung läuft", "about": "Versuch", "because": "warum", "time-left": "Zeit übrig", "time-used": "Verbrauchte Zeit",
  "expected": "erwartete Genauigkeit", "left-of": "{0} s von {1} s Gleiszeit", "expected-at": "bei Stufe {0}: Halte auf {1} mm, Tempo auf {2} % (95 %)",
  "chart-speeds": "Tempo je Stufe", "chart-stops-by-step": "Anhalteweg je Stufe", "chart-stored": "Tempo je Stufe aus Aufzeichnungen",
  "chart-law": "Tempowechsel", "chart-beyond": "Jenseits des Gesetzes", "axis-step": "Stufe", "axis-since": "seit dem Befehl (s)",
  "axis-beyond": "jenseits (mm)", "beyond-law": "jenseits des Gesetzes", "from-below": "von unten", "from-above": "von oben", "from-unknown": "Seite nicht aufgezeichnet",

  // health
  "health": "Befinden", "predicted": "Vorhersagen", "rms-mm": "Fehler, rms (mm)", "mean-mm": "Mittel (mm)", "inside-95": "im 95-%-Intervall",
  "drift": "auf dem Weg zum Driftalarm", "drift-of": "Zug {0}: {1} % des Wegs zum Driftalarm", "too-few": "noch zu wenige",
  "note-errors": "Wo jeder Zug neben der Schätzung war, als ein Kontakt es sagte.", "note-doubts": "Fehler im Maß des vorher genannten Intervalls: 95 von 100 gehören ins getönte Band.",
  "axis-doubts": "Fehler / halbes Intervall", "chart-errors": "Vorhersagefehler aller Züge", "chart-doubts": "Vorhersagefehler nach ihren Intervallen",
  "alarms": "Alarme", "no-alarm": "Bisher keiner.", "line": "Leitung und Schleife", "chart-poll": "Abfrageperiode", "chart-first-byte": "Erstes Byte", "chart-turn": "Steuerschleife",
  "note-poll": "Von einem Lesen der Kontakte zum nächsten, ohne Befehl dazwischen.", "note-first-byte": "Vom letzten Bit einer Frage bis zum ersten Byte der Antwort.",
  "note-turn": "Wie lange die Steuerschleife beschäftigt ist, wenn sie aufwacht.", "axis-ms": "ms", "axis-count": "Male", "times": "Male",
  "quantiles": "{0} Male: Median {1} ms, 95 % {2}, 99 % {3}, längstes {4}", "none-yet": "Noch nichts gezählt.",

  // recordings
  "recordings": "Aufzeichnungen", "session": "Sitzung", "events": "Ereignisse", "excluded-count": "ausgeschlossen", "decided-by": "entschieden von",
  "machine-drive": "Fahren", "machine-calibrate": "Kalibrierung", "machine-tour": "Vorführung", "choose-two": "Eine Sitzung wählen, um sie noch einmal zu durchlaufen, oder zwei, um sie zu vergleichen.",
  "no-recordings": "Der Speicher hat noch keine Aufzeichnung.", "walking": "wird noch einmal durchlaufen …", "walked-track": "Die Anlage von {0}", "play": "Abspielen", "pause": "Anhalten",
  "moment": "Augenblick", "compared": "Verglichen", "note-recorded": "Wo Züge neben der Schätzung waren, als ein Kontakt es sagte; senkrecht: der gezeigte Augenblick.",
  "chart-recorded": "Vorhersagefehler der Sitzungen", "axis-session": "Zeit seit ihrem ersten Bild (s)",

  // odometry
  "odometry": "Odometrie", "drop-here": "Die Aufzeichnung eines Wegimpulsgebers hierher ziehen: CSV oder Parquet.", "or-choose": "Oder eine Datei wählen:",
  "note-odometry": "Spalten t_s, pulses_1, pulses_2 und mehr; sie wird durchlaufen wie von `footplate odometry`, für zwei angetriebene Radsätze mit 80 Zähnen. Höchstens 64 MB. Die Seite des Ergebnisses ist englisch.",
  "walking-file": "{0} wird durchlaufen …", "odometry-of": "Odometrie von {0}", "too-large": "{0} ist zu groß: {1} MB; höchstens 64 MB werden genommen",
};
