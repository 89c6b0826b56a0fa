//! The hand-shake line (CTS): when the station is ready for the next byte.

use footplate_core::{TimeSpan, Timestamp};

use crate::draws::Draws;

/// The time from the last bit of a byte until the line falls (chosen: a few instructions of a slow
/// processor; programs that look only at the level lose bytes by it).
const FALL: TimeSpan = TimeSpan::from_us(200);

/// The use of the hand-shake line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CtsSwitch {
    /// It falls after every byte.
    PerByte {
        /// The shortest time from the last bit of a byte until it is ready again.
        least: TimeSpan,
        /// The longest.
        most: TimeSpan,
    },
    /// There is no such line: the station accepts every byte, except while it answers.
    None,
}

impl CtsSwitch {
    /// A station that needs the hand-shake (times chosen: a fraction of a byte).
    pub const fn per_byte() -> Self {
        Self::PerByte { least: TimeSpan::from_us(500), most: TimeSpan::from_us(2000) }
    }
}

/// The state of the line, and its next changes.
#[derive(Debug, Clone)]
pub(crate) struct Cts {
    switch: CtsSwitch,
    pub(crate) is_up: bool,
    falls: Option<Timestamp>,
    rises: Option<Timestamp>,
}

impl Cts {
    pub(crate) const fn new(switch: CtsSwitch) -> Self {
        Self { switch, is_up: true, falls: None, rises: None }
    }

    /// A byte was received at a time and keeps the station busy until another.
    pub(crate) fn received(&mut self, at: Timestamp, busy_until: Timestamp, draws: &mut Draws) {
        let CtsSwitch::PerByte { least, most } = self.switch else { return };
        let takes = TimeSpan::from_s(draws.uniform(least.as_s()..most.as_s()));
        self.falls = Some(at + FALL);
        self.rises = Some((busy_until + takes).max(at + FALL + FALL));
    }

    /// The time of its next change.
    pub(crate) fn next(&self) -> Option<Timestamp> {
        self.falls.or(self.rises)
    }

    /// Changes it; returns its new state.
    pub(crate) fn change(&mut self) -> bool {
        if self.falls.take().is_some() {
            self.is_up = false;
        } else {
            self.rises = None;
            self.is_up = true;
        }
        self.is_up
    }

    /// Whether the station receives a byte that begins now.
    pub(crate) fn hears(&self) -> bool {
        self.switch == CtsSwitch::None || (self.is_up && self.falls.is_none())
    }
}
