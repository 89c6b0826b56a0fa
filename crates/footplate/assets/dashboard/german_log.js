// The lines of the log, and the reasons of refused commands, in German. A line that is not known stays English as a whole.

const LEGS = { straight: "gerade", curved: "auf Abzweig" };
const trains = (list) => list.replace(/train (\d+)/g, "Zug $1");

/** What may follow a detection or a stop. */
const TAILS = [
  [/, found/, ", lokalisiert"], [/, (\d+) ms late/, ", $1 ms später"], [/, (\d+) ms early/, ", $1 ms früher"], [/, predicted ([\d.]+ s)/, ", vorhergesagt $1"],
  [/, (\d+) missed before/, ", $1 davor ausgelassen"], [/; next (\S+) at/, "; als Nächstes $1 um"], [/, ([+−-]?[\d.]+) mm from the target/, ", $1 mm neben dem Ziel"],
  [/\(predicted (\S+) mm to (\S+) mm\)/, "(vorhergesagt $1 mm bis $2 mm)"], [/, ([\d.]+) s after (\S+?);/, ", $1 s nach $2;"], [/; rests at (\S+) mm to (\S+) mm/, "; hält bei $1 mm bis $2 mm"],
];

const LINES = [
  [/^( *[\d.]+ s {2})train (\d+) at (\S+?)(,? .*)?$/, (_, at, train, place, more = "") => `${at}Zug ${train} bei ${place}${tailed(more)}`],
  [/^( *[\d.]+ s {2})train (\d+) will be commanded to stop(.*)$/, (_, at, train, more) => `${at}Zug ${train} erhält den Haltbefehl${tailed(more)}`],
  [/^train (\d+): position unknown; run it over a sensor first$/, "Zug $1: Position unbekannt; erst über einen Rückmelder fahren"],
  [/^train (\d+): (.*), at rest$/, "Zug $1: $2, steht"], [/^train (\d+): (.*) mm\/s at step (\d+)$/, "Zug $1: $2 mm/s, Stufe $3"],
  [/^turnout (\d+) set (\w+)$/, (_, turnout, leg) => `Weiche ${turnout} ${LEGS[leg] ?? leg} gestellt`],
  [/^turnout (\d+) is (\w+): train (\d+) took that leg$/, (_, turnout, leg, train) => `Weiche ${turnout} steht ${LEGS[leg] ?? leg}: Zug ${train} ist so gefahren`],
  [/^train (\d+) runs at step (\d+): zone (.*) allows (\d+) mm\/s$/, "Zug $1 fährt mit Stufe $2: Zone $3 erlaubt $4 mm/s"],
  [/^train (\d+) should have passed (\S+) ([\d.]+) s ago: .*$/, "Zug $1 hätte vor $3 s bei $2 sein sollen: eine Meldung fehlt, oder er steht"],
  [/^train (\d+) stopped: the track ends at (\S+)$/, "Zug $1 angehalten: das Gleis endet bei $2"],
  [/^train (\d+) stopped: the track ahead is not reserved for it$/, "Zug $1 angehalten: das Gleis vor ihm ist nicht für ihn reserviert"],
  [/^position of train (\d+) lost, train stopped: .*$/, "Position von Zug $1 verloren, Zug angehalten: den Zug prüfen und über einen Rückmelder fahren"],
  [/^(\S+) reports repeatedly where no train can be: .*$/, "$1 meldet wiederholt, wo kein Zug sein kann: wird ignoriert, bis er wieder stimmt"],
  [/^(\S+) has behaved for a while and is used again$/, "$1 stimmt seit einer Weile und wird wieder verwendet"],
  [/^( *[\d.]+ s {2})(\S+) reported, but no train can have been there$/, "$1$2 hat gemeldet, aber dort kann kein Zug gewesen sein"],
  [/^route set for train (\d+): about (\d+) s(.*)$/, (_, train, time, more) => `Fahrstraße für Zug ${train} gestellt: etwa ${time} s${more.replace(", reversing once", ", einmal wenden").replace(/, reversing (\d+) times/, ", $1-mal wenden")}`],
  [/^train (\d+) waits for track that is reserved for (.*)$/, (_, train, on) => `Zug ${train} wartet auf Gleis, das für ${trains(on)} reserviert ist`],
  [/^train (\d+) is in a deadlock: (.*) makes room$/, (_, train, others) => `Zug ${train} ist blockiert: ${trains(others)} macht Platz`],
  [/^train (\d+) moves to (\S+) to make room for train (\d+)$/, "Zug $1 fährt nach $2, um Zug $3 Platz zu machen"],
  [/^train (\d+) has arrived after ([\d.]+) s$/, "Zug $1 ist nach $2 s angekommen"],
  [/^no train is sent onto track where train (\d+) may be$/, "kein Zug wird auf Gleis geschickt, auf dem Zug $1 sein kann"],
  [/^track power off: train (\d+) may not have stopped$/, "Fahrstrom aus: Zug $1 fährt vielleicht noch"],
  [/^the track is clear; trains may run again$/, "das Gleis ist frei; Züge dürfen wieder fahren"],
  [/^track power on; all trains are commanded to stop$/, "Fahrstrom an; alle Züge erhalten den Haltbefehl"],
  [/^train (\d+) creeps at step (\d+) until two sensors confirm its position$/, "Zug $1 schleicht mit Stufe $2, bis zwei Rückmelder seine Position bestätigen"],
  [/^train (\d+) is located again$/, "Zug $1 ist wieder lokalisiert"], [/^train (\d+) is located first$/, "Zug $1 wird erst lokalisiert"],
  [/^train (\d+) resumes its command$/, "Zug $1 setzt seinen Befehl fort"],
  [/^the command of train (\d+) was cancelled; send it again$/, "der Befehl von Zug $1 wurde aufgehoben; noch einmal senden"],
  [/^halt: all trains stopped, track power off; .*$/, "Nothalt: alle Züge angehalten, Fahrstrom aus; `power on` schaltet ihn ein"],
  [/^schedule `(.*)` begins$/, "Fahrplan `$1` beginnt"], [/^schedule `(.*)` is saved$/, "Fahrplan `$1` ist gespeichert"], [/^schedule `(.*)` has ended$/, "Fahrplan `$1` ist zu Ende"],
  [/^schedule `(.*)` runs: round (\d+)(?: of (\d+))?$/, (_, name, round, rounds) => `Fahrplan \`${name}\` läuft: Runde ${round}${rounds ? ` von ${rounds}` : ""}`],
  [/^schedule `(.*)` was ended; .*$/, "Fahrplan `$1` wurde beendet; seine Züge führen ihre Befehle zu Ende"],
  [/^schedule `(.*)` ended: train (\d+) was commanded by hand$/, "Fahrplan `$1` beendet: Zug $2 erhielt einen Befehl von Hand"],
  [/^refused `(.*)`: (.*)$/, (_, line, why) => `abgelehnt: \`${line}\`: ${logInGerman(why)}`],
  // Reasons of refused commands.
  [/^train (\d+) is stopped for safety until the incident is resolved$/, "Zug $1 steht zur Sicherheit, bis der Vorfall geklärt ist"],
  [/^the station does not answer$/, "die Zentrale antwortet nicht"], [/^track power is off: enter `power on`$/, "der Fahrstrom ist aus: `power on` eingeben"],
  [/^step (\d+) does not move this train reliably: use a higher step$/, "Stufe $1 bewegt diesen Zug nicht sicher: eine höhere Stufe nehmen"],
  [/^no known path from `(.*)` to `(.*)`: the position of turnout (\d+) is unknown; throw it first$/, "kein bekannter Weg von `$1` nach `$2`: die Stellung von Weiche $3 ist unbekannt; erst stellen"],
  [/^no path from `(.*)` to `(.*)` with the turnouts in their present positions$/, "kein Weg von `$1` nach `$2`, wie die Weichen jetzt liegen"],
  [/^no path takes train (\d+) to `(.*)` with any turnout positions and reversals: .*$/, "kein Weg bringt Zug $1 nach `$2`, wie die Weichen auch liegen: vielleicht fehlt Platz zum Halten oder Wenden"],
  [/^`(.*)` is too close to stop at: the nearest possible place is `(.*)`, (\S+) mm beyond it(?:; the train passes it again after (\S+) m)?$/,
    (_, target, nearest, mm, round) => `\`${target}\` ist zu nah zum Anhalten: die nächste mögliche Stelle ist \`${nearest}\`, ${mm} mm dahinter${round ? `; der Zug kommt nach ${round} m wieder vorbei` : ""}`],
  [/^the move is too short: this train can move (\S+) mm at least$/, "die Strecke ist zu kurz: dieser Zug kann mindestens $1 mm fahren"],
  [/^the train does not get as far as `(.*)` at this step$/, "der Zug kommt mit dieser Stufe nicht bis `$1`"],
  [/^the position of train (\d+) is unknown: .*$/, "die Position von Zug $1 ist unbekannt: ihn über einen Rückmelder fahren"],
  [/^train (\d+) cannot be kept clear of train (\d+), whose position is unknown: .*$/, "Zug $1 kann Zug $2 nicht ausweichen, dessen Position unbekannt ist: diesen über einen Rückmelder fahren oder sagen, wo er steht"],
  [/^the position of turnout (\d+) is unknown and train (\d+) may be on it: .*$/, "die Stellung von Weiche $1 ist unbekannt, und Zug $2 steht vielleicht darauf: ihre Stellung eingeben"],
  [/^train (\d+) was stopped: the track ends at `(.*)`$/, "Zug $1 wurde angehalten: das Gleis endet bei `$2`"],
  [/^train (\d+) was stopped: the track ahead is not reserved for it$/, "Zug $1 wurde angehalten: das Gleis vor ihm ist nicht für ihn reserviert"],
  [/^train (\d+) is still moving: wait until it is at rest$/, "Zug $1 fährt noch: warten, bis er steht"],
  [/^train (\d+) is on turnout (\d+) or about to reach it: .*$/, "Zug $1 ist auf Weiche $2 oder gleich dort: warten oder ihn erst anhalten"],
  [/^turnout (\d+) can be curved only while turnout (\d+) is straight, and train (\d+) is on that one: .*$/, "Weiche $1 kann nur auf Abzweig liegen, solange Weiche $2 gerade liegt, und auf der ist Zug $3: warten oder ihn erst anhalten"],
  [/^`(.*)` cannot be reached that soon: allow at least (\S+) s$/, "`$1` ist so schnell nicht zu erreichen: mindestens $2 s geben"],
  [/^a moving train cannot take that long to `(.*)`: allow at most (\S+) s, or stop it first$/, "ein fahrender Zug braucht nicht so lange bis `$1`: höchstens $2 s geben oder ihn erst anhalten"],
];

const tailed = (text) => TAILS.reduce((line, [english, german]) => line.replace(english, german), text);

/** A line of the log in German. */
export function logInGerman(line) {
  const known = LINES.find(([is]) => is.test(line));
  return known ? line.replace(...known) : line;
}
