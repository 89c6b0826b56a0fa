//! What is known of a train's motion at the end of a period.

use crate::time::Timestamp;
use crate::units::{Acceleration, Length, Speed};

/// Speed, acceleration and distance with their bounds, and how they came about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionEstimate {
    /// The end of the period.
    pub time: Timestamp,
    /// The best estimate of the speed, negative backwards.
    pub speed: Speed,
    /// Its standard deviation as the filter believes it.
    pub speed_deviation: Speed,
    /// The speed lies between this ...
    pub speed_low: Speed,
    /// ... and this, as long as what is assumed of the vehicle is true.
    pub speed_high: Speed,
    /// The best estimate of the acceleration.
    pub acceleration: Acceleration,
    /// The best estimate of the distance since the first period.
    pub distance: Length,
    /// The distance lies between this ...
    pub distance_low: Length,
    /// ... and this.
    pub distance_high: Length,
    /// By how much at most the distance estimated can be too long, summed up over the way; never decreases.
    pub over: Length,
    /// By how much at most the distance estimated can be too short, summed up over the way; never decreases.
    pub under: Length,
    /// What each wheelset does.
    pub wheels: [WheelState; 2],
    /// How the estimate came about.
    pub mode: Mode,
    /// The share that the first wheelset, the second and the virtual sensor had in it; they add up to 1.
    pub shares: [f64; 3],
}

impl MotionEstimate {
    /// Whether it may be used: only a mode that knows what it does not know is refused.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.mode != Mode::Ambiguous
    }
}

/// What a wheelset does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum WheelState {
    /// It rolls.
    Rolling,
    /// Traction turns it faster than the train moves.
    Spin,
    /// The brake holds it back.
    Slide,
    /// Its tachometer is not believed.
    Excluded,
}

/// How an estimate came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Mode {
    /// Both wheelsets roll.
    Normal,
    /// One slips or slides, the other carries the estimate.
    OneSlip,
    /// Both slip or slide; the virtual sensor carries the estimate.
    Correction,
    /// Nothing has carried it for too long: the bounds hold, the estimate is a guess.
    Ambiguous,
    /// A tachometer is missing or not believed.
    Degraded,
}
