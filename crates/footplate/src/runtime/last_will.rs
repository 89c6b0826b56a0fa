//! The last will: what a guardian sends to the station if this program dies. It is the end of the session, computed in
//! advance.
//!
//! A guardian knows no station. It receives bytes and times: those that a copy of the session produces when it is closed on
//! a line that was reopened and stays silent. So every station that has a session has a last will.

use std::collections::BTreeSet;

use footplate_core::{Command, Event, EventKind, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_wire::{Session, Transmit};

use super::ending::WITHIN;
use crate::link::{Bequest, Link, Lost};

/// How long the handshake line is down after a byte, for the copy: one byte at 2400 baud (Märklin). The guardian waits for
/// the real one.
const HAND_SHAKE: TimeSpan = TimeSpan::from_ms(5);
/// Upper bound: many times what stops every train of a station.
const MOST_PARTS: usize = 2_000;

/// A power command leaves within this time, other commands before it included; until then a last will begins without power, which is safe.
const POWER_LEAVES_WITHIN: TimeSpan = TimeSpan::from_ms(1_000);

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
    pub(super) fn keep<L: Link>(&mut self, session: &dyn Session, link: &mut L) -> Result<(), Lost> {
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

/// What a session sends at its end on a line that was reopened and is silent.
fn farewell_of(session: &dyn Session, began: Timestamp, has_cts: bool) -> Vec<Bequest> {
    let mut copy = session.copied();
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

    /// A session that has commanded its trains a step, and may have been cut off at any moment.
    fn driven(mut session: impl Session, until: Timestamp) -> impl Session {
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

    #[test]
    fn the_will_of_an_interface_stops_its_trains_at_once_from_any_moment_on() {
        for (pace, has_cts) in [(Pace::CAREFUL, false), (Pace::FAST, false), (Pace::Cts, true)] {
            for until in (0..1_000).step_by(7) {
                let settings = Settings { pace, ..Settings::with_cts(5) };
                let session = Interface::new(Timestamp::ZERO, settings).expect("modules");
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
            let session = Interface::new(Timestamp::ZERO, Settings::with_cts(5)).expect("modules");
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
        let mut session = dcc_ex::Client::new(Timestamp::ZERO, dcc_ex::Settings::default());
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
