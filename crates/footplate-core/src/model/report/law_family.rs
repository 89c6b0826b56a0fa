//! The laws by which a train may change speed, each with one number that is learnt: its pace.

use crate::kinematics::{SpeedChange, SpeedLaw};
use crate::time::TimeSpan;
use crate::units::Speed;

/// What stays the same from one change of speed to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Constant {
    /// The mean acceleration: a larger change takes longer. The pace is in m/s².
    Acceleration,
    /// The time of the law, whatever the change. The pace is in s.
    Time,
}

/// A law of speed change up to its pace.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LawFamily {
    /// The shape of the change.
    pub law: SpeedLaw,
    /// What stays the same between changes.
    pub constant: Constant,
}

/// Mean accelerations and times before a train has shown its own, as geometric mean and relative spread:
/// published courses' trains accelerate at 80 to 250 mm/s² and lag by 0.6 to 1.4 s; a whole change takes
/// three such times.
const EXPECTED_ACCELERATION: f64 = 0.150;
const EXPECTED_LAG_S: f64 = 1.0;
const EXPECTED_TIME_S: f64 = 3.0;
const EXPECTED_SPREAD: f64 = 0.4;

impl LawFamily {
    /// Every one there is: each shape with each constant, but a lag, which has only its time.
    pub fn all() -> impl Iterator<Item = Self> {
        SpeedLaw::ALL.into_iter().flat_map(|law| {
            [Constant::Acceleration, Constant::Time]
                .into_iter()
                .filter(move |constant| law != SpeedLaw::Lag || *constant == Constant::Time)
                .map(move |constant| Self { law, constant })
        })
    }

    /// The change from one speed to another at a pace.
    #[inline]
    #[must_use]
    pub fn change(self, pace: f64, from: Speed, to: Speed) -> SpeedChange<'static> {
        let time = match self.constant {
            Constant::Acceleration => (to - from).abs().as_m_per_s() / pace,
            Constant::Time => pace,
        };
        self.law.between(from, to, TimeSpan::from_s(time))
    }

    /// Logarithm of the pace before a train has shown its own, and its variance.
    #[must_use]
    pub fn expected_ln_pace(self) -> (f64, f64) {
        let middle = match (self.constant, self.law) {
            (Constant::Acceleration, _) => EXPECTED_ACCELERATION,
            (Constant::Time, SpeedLaw::Lag) => EXPECTED_LAG_S,
            (Constant::Time, _) => EXPECTED_TIME_S,
        };
        (libm::log(middle), EXPECTED_SPREAD * EXPECTED_SPREAD)
    }
}
