// The list of commands (`help`) in German. The commands themselves are the same in every language.

const MEANINGS = {
  "run train 24 at step 8; step 0 stops it": "Zug 24 mit Stufe 8 fahren; Stufe 0 hält ihn an",
  "stop, then reverse [and run at step 8]": "anhalten, dann wenden [und mit Stufe 8 fahren]",
  "throw turnout 11 (curved or straight)": "Weiche 11 stellen (curved: Abzweig, straight: gerade)",
  "throw all turnouts straight, so that their positions are known": "alle Weichen gerade stellen, dann sind ihre Stellungen bekannt",
  "stop with the pickup 120 mm past sensor C13": "mit dem Schleifer 120 mm hinter Rückmelder C13 halten",
  "... from step 8": "... aus Stufe 8",
  "... with at most 1 stop in 1000 beyond it": "... und höchstens einer von 1000 Halten liegt dahinter",
  "... after passing it once": "... nachdem er einmal vorbei ist",
  "take the fastest free route; turnouts and reversals are included": "den schnellsten freien Weg nehmen, mit Weichen und Wenden",
  "... and arrive in the direction of that sensor": "... und in der Richtung dieses Rückmelders ankommen",
  "from standstill, move on by 37 mm": "aus dem Stand 37 mm vorrücken",
  "run at a mean speed, also between throttle steps": "ein mittleres Tempo halten, auch zwischen zwei Stufen",
  "keep 1.5 s behind train 24, sensor by sensor (or by 150mm)": "1.5 s hinter Zug 24 bleiben, von Rückmelder zu Rückmelder (oder by 150mm)",
  "come to rest there in 12 s": "in 12 s dort stehen",
  "creep to the next sensor and stop there: then its position is known": "zum nächsten Rückmelder schleichen und dort halten: dann ist die Position bekannt",
  "train 24 is there: you put it there, or you see it there": "Zug 24 ist dort: dorthin gestellt oder dort gesehen",
  "length of train 24: its pickup, and from there to its further end": "Länge von Zug 24: der Schleifer, und von dort zum weiteren Ende",
  "switch the light of train 24 on (or off); the same as function 24 0 on": "Licht von Zug 24 einschalten (off: aus); dasselbe wie function 24 0 on",
  "switch function F2 of train 24 on (or off)": "Funktion F2 von Zug 24 einschalten (off: aus)",
  "emergency stop: stop all trains, switch the track power off": "Nothalt: alle Züge anhalten, Fahrstrom aus",
  "switch the track power on": "Fahrstrom einschalten",
  "position and speed of the train, with intervals": "Position und Tempo des Zuges, mit Intervallen",
  "go on after 2 seconds (also 500ms)": "nach 2 Sekunden weiter (auch 500ms)",
  "go on when train 24 has finished its command and is at rest": "weiter, wenn Zug 24 seinen Befehl ausgeführt hat und steht",
  "go on when train 24 passes sensor C13": "weiter, wenn Zug 24 an Rückmelder C13 vorbeifährt",
  "go on when the position of train 24 is known": "weiter, wenn die Position von Zug 24 bekannt ist",
  "the saved schedules, and how far those have come that run": "die gespeicherten Fahrpläne, und wie weit die laufenden sind",
  "begin the saved schedule `Evening`; it runs beside the prompt": "den gespeicherten Fahrplan `Evening` beginnen; er läuft nebenher",
  "end it; its trains finish the commands that they have": "ihn beenden; seine Züge führen ihre Befehle zu Ende",
  "show this list": "diese Liste zeigen",
  "stop all trains and end": "alle Züge anhalten und beenden",
};

/** A line of the list: the command in its column, and what it does. */
const LINE = /^(.*?\S)( {2,})(\S.*)$/;

/** A line of the list in German; nothing if it is none. */
export function helpInGerman(line) {
  const [, command, gap, meaning] = LINE.exec(line) ?? [];
  return MEANINGS[meaning] && command + gap + MEANINGS[meaning];
}
