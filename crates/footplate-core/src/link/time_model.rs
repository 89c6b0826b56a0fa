//! How long a link takes, as planners and estimators need to know it of any command station.

use crate::time::TimeSpan;

/// The times of a link: from a command that is planned to one that has left, and from a detection to a changed plan.
///
/// Each station's session supplies its own; a machine is given it as a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TimeModel {
    /// From the first bit of a command on the line until it has left.
    pub command: TimeSpan,
    /// How long a command waits in the mean for what is on the line already.
    pub usual_wait: TimeSpan,
    /// How soon a command that is ordered now has surely left: the longest wait and the command itself.
    pub soonest: TimeSpan,
    /// From a detection until its report can have changed a plan and the new command has left, at the longest.
    pub reaction: TimeSpan,
    /// How long before its report a detection may have occurred, if the report does not say.
    pub report_window: TimeSpan,
}

impl TimeModel {
    /// A line of 2400 baud, eleven bits a byte, on which sensors are polled: the slowest link in use.
    ///
    /// Two bytes a command; the longest poll is eleven bytes of 4.583 ms and half of that is waited for, rounded; a
    /// tenth is added to the soonest. A poll that just missed a detection, the next one and the command take 150 ms.
    /// Intervals of up to 70 ms between polls were measured.
    pub const POLLED_2400_BAUD: Self = Self {
        command: TimeSpan::from_us(9_167),
        usual_wait: TimeSpan::from_ms(29),
        soonest: TimeSpan::from_ms(66),
        reaction: TimeSpan::from_ms(150),
        report_window: TimeSpan::from_ms(70),
    };

    /// When a command that is decided now usually has left.
    #[must_use]
    pub fn usually_left(&self) -> TimeSpan {
        self.command + self.usual_wait
    }
}

/// The most careful one.
impl Default for TimeModel {
    fn default() -> Self {
        Self::POLLED_2400_BAUD
    }
}
