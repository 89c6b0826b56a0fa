//! When the station is ready for the next byte, and how it says so.

use footplate_core::{TimeSpan, Timestamp};

use crate::draws::Draws;

/// From the last bit of a byte until the station takes its readiness back (chosen: a few instructions of a slow
/// processor; programs that look only at the level lose bytes by it).
const FALL: TimeSpan = TimeSpan::from_us(200);

/// How the station uses the wire that says whether it is ready.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CtsSwitch {
    /// It says so, byte by byte.
    PerByte {
        /// The shortest time from the last bit of a byte until it is ready again.
        least: TimeSpan,
        /// The longest.
        most: TimeSpan,
    },
    /// There is no such wire: the station accepts every byte, except while it answers.
    None,
}

impl CtsSwitch {
    /// A box that wants to be asked (times chosen: a fraction of a byte).
    #[must_use]
    pub const fn per_byte() -> Self {
        Self::PerByte { least: TimeSpan::from_us(500), most: TimeSpan::from_us(2000) }
    }
}

/// Whether the station is ready, and when that will change.
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

    /// When it changes next.
    pub(crate) fn next(&self) -> Option<Timestamp> {
        self.falls.or(self.rises)
    }

    /// It changes; returns what it is now.
    pub(crate) fn change(&mut self) -> bool {
        if self.falls.take().is_some() {
            self.is_up = false;
        } else {
            self.rises = None;
            self.is_up = true;
        }
        self.is_up
    }

    /// Whether a byte that begins now is heard.
    pub(crate) fn hears(&self) -> bool {
        self.switch == CtsSwitch::None || (self.is_up && self.falls.is_none())
    }
}
