//! Delays between the track, the bus and this program.
//!
//! The bus carries 16 457 bit/s, ten bits a byte. A message waits for the one before it, for 1.2 ms of silence, and by a throttle's or
//! detector's priority for up to 1.5 ms more (LocoNet Personal Use Edition, "Network timing"). How long detectors filter their inputs
//! no source says of all; 40 ms leave room for a scan and for a slot's data of 14 bytes before the report.

use footplate_core::TimeSpan;
use footplate_core::link::{TimeModel, UsualLine};

use super::outstanding::REPEATED_AFTER;

/// One byte on the bus.
pub const BUS_BYTE: TimeSpan = TimeSpan::from_us(608);

/// The shortest time from a sensor being occupied until the host has the message: its four bytes.
pub const SENSOR_DELAY_SHORTEST: TimeSpan = TimeSpan::from_ns(4 * BUS_BYTE.as_ns());

/// The longest, unless a person says another.
pub const SENSOR_DELAY_LONGEST: TimeSpan = TimeSpan::from_ms(40);

/// The times for planners. A command counts as sent when it is handed to the server; the request before it takes up to four
/// messages of 5 ms each, and a tenth more is allowed. A stop may wait for as long behind the slowest report.
pub const TIME_MODEL: TimeModel = TimeModel {
    command: TimeSpan::ZERO,
    usual_wait: TimeSpan::from_ms(4),
    soonest: TimeSpan::from_ms(33),
    reaction: TimeSpan::from_ms(70),
    report_window: SENSOR_DELAY_LONGEST,
};

/// The line that these times hold for: answers come within three messages on a bus that others use, too.
pub const USUAL_LINE: UsualLine =
    UsualLine { answers_within: TimeSpan::from_ms(40), repeated_after: REPEATED_AFTER };
