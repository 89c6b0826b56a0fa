//! What is read in one odometry period.

use crate::time::Timestamp;
use crate::units::{Acceleration, Length};

/// The readings of one odometry period, which ends at `time`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Period {
    /// When the counters were read.
    pub time: Timestamp,
    /// What the two tachometers said.
    pub wheels: [WheelReading; 2],
    /// The command: −1 full brake, 0 coasting, 1 full traction; absent where it is not recorded.
    pub effort: Option<f64>,
    /// Acceleration along the track from an inertial sensor.
    pub acceleration: Option<Acceleration>,
    /// A known place that the train passed within this period.
    pub balise: Option<Length>,
    /// The standard deviation of that place, where one is stated. It may then be wrong by far more, bounds nothing, and is weighed
    /// with all others ([`StatedPlaces`](crate::odometry::StatedPlaces)) instead of by the odometer.
    pub balise_deviation: Option<Length>,
}

impl Period {
    /// A period of which nothing is known but its end.
    #[must_use]
    pub const fn empty(time: Timestamp) -> Self {
        let wheels = [WheelReading::MISSING; 2];
        Self { time, wheels, effort: None, acceleration: None, balise: None, balise_deviation: None }
    }

    /// A period with the pulses of two tachometers and nothing else.
    #[must_use]
    pub const fn with_pulses(time: Timestamp, pulses: [i64; 2]) -> Self {
        let [first, second] = pulses;
        let wheels = [WheelReading::pulses(first), WheelReading::pulses(second)];
        Self { wheels, ..Self::empty(time) }
    }
}

/// What one tachometer said.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WheelReading {
    /// The pulses.
    pub count: Count,
    /// The direction in which the wheel turned.
    pub direction: Direction,
    /// When the last pulse of the period came, where the hardware stamps it.
    pub last_edge: Option<Timestamp>,
}

impl WheelReading {
    /// The tachometer said nothing.
    pub const MISSING: Self = Self { count: Count::Missing, direction: Direction::Unknown, last_edge: None };

    /// So many pulses in the period, by a sensor without direction and time stamps.
    #[must_use]
    pub const fn pulses(pulses: i64) -> Self {
        Self { count: Count::Pulses(pulses), ..Self::MISSING }
    }
}

/// How a tachometer reports its pulses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    /// No report in this period.
    Missing,
    /// Pulses within the period. Never negative from a sound sensor.
    Pulses(i64),
    /// A running counter, which wraps, and counts down backwards where the sensor knows the direction.
    Counter(i64),
}

/// The direction in which a wheel turned, where the phases of its sensor tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Direction {
    /// The sensor does not tell.
    #[default]
    Unknown,
    /// The direction in which distance grows.
    Forward,
    /// The opposite direction.
    Backward,
}
