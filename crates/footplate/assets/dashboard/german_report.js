// The reports of `footplate doctor` and `footplate calibrate` in German, line by line. A line that is not known stays English.

/** The width of the first column of a report of the doctor, in characters. */
const LABEL = 14;
const LABELS = {
  "line": "Leitung", "interface": "Interface", "replies": "Antworten", "polls": "Abfragen", "poll period": "Periode", "first byte": "Antwortzeit",
  "command": "Befehl", "requests": "Anfragen", "answers": "Antworten", "noise": "Störungen", "station": "Zentrale", "sensors": "Rückmelder", "delay": "Verzögerung",
  "track": "Gleis", "railcom": "RailCom", "checksums": "Prüfsummen", "on the bus": "Am Bus", "locomotive": "Lok", "cycle": "Zyklus",
  "server": "Server", "bus": "Bus", "system": "System",
};
/** Phrases in the second column, the longest first where one is part of another. */
const PHRASES = [
  ["sensor modules, hand-shake", "Rückmeldemodule, Handshake"], ["by the clock", "nach der Uhr"], ["answers reads of single sensor modules", "beantwortet das Lesen einzelner Rückmeldemodule"],
  ["answers reads of all sensor modules only: every read takes as long as all of them, and a sensor that is occupied for less may be missed",
    "beantwortet nur das Lesen aller Rückmeldemodule zugleich: jede Abfrage dauert so lange wie alle, und kürzere Meldungen können fehlen"],
  ["not seen long enough to know which reads it answers", "zu kurz beobachtet, um zu wissen, was es beantwortet"],
  [/come up to (\S+) ms later than their bytes take/, "kommen bis zu $1 ms später, als ihre Bytes dauern"], ["without a whole reply", "ohne vollständige Antwort"],
  ["without an answer", "ohne Antwort"], ["median", "Median"], ["longest", "längste"], [/costs (\S+) ms of the line \(one byte; two cost 5 ms more\)/, "kostet $1 ms der Leitung (ein Byte; zwei kosten 5 ms mehr)"],
  ["none was seen between two polls", "keiner zwischen zwei Abfragen beobachtet"], ["bytes could not be read", "Bytes waren nicht lesbar"], ["unknown", "unbekannt"],
  [/(\d+) inputs,/, "$1 Eingänge,"], ["occupied", "besetzt"], [/(\d+) reports/, "$1 Meldungen"], ["with their time", "mit Zeitangabe"],
  [/of reports taken to be (\S+) to (\S+) ms/, "der Meldungen, angenommen: $1 bis $2 ms"], ["as on firmware", "wie bei Firmware"],
  [/hardware (\S+), firmware (\S+), serial number/, "Hardware $1, Firmware $2, Seriennummer"], [/serial number (\S+), does not say what it is/, "Seriennummer $1, nennt ihre Art nicht"],
  ["does not say what it is", "nennt seine Art nicht"], ["station at", "Zentrale bei"], [/train (\d+): (\d+) received, (\d+) errors/, "Zug $1: $2 empfangen, $3 Fehler"], ["reports speed", "meldet Tempo"],
  ["wrong; they are not relied on", "falsch; sie werden nicht verwendet"], [/number (\S+), version/, "Nummer $1, Version"], [/, number (0x)/, ", Nummer $1"],
  [/of sensors taken to be (\S+) ms, as set in the station \(scan\)/, "der Rückmelder, angenommen: $1 ms, wie in der Zentrale eingestellt (scan)"],
  [/(\d+) in slot (\d+), used by a throttle/, "$1 in Slot $2, von einem Fahrregler belegt"], [/(\d+) in slot (\d+), not in use/, "$1 in Slot $2, frei"], [/refused (\d+) messages/, "$1 Nachrichten abgelehnt"],
  [/as fast as usual: 99 of 100 answers within (\S+) ms/, "so schnell wie üblich: 99 von 100 Antworten innerhalb von $1 ms"],
  [/(\S+) ms slower than usual \((\S+) ms\), (\S+) % lost: a command may need (\d+) more tries/, "$1 ms langsamer als üblich ($2 ms), $3 % verloren: ein Befehl kann $4 weitere Versuche brauchen"],
  [/no participant on the CAN bus has named itself; check the station's address, or the adapter and its cable/, "kein Teilnehmer am CAN-Bus hat sich gemeldet; Adresse der Zentrale oder Adapter und Kabel prüfen"],
  ["a Central Station", "eine Central Station"], ["a track processor", "ein Gleisprozessor"], ["none", "keine"],
];
/** Lines of the result of a calibration. */
const RESULT = [
  [/^Train (\d+) on (.+?): (\S+) of track time, (.*)$/, (_, train, layout, time, why) => `Zug ${train} auf ${layout}: ${time} Fahrzeit, ${WHYS[why] ?? why}`],
  [/^ {2}step {2}reached from {3}speed mm\/s {9}stop mm {5}std dev {3}95 % of stops within {3}stops$/, " Stufe  erreicht von   Tempo mm/s     Halteweg mm    Streuung   95 % der Halte unter   Halte"],
  [/^( +\d+ {2})below {5}/, "$1unten     "], [/^( +\d+ {2})above {5}/, "$1oben      "],
  [/^value ± one standard deviation of the estimate; std dev is the repeatability of a single stop$/, "Wert ± eine Standardabweichung der Schätzung; Streuung: die Wiederholgenauigkeit eines einzelnen Halts"],
  [/^no step has been measured$/, "noch keine Fahrstufe gemessen"],
];
const WHYS = {
  "the time budget is used up": "die vorgesehene Zeit ist um",
  "no remaining experiment is worth its time": "kein weiterer Versuch lohnt sich",
  "interrupted; the measurements so far are kept": "unterbrochen; die bisherigen Messungen bleiben",
  "the train was not found: no sensor reported it at any step. Check that it is on the track, that the track has power and that the address is right":
    "der Zug wurde nicht gefunden: kein Rückmelder hat ihn bei irgendeiner Fahrstufe gemeldet. Steht er auf dem Gleis, hat das Gleis Strom, stimmt die Adresse?",
  "the order of the sensors does not show in which direction the train runs: a circuit needs three of them, or one that reports the direction":
    "die Reihenfolge der Rückmelder zeigt nicht, in welcher Richtung der Zug fährt: ein Kreis braucht drei von ihnen, oder einen, der die Richtung meldet",
  "no circuit can be reached from the train's position: put it on a closed loop": "von seiner Position ist kein Kreis erreichbar: den Zug auf einen geschlossenen Kreis stellen",
  "the sensors report in an order that is impossible on this layout: check `--layout`": "die Rückmelder melden in einer Folge, die es auf dieser Anlage nicht gibt: die Anlage prüfen",
};

const SIDES = { "above": "von oben", "below": "von unten" };
const STOPS = { "past": "hinter", "short of": "vor" };
/** An experiment of a calibration. */
const EXPERIMENT = [
  [/speed at step (\d+) from (above|below)/, (_, step, side) => `Tempo bei Fahrstufe ${step} ${SIDES[side]}`],
  [/stop from step (\d+) from (above|below), (past|short of) a sensor/, (_, step, side, of) => `Halt aus Fahrstufe ${step} ${SIDES[side]}, ${STOPS[of]} einem Rückmelder`],
  [/short move of (\S+) s at step (\d+)/, "kurze Fahrt von $1 s bei Fahrstufe $2"],
];
const experiment = (text) => EXPERIMENT.reduce((line, [english, german]) => line.replace(english, german), text);

/** The lines of a calibration while it runs. */
export const CALIBRATION = [
  [/^( *(?:speed at|stop from|short move) .*): (.*), in (\S+) s$/, (_, what, result, took) => `${experiment(what)}: ${result.replace("(was", "(war")}, in ${took} s`],
  [/^((?:speed at|stop from|short move) .*): takes (\S+) s; expected information (\S+)$/, (_, what, takes, gain) => `${experiment(what)}: dauert ${takes} s; erwartete Information ${gain}`],
  [/^found at (\S+) at step (\d+)$/, "gefunden bei $1 mit Stufe $2"],
  [/^circuit: (\d+) sensors in (\S+) m, turnouts (.*)$/, (_, sensors, length, turnouts) => `Kreis: ${sensors} Rückmelder auf ${length} m, Weichen ${turnouts.replaceAll("straight", "gerade").replaceAll("curved", "auf Abzweig")}`],
  [/^no circuit can be reached beyond (\S+): it reverses$/, "hinter $1 ist kein Kreis erreichbar: er wendet"],
  [/^! it stalled at step (\d+); .*$/, "! er blieb mit Stufe $1 stehen; sie wird nicht mehr verwendet"], [/^! (\d+) sensor\(s\) before (\S+) did not report$/, "! $1 Rückmelder vor $2 haben nicht gemeldet"],
  [/^! (\S+) reported, where the train cannot be$/, "! $1 hat gemeldet, wo der Zug nicht sein kann"], [/^! turnout (\d+) is not (\w+) as commanded; .*$/, "! Weiche $1 liegt nicht wie befohlen; noch einmal gestellt"],
  [/^! it is at (\S+), where it cannot have run to from (\S+): .*$/, "! er ist bei $1, wohin er von $2 nicht gefahren sein kann: wurde er hochgehoben?"],
  [/^! no sensor report for too long after (\S+): .*$/, "! zu lange keine Meldung nach $1: er hält und wird neu lokalisiert"],
  [/^! lengths differ from the layout: (.*)$/, (_, list) => `! Längen stimmen nicht mit der Anlage überein: ${list.replace(/(\S+) to (\S+) (\S+) instead of/g, "$1 bis $2 $3 statt")}`],
];

function lineInGerman(line) {
  for (const [is, german] of RESULT) {
    if (is.test(line)) return line.replace(is, german);
  }
  const label = LABELS[line.slice(0, LABEL).trimEnd()];
  if (!label) return line;
  return PHRASES.reduce((text, [english, german]) => text.replace(english, german), label.padEnd(Math.max(LABEL, label.length + 1)) + line.slice(LABEL));
}

/** A report in German. */
export const inGerman = (report) => report.split("\n").map(lineInGerman).join("\n");
