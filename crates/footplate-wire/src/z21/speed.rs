//! How fast a locomotive is commanded to run, in each of the three numbers of steps that DCC decoders have.

use footplate_core::{DecoderSteps, SpeedStep};

/// How fast a locomotive is commanded to run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Throttle {
    /// It stops by its decoder's own rule.
    Stop,
    /// It stops at once.
    EmergencyStop,
    /// A step, from 1.
    Step(u8),
}

/// The lower bits of a speed byte that hold a step of 14 or 28.
const COARSE: u8 = 0x0f;
/// The bit of a speed byte that tells the upper of two steps of 28.
const UPPER: u8 = 0x10;

/// A number of steps as the station's answers name it.
pub(super) const fn code_of(steps: DecoderSteps) -> u8 {
    match steps {
        DecoderSteps::Fourteen => 0,
        DecoderSteps::TwentyEight => 2,
        DecoderSteps::All => 4,
    }
}

/// The number of steps that an answer names.
pub(super) const fn steps_of(code: u8) -> Option<DecoderSteps> {
    match code {
        0 => Some(DecoderSteps::Fourteen),
        2 => Some(DecoderSteps::TwentyEight),
        4 => Some(DecoderSteps::All),
        _ => None,
    }
}

impl Throttle {
    /// The throttle for a step of `steps`, among the steps that a locomotive is commanded in: all are equally far apart, and the
    /// highest is the highest. `None` beyond the highest step.
    pub fn of(step: SpeedStep, steps: DecoderSteps, commanded: DecoderSteps) -> Option<Self> {
        match steps.scaled(step, commanded.highest().get())? {
            0 => Some(Self::Stop),
            step => Some(Self::Step(step)),
        }
    }

    /// Whether a locomotive at this throttle is commanded to stand.
    #[must_use]
    pub const fn is_stop(self) -> bool {
        matches!(self, Self::Stop | Self::EmergencyStop)
    }

    /// The lower seven bits of the speed byte (NMRA S-9.2 and S-9.2.1): 0 stop, 1 emergency stop, 2 step 1.
    pub(super) const fn code(self, steps: DecoderSteps) -> u8 {
        match (self, steps) {
            (Self::Stop, _) | (Self::Step(0), _) => 0,
            (Self::EmergencyStop, _) => 1,
            (Self::Step(step), DecoderSteps::Fourteen | DecoderSteps::All) => step.saturating_add(1),
            (Self::Step(step), DecoderSteps::TwentyEight) => {
                step.div_ceil(2) + 1 + if step.is_multiple_of(2) { UPPER } else { 0 }
            }
        }
    }

    pub(super) const fn of_code(code: u8, steps: DecoderSteps) -> Self {
        let coarse = code & COARSE;
        match (steps, code) {
            (DecoderSteps::All, 0) => Self::Stop,
            (DecoderSteps::All, 1) => Self::EmergencyStop,
            (DecoderSteps::All, code) => Self::Step(code - 1),
            _ if coarse == 0 => Self::Stop,
            _ if coarse == 1 => Self::EmergencyStop,
            (DecoderSteps::Fourteen, _) => Self::Step(coarse - 1),
            (DecoderSteps::TwentyEight, code) => {
                Self::Step(2 * (coarse - 1) - if code & UPPER == 0 { 1 } else { 0 })
            }
        }
    }

    /// Whether it is the same speed as another, said in other steps: some stations keep the number of steps that they have
    /// stored for a locomotive.
    pub(super) fn is_like(self, steps: DecoderSteps, other: Self, other_steps: DecoderSteps) -> bool {
        match (self, other) {
            (Self::Step(step), Self::Step(other)) => {
                let [highest, other_highest] =
                    [steps, other_steps].map(|steps| u16::from(steps.highest().get()));
                let (one, two) = (u16::from(step) * other_highest, u16::from(other) * highest);
                // As near as the coarser of both can say it.
                2 * one.abs_diff(two) <= if steps == other_steps { 0 } else { highest.max(other_highest) }
            }
            (one, other) => one.is_stop() && other.is_stop(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_a_throttle_and_back() {
        for steps in DecoderSteps::EVERY {
            let all = (1..=steps.highest().get())
                .map(Throttle::Step)
                .chain([Throttle::Stop, Throttle::EmergencyStop]);
            for throttle in all {
                assert_eq!(Throttle::of_code(throttle.code(steps), steps), throttle, "{steps:?}");
            }
        }
        // The upper bit of 28 steps means nothing for stops.
        assert_eq!(Throttle::of_code(0x10, DecoderSteps::TwentyEight), Throttle::Stop);
        assert_eq!(Throttle::of_code(0x11, DecoderSteps::TwentyEight), Throttle::EmergencyStop);
    }

    #[test]
    fn the_steps_of_the_program_are_spread_over_those_of_the_decoder() {
        for (steps, each) in
            [(DecoderSteps::Fourteen, 1), (DecoderSteps::TwentyEight, 2), (DecoderSteps::All, 9)]
        {
            let throttle = |step, of| Throttle::of(SpeedStep::new(step).unwrap(), of, steps);
            for step in 1..=14 {
                assert_eq!(throttle(step, DecoderSteps::Fourteen), Some(Throttle::Step(step * each)));
            }
            assert_eq!(throttle(15, DecoderSteps::Fourteen), None);
            let highest = steps.highest();
            assert!((1..=highest.get()).all(|step| throttle(step, steps) == Some(Throttle::Step(step))));
        }
    }

    #[test]
    fn a_speed_is_recognised_in_the_steps_that_a_station_keeps() {
        let is_like =
            |one, steps, other, others| Throttle::Step(one).is_like(steps, Throttle::Step(other), others);
        assert!(
            is_like(72, DecoderSteps::All, 8, DecoderSteps::Fourteen)
                && is_like(72, DecoderSteps::All, 16, DecoderSteps::TwentyEight)
        );
        assert!(
            !is_like(72, DecoderSteps::All, 9, DecoderSteps::Fourteen)
                && !is_like(72, DecoderSteps::All, 73, DecoderSteps::All)
        );
        assert!(!Throttle::Stop.is_like(DecoderSteps::All, Throttle::Step(1), DecoderSteps::Fourteen));
        assert!(Throttle::Stop.is_like(DecoderSteps::All, Throttle::EmergencyStop, DecoderSteps::All));
    }
}
