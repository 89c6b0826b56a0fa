//! The last will: what a guardian sends to the station if this program dies. It is the end of the session, computed in
//! advance.
//!
//! A guardian knows no station. It receives bytes and times: those that a copy of the session produces when it is closed on
//! a line that was reopened and stays silent. So every station that has a session has a last will.

use std::collections::BTreeSet;
use std::time::Duration;

use footplate_core::{Command, Event, EventKind, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_wire::{Session, Transmit};

use super::ending::WITHIN;
use crate::link::{Bequest, Link, Lost, StationSession};

/// How long the handshake line is down after a byte, for the copy: one byte at 2400 baud (Märklin). The guardian waits for
/// the real one.
const HAND_SHAKE: TimeSpan = TimeSpan::from_ms(5);
/// Upper bound: many times what stops every train of a station.
const MOST_PARTS: usize = 2_000;

/// A power command leaves within this time, other commands before it included; until then a last will begins without power, which is safe.
const POWER_LEAVES_WITHIN: TimeSpan = TimeSpan::from_ms(1_000);

/// A last will repeats every stop within this time (the slowest, of JMRI, every 500 ms): a station that is heard so long before the end
/// of it has received them all.
const ROUND: Duration = Duration::from_secs(1);

/// Between two attempts to open a line again.
const REOPEN_EVERY: Duration = Duration::from_millis(250);
/// How long a byte waits for the handshake. After that it is sent all the same.
const HAND_SHAKE_WITHIN: Duration = Duration::from_millis(100);
/// How often the handshake line is read meanwhile.
const HAND_SHAKE_EVERY: Duration = Duration::from_micros(500);
/// How long the handshake line may take to go down after a byte; before that, "up" means nothing.
const HAND_SHAKE_FALLS: Duration = Duration::from_millis(10);

/// Keeps the guardian's last will up to date.
#[derive(Debug, Default)]
pub(super) struct LastWill {
    /// Trains whose command was accepted and that no last will stops yet.
    expected: BTreeSet<TrainId>,
    /// Trains that were commanded to run.
    running: BTreeSet<TrainId>,
    was_running: bool,
    /// Whether the last will must be computed again.
    is_stale: bool,
    /// When a power command that was accepted has left the session.
    power_leaves: Option<Timestamp>,
}

impl LastWill {
    pub(super) fn new() -> Self {
        Self { is_stale: true, ..Self::default() }
    }

    /// A command was accepted; its bytes have not left.
    pub(super) fn accepted(&mut self, now: Timestamp, command: Command) {
        if let Command::PowerOff | Command::PowerOn = command {
            // A last will may begin with the power as it should be.
            (self.is_stale, self.power_leaves) = (true, Some(now + POWER_LEAVES_WITHIN));
        }
        if let Command::Speed { train, step } = command
            && step != SpeedStep::STAND
        {
            self.running.insert(train);
            self.expected.insert(train);
        }
    }

    /// A command has left.
    pub(super) fn left(&mut self, event: &Event) {
        match event.kind {
            EventKind::Speed { train, step: SpeedStep::STAND } => {
                self.running.remove(&train);
            }
            EventKind::Speed { train, .. } => {
                self.running.insert(train);
            }
            _ => {}
        }
    }

    /// The station has confirmed a direction, which a stop may name.
    pub(super) fn directed(&mut self) {
        self.is_stale = true;
    }

    /// Tells the guardian what has changed. Call it before bytes leave, so that the guardian can stop a train before the train
    /// receives its step.
    pub(super) fn keep<L: Link>(&mut self, session: &StationSession, link: &mut L) -> Result<(), Lost> {
        let (now, has_cts) = (link.now(), link.cts().is_some());
        let Some(guardian) = link.guardian() else { return Ok(()) };
        if !self.expected.is_empty() {
            let closing = session.closing();
            for train in closing.not_commanded.iter().chain(&closing.commanded_to_stop) {
                self.is_stale |= self.expected.remove(train);
            }
        }
        self.is_stale |= self.power_leaves.take_if(|leaves| now >= *leaves).is_some();
        if std::mem::take(&mut self.is_stale) {
            guardian.bequeath(&farewell_of(session, now, has_cts))?;
        }
        let runs = !self.running.is_empty();
        if runs != self.was_running {
            self.was_running = runs;
            guardian.note_running(runs)?;
        }
        Ok(())
    }
}

/// A last will as bytes: of each part the pause before it (µs, four bytes), its length (two bytes) and its bytes. A pause of the
/// station's clock takes `1 / speed` of it in real time.
pub(crate) fn written(will: &[Bequest], speed: f64) -> Vec<u8> {
    let mut bytes = Vec::new();
    for Bequest { after, bytes: part } in will {
        let pause_us = (after.as_s() * 1e6 / speed).clamp(0.0, f64::from(u32::MAX));
        bytes.extend((pause_us as u32).to_le_bytes());
        bytes.extend(u16::try_from(part.len()).unwrap_or(u16::MAX).to_le_bytes());
        bytes.extend(part);
    }
    bytes
}

/// A line over which a last will is sent.
pub(crate) trait WillLine {
    fn is_open(&self) -> bool;

    /// Opens it, anew if it is open.
    fn open(&mut self) -> Result<(), Lost>;

    /// Closes it, because it is gone.
    fn close(&mut self);

    /// Puts bytes on the line now.
    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost>;

    /// The station's hand-shake line; `None` where there is none that could be read.
    fn cts(&self) -> Option<bool>;

    fn pause(&mut self, span: Duration);

    /// Whether the station has answered anything since [`expect_answer`](Self::expect_answer); `true` for one that does not answer
    /// commands.
    fn has_answered(&self) -> bool;

    fn expect_answer(&mut self);

    /// Whether a person does not want to wait any longer.
    fn gives_up(&self) -> bool;

    fn say(&self, words: &str);
}

/// Sends a last will. Starts again each time the line has to be reopened, until all of it is sent or a person gives up; it is tried at
/// least once. Returns whether it was sent.
pub(crate) fn carry_out(line: &mut impl WillLine, will: &[u8]) -> bool {
    let mut was_gone = false;
    loop {
        let said = if line.is_open() { Ok(()) } else { line.open() };
        if said.is_ok() && std::mem::take(&mut was_gone) {
            line.say("the line is open again");
        }
        let Err(lost) = said.and_then(|()| try_to_carry_out(line, will)) else { return true };
        if !was_gone {
            line.say(&format!("{lost}; trying for ever (Ctrl-C gives up, and leaves trains running)"));
        }
        was_gone = true;
        line.close();
        line.pause(REOPEN_EVERY);
        if line.gives_up() {
            return false;
        }
    }
}

fn try_to_carry_out(line: &mut impl WillLine, will: &[u8]) -> Result<(), Lost> {
    line.expect_answer();
    let whole: Duration = Parts(will).map(|(pause, _)| pause).sum();
    let (mut elapsed, mut hears) = (Duration::ZERO, None);
    for (pause, bytes) in Parts(will) {
        line.pause(pause);
        elapsed += pause;
        if elapsed + ROUND > whole && whole > ROUND {
            hears.get_or_insert_with(|| line.has_answered());
        }
        await_hand_shake(line);
        line.write(bytes)?;
    }
    // A line that went during the last bytes did not carry them.
    line.pause(REOPEN_EVERY);
    if !line.is_open() {
        return Err(Lost("the line is gone".to_owned()));
    }
    // Datagrams vanish without notice, and so do bytes on a connection whose other end is gone. What a station says of itself after the
    // last of them shows only that the line is back.
    let hears = hears.unwrap_or_else(|| line.has_answered());
    if hears { Ok(()) } else { Err(Lost("the station does not answer".to_owned())) }
}

/// The parts of a last will that was [`written`]: the pause before each, and its bytes.
struct Parts<'w>(&'w [u8]);

impl<'w> Iterator for Parts<'w> {
    type Item = (Duration, &'w [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let [a, b, c, d, low, high, more @ ..] = self.0 else { return None };
        let pause = u32::from_le_bytes([*a, *b, *c, *d]);
        let length = usize::from(u16::from_le_bytes([*low, *high]));
        let (bytes, rest) = more.split_at_checked(length).unwrap_or((more, &[]));
        self.0 = rest;
        Some((Duration::from_micros(pause.into()), bytes))
    }
}

/// Waits until the station takes the next byte, where its hand-shake line can be read.
fn await_hand_shake(line: &mut impl WillLine) {
    let mut waited = Duration::ZERO;
    while line.cts() == Some(true) && waited < HAND_SHAKE_FALLS {
        line.pause(HAND_SHAKE_EVERY);
        waited += HAND_SHAKE_EVERY;
    }
    while line.cts() == Some(false) && waited < HAND_SHAKE_WITHIN {
        line.pause(HAND_SHAKE_EVERY);
        waited += HAND_SHAKE_EVERY;
    }
}

/// What a session sends at its end on a line that was reopened and is silent.
fn farewell_of(session: &StationSession, began: Timestamp, has_cts: bool) -> Vec<Bequest> {
    let mut copy = session.clone();
    let mut said = Vec::new();
    let (mut now, mut last) = (began, began);
    while copy.poll_output().is_some() {}
    copy.handle_reopened(now);
    if has_cts {
        copy.handle_cts(now, true);
    }
    copy.close(now);
    while said.len() < MOST_PARTS {
        let mut wrote = false;
        while let Some(output) = copy.poll_output() {
            let bytes = match output {
                Transmit::Byte(byte) => vec![byte],
                Transmit::Message(bytes) => bytes,
                Transmit::Event(_)
                | Transmit::Notice(_)
                | Transmit::Functions(..)
                | Transmit::Direction(..)
                | Transmit::ReportedSpeed(..) => continue,
            };
            said.push(Bequest { after: now - last, bytes });
            (last, wrote) = (now, true);
        }
        if copy.closing().is_complete() || now - began >= WITHIN {
            break;
        }
        if wrote && has_cts {
            copy.handle_cts(now, false);
            now += HAND_SHAKE;
            copy.handle_cts(now, true);
            continue;
        }
        let Some(next) = copy.next_timeout() else { break };
        now = next;
        copy.handle_timeout(now);
    }
    said
}

#[cfg(test)]
mod tests {
    use footplate_wire::dcc_ex;
    use footplate_wire::marklin_serial::{Interface, Message, Pace, Settings};

    use super::*;

    const TRAINS: [TrainId; 3] = [TrainId(24), TrainId(58), TrainId(71)];

    fn ms(will: &[Bequest]) -> Vec<(f64, Vec<u8>)> {
        let mut at = TimeSpan::ZERO;
        will.iter()
            .map(|part| {
                at += part.after;
                (at.as_ms(), part.bytes.clone())
            })
            .collect()
    }

    /// A session that has told its trains a step, and may have been cut off at any moment.
    fn driven(mut session: StationSession, until: Timestamp) -> StationSession {
        session.handle_cts(Timestamp::ZERO, true);
        for train in TRAINS {
            let step = SpeedStep::new(9).expect("a step");
            session.handle_command(Timestamp::ZERO, Command::Speed { train, step }).expect("an address");
        }
        while let Some(at) = session.next_timeout().filter(|at| *at < until) {
            while session.poll_output().is_some() {}
            session.handle_timeout(at);
        }
        session
    }

    /// A line that is open from its nth attempt on, and a person who does not wait.
    struct Impatient {
        opens_after: usize,
        attempts: usize,
        written: Vec<u8>,
    }

    impl WillLine for Impatient {
        fn is_open(&self) -> bool {
            self.attempts > self.opens_after
        }
        fn open(&mut self) -> Result<(), Lost> {
            self.attempts += 1;
            if self.is_open() { Ok(()) } else { Err(Lost("it is gone".to_owned())) }
        }
        fn close(&mut self) {}
        fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
            self.written.extend(bytes);
            Ok(())
        }
        fn cts(&self) -> Option<bool> {
            None
        }
        fn pause(&mut self, _: Duration) {}
        fn has_answered(&self) -> bool {
            true
        }
        fn expect_answer(&mut self) {}
        fn gives_up(&self) -> bool {
            true
        }
        fn say(&self, _: &str) {}
    }

    #[test]
    fn a_will_is_tried_once_even_if_a_person_gives_up() {
        let will = written(&[Bequest { after: TimeSpan::ZERO, bytes: b"stop".to_vec() }], 1.0);
        for (opens_after, sent) in [(0, true), (1, false)] {
            let mut line = Impatient { opens_after, attempts: 0, written: Vec::new() };
            assert_eq!(carry_out(&mut line, &will), sent);
            assert_eq!((line.attempts, line.written == b"stop"), (1, sent));
        }
    }

    /// A line whose station is reached from a time on, and then says something of itself.
    struct CutOff {
        back: Duration,
        now: Duration,
        heard: bool,
        arrived: Vec<Duration>,
    }

    impl WillLine for CutOff {
        fn is_open(&self) -> bool {
            true
        }
        fn open(&mut self) -> Result<(), Lost> {
            Ok(())
        }
        fn close(&mut self) {}
        fn write(&mut self, _: &[u8]) -> Result<(), Lost> {
            if self.now >= self.back {
                self.arrived.push(self.now);
            }
            Ok(())
        }
        fn cts(&self) -> Option<bool> {
            None
        }
        fn pause(&mut self, span: Duration) {
            self.now += span;
            self.heard |= self.now > self.back;
        }
        fn has_answered(&self) -> bool {
            self.heard
        }
        fn expect_answer(&mut self) {
            self.heard = false;
        }
        fn gives_up(&self) -> bool {
            false
        }
        fn say(&self, _: &str) {}
    }

    #[test]
    fn a_station_that_is_heard_only_after_the_last_stop_is_stopped_again() {
        // A stop every 100 ms for 5 s, as a session writes it on a line without answers.
        let stop = |nth: i64| Bequest { after: TimeSpan::from_ms(100 * nth.min(1)), bytes: b"stop".to_vec() };
        let will = written(&(0..=50).map(stop).collect::<Vec<_>>(), 1.0);
        for (back_ms, ends_ms) in [(0, 5_250), (3_900, 5_250), (4_100, 10_750), (5_100, 10_750)] {
            let back = Duration::from_millis(back_ms);
            let mut line = CutOff { back, now: Duration::ZERO, heard: false, arrived: Vec::new() };
            assert!(carry_out(&mut line, &will));
            assert_eq!(line.now, Duration::from_millis(ends_ms), "back after {back_ms} ms");
            let first = *line.arrived.first().expect("a stop");
            assert!(first - back <= Duration::from_millis(500), "{first:?}");
            assert!(line.arrived.len() >= 10, "{}", line.arrived.len());
        }
    }

    #[test]
    fn the_will_of_an_interface_stops_its_trains_at_once_from_any_moment_on() {
        for (pace, has_cts) in [(Pace::CAREFUL, false), (Pace::FAST, false), (Pace::Cts, true)] {
            for until in (0..1_000).step_by(7) {
                let settings = Settings { pace, ..Settings::with_cts(5) };
                let session = Interface::new(Timestamp::ZERO, settings).expect("modules").into();
                let now = Timestamp::ZERO + TimeSpan::from_ms(until);
                let said = ms(&farewell_of(&driven(session, now), now, has_cts));
                let bytes: Vec<u8> = said.iter().flat_map(|(_, bytes)| bytes).copied().collect();
                for train in TRAINS {
                    let light = settings.light;
                    let stop =
                        Message::Drive { train, step: SpeedStep::STAND, light }.encode().expect("bytes");
                    let stop = stop.as_bytes();
                    let at = bytes.windows(2).position(|two| two == stop).expect("a stop");
                    assert!(said[at + 1].0 < 700.0, "{train} after {until} ms, {pace:?}: {said:?}");
                }
                let [off @ .., last] = &bytes[bytes.len() - 2..] else { panic!("{bytes:?}") };
                let stop = Message::Stop.encode().expect("bytes");
                assert_eq!((off, &[*last][..]), (stop.as_bytes(), stop.as_bytes()));
            }
        }
    }

    #[test]
    fn no_will_switches_the_power_on_after_an_emergency_stop() {
        for until in (0..1_000).step_by(7) {
            let session: StationSession =
                Interface::new(Timestamp::ZERO, Settings::with_cts(5)).expect("modules").into();
            let now = Timestamp::ZERO + TimeSpan::from_ms(until);
            let mut session = driven(session, now);
            // The commands of an emergency stop are accepted; none has left yet.
            let mut will = LastWill::default();
            session.handle_command(now, Command::PowerOff).expect("always");
            will.accepted(now, Command::PowerOff);
            assert!(will.is_stale, "the guardian gets a new one");
            let said = farewell_of(&session, now, true);
            let go = Message::Go.encode().expect("bytes");
            assert!(said.iter().all(|part| part.bytes != go.as_bytes()), "after {until} ms: {said:?}");
        }
    }

    #[test]
    fn the_will_of_a_board_stops_its_trains_at_once() {
        let mut session: StationSession =
            dcc_ex::Client::new(Timestamp::ZERO, dcc_ex::Settings::default()).into();
        // A board that answers what is needed to open, and how each train faces.
        let mut now = Timestamp::ZERO;
        for train in TRAINS {
            let step = SpeedStep::new(9).expect("a step");
            session.handle_command(now, Command::Speed { train, step }).expect("an address");
        }
        while now < Timestamp::ZERO + TimeSpan::from_ms(3_000) {
            while let Some(output) = session.poll_output() {
                let Transmit::Message(bytes) = output else { continue };
                let answer = match String::from_utf8_lossy(&bytes).as_ref() {
                    "<s>" => "<iDCC-EX V-5.6.0 / MEGA / STANDARD_MOTOR_SHIELD G-x>\n<p0>\n".to_owned(),
                    "<1 MAIN>" => "<p1 MAIN>\n".to_owned(),
                    "<#>" => "<# 50>\n".to_owned(),
                    "<t 24>" => "<l 24 0 128 0>\n".to_owned(),
                    "<t 58>" => "<l 58 0 128 0>\n".to_owned(),
                    "<t 71>" => "<l 71 0 128 0>\n".to_owned(),
                    _ => continue,
                };
                session.handle_bytes(now, answer.as_bytes());
            }
            now += TimeSpan::from_ms(5);
            session.handle_timeout(now);
        }
        let said = ms(&farewell_of(&session, now, false));
        for train in TRAINS {
            let stop = format!("<t {train} 0");
            let first = said.iter().find(|(_, bytes)| String::from_utf8_lossy(bytes).starts_with(&stop));
            assert!(first.expect("a stop").0 < 500.0, "{said:?}");
        }
        assert!(said.iter().any(|(at, bytes)| bytes == b"<0>" && *at < 2_000.0), "{said:?}");
    }
}
