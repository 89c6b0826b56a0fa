//! Delays between the track, the board and this program.
//!
//! Measured on firmware 5.6.0 under a cycle-accurate simulator in real time, 8 sensors defined. The source agrees: each sensor
//! is read every 10 ms at most, and a change counts when the next scan confirms it.

use footplate_core::TimeSpan;
use footplate_core::link::{TimeModel, UsualLine};

use super::outstanding::REPEATED_AFTER;

/// The shortest time from a sensor being occupied until the host has the message (20 samples; median 16.8 ms).
pub const SENSOR_DELAY_SHORTEST: TimeSpan = TimeSpan::from_us(3_600);

/// The longest of the same samples.
pub const SENSOR_DELAY_LONGEST: TimeSpan = TimeSpan::from_us(23_100);

/// The shortest time from `<t …>` to `<l …>` with one request outstanding (40 samples; median 3.4 ms).
pub const ANSWER_SHORTEST: TimeSpan = TimeSpan::from_us(600);

/// The longest of the same samples.
pub const ANSWER_LONGEST: TimeSpan = TimeSpan::from_us(9_100);

/// The times for planners. A command counts as sent when it is written; requests go 50 ms apart at the most crowded,
/// and a tenth more is allowed; a stop waits for one request of 10 ms only, behind the slowest report.
pub const TIME_MODEL: TimeModel = TimeModel {
    command: TimeSpan::ZERO,
    usual_wait: TimeSpan::from_ms(4),
    soonest: TimeSpan::from_ms(55),
    reaction: TimeSpan::from_ms(40),
    report_window: TimeSpan::from_ms(20),
};

/// The line that these times hold for: answers come within the longest that was measured.
pub const USUAL_LINE: UsualLine =
    UsualLine { answers_within: ANSWER_LONGEST, repeated_after: REPEATED_AFTER };
