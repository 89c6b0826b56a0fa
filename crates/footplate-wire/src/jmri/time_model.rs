//! Delays between the track, the hardware, JMRI and this program.
//!
//! They depend on the hardware, of which JMRI drives dozens of kinds: some report a sensor at once, others are polled. So the range is
//! wide, and no source states it for all; [`Settings::sensor_delay`](super::Settings::sensor_delay) narrows or widens it.

use footplate_core::TimeSpan;
use footplate_core::link::{TimeModel, UsualLine};

use super::outstanding::REPEATED_AFTER;

/// The shortest time from a sensor being occupied until the program has the report (chosen: the report of a LocoNet detector takes
/// 2.4 ms on the bus alone, and JMRI passes it on within a millisecond).
pub const SENSOR_DELAY_SHORTEST: TimeSpan = TimeSpan::from_ms(3);

/// The longest, unless a person says another (chosen: twice that of LocoNet without JMRI).
pub const SENSOR_DELAY_LONGEST: TimeSpan = TimeSpan::from_ms(80);

/// The times for planners. A command counts as sent when it is handed to JMRI, which queues it for the hardware; a stop waits for
/// one request of 5 ms, behind the slowest report.
pub const TIME_MODEL: TimeModel = TimeModel {
    command: TimeSpan::ZERO,
    usual_wait: TimeSpan::from_ms(4),
    soonest: TimeSpan::from_ms(33),
    reaction: TimeSpan::from_ms(95),
    report_window: SENSOR_DELAY_LONGEST,
};

/// The line that these times hold for: JMRI answers from its own memory, within a few milliseconds on the same computer or network.
pub const USUAL_LINE: UsualLine =
    UsualLine { answers_within: TimeSpan::from_ms(40), repeated_after: REPEATED_AFTER };
