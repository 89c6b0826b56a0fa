//! What is said of a period: the state of each wheelset, the mode, and the bounds in the sense in which distance grows.

use super::motion_estimate::{Mode, MotionBounds, MotionEstimate, WheelState};
use super::odometer::Odometer;
use super::wheel_channel::WheelChannel;
use super::wheels::{Loss, Range};
use crate::units::{Length, Speed};

/// Both sensors silent for longer: nothing is known of the speed but its bounds (s).
const BLIND_S: f64 = 5.0;
/// A correction of a train that is slower ends by itself (m/s).
const NEARLY_STANDING: f64 = 0.1;
/// What is more probable than not is said of a wheelset.
const PROBABLE: f64 = 0.5;

impl Odometer {
    /// Which wheelsets probably slip or slide, and which sensors are probably dead.
    pub(super) fn probable(&self) -> ([Option<Loss>; 2], [bool; 2]) {
        let [_, first, second, both, alike, _, first_dead, second_dead] = self.bank.probabilities();
        let loss = if self.bank.holds_back() { Loss::Slide } else { Loss::Spin };
        let slips = |own: f64| (own + both + alike > PROBABLE).then_some(loss);
        ([slips(first), slips(second)], [first_dead > PROBABLE, second_dead > PROBABLE])
    }

    pub(super) fn states(&self, lost: [Option<Loss>; 2], dead: [bool; 2]) -> [WheelState; 2] {
        let [first, second] = &self.wheels;
        let ([first_lost, second_lost], [first_dead, second_dead]) = (lost, dead);
        let state = |wheel: &WheelChannel, lost, dead| match lost {
            _ if !wheel.is_read() || dead => WheelState::Excluded,
            Some(Loss::Slide) => WheelState::Slide,
            Some(Loss::Spin) => WheelState::Spin,
            None => WheelState::Rolling,
        };
        [state(first, first_lost, first_dead), state(second, second_lost, second_dead)]
    }

    pub(super) fn mode(&self, states: [WheelState; 2]) -> Mode {
        let longest = self.vehicle.thresholds.longest_correction.as_s();
        if self.blind > BLIND_S || self.corrected_for > longest && self.speed > NEARLY_STANDING {
            return Mode::Ambiguous;
        }
        match states {
            [WheelState::Excluded, _] | [_, WheelState::Excluded] => Mode::Degraded,
            [WheelState::Rolling, WheelState::Rolling] => Mode::Normal,
            [WheelState::Rolling, _] | [_, WheelState::Rolling] => Mode::OneSlip,
            _ => Mode::Correction,
        }
    }

    /// Fills in the bounds, in the sense in which distance grows, and the amounts that never decrease.
    pub(super) fn finished(&self, estimate: MotionEstimate, last: &MotionEstimate) -> MotionEstimate {
        let sense = |range: Range| if self.direction < 0.0 { range.reversed() } else { range };
        let bounds = |speed: Range, distance: Range| {
            let (speed, distance) = (sense(speed), sense(distance));
            MotionBounds {
                speed_low: Speed::from_m_per_s(speed.low),
                speed_high: Speed::from_m_per_s(speed.high),
                distance_low: Length::from_m(distance.low),
                distance_high: Length::from_m(distance.high),
            }
        };
        let guaranteed = bounds(self.bounds.speed(), self.distance_bounds.distance());
        // Where a run begins the distance is guaranteed to be zero.
        let probable = self.probable_distance.and(self.distance_bounds.distance());
        let confidence = bounds(self.probable_speed, probable);
        let [over, under] = self.amounts;
        let over = (estimate.distance - guaranteed.distance_low + Length::from_m(over)).max(last.over);
        let under = (guaranteed.distance_high - estimate.distance + Length::from_m(under)).max(last.under);
        MotionEstimate { guaranteed, confidence, over, under, ..estimate }
    }
}
