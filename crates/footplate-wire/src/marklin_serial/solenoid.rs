//! The one coil that may be powered at a time, and when it has to be released.

use footplate_core::{Command, TimeSpan, Timestamp, TurnoutId};

use super::line::{BYTE_TIME, SOLENOID_HOLD_LONGEST, SOLENOID_HOLD_SHORTEST};

/// How long a solenoid is powered where the line allows it: Märklin's text says about 150 ms.
const HOLD: TimeSpan = TimeSpan::from_ms(150);

/// From here on a release goes before everything, emergency stops too: as many of them as there are trains would take
/// longer than the coil bears, and one byte delays them by 5 ms. With careful gaps up to 210 ms may still pass until the
/// line is in step.
const HURRY_AFTER: TimeSpan = TimeSpan::from_ms(250);

/// How often a release is repeated on a line that was disturbed, once after each of the next whole replies. Nothing confirms it: where
/// noise alters its one byte, every reply may still come whole. Three releases are altered once in 8000 times where one byte in
/// twenty is.
const REPEATS: u8 = 2;

/// The solenoid that is powered, if one is, and how often the last release is still to be repeated.
#[derive(Debug, Clone, Default)]
pub(super) struct Solenoid {
    powered: Option<(TurnoutId, Timestamp)>,
    repeats: u8,
    /// A whole reply has come since the last release.
    repeat_is_due: bool,
}

impl Solenoid {
    /// The last bit of its turnout's command has left.
    pub(super) fn power(&mut self, turnout: TurnoutId, at: Timestamp) {
        *self = Self { powered: Some((turnout, at)), ..Self::default() };
    }

    /// It was released, on a line that may be noisy or not; returns what was powered for longer than it bears.
    pub(super) fn release(&mut self, at: Timestamp, is_noisy: bool) -> Option<(TurnoutId, TimeSpan)> {
        self.repeats = match self.powered {
            Some(_) if is_noisy => REPEATS,
            Some(_) => 0,
            None => self.repeats.saturating_sub(1),
        };
        self.repeat_is_due = false;
        let (turnout, since) = self.powered.take()?;
        let held = at - since;
        (held > SOLENOID_HOLD_LONGEST).then_some((turnout, held))
    }

    /// A whole reply has come.
    pub(super) fn answered(&mut self) {
        self.repeat_is_due = self.repeats > 0;
    }

    /// Whether the last release is to be repeated now.
    pub(super) const fn repeat_is_due(&self) -> bool {
        self.repeat_is_due
    }

    pub(super) fn is_powered(&self) -> bool {
        self.powered.is_some()
    }

    /// Whether a command may go now: turnouts wait in their order while one is powered.
    pub(super) fn lets(&self, command: &Command) -> bool {
        !(self.is_powered() && matches!(command, Command::Turnout { .. }))
    }

    fn since(&self) -> Option<Timestamp> {
        self.powered.map(|(_, since)| since)
    }

    /// When to write its release.
    pub(super) fn due(&self) -> Option<Timestamp> {
        Some(self.since()? + HOLD)
    }

    /// The same where nothing else is to come any more: as soon as the turnout is sure to have moved. The byte is on
    /// the line for a while more.
    pub(super) fn earliest(&self) -> Option<Timestamp> {
        Some(self.since()? + SOLENOID_HOLD_SHORTEST)
    }

    pub(super) fn hurries(&self, now: Timestamp) -> bool {
        self.hurries_at().is_some_and(|at| now >= at)
    }

    pub(super) fn hurries_at(&self) -> Option<Timestamp> {
        Some(self.since()? + HURRY_AFTER)
    }

    /// When the line has to be free for its release at the latest: a whole command may be in transit by then.
    pub(super) fn latest(&self) -> Option<Timestamp> {
        const ROOM: i64 = 4;
        Some(self.since()? + SOLENOID_HOLD_LONGEST - TimeSpan::from_ns(BYTE_TIME.as_ns() * ROOM))
    }
}
