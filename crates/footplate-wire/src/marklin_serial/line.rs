//! Times on the serial line of the interface.
//!
//! The line is the bottleneck of the whole railway: each command waits for the poll before it, and each poll for the command before
//! it.

use footplate_core::TimeSpan;
use footplate_core::link::TimeModel;

/// The speed of the line (Märklin, instructions of the 6050).
const BITS_PER_S: i64 = 2400;
/// One start bit, eight data bits, no parity, two stop bits (same source).
const BITS_PER_BYTE: i64 = 11;
const NS_PER_S: i64 = 1_000_000_000;

/// One byte on the line: 11 bits at 2400 baud, 4.583 ms.
pub const BYTE_TIME: TimeSpan = TimeSpan::from_ns(BITS_PER_BYTE * NS_PER_S / BITS_PER_S);

/// From one byte of a reply to the next: the interface leaves a little more room than the line needs (4.87 ms,
/// very constant; measured on a 6051 by R. Elder, report on a train controller, Waterloo CS 452).
pub const REPLY_BYTE_SPACING: TimeSpan = TimeSpan::from_us(4_870);

/// The shortest time a solenoid must be powered to throw its turnout (Waterloo CS 452, lecture 2 of fall 2019).
pub const SOLENOID_HOLD_SHORTEST: TimeSpan = TimeSpan::from_ms(100);

/// The longest time a solenoid may be powered; forgetting to switch it off burns its coil (same source).
pub const SOLENOID_HOLD_LONGEST: TimeSpan = TimeSpan::from_ms(500);

/// The times for planners.
///
/// Two bytes a command; the longest poll is eleven bytes of 4.583 ms and half of that is waited for, rounded; a
/// tenth is added to the soonest. A poll that just missed a detection, the next one and the command take 150 ms.
/// Intervals of up to 70 ms between polls were measured.
pub const TIME_MODEL: TimeModel = TimeModel {
    command: TimeSpan::from_us(9_167),
    usual_wait: TimeSpan::from_ms(29),
    soonest: TimeSpan::from_ms(66),
    reaction: TimeSpan::from_ms(150),
    report_window: TimeSpan::from_ms(70),
};

/// How long a number of bytes without gaps occupies the line.
pub const fn time_on_line(bytes: u32) -> TimeSpan {
    TimeSpan::from_ns(BITS_PER_BYTE * NS_PER_S * bytes as i64 / BITS_PER_S)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_model_is_that_of_this_line() {
        // Two bytes a command: 22 bits at 2400 baud. The longest poll, a command and a tenth: 1.1 (50.417 + 9.167) ms.
        assert!((TIME_MODEL.command - time_on_line(2)).abs() < TimeSpan::from_us(1));
        let soonest = (time_on_line(11) + time_on_line(2)).as_ms() * 1.1;
        assert!((TIME_MODEL.soonest.as_ms() - soonest).abs() < 0.5, "{soonest}");
    }

    #[test]
    fn a_poll_of_five_modules_takes_fifty_milliseconds() {
        // One byte asks, ten answer: 11 bytes of 11 bits at 2400 baud are 50.417 ms.
        assert_eq!(time_on_line(11), TimeSpan::from_ns(50_416_666));
        assert_eq!(time_on_line(1), BYTE_TIME);
    }
}
