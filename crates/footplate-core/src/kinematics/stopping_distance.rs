//! The three distances that are called *the* stopping distance, as three types that do not mix.
//!
//! ```text
//! what is known exactly           the distance is counted from      and is
//! where braking begins            FromBraking                       σ₃
//! where the command is given      FromCommand                       v τ₂ + σ₃
//! where a polled report came      FromReport                        v (φ + π/2 + τ₂) + σ₃
//! ```
//!
//! Letters: `v` speed, `σ₃` braking distance, `τ₂` from the command until the decoder starts to brake, `φ` from the
//! reading of a sensor until its report is stamped, `π` the interval of the poll that reported it: the sensor tripped
//! at any moment of that interval, on average half of it before the reading.
//!
//! At 500 mm/s and 65 ms each, the three differ by 32 mm and by 49 mm, several times the scatter of a stop.

use core::marker::PhantomData;

use crate::time::TimeSpan;
use crate::units::{Length, Speed};

/// Counted from where the train begins to brake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FromBraking;

/// Counted from where the train is when the command to stop is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FromCommand;

/// Counted from the sensor whose report triggers the command, which is sent at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FromReport;

/// Distance until the train is at rest; the type states from where it is counted.
///
/// ```compile_fail
/// use footplate_core::kinematics::{FromBraking, FromCommand, StoppingDistance};
/// use footplate_core::Length;
/// let braking = StoppingDistance::<FromBraking>::new(Length::from_mm(300.0));
/// let command: StoppingDistance<FromCommand> = braking; // only together with a speed and a delay
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StoppingDistance<From> {
    length: Length,
    counted_from: PhantomData<From>,
}

impl<From> StoppingDistance<From> {
    /// A length measured or computed from where the type says.
    #[must_use]
    pub const fn new(length: Length) -> Self {
        Self { length, counted_from: PhantomData }
    }

    /// The plain length.
    #[must_use]
    pub const fn length(self) -> Length {
        self.length
    }

    fn longer<Other>(self, speed: Speed, delay: TimeSpan) -> StoppingDistance<Other> {
        StoppingDistance::new(self.length + speed.abs() * delay)
    }
}

impl StoppingDistance<FromBraking> {
    /// For a train that runs at `speed` and starts to brake `command_delay` (τ₂) after the command.
    #[must_use]
    pub fn counted_from_command(
        self,
        speed: Speed,
        command_delay: TimeSpan,
    ) -> StoppingDistance<FromCommand> {
        self.longer(speed, command_delay)
    }
}

impl StoppingDistance<FromCommand> {
    /// From a distance counted from braking, for a train at `speed` that starts to brake `command_delay` (τ₂) after
    /// the command. A negative result means that speed, delay and distance are inconsistent.
    #[must_use]
    pub fn counted_from_braking(
        self,
        speed: Speed,
        command_delay: TimeSpan,
    ) -> StoppingDistance<FromBraking> {
        self.longer(speed, -command_delay)
    }

    /// The mean, for a train that passes a sensor at `speed`, reported `to_stamp` (φ) after a reading that came
    /// `poll_interval` (π) after the previous one.
    #[must_use]
    pub fn counted_from_report(
        self,
        speed: Speed,
        to_stamp: TimeSpan,
        poll_interval: TimeSpan,
    ) -> StoppingDistance<FromReport> {
        self.longer(speed, mean_report_delay(to_stamp, poll_interval))
    }
}

impl StoppingDistance<FromReport> {
    /// The inverse of [`counted_from_report`](StoppingDistance::<FromCommand>::counted_from_report).
    #[must_use]
    pub fn counted_from_command(
        self,
        speed: Speed,
        to_stamp: TimeSpan,
        poll_interval: TimeSpan,
    ) -> StoppingDistance<FromCommand> {
        self.longer(speed, -mean_report_delay(to_stamp, poll_interval))
    }
}

/// Mean time from the tripping of a sensor to the stamp of its report: φ + π/2.
pub(super) fn mean_report_delay(to_stamp: TimeSpan, poll_interval: TimeSpan) -> TimeSpan {
    to_stamp + TimeSpan::from_ns(poll_interval.as_ns() / 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPEED: Speed = Speed::from_mm_per_s(500.0);
    const DELAY: TimeSpan = TimeSpan::from_ms(65);

    #[test]
    fn each_delay_adds_what_the_train_runs_in_it() {
        let braking = StoppingDistance::<FromBraking>::new(Length::from_mm(400.0));
        let command = braking.counted_from_command(SPEED, DELAY);
        assert!((command.length().as_mm() - 432.5).abs() < 1e-9);
        // 65 ms to the stamp and half of 65 ms of polling.
        let report = command.counted_from_report(SPEED, DELAY, DELAY);
        assert!((report.length().as_mm() - (432.5 + 48.75)).abs() < 1e-9);
        let back = report.counted_from_command(SPEED, DELAY, DELAY).counted_from_braking(SPEED, DELAY);
        assert!((back.length() - braking.length()).abs() < Length::from_mm(1e-9));
    }

    #[test]
    fn a_train_that_backs_up_needs_the_same_distance() {
        let braking = StoppingDistance::<FromBraking>::new(Length::from_mm(400.0));
        assert_eq!(braking.counted_from_command(-SPEED, DELAY), braking.counted_from_command(SPEED, DELAY));
    }
}
