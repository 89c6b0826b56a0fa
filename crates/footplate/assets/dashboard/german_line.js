// What the link reports and refuses, and what the server denies, in German.

/** A command as the link names it: `train 24 step 8`, or as a recording does: `step 8 for train 24`. */
const COMMANDS = [
  [/^train (\d+) step (\d+)$/, "Zug $1 Stufe $2"], [/^step (\d+) for train (\d+)$/, "Stufe $1 für Zug $2"],
  [/^train (\d+) reverse$/, "Zug $1 wenden"], [/^turn around, train (\d+)$/, "Zug $1 wenden"],
  [/^turnout (\d+) straight$/, "Weiche $1 gerade"], [/^turnout (\d+) curved$/, "Weiche $1 auf Abzweig"],
  [/^train (\d+) F(\d+) on$/, "Zug $1 F$2 ein"], [/^train (\d+) F(\d+) off$/, "Zug $1 F$2 aus"], [/^F(\d+) on for train (\d+)$/, "F$1 ein für Zug $2"], [/^F(\d+) off for train (\d+)$/, "F$1 aus für Zug $2"],
  [/^power off$/, "Fahrstrom aus"], [/^power on$/, "Fahrstrom ein"],
];

/** What to check at each kind of station. */
const CHECKS = [
  [/^check its power, the cable and the port$/, "Strom, Kabel und Anschluss prüfen"],
  [/^check the line's speed \(115200 baud\) and that the port belongs to a DCC-EX board$/, "die Geschwindigkeit der Leitung (115200 Baud) prüfen, und ob der Anschluss zu einem DCC-EX-Board gehört"],
  [/^check the line's speed \(115200 baud\), the cable, and that no other program writes to the port$/, "die Geschwindigkeit der Leitung (115200 Baud) und das Kabel prüfen, und ob ein anderes Programm auf den Anschluss schreibt"],
  [/^check that JMRI is running and not in the middle of something, and the network$/, "prüfen, ob JMRI läuft und nicht beschäftigt ist, und das Netz"],
  [/^check that the port belongs to JMRI's web server \(usually port 12080\)$/, "prüfen, ob der Port zum Webserver von JMRI gehört (meist 12080)"],
  [/^check that the LocoNet server \(LbServer\) is running, its address and port, and the power of the command station$/, "prüfen, ob der LocoNet-Server (LbServer) läuft, dazu seine Adresse, seinen Port und den Strom der Zentrale"],
  [/^check that the port belongs to a LocoNet-over-TCP server \(usually port 1234\)$/, "prüfen, ob der Port zu einem LocoNet-over-TCP-Server gehört (meist 1234)"],
  [/^check its power and network cable, that CAN is switched on in the station's settings, and that a CS2 sends to this computer's address$/, "Strom und Netzkabel prüfen, ob CAN in den Einstellungen der Zentrale eingeschaltet ist, und ob eine CS2 an die Adresse dieses Computers sendet"],
  [/^check that the address belongs to a CS2 or CS3 \(port 15731\)$/, "prüfen, ob die Adresse zu einer CS2 oder CS3 gehört (Port 15731)"],
  [/^check the power of the track box, the CAN cable and the port$/, "Strom der Gleisbox, CAN-Kabel und Anschluss prüfen"],
  [/^check that the port belongs to a CAN adapter that understands slcan \(Lawicel\)$/, "prüfen, ob der Anschluss zu einem CAN-Adapter gehört, der slcan (Lawicel) versteht"],
  [/^check that the port belongs to a CAN adapter that understands slcan \(Lawicel\), and that no other program uses it$/, "prüfen, ob der Anschluss zu einem CAN-Adapter gehört, der slcan (Lawicel) versteht, und ob ein anderes Programm ihn benutzt"],
  [/^check its power, the network cable, that its address is right \(a Z21 has 192\.168\.0\.111 unless changed\) and that this computer is in its network$/, "Strom und Netzkabel prüfen, ob die Adresse stimmt (eine Z21 hat 192.168.0.111, wenn nicht geändert), und ob dieser Computer in ihrem Netz ist"],
  [/^check that the address belongs to a Z21 \(UDP port 21105\)$/, "prüfen, ob die Adresse zu einer Z21 gehört (UDP-Port 21105)"],
];

/** Why the link refuses a command. */
const REFUSALS = [
  [/^train (\d+) has no address here; addresses are (\S+) to (\S+)$/, "Zug $1 hat hier keine Adresse; Adressen sind $2 bis $3"],
  [/^train (\d+) has (\S+) speed steps, and this station commands 14: .*$/, "Zug $1 hat $2 Fahrstufen, und diese Zentrale befiehlt 14: seine Stufen weglassen oder eine andere Zentrale nehmen"],
  [/^step (\S+) is beyond the decoder; steps are 0 to (\S+)$/, "Stufe $1 hat der Decoder nicht; Stufen sind 0 bis $2"],
  [/^(\S+) cannot be switched over this link; functions are F0 to F(\S+)$/, "$1 lässt sich über diese Verbindung nicht schalten; Funktionen sind F0 bis F$2"],
  [/^turnout (\d+) has no address here; addresses are (\S+) to (\S+)$/, "Weiche $1 hat hier keine Adresse; Adressen sind $2 bis $3"],
  [/^the station has no such command$/, "die Zentrale hat keinen solchen Befehl"],
  [/^(\S+) commands already wait for the line; .*$/, "$1 Befehle warten schon auf die Leitung; warten, bis einige gesendet sind"],
  [/^the link is being closed; .*$/, "die Verbindung wird geschlossen; sie wieder öffnen, um Züge zu fahren"],
];

const translated = (list, text) => {
  const known = list.find(([is]) => is.test(text));
  return known ? text.replace(...known) : undefined;
};
const command = (text) => translated(COMMANDS, text) ?? text;
const check = (text) => translated(CHECKS, text) ?? text;

/** The end of a session, part by part. */
const END = [
  [/NOT commanded to stop and possibly running: ([^;]*)/, "Halt NICHT befohlen, fahren vielleicht: $1"], [/commanded to stop: ([^;]*)/, "Halt befohlen: $1"],
  [/solenoids not released/, "Spulen nicht freigegeben"], [/solenoids released/, "Spulen freigegeben"],
  [/track power not switched off/, "Fahrstrom nicht abgeschaltet"], [/track power switched off/, "Fahrstrom abgeschaltet"],
  [/the station accepted the bytes; this line gives no further confirmation/, "die Zentrale hat die Bytes angenommen; mehr bestätigt diese Leitung nicht"],
  [/this line gives no confirmation: check that the trains are at rest/, "diese Leitung bestätigt nichts: prüfen, ob die Züge stehen"],
  [/the station has confirmed it/, "die Zentrale hat es bestätigt"],
  [/the station did not confirm the rest: check that the trains are at rest, and switch the track power off by hand/, "den Rest hat die Zentrale nicht bestätigt: prüfen, ob die Züge stehen, und den Fahrstrom von Hand abschalten"],
];

export const LINE = [
  ...COMMANDS, ...REFUSALS,
  [/^not sent: (.*)$/, (_, what) => `nicht gesendet: ${refusedCommand(what)}`],
  [/^(?:train|step|turn|turnout|F\d+|power)\b[^:]*: (?:train|step|F\d+|turnout|the|\d+) .*$/, (whole) => refusedCommand(whole)],
  // Reports of the link.
  [/^the station answers$/, "die Zentrale antwortet"],
  [/^a sensor reply had (\S+) bytes instead of (\S+); .*$/, "eine Antwort der Rückmelder hatte $1 statt $2 Bytes; sie wurde verworfen, und es wird noch einmal gelesen"],
  [/^(\S+) unexpected bytes were dropped; .*$/, "$1 unerwartete Bytes wurden verworfen; die Leitung wird neu abgestimmt"],
  [/^the station has answered nothing for (\S+) s; (.*)$/, (_, since, what) => `die Zentrale antwortet seit ${since} s nicht; ${check(what)}`],
  [/^no whole reply for (\S+) s, only (\S+) stray bytes; (.*)$/, (_, since, bytes, what) => `seit ${since} s keine ganze Antwort, nur ${bytes} einzelne Bytes; ${check(what)}`],
  [/^(\S+) bytes came that could not be read; (.*)$/, (_, bytes, what) => `${bytes} Bytes waren nicht zu lesen; ${check(what)}`],
  [/^the line garbles data: .*$/, "die Leitung verstümmelt Daten: die Züge stehen, bis sie sauber ist; Kabel prüfen"],
  [/^the line is open again; .*$/, "die Leitung ist wieder offen; die Züge werden angehalten, und die Zentrale wird nach allen Zuständen gefragt"],
  [/^the station is (.*)$/, (whole, what) => (what.startsWith("locked") ? "die Zentrale ist gesperrt: sie ignoriert das Fahren über das Netz, bis ihr Freischaltcode in ihrer App eingegeben ist" : `die Zentrale: ${what}`)],
  [/^the station was reset; .*$/, "die Zentrale wurde zurückgesetzt; die Züge hielten, als der Strom ausfiel, und stehen, bis sie einen neuen Befehl bekommen"],
  [/^the station did not confirm: (.*); check that it has not stopped$/, (_, what) => `die Zentrale hat nicht bestätigt: ${command(what)}; prüfen, ob sie noch läuft`],
  [/^the station does not report everything it was asked to \(broadcast flags (\S+)\): .*$/, "die Zentrale meldet nicht alles, worum sie gebeten wurde (Broadcast-Flags $1): ihre Firmware prüfen, und woran ihre Rückmelder hängen (feedback=r-bus, can oder loconet)"],
  [/^the station has no turnout (\d+): define it there (\(.*\)), or leave out `turnouts=defined`$/, "die Zentrale hat keine Weiche $1: sie dort definieren $2 oder `turnouts=defined` weglassen"],
  [/^the station refused a request: (.*)$/, "die Zentrale hat eine Anfrage abgelehnt: $1"],
  [/^the station has no free slot for train (\d+): .*$/, "die Zentrale hat keinen freien Platz (Slot) für Zug $1: an einem Fahrregler, der nicht fährt, eine Lok abgeben, oder die Zentrale neu starten"],
  [/^another throttle switched functions of train (\d+); on now: (.*)$/, (_, train, on) => `ein anderer Fahrregler hat Funktionen von Zug ${train} geschaltet; jetzt ein: ${on === "none" ? "keine" : on}`],
  [/^another throttle reversed train (\d+); .*$/, "ein anderer Fahrregler hat Zug $1 gewendet; ihn nur von einer Stelle aus fahren"],
  [/^another throttle drives train (\d+); .*$/, "ein anderer Fahrregler fährt Zug $1; ihn nur von einer Stelle aus fahren"],
  [/^the track has lost its power: .*$/, "der Fahrstrom ist ausgefallen: ein Kurzschluss, oder ein anderes Programm hat ihn abgeschaltet; die Ursache beheben, dann einschalten"],
  [/^the station has not been ready for (\S+) s \(CTS is down\); .*$/, "die Zentrale ist seit $1 s nicht bereit (CTS ist unten); Strom und Kabel prüfen, oder den zeitgesteuerten Modus versuchen, wenn der Adapter kein CTS hat"],
  [/^repeated, because a reply was lost after it: (.*)$/, (_, what) => `wiederholt, weil danach eine Antwort verloren ging: ${command(what)}`],
  [/^train (\d+) was commanded to reverse just before a reply was lost; .*$/, "Zug $1 sollte wenden, kurz bevor eine Antwort verloren ging; seine Fahrtrichtung ist unbekannt"],
  [/^train (\d+) may have been reversed just before the last session died; .*$/, "Zug $1 sollte vielleicht wenden, kurz bevor die letzte Sitzung starb; seine Fahrtrichtung ist unbekannt"],
  [/^sensor (\S+) is occupied from the start: .*$/, "Rückmelder $1 ist von Anfang an belegt: ein Zug steht darauf, oder er klemmt"],
  [/^the interface answers reads of single sensor modules$/, "das Interface beantwortet das Lesen einzelner Rückmeldemodule"],
  [/^the interface answers reads of all sensor modules only: .*$/, "das Interface liest nur alle Rückmeldemodule auf einmal: jedes Lesen dauert so lange wie alle, und ein Rückmelder, der kürzer belegt ist, kann fehlen"],
  [/^turnout (\d+) was powered for (\S+) ms; .*$/, "Weiche $1 hatte $2 ms lang Strom; prüfen, ob ihre Spule heiß ist"],
  [/^.*track power (?:not )?switched off; .*$/, (whole) => END.reduce((text, [english, german]) => text.replace(english, german), whole)],
  // What the server denies.
  [/^alarm (\d+) is over already$/, "Alarm $1 ist schon vorbei"], [/^`(.*)` is not the number of an alarm; .*$/, "`$1` ist nicht die Nummer eines Alarms; /api/picture nennt sie"],
  [/^this server is not called that: .*$/, "dieser Server heißt anders: ihn unter der Adresse öffnen, die `footplate` beim Start genannt hat"],
  [/^only the dashboard's own pages may ask this server$/, "nur die eigenen Seiten dürfen diesen Server fragen"],
  [/^beyond this machine the token is needed, as (`.*`)$/, "von anderen Computern aus ist das Token nötig, als $1"],
  [/^orders come as (`.*`), recordings as (`.*`)$/, "Befehle kommen als $1, Aufzeichnungen als $2"],
];

/** A command and why it was refused. */
function refusedCommand(text) {
  const at = text.indexOf(": ");
  const [what, why] = [text.slice(0, at), text.slice(at + 2)];
  return `${command(what)}: ${translated(REFUSALS, why) ?? why}`;
}
