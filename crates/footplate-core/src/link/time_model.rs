//! The times of a link, for planners and estimators, whatever the command station.

use crate::time::TimeSpan;

/// The times of a link: from planning a command until it was sent, and from a detection to a changed plan.
///
/// Each station's session supplies its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TimeModel {
    /// From the first to the last bit of a command on the line.
    pub command: TimeSpan,
    /// The mean time that a command waits for other bytes on the line.
    pub usual_wait: TimeSpan,
    /// The longest time until a command that is ordered now was sent: the longest wait and the command itself.
    pub soonest: TimeSpan,
    /// The longest time from a detection until its report has changed a plan and the new command was sent.
    pub reaction: TimeSpan,
    /// The longest time from a detection to its report, for reports without an interval.
    pub report_window: TimeSpan,
}

impl TimeModel {
    /// Assumed until a link states its own: a slow serial line on which sensors are polled every 70 ms. No link in use
    /// takes longer to send a command.
    pub const ASSUMED: Self = Self {
        command: TimeSpan::from_us(9_167),
        usual_wait: TimeSpan::from_ms(29),
        soonest: TimeSpan::from_ms(66),
        reaction: TimeSpan::from_ms(150),
        report_window: TimeSpan::from_ms(70),
    };

    /// The mean time until a command that is ordered now was sent.
    pub fn usually_left(&self) -> TimeSpan {
        self.command + self.usual_wait
    }
}

/// That of an unknown link.
impl Default for TimeModel {
    fn default() -> Self {
        Self::ASSUMED
    }
}
