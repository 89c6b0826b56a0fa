//! How fast a locomotive is commanded to run, in each of the three numbers of steps that DCC decoders have.

use footplate_core::SpeedStep;

/// The speed steps of a decoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Steps {
    /// 14 steps.
    Fourteen,
    /// 28 steps.
    TwentyEight,
    /// 126 steps; the station says 128, because it counts stop and emergency stop.
    #[default]
    All,
}

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
/// The program's highest step on this link.
pub(super) const HIGHEST_STEP: u8 = 14;

impl Steps {
    /// The highest.
    #[must_use]
    pub const fn highest(self) -> u8 {
        match self {
            Self::Fourteen => 14,
            Self::TwentyEight => 28,
            Self::All => SpeedStep::HIGHEST,
        }
    }

    /// The throttle for one of the program's 14 steps: all are equally far apart, and the highest is the highest. `None` beyond
    /// step 14.
    #[must_use]
    pub const fn throttle_of(self, step: SpeedStep) -> Option<Throttle> {
        match step.get() {
            0 => Some(Throttle::Stop),
            step if step <= HIGHEST_STEP => Some(Throttle::Step(step * (self.highest() / HIGHEST_STEP))),
            _ => None,
        }
    }

    /// As the station's answers name them.
    pub(super) const fn code(self) -> u8 {
        match self {
            Self::Fourteen => 0,
            Self::TwentyEight => 2,
            Self::All => 4,
        }
    }

    pub(super) const fn of_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Fourteen),
            2 => Some(Self::TwentyEight),
            4 => Some(Self::All),
            _ => None,
        }
    }
}

impl Throttle {
    /// Whether a locomotive at this throttle is commanded to stand.
    #[must_use]
    pub const fn is_stop(self) -> bool {
        matches!(self, Self::Stop | Self::EmergencyStop)
    }

    /// The lower seven bits of the speed byte (NMRA S-9.2 and S-9.2.1): 0 stop, 1 emergency stop, 2 step 1.
    pub(super) const fn code(self, steps: Steps) -> u8 {
        match (self, steps) {
            (Self::Stop, _) | (Self::Step(0), _) => 0,
            (Self::EmergencyStop, _) => 1,
            (Self::Step(step), Steps::Fourteen | Steps::All) => step.saturating_add(1),
            (Self::Step(step), Steps::TwentyEight) => {
                step.div_ceil(2) + 1 + if step.is_multiple_of(2) { UPPER } else { 0 }
            }
        }
    }

    pub(super) const fn of_code(code: u8, steps: Steps) -> Self {
        let coarse = code & COARSE;
        match (steps, code) {
            (Steps::All, 0) => Self::Stop,
            (Steps::All, 1) => Self::EmergencyStop,
            (Steps::All, code) => Self::Step(code - 1),
            _ if coarse == 0 => Self::Stop,
            _ if coarse == 1 => Self::EmergencyStop,
            (Steps::Fourteen, _) => Self::Step(coarse - 1),
            (Steps::TwentyEight, code) => {
                Self::Step(2 * (coarse - 1) - if code & UPPER == 0 { 1 } else { 0 })
            }
        }
    }

    /// Whether it is the same speed as another, said in other steps: some stations keep the number of steps that they have
    /// stored for a locomotive.
    pub(super) fn is_like(self, steps: Steps, other: Self, other_steps: Steps) -> bool {
        match (self, other) {
            (Self::Step(step), Self::Step(other)) => {
                let (highest, other_highest) = (u16::from(steps.highest()), u16::from(other_steps.highest()));
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

    const EVERY: [Steps; 3] = [Steps::Fourteen, Steps::TwentyEight, Steps::All];

    #[test]
    fn every_code_is_a_throttle_and_back() {
        for steps in EVERY {
            let all =
                (1..=steps.highest()).map(Throttle::Step).chain([Throttle::Stop, Throttle::EmergencyStop]);
            for throttle in all {
                assert_eq!(Throttle::of_code(throttle.code(steps), steps), throttle, "{steps:?}");
            }
        }
        // The upper bit of 28 steps means nothing for stops.
        assert_eq!(Throttle::of_code(0x10, Steps::TwentyEight), Throttle::Stop);
        assert_eq!(Throttle::of_code(0x11, Steps::TwentyEight), Throttle::EmergencyStop);
    }

    #[test]
    fn the_steps_of_the_program_are_spread_over_those_of_the_decoder() {
        for (steps, each) in [(Steps::Fourteen, 1), (Steps::TwentyEight, 2), (Steps::All, 9)] {
            for step in 1..=14 {
                let throttle = steps.throttle_of(SpeedStep::new(step).unwrap());
                assert_eq!(throttle, Some(Throttle::Step(step * each)));
            }
            assert_eq!(steps.throttle_of(SpeedStep::new(15).unwrap()), None);
        }
    }

    #[test]
    fn a_speed_is_recognised_in_the_steps_that_a_station_keeps() {
        let is_like =
            |one, steps, other, others| Throttle::Step(one).is_like(steps, Throttle::Step(other), others);
        assert!(
            is_like(72, Steps::All, 8, Steps::Fourteen) && is_like(72, Steps::All, 16, Steps::TwentyEight)
        );
        assert!(!is_like(72, Steps::All, 9, Steps::Fourteen) && !is_like(72, Steps::All, 73, Steps::All));
        assert!(!Throttle::Stop.is_like(Steps::All, Throttle::Step(1), Steps::Fourteen));
        assert!(Throttle::Stop.is_like(Steps::All, Throttle::EmergencyStop, Steps::All));
    }
}
