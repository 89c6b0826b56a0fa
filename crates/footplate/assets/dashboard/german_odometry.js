// The errors of tachometer recordings and vehicle files in German.

/** What a value should be, before the sentences around it. */
const EXPECTED = [
  [/a time in seconds, such as (\S+)/, "eine Zeit in Sekunden, etwa $1"], [/a time in seconds/, "eine Zeit in Sekunden"], [/a whole number/, "eine ganze Zahl"], [/the name of the run that the row belongs to/, "der Name der Fahrt, zu der die Zeile gehört"],
  [/(?:the name of )?one of at most (\d+) runs(?:; is it a name a row\?)?/, "der Name einer von höchstens $1 Fahrten"], [/1 \(forward\), -1 \(backward\) or 0 \(unknown\)/, "1 (vorwärts), -1 (rückwärts) oder 0 (unbekannt)"],
  [/a part of the full force from -1 \(brake\) to 1 \(traction\)/, "ein Teil der vollen Kraft von -1 (Bremse) bis 1 (Zugkraft)"], [/a finite number of m\/s²/, "eine endliche Zahl von m/s²"], [/a finite number of m\/s/, "eine endliche Zahl von m/s"],
  [/a finite number of metres/, "eine endliche Zahl von Metern"], [/a standard deviation in metres above 0/, "eine Standardabweichung in Metern über 0"],
  [/a text or a whole number/, "ein Text oder eine ganze Zahl"], [/a text in quotes/, "ein Text in Anführungszeichen"], [/a number$/, "eine Zahl"], [/two tables, each below/, "zwei Tabellen, jede unter"], [/a table(?: below)?/, "eine Tabelle"],
  [/DOUBLE in seconds, or INT64 as a timestamp/, "DOUBLE in Sekunden oder INT64 als Zeitstempel"], [/(\S+) or (INT64|FLOAT|"\w+")/, "$1 oder $2"],
  [/, or (?:nothing|null) where (?:it is missing|there is none)/, ", oder nichts, wo sie fehlt"],
];
/** What stands there instead. */
const FOUND = [[/the text/, "der Text"], [/the date/, "das Datum"], [/a list/, "eine Liste"], [/a table/, "eine Tabelle"]];
const PLACES = { "a vehicle": "einem Fahrzeug", "vehicle": "Fahrzeug" };

const inGerman = (words, text) => words.reduce((line, [english, german]) => line.replace(english, german), text);
const at = (place) => place.replace("the vehicle's file", "die Fahrzeugdatei").replace(/, line (\d+)/, ", Zeile $1").replace(/, row (\d+)/, ", Zeile $1").replace(/, column /, ", Spalte ");

const SENTENCES = [
  [/^missing columns: (.*); the header names (.*) (\(docs\S+\))$/, (_, missing, names, where) => `Spalten fehlen: ${missing.replaceAll(" (or ", " (oder ")}; die Kopfzeile nennt ${names} ${where}`],
  [/^no column is mapped to (.*); the header names (.*) (\(docs\S+\))$/, (_, missing, names, where) => `keine Spalte ist zugeordnet zu ${missing.replaceAll(" and to ", " und zu ")}; die Kopfzeile nennt ${names} ${where}`],
  [/^columns of Parquet files cannot be mapped; .*$/, "Spalten von Parquet-Dateien lassen sich nicht zuordnen; sie beim Schreiben umbenennen, oder CSV schreiben"],
  [/^no rows below the header; .*$/, "keine Zeile unter der Kopfzeile; eine Aufzeichnung hat mindestens eine"],
  [/^`t_s` does not increase from row to row and `(.*)` does; .*$/, "`t_s` nimmt nicht von Zeile zu Zeile zu, aber `$1`; sind die beiden Spalten in der Kopfzeile vertauscht?"],
  [/^it begins like Parquet and cannot be read as that: (.*); .*$/, "sie beginnt wie Parquet und ist so nicht lesbar: $1; wurde sie bis zum Ende geschrieben und kopiert?"],
  [/^its (\S+) values would unpack to (\S+) bytes; at most (\S+) are read; .*$/, "ihre $1 Werte wären entpackt $2 Bytes; höchstens $3 werden gelesen; die Spalte mit Werten eigener Länge schreiben"],
  [/^its type is (.*); it should be (.*)$/, (_, found, expected) => `ihr Typ ist ${found}; er sollte ${inGerman(EXPECTED, expected)} sein`],
  [/^`(.*)` should be (.*)$/, (_, value, expected) => `\`${value}\` ist falsch; richtig wäre ${inGerman(EXPECTED, expected)}`],
  [/^cannot be read: (.*)$/, "nicht lesbar: $1"], [/^the file is empty; .*$/, "die Datei ist leer; ihre erste Zeile sollte die Spalten nennen"],
  [/^the line is longer than (\S+) bytes; .*$/, "die Zeile ist länger als $1 Bytes; ist es eine CSV-Datei mit einer Zeile je Messung?"], [/^byte (\S+) of the line is not UTF-8; .*$/, "Byte $1 der Zeile ist kein UTF-8; die Datei als UTF-8 sichern"],
  [/^the line breaks off; complete it or delete it$/, "die Zeile bricht ab; sie ergänzen oder löschen"],
  [/^a quote is opened and not closed on the same line$/, "ein Anführungszeichen wird geöffnet und in derselben Zeile nicht geschlossen"], [/^(.*) fields where the header names (\S+) columns$/, "$1 Felder, wo die Kopfzeile $2 Spalten nennt"],
  [/^two columns are called `(.*)`; .*$/, "zwei Spalten heißen `$1`; jeder einen eigenen Namen geben"], [/^(.*) needs the column `(.*)`, which the header does not name$/, "$1 braucht die Spalte `$2`, die die Kopfzeile nicht nennt"],
  [/^the file is longer than (\S+) bytes; is it a vehicle\?$/, "die Datei ist länger als $1 Bytes; ist es ein Fahrzeug?"], [/^no UTF-8 text; .*$/, "kein UTF-8-Text; die Datei als UTF-8 sichern"],
  [/^`(.*)` is not a key of (.*); (?:did you mean (`.*`)\?|its keys are (.*))$/, (_, key, table, near, known) => `\`${key}\` ist kein Schlüssel von ${PLACES[table] ?? table}; ${near ? `ist ${near} gemeint?` : `möglich sind ${known}`}`],
  [/^(.*) lacks `(.*)`; (\S+) shows an example$/, (_, table, key, page) => `in ${PLACES[table] ?? table} fehlt \`${key}\`; ${page} zeigt ein Beispiel`],
  [/^(\S+) is (\S+); it should lie between (\S+) and (\S+)$/, "$1 ist $2; richtig wäre $3 bis $4"],
  [/^(\S+) is (.*); it should be (.*)$/, (_, key, found, expected) => `${key} ist ${inGerman(FOUND, found)}; richtig wäre ${inGerman(EXPECTED, expected)}`],
  [/^(\S+) tables `\[\[wheelset\]\]`; .*$/, "$1 Tabellen `[[wheelset]]`; es sollten zwei sein, die erste für pulses_1, die zweite für pulses_2"],
];

/** Errors without a place in a file. */
export const ODOMETRY_ERRORS = [
  [/^`(.*)` should be a recording whose name ends with \.csv or \.parquet$/, "`$1` ist keine Aufzeichnung: ihr Name endet auf .csv oder .parquet"],
  [/^this takes more than (.*) of (memory|processor time).*$/, (_, limit, what) => `das braucht mehr als ${limit} ${what === "memory" ? "Speicher" : "Rechenzeit"}, mehr als ein Browser verlangen darf: denselben Befehl in einem Terminal geben`],
  [/^`(.*)` is not the number of a recording$/, "`$1` ist keine Nummer einer Aufzeichnung"], [/^`(.*)` is not the number of a train, such as 24$/, "`$1` ist keine Nummer eines Zuges wie 24"],
  [/^(\S+) events cannot be marked at once: 1 to (\S+) can$/, "$1 Ereignisse lassen sich nicht auf einmal markieren: 1 bis $2"],
];

/** An error of a recording or a vehicle file in German, with its place; nothing if it is none. */
export function ofRecording(text) {
  const [, place, said] = /^((?:.*?\.(?:csv|parquet)|the vehicle's file).*?): (.*)$/.exec(text) ?? [];
  const sentence = SENTENCES.find(([is]) => is.test(said));
  return sentence && `${at(place)}: ${said.replace(...sentence)}`;
}
