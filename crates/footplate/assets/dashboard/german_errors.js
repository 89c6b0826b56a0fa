// The errors of a command, of a schedule, of the set-up and of a layout file in German.

/** What a command should have: nouns, before the sentences around them. */
const NOUNS = [
  [/the number of a train, such as/g, "die Nummer eines Zuges, etwa"], [/`all` or the number of a turnout, such as/g, "`all` oder die Nummer einer Weiche, etwa"],
  [/a step from 0 to/g, "eine Stufe von 0 bis"], [/a function from 0 \(the light\) to/g, "eine Funktion von 0 (das Licht) bis"], [/a place, such as/g, "eine Stelle, etwa"], [/a sensor, such as/g, "ein Rückmelder, etwa"],
  [/the name of a schedule/g, "der Name eines Fahrplans"], [/a share of stops from (\S+) to (\S+)/g, "ein Anteil der Halte von $1 bis $2"], [/a distance ahead, such as/g, "eine Strecke nach vorn, etwa"],
  [/a speed, such as/g, "ein Tempo, etwa"], [/a time such as 2s, or a train such as 24/g, "eine Zeit wie 2s oder ein Zug wie 24"], [/a time, such as/g, "eine Zeit, etwa"], [/at most a day:/g, "höchstens ein Tag:"],
  [/(`[^`]*`|\d\S*) or (`[^`]*`|\d\S*)/g, "$1 oder $2"], [/(\d\S*) to (\d\S*)/g, "$1 bis $2"],
];

/** Sentences about a word of a command. */
const MISTAKES = [
  [/: did you mean (`.*`)\?$/, ": ist $1 gemeint?"], [/: write a name (?:such as|like) (.*)$/, ": einen Namen wie $1 schreiben"], [/: write one of (.*)$/, ": eines davon schreiben: $1"], [/: write (`.*`)$/, ": $1 schreiben"],
  [/ is not a command/, " ist kein Befehl"], [/ is one word too many: remove it/, " ist ein Wort zu viel: weglassen"], [/ is not allowed here/, " ist hier nicht erlaubt"],
  [/ is the same train: name the train ahead of it/, " ist derselbe Zug: den Zug vor ihm nennen"], [/ is not a train of this session: (?:none is)?/, " ist kein Zug dieser Sitzung: "], [/ is not a turnout of (.*): it has /, " ist keine Weiche von $1: dort sind "],
  [/ is not a sensor of /, " ist kein Rückmelder von "], [/ is off the track: the track ends at (`.*`), (\S+) mm before the end of the path/, " ist nicht auf dem Gleis: es endet $2 mm vorher bei $1"], [/ is off the track: (.*)/, " ist nicht auf dem Gleis: $1"],
  [/ is not a saved schedule/, " ist kein gespeicherter Fahrplan"], [/: none is saved; .*$/, ": keiner ist gespeichert; die Seite „Fahrpläne“ schreibt sie"], [/^(\S+) has no place (`.*?`)/, "$1 hat keine Stelle $2"],
  [/ is not an offset: write millimetres, for example /, " ist kein Abstand: Millimeter schreiben, zum Beispiel "], [/ should be /, " sollte sein: "], [/^(.*) is missing after (`.*`)/, "nach $2 fehlt $1"],
];

const inGerman = (text) => [...NOUNS, ...MISTAKES].reduce((line, [english, german]) => line.replace(english, german), text);

export const ERRORS = [
  [/^(?:line (\d+), )?column (\d+): (.*)$/, (_, line, column, what) => `${line ? `Zeile ${line}, ` : ""}Spalte ${column}: ${inGerman(what)}`],
  [/^line (\d+): `(.*)` is not for schedules$/, "Zeile $1: `$2` gehört nicht in Fahrpläne"],
  [/^(\S+) lines are too many for a schedule: the limit is (\S+)$/, "$1 Zeilen sind zu viele für einen Fahrplan: höchstens $2"], [/^0 rounds: .*$/, "0 Runden: mindestens 1, oder bis er beendet wird"],
  [/^the schedule has no line that does anything$/, "der Fahrplan hat keine Zeile, die etwas tut"], [/^(\S+) schedules run already: .*$/, "$1 Fahrpläne laufen schon: erst einen beenden"],
  [/^schedule `(.*)` runs already$/, "Fahrplan `$1` läuft schon"], [/^schedule `(.*)` drives train (\d+) already: .*$/, "Fahrplan `$1` fährt Zug $2 schon: ihn erst beenden"],
  [/^give the schedule a name of 1 to (\S+) characters$/, "dem Fahrplan einen Namen von 1 bis $1 Zeichen geben"], [/^there is no schedule `(.*)`; .*$/, "es gibt keinen Fahrplan `$1`"],
  // Requests.
  [/^too many orders wait: .*$/, "zu viele Befehle warten: gleich noch einmal versuchen"], [/^the control loop did not answer: .*$/, "die Steuerschleife hat nicht geantwortet: ist die Verbindung in Ordnung?"],
  [/^the request did not arrive within (\S+) s: .*$/, "die Anfrage ist in $1 s nicht angekommen: noch einmal senden"],
  [/^too many requests are being computed: .*$/, "zu viele Anfragen werden berechnet: gleich noch einmal versuchen"], [/^what was sent did not arrive within (\S+) s$/, "das Gesendete ist in $1 s nicht angekommen"],
  [/^what was sent is too large: at most (\S+) MB are allowed$/, "das Gesendete ist zu groß: höchstens $1 MB sind erlaubt"], [/^this session has no store: .*$/, "diese Sitzung hat keinen Speicher: sie mit `--store railway.db` beginnen"],
  [/^this page has been dropped: .*$/, "diese Seite ist nicht mehr da: die Aufzeichnung noch einmal senden"], [/^four slides are being watched already: .*$/, "vier Rutschfahrten laufen schon: in einer Minute noch einmal versuchen"],
  // The set-up.
  [/^choose a command station first$/, "erst eine Zentrale wählen"], [/^choose or draw a layout first$/, "erst eine Anlage wählen oder zeichnen"], [/^name a train first$/, "erst einen Zug nennen"],
  [/^name one train at least: .*$/, "mindestens einen Zug nennen: die Adresse seines Decoders"], [/^(\S+) trains are too many: the set-up takes (\S+)$/, "$1 Züge sind zu viele: höchstens $2"], [/^0 is not an address of a train: .*$/, "0 ist keine Adresse eines Zuges: Adressen beginnen bei 1"],
  [/^address (\S+) is used twice: .*$/, "Adresse $1 kommt zweimal vor: jeder Zug braucht seine eigene"], [/^the name of train (\S+) is too long: use up to (\S+) characters$/, "der Name von Zug $1 ist zu lang: höchstens $2 Zeichen"],
  [/^another link was chosen while .*$/, "während der Prüfung wurde eine andere Verbindung gewählt: noch einmal prüfen"],
  [/^train (\S+) is not in the set-up: .*$/, "Zug $1 ist nicht eingerichtet: ihn erst zu den Zügen nehmen"], [/^all turnouts are set straight before the train moves: .*$/, "alle Weichen werden gerade gestellt, bevor der Zug fährt: erst prüfen, dass kein Zug auf einer steht"],
  [/^the link is (?:still )?being checked(?: already)?: .*$/, "die Verbindung wird noch geprüft: das Ergebnis abwarten"], [/^(.*) exists already and is another layout: .*$/, "$1 gibt es schon, mit einer anderen Anlage: dieser einen anderen Namen geben"],
  [/^give the layout another name, .*$/, "der Anlage einen anderen Namen aus Buchstaben und Ziffern geben: ihre Datei heißt danach"], [/^the folder of the store has a name .*$/, "der Ordner des Speichers hat einen Namen, der sich nicht in eine Adresse schreiben lässt"],
  [/^choose the simulated railway in the list .*$/, "die simulierte Bahn in der Liste wählen statt einer Adresse"], [/^a simulated railway runs up to (\S+) times as fast as real$/, "eine simulierte Bahn läuft höchstens $1-mal so schnell wie in Wirklichkeit"],
  [/^this railway was not set up in the browser: .*$/, "diese Bahn wurde nicht im Browser eingerichtet: `footplate serve` ohne --link starten"], [/^name a step: .*$/, "einen Schritt nennen: `link`, `layout`, `drawn` oder `trains`"],
  [/^(.*) is damaged: delete it to set up the railway again; .*$/, "$1 ist beschädigt: löschen, um die Bahn neu einzurichten; der Speicher behält alle Kalibrierungen"], [/^cannot (read|write) (.*)$/, (_, does, file) => `${file} lässt sich nicht ${does === "read" ? "lesen" : "schreiben"}`],
  // Layouts.
  [/^(.*), line (\d+), column (\d+): (.*)$/, (_, file, line, column, what) => `${file.replace("the drawn layout", "die gezeichnete Anlage")}, Zeile ${line}, Spalte ${column}: ${ofLayout(what)}`],
];

/** What the editor can get wrong in a layout; the rest concerns people who write the file. */
const LAYOUT = [
  [/^there is a block `(.*)` already; .*$/, "es gibt schon einen Block `$1`; jeder braucht einen eigenen Namen"], [/^detector (\d+) belongs to `(.*)` already; .*$/, "Melder $1 gehört schon zu `$2`; die Nummer angeben, die dieser Block meldet"],
  [/^the block's name `(.*)` is not .*$/, "der Blockname `$1` hat nicht 1 bis 32 Zeichen in einer Zeile"], [/^the rails at `(.*?)` belong to block `(.*?)`, but .*$/, "die Gleise bei `$1` gehören zum Block `$2`, aber dort beginnt ein anderer: eine Trennstelle dazwischen setzen"],
  [/^an edge is in block `(.*)` and in block `(.*)`: .*$/, "ein Gleis ist in den Blöcken `$1` und `$2`: eine Trennstelle dazwischen setzen"], [/^no boundary leads into block `(.*)`: .*$/, "keine Trennstelle führt in den Block `$1`"],
  [/^the edges from `(.*)` come back to it after 0 mm: .*$/, "die Gleise ab `$1` kommen nach 0 mm zu ihm zurück: mindestens eines muss länger sein"], [/^there are too many paths from `(.*)` to the next sensors: .*$/, "von `$1` führen zu viele Wege zu den nächsten Rückmeldern: Rückmelder zwischen die Weichen setzen"],
  [/^an edge that leaves (`.*`) comes back to the same rail end$/, "ein Gleis ab $1 kommt zum selben Gleisende zurück"], [/^no edge leads on from (`.*`): .*$/, "ab $1 geht es nicht weiter: es mit einer Stelle oder einem Gleisende verbinden"],
];

const ofLayout = (what) => {
  const known = LAYOUT.find(([is]) => is.test(what));
  return known ? what.replace(...known) : what;
};
