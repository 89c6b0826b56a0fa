//! What is said of a period: the state of each wheelset, the mode, and the bounds in the sense in which distance grows.

use super::motion_estimate::{Mode, MotionEstimate, WheelState};
use super::odometer::Odometer;
use super::virtual_sensor::VirtualSensor;
use super::wheel_channel::WheelChannel;
use crate::units::{Length, Speed};
use crate::wheels::Loss;

/// Both sensors silent or disbelieved for longer: the estimate is a guess (s).
const BLIND_S: f64 = 5.0;
/// A correction of a train that is slower ends by itself (m/s).
const NEARLY_STANDING: f64 = 0.1;

impl Odometer {
    pub(super) fn states(&self, lost: [Option<Loss>; 2]) -> [WheelState; 2] {
        let [first, second] = &self.wheels;
        let [first_lost, second_lost] = lost;
        let state = |wheel: &WheelChannel, lost| match lost {
            _ if !wheel.is_read() => WheelState::Excluded,
            Some(Loss::Slide) => WheelState::Slide,
            Some(Loss::Spin) => WheelState::Spin,
            None => WheelState::Rolling,
        };
        [state(first, first_lost), state(second, second_lost)]
    }

    pub(super) fn mode(&self, lost: [Option<Loss>; 2], trusted: [bool; 2]) -> Mode {
        let too_long = |sensor: &VirtualSensor| {
            sensor.elapsed() > self.vehicle.thresholds.longest_correction.as_s()
                && self.train.v > NEARLY_STANDING
        };
        if self.blind > BLIND_S || self.stand_in.as_ref().is_some_and(too_long) {
            return Mode::Ambiguous;
        }
        if self.wheels.iter().any(|wheel| !wheel.is_read()) {
            return Mode::Degraded;
        }
        match (trusted, lost) {
            ([false, false], _) => Mode::Correction,
            (_, [None, None]) => Mode::Normal,
            _ => Mode::OneSlip,
        }
    }

    /// Fills in the bounds, in the sense in which distance grows, and the amounts that never decrease.
    pub(super) fn finished(&self, estimate: MotionEstimate, last: &MotionEstimate) -> MotionEstimate {
        let (mut speed, mut ways) = (self.bounds.speed(), self.ways.distance());
        if self.way < 0.0 {
            (speed, ways) = (speed.reversed(), ways.reversed());
        }
        let distance = estimate.distance.as_m();
        let [over, under] = self.amounts;
        let over = Length::from_m(over + distance - ways.low).max(last.over);
        let under = Length::from_m(under + ways.high - distance).max(last.under);
        MotionEstimate {
            speed_low: Speed::from_m_per_s(speed.low),
            speed_high: Speed::from_m_per_s(speed.high),
            distance_low: Length::from_m(ways.low),
            distance_high: Length::from_m(ways.high),
            over,
            under,
            ..estimate
        }
    }
}
