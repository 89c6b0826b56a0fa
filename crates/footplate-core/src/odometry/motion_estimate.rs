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
    /// Its standard deviation as the filter states it.
    pub speed_deviation: Speed,
    /// The best estimate of the acceleration.
    pub acceleration: Acceleration,
    /// The best estimate of the distance since the first period.
    pub distance: Length,
    /// Speed and distance lie within these whenever the claims of the vehicle hold.
    pub guaranteed: MotionBounds,
    /// They lie within these with the stated probability, by the stated priors; never wider than the guaranteed ones.
    pub confidence: MotionBounds,
    /// By how much at most the distance estimated can be too long, by the guaranteed bounds, summed up along the path;
    /// never decreases.
    pub over: Length,
    /// The same of too short.
    pub under: Length,
    /// What each wheelset does.
    pub wheels: [WheelState; 2],
    /// How the estimate came about.
    pub mode: Mode,
    /// The share that the first wheelset, the second and the virtual sensor had in it; they add up to 1.
    pub shares: [f64; 3],
}

/// Between which speeds and distances a train is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionBounds {
    /// The speed is at least this ...
    pub speed_low: Speed,
    /// ... and at most this.
    pub speed_high: Speed,
    /// The distance since the first period is at least this ...
    pub distance_low: Length,
    /// ... and at most this.
    pub distance_high: Length,
}

/// What a wheelset does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum WheelState {
    /// It rolls.
    Rolling,
    /// Traction turns it faster than the train moves.
    Spin,
    /// It slides: the brake turns it slower than the train.
    Slide,
    /// Its tachometer is excluded.
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
    /// Nothing has carried it for too long: the bounds hold, nothing supports the estimate.
    Ambiguous,
    /// A tachometer is missing or excluded.
    Degraded,
}
