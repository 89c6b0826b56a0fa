// The lines of the log, and the reasons of refused commands, in German. A line that is not known stays English as a whole.

import { ERRORS } from "./german_errors.js";
import { helpInGerman } from "./german_help.js";
import { LINE } from "./german_line.js";
import { ODOMETRY_ERRORS, ofRecording } from "./german_odometry.js";
import { CALIBRATION } from "./german_report.js";

const LEGS = { straight: "gerade", curved: "auf Abzweig" };
const trains = (list) => list.replace("no train that can move", "kein Zug, der fahren kann").replace(/train (\d+)/g, "Zug $1");
const WHILE = { "while it was being stopped": "beim Anhalten", "while it crept to a sensor": "beim Schleichen zum Rückmelder", "while it was measured again": "beim erneuten Messen" };

/** What may follow a detection or a stop. */
const TAILS = [
  [/, found/, ", lokalisiert"], [/, (\d+) ms late/, ", $1 ms später"], [/, (\d+) ms early/, ", $1 ms früher"], [/, predicted ([\d.]+ s)/, ", vorhergesagt $1"],
  [/, (\d+) missed before/, ", $1 davor ausgelassen"], [/; next (\S+) at/, "; als Nächstes $1 um"], [/, ([+−-]?[\d.]+) mm from the target/, ", $1 mm neben dem Ziel"],
  [/\(predicted (\S+) mm to (\S+) mm\)/, "(vorhergesagt $1 mm bis $2 mm)"], [/; starts at step (\S+) at (\S+ s)/, "; fährt um $2 mit Stufe $1 an"],
  [/, with minimum jerk/, ", mit kleinstem Ruck"], [/, through a steady speed/, ", über ein gleichmäßiges Tempo"], [/ from (\S+) to (\S+) mm\/s, and stops from step (\S+)/, " von $1 auf $2 mm/s, und hält aus Stufe $3"],
  [/; (\S+) should have reported it and did not/, "; $1 hätte ihn melden müssen und hat nicht"],
  [/, reversing once/, ", einmal wenden"], [/, reversing (\d+) times/, ", $1-mal wenden"], [/, ([\d.]+) s after (\S+?);/, ", $1 s nach $2;"], [/; rests at (\S+) mm to (\S+) mm/, "; hält bei $1 mm bis $2 mm"],
];

const LINES = [
  [/^( *[\d.]+ s {2})train (\d+) at (\S+?)(,? .*)?$/, (_, at, train, place, more = "") => `${at}Zug ${train} bei ${place}${tailed(more)}`],
  [/^( *[\d.]+ s {2})train (\d+) will be commanded to stop(.*)$/, (_, at, train, more) => `${at}Zug ${train} erhält den Haltbefehl${tailed(more)}`],
  [/^( *[\d.]+ s {2})train (\d+) will be at rest there(.*)$/, (_, at, train, more) => `${at}Zug ${train} wird dort stehen${tailed(more)}`],
  [/^( *[\d.]+ s {2})train (\d+) holds (\S+) mm\/s from here on$/, "$1Zug $2 hält von hier an $3 mm/s"],
  [/^( *[\d.]+ s {2})(\S+) was reported by train (\d+): the next sensor shows its direction$/, (_, at, sensor, train) => `${at}${sensor} kam von Zug ${train}: seine Richtung zeigt der nächste Rückmelder`],
  [/^( *[\d.]+ s {2})(\S+) was reported by train (\d+) or by (.*): the next reports decide$/, (_, at, sensor, train, or) => `${at}${sensor} kam von Zug ${train} oder ${or === "no train at all" ? "von keinem Zug" : `von ${trains(or)}`}: die nächsten Meldungen entscheiden`],
  [/^train (\d+) comes to rest about (\S+) mm beyond the target: .*$/, "Zug $1 hält etwa $2 mm hinter dem Ziel: es war näher als geschätzt"],
  [/^train (\d+) is held back: it would come too close to train (\d+), .*$/, "Zug $1 wird zurückgehalten: er käme Zug $2 zu nah, oder dessen Position ist unbekannt"],
  [/^something moves from (\S+) to (\S+) that Footplate does not drive; stopped: (.*); check the track.*$/, (_, from, to, list) => `von ${from} nach ${to} bewegt sich etwas, das Footplate nicht fährt; angehalten: ${trains(list)}; das Gleis prüfen, dann \`power on\` eingeben oder den Zug, der es ist, mit \`place\` setzen`],
  [/^not confirmed as sent: (.*)$/, "Senden nicht bestätigt: $1"],
  [/^train (\d+) is in a deadlock: no train can make room for another; .*$/, "Zug $1 ist blockiert: kein Zug kann einem anderen Platz machen; einen von Hand umsetzen und mit `place` sagen, wo er ist"],
  [/^train (\d+) is in a deadlock that no train can resolve from its place: .*$/, "Zug $1 ist blockiert, und kein Zug kann das von seiner Stelle aus lösen: einer wird anderswohin geschickt"],
  [/^train (\d+) does not start yet(?:: (.*))?; Footplate tries again$/, (_, train, why) => `Zug ${train} fährt noch nicht an${why ? `: ${logInGerman(why)}` : ""}; Footplate versucht es wieder`],
  [/^train (\d+) left its reserved route: stopped$/, "Zug $1 hat seine reservierte Fahrstraße verlassen: angehalten"],
  [/^train (\d+) left its reserved route: stopped, with the trains it could meet: (.*)$/, (_, train, list) => `Zug ${train} hat seine reservierte Fahrstraße verlassen: angehalten, mit den Zügen, denen er begegnen könnte: ${trains(list)}`],
  [/^train (\d+) is waiting for clearance to creep$/, "Zug $1 wartet, bis er schleichen darf"],
  [/^train (\d+) runs at (\S+) % \(± (\S+) %\) of its calibrated speed at step (\S+)$/, "Zug $1 fährt mit Stufe $4 $2 % (± $3 %) des kalibrierten Tempos"],
  [/^train (\d+) came to rest (\S+) mm beyond the prediction \(± (\S+) mm\)$/, "Zug $1 hielt $2 mm hinter der Vorhersage (± $3 mm)"],
  [/^recovery took (\S+) s; train (\d+) is back in service: (.*)$/, (_, took, train, found) => `nach ${took} s ist Zug ${train} wieder im Dienst: ${logInGerman(found)}`],
  [/^it runs at (\S+) % of its calibrated speeds$/, "er fährt mit $1 % seiner kalibrierten Tempi"], [/^it runs as fast as before, and its stops have changed$/, "er fährt so schnell wie zuvor, und seine Bremswege haben sich geändert"], [/^it is another engine, and was calibrated anew$/, "es ist eine andere Lok, sie wurde neu kalibriert"], [/^its model is unchanged$/, "sein Modell ist unverändert"],
  [/^position of train (\d+) lost: recovery failed (.*); check the train, then enter .*$/, (_, train, during) => `Position von Zug ${train} verloren: die Wiederherstellung ist ${WHILE[during] ?? during} gescheitert; den Zug prüfen, dann \`place ${train} at ...\` eingeben oder ihn über einen Rückmelder fahren, wenn kein anderer Zug in der Nähe ist`],
  [/^stops of train (\d+) miss their intervals: the intervals are ±(\S+) mm wider from now on; .*$/, "Zug $1 hält außerhalb seiner Intervalle: sie sind ab jetzt ±$2 mm breiter; wenn Last, Zug oder Gleis sich geändert haben, ihn neu kalibrieren"],
  [/^train (\d+) extends (\S+) mm ahead of the leading end of its pickup, and (\S+) mm behind it$/, "Zug $1 reicht $2 mm vor das vordere Ende seines Schleifers und $3 mm dahinter"],
  [/^train (\d+) has no command that would bring it to rest; .*$/, "Zug $1 hat keinen Befehl, der ihn anhält; das Skript geht weiter"], [/^nothing happened within (\S+) s; .*$/, "in $1 s ist nichts geschehen; das Skript geht weiter"],
  [/^`(.*)` waits: (.*)$/, (_, line, why) => `\`${line}\` wartet: ${logInGerman(why)}`],
  [/^schedule `(.*)` has ended; (\S+) lines? of its last round (?:was|were) refused$/, (_, name, count) => `Fahrplan \`${name}\` ist zu Ende; abgelehnte Zeilen der letzten Runde: ${count === "one" ? 1 : count}`],
  [/^no schedule is saved: .*$/, "kein Fahrplan ist gespeichert: auf der Seite „Fahrpläne“ schreibt man sie"], [/^no schedule `(.*)` runs$/, "kein Fahrplan `$1` läuft"],
  // Why a train was stopped.
  [/^train (\d+) stopped: the track ahead is reserved for (.*)$/, (_, train, list) => `Zug ${train} angehalten: das Gleis voraus ist für ${trains(list)} reserviert`],
  [/^train (\d+) stopped: (.*); also stopped, because they could meet it: (.*)$/, (_, train, why, list) => `Zug ${train} angehalten: ${logInGerman(why)}; auch angehalten, weil sie ihm begegnen könnten: ${trains(list)}`],
  [/^train (\d+) stopped: ((?:it|its|a sensor|several sensors|the stop command) .*)$/, (_, train, why) => `Zug ${train} angehalten: ${logInGerman(why)}`],
  [/^train (\d+) is not calibrated, so its stops are uncertain: .*$/, "Zug $1 ist nicht kalibriert, daher sind seine Halte unsicher: erst `footplate calibrate` ausführen"],
  [/^the last commands were not recorded: (.*)$/, (_, why) => `die letzten Befehle wurden nicht aufgezeichnet: ${logInGerman(why)}`],
  [/^the reports are not of layout `(.*)`: (\d+) of (\d+) sensors cannot follow the one before: (.*); give the layout .*$/, (_, layout, times, reports, stray) => `die Meldungen sind nicht von der Anlage \`${layout}\`: ${times} von ${reports} Rückmeldern können nicht auf den vorigen folgen: ${stray.replace(/ after /g, " nach ").replace(/\bonce\b/g, "einmal").replace(/(\d+) times/g, "$1-mal").replace(/next is/g, "als Nächstes").replace(/ or /g, " oder ").replace(", and others", " und andere").replace(/sensor (\S+) is not on it/g, "Rückmelder $1 ist nicht darauf")}; die Anlage angeben, auf der aufgezeichnet wurde, oder ihre Kanten berichtigen`],
  [/^it runs slower than calibrated$/, "er fährt langsamer als kalibriert"], [/^it runs faster than calibrated$/, "er fährt schneller als kalibriert"], [/^its position is lost$/, "seine Position ist verloren"],
  [/^a sensor reported it where it cannot have run to$/, "ein Rückmelder hat ihn gemeldet, wohin er nicht gefahren sein kann"], [/^a sensor reported it at a time when .*$/, "ein Rückmelder hat ihn zu einer Zeit gemeldet, zu der er nicht dort gewesen sein kann"],
  [/^its decoder reports that it stands still$/, "sein Decoder meldet, dass er steht"],
  [/^the speeds that the decoder of train (\d+) reports contradict the sensors: .*$/, "die Geschwindigkeiten, die der Decoder von Zug $1 meldet, widersprechen den Rückmeldern: sie werden nicht mehr verwendet; RailCom-Einstellungen prüfen"],
  [/^several sensors in a row did not report it$/, "mehrere Rückmelder nacheinander haben ihn nicht gemeldet"], [/^the stop command could not be sent$/, "der Haltbefehl konnte nicht gesendet werden"],
  [/^it was commanded to stop and sensors still report it$/, "er hat den Haltbefehl, und Rückmelder melden ihn weiter"], [/^its model no longer fits$/, "sein Modell stimmt nicht mehr"],
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
  [/^route set for train (\d+): about (\d+) s(.*)$/, (_, train, time, more) => `Fahrstraße für Zug ${train} gestellt: etwa ${time} s${tailed(more)}`],
  [/^train (\d+) waits for track that is reserved for (.*)$/, (_, train, on) => `Zug ${train} wartet auf Gleis, das für ${trains(on)} reserviert ist`],
  [/^train (\d+) is in a deadlock: it moves elsewhere first$/, "Zug $1 ist blockiert: er fährt zuerst anderswohin"],
  [/^train (\d+) is in a deadlock: (.*) makes room$/, (_, train, others) => `Zug ${train} ist blockiert: ${trains(others)} macht Platz`],
  [/^train (\d+) is in a deadlock: (.*) make room$/, (_, train, others) => `Zug ${train} ist blockiert: ${trains(others)} machen Platz`],
  [/^train (\d+) moves to (\S+) to make room for train (\d+)$/, "Zug $1 fährt nach $2, um Zug $3 Platz zu machen"],
  [/^train (\d+) moves to (\S+) first, so that .*$/, "Zug $1 fährt erst nach $2, damit die nächste Suche nach einem Weg von anderen Stellen ausgeht"],
  [/^train (\d+) has arrived after ([\d.]+) s$/, "Zug $1 ist nach $2 s angekommen"],
  [/^no train is sent onto track where train (\d+) may be$/, "kein Zug wird auf Gleis geschickt, auf dem Zug $1 sein kann"],
  [/^track power off: train (\d+) may not have stopped$/, "Fahrstrom aus: Zug $1 fährt vielleicht noch"],
  [/^the track is clear; trains may run again$/, "das Gleis ist frei; Züge dürfen wieder fahren"],
  [/^sensors report at random: trains stop until none has for 3 s; check the line and the sensor modules$/,
    "Melder melden wahllos: die Züge stehen, bis 3 s lang keiner meldet; Leitung und Rückmeldemodule prüfen"],
  [/^sensors no longer report at random$/, "die Melder melden nicht mehr wahllos"],
  [/^track power on; all trains are commanded to stop$/, "Fahrstrom an; alle Züge erhalten den Haltbefehl"],
  [/^train (\d+) creeps at step (\d+) until two sensors confirm its position$/, "Zug $1 schleicht mit Stufe $2, bis zwei Rückmelder seine Position bestätigen"],
  [/^train (\d+) was not found within (\S+) s: .*$/, "Zug $1 wurde in $2 s nicht gefunden: wenn er auf der Anlage ist, sagen, wo, zum Beispiel `place $1 at C13`"],
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
  [/^something moved that Footplate does not drive: check the track, then enter `power on`, or `place` the train that it is$/, "etwas hat sich bewegt, das Footplate nicht fährt: die Gleise prüfen, dann `power on` eingeben, oder mit `place` sagen, welcher Zug es war"],
  [
    /^train (\d+) is stopped for safety: an earlier message says why and what to do$/,
    "Zug $1 steht zur Sicherheit: Eine frühere Meldung sagt, warum, und was zu tun ist",
  ],
  [/^train (\d+) may be on turnout (\d+), which is set for another leg .*$/, "Zug $1 steht vielleicht auf Weiche $2, die nicht so liegt, wie er kam, und auf der er zurück entgleisen würde: erst vorwärts von ihr herunterfahren"],
  [/^the position of train (\d+) would be lost if it reversed here: set `(.+)` first$/, "die Position von Zug $1 ginge verloren, wenn er hier die Richtung wechselte: erst `$2` stellen"],
  [/^sensors report at random$/, "Melder melden wahllos"], [/^sensors report at random: wait until none has for 3 s, then enter it again$/, "Melder melden wahllos: warten, bis 3 s lang keiner meldet, dann noch einmal eingeben"],
  [/^the station does not answer$/, "die Zentrale antwortet nicht"], [/^track power is off: enter `power on`$/, "der Fahrstrom ist aus: `power on` eingeben"],
  [/^step (\d+) does not move this train reliably: use a higher step$/, "Stufe $1 bewegt diesen Zug nicht sicher: eine höhere Stufe nehmen"],
  [/^no known path from `(.*)` to `(.*)`: the position of turnout (\d+) is unknown; throw it first$/, "kein bekannter Weg von `$1` nach `$2`: die Stellung von Weiche $3 ist unbekannt; erst stellen"],
  [/^no path from `(.*)` to `(.*)` with the turnouts in their present positions: .*$/, "kein Weg von `$1` nach `$2`, wie die Weichen jetzt liegen: Weichen stellen, zum Beispiel `turnout all straight`, oder mit `go` stellen lassen"],
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
  [/^train (\d+) is not part of this session$/, "Zug $1 gehört nicht zu dieser Sitzung"], [/^the layout has no turnout (\d+)$/, "die Anlage hat keine Weiche $1"],
  [/^step (\d+) is too high: the highest step of this train is (\d+)$/, "Stufe $1 ist zu hoch: die höchste Stufe dieses Zuges ist $2"],
  [/^probability (\S+) % is out of range: .*$/, "Wahrscheinlichkeit $1 % ist außerhalb des Bereichs: 0.0001 % bis 50 %"], [/^distance (\S+) mm is out of range: .*$/, "Strecke $1 mm ist außerhalb des Bereichs: 1 mm bis 100000 mm"],
  [/^the commands to turnout (\d+) were not sent: .*$/, "die Befehle an Weiche $1 wurden nicht gesendet: die Leitung verstümmelt Daten, oder diese Verbindung hat ihre Adresse nicht; Kabel und Adapter prüfen, dann die Adresse im Gleisplan, oder ein Ziel ohne Weiche $1 wählen"],
  [/^train (\d+) did not arrive within (\S+) s: .*$/, "Zug $1 ist in $2 s nicht angekommen: wegräumen, was seinen Weg versperrt, und Züge mit unsicherer Position über einen Rückmelder fahren"],
  [/^train (\d+) already follows train (\d+): .*$/, "Zug $1 folgt schon Zug $2: Zug $1 erst einen anderen Befehl geben"], [/^gap to train (\d+) too short to stop safely: use at least (.*)$/, "Abstand zu Zug $1 ist zu kurz, um sicher zu halten: mindestens $2"],
  [/^(\S+) mm\/s cannot be held: use (\S+) to (\S+) mm\/s$/, "$1 mm/s lassen sich nicht halten: $2 bis $3 mm/s"], [/^no sensor reported train (\d+) within (\S+) s: .*$/, "kein Rückmelder hat Zug $1 in $2 s gemeldet: prüfen, ob er fährt und auf dieser Anlage ist"],
  [/^the position is not on this layout$/, "die Stelle ist nicht auf dieser Anlage"], [/^a distance should be a finite number$/, "eine Strecke sollte eine endliche Zahl sein"],
  [/^the position of turnout (\d+), (\S+) mm before the end of the path, is unknown: .*$/, "die Stellung von Weiche $1, $2 mm vor dem Ende des Weges, ist unbekannt: erst stellen"], [/^the track ends at `(.*)`, (\S+) mm before the end of the path$/, "das Gleis endet bei `$1`, $2 mm vor dem Ende des Weges"],
  // The titles of the measurements behind a figure.
  [/^Train (\d+), step (\d+), reached from (\w+): (.*) mm\/s, from (\d+) reports?; .*$/, (_, train, step, side, speed, reports) => `Zug ${train}, Stufe ${step}, erreicht von ${{ below: "unten", above: "oben" }[side] ?? "unbekannt"}: ${speed} mm/s, aus ${reports} Meldungen; aufgeführt sind die, zwischen denen er gleichmäßig fuhr`],
  [/^Train (\d+), stops from step (\d+): (.*) mm; .*$/, "Zug $1, Halte aus Stufe $2: $3 mm; mit dem Bandmaß gemessen, ab dem Befehl"],
  [/^Train (\d+): (\d+) changes behind its law$/, "Zug $1: $2 Änderungen hinter seinem Gesetz"],
  [/^Train (\d+), (\S+) to (\S+): (.*) mm to add to (\d+) mm$/, "Zug $1, $2 bis $3: $4 mm zu $5 mm dazu"],
  // The names of recorded sessions.
  [/^calibration of train (\d+), (\d.*)$/, "Kalibrierung von Zug $1, $2"], [/^drive (\d.*)$/, "Fahrt $1"], [/^demo (\d.*)$/, "Vorführung $1"],
  ...CALIBRATION, ...ODOMETRY_ERRORS, ...ERRORS, ...LINE,
];

const tailed = (text) => TAILS.reduce((line, [english, german]) => line.replace(english, german), text);

/** Numbers before a unit with a decimal comma. */
const withCommas = (text) => text.replace(/(\d)\.(\d+)(?= (?:s|ms|mm|m|mm\/s|%|±)(?![\w]))/g, "$1,$2");

/** A line of the log, or an error of the server, in German; several lines one by one. */
export function logInGerman(text) {
  return text.split("\n").map((line) => {
    const known = LINES.find(([is]) => is.test(line));
    return ofRecording(line) ?? helpInGerman(line) ?? (known ? withCommas(line.replace(...known)) : line);
  }).join("\n");
}
