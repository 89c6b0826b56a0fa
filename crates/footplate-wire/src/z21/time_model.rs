//! Delays between the track, the station and this program.
//!
//! No source gives figures for a real Z21; these are reasoned, and wide on purpose. A feedback bus of this kind asks all its
//! modules in a cycle of 33 ms (the RS-bus that the R-BUS resembles), so that a change waits for up to one cycle; then the station
//! sends a datagram. Over a wired network that takes about a millisecond; 40 ms leave some for a busy station.

use footplate_core::TimeSpan;
use footplate_core::link::{TimeModel, UsualLine};

use super::outstanding::REPEATED_AFTER;

/// The shortest time from a sensor being occupied until the host has the message: a datagram's transit.
pub const SENSOR_DELAY_SHORTEST: TimeSpan = TimeSpan::from_ms(1);

/// The longest, unless a person says another: one cycle of the feedback bus and what the station needs.
pub const SENSOR_DELAY_LONGEST: TimeSpan = TimeSpan::from_ms(40);

/// The times for planners. A command counts as sent when its datagram is written. Datagrams go 20 ms apart at the most
/// crowded, and a tenth more is allowed; a stop waits for 5 ms at most, behind the slowest report.
pub const TIME_MODEL: TimeModel = TimeModel {
    command: TimeSpan::ZERO,
    usual_wait: TimeSpan::ZERO,
    soonest: TimeSpan::from_ms(22),
    reaction: TimeSpan::from_ms(50),
    report_window: SENSOR_DELAY_LONGEST,
};

/// The line that these times hold for: answers come within some milliseconds in the station, and a wired network.
pub const USUAL_LINE: UsualLine =
    UsualLine { answers_within: TimeSpan::from_ms(10), repeated_after: REPEATED_AFTER };
