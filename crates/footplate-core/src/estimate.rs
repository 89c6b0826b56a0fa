//! A number with its uncertainty: the type in which numbers travel.
//!
//! It stands in the lowest layer, not in `tracking`, because the model, kinematics and the files below
//! the filters all pass it on.

use crate::time::Timestamp;

/// Half of an interval that holds 95 % of a normal distribution, in standard deviations.
pub const HALF_95: f64 = 1.959_964;

/// A value, how sure we are of it, how many measurements it rests on, and the date of the newest of them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Estimate<Q = f64> {
    /// The best value, in the unit of its type.
    pub value: Q,
    /// One standard deviation, in the unit of its type. Measured or derived; never a guess of a default.
    pub uncertainty: Q,
    /// Measurements behind the value.
    pub count: u32,
    /// When the newest of them was made.
    pub date: Timestamp,
}

impl<Q> Estimate<Q> {
    /// The same measurements seen through `f`, which is applied to value and uncertainty alike: a change of
    /// unit or a multiplication by an exact factor.
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
