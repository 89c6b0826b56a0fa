//! A number with its uncertainty, as it is passed between modules.
//!
//! It is in the lowest layer, not in `tracking`: the model, kinematics and the files below the filters all use it.

use crate::time::Timestamp;

/// Half-width of a 95 % interval of a normal distribution, in standard deviations.
pub const HALF_95: f64 = 1.959_964;

/// A value, its uncertainty, the number of measurements behind it, and the date of the newest.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Estimate<Q = f64> {
    /// The estimate, in the unit of its type.
    pub value: Q,
    /// One standard deviation, in the unit of its type. Measured or derived, never a default.
    pub uncertainty: Q,
    /// The number of measurements behind the value.
    pub count: u32,
    /// When the newest of them was made.
    pub date: Timestamp,
}

impl<Q> Estimate<Q> {
    /// The same measurements with `f` applied to value and uncertainty: a change of unit, or an exact factor.
    #[must_use]
    pub fn scaled<R>(self, f: impl Fn(Q) -> R) -> Estimate<R> {
        Estimate {
            value: f(self.value),
            uncertainty: f(self.uncertainty),
            count: self.count,
            date: self.date,
        }
    }
}
