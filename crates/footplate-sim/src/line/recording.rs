//! What a simulated run leaves: samples for the estimator, truth for scorers.

use footplate_core::{Acceleration, Length, Speed, Timestamp};

use super::vehicle::LineVehicle;

/// One simulated run.
#[derive(Debug, Clone, PartialEq)]
pub struct LineRun {
    /// What the operator believes of the train.
    pub vehicle: LineVehicle,
    /// What was recorded, row by row.
    pub samples: Vec<LineSample>,
    /// What really was at the end of each sample's period; as many as samples.
    pub truth: Vec<LineTruth>,
    /// What happened in between, in order.
    pub events: Vec<LineEvent>,
    /// What the diameters of the measured wheelsets really are.
    pub diameters: [Length; 2],
    /// Where its energy came from and went.
    pub energy: LineEnergy,
}

/// What was read in one period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineSample {
    /// When the counters were read, on the clock of the recorder; zero for the first sample.
    pub time: Timestamp,
    /// What the two tachometers said.
    pub wheels: [WheelSample; 2],
    /// The driver's command: −1 full brake, 0 nothing, 1 full traction, in the direction of travel; absent where it is
    /// not recorded.
    pub effort: Option<f64>,
    /// Along the track from an inertial sensor, where the train has one.
    pub acceleration: Option<Acceleration>,
    /// A known place that was passed within the period, as far as the place where distance is zero.
    pub balise: Option<Length>,
    /// How well that place is known, if that is stated (one standard deviation).
    pub balise_deviation: Option<Length>,
}

/// What one tachometer said in one period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WheelSample {
    /// Pulses within the period, both directions together; absent if there was no report.
    pub pulses: Option<i64>,
    /// The running counter, which goes on where a report is lost: forward less backward pulses, modulo
    /// [`counter_modulus`](super::LineVehicle::counter_modulus).
    pub counter: Option<i64>,
    /// The last direction of rotation by the phases of the sensor; absent before the first pulse, or with one phase only.
    pub turned: Option<Turned>,
    /// When the last pulse of the period came, to a microsecond.
    pub last_edge: Option<Timestamp>,
}

/// The direction of rotation of a wheel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turned {
    /// The direction in which distance grows.
    Forward,
    /// The opposite direction.
    Backward,
}

/// What really was at the end of a period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineTruth {
    /// Of the train, negative backwards.
    pub speed: Speed,
    /// Since the first sample.
    pub distance: Length,
    /// Of the train.
    pub acceleration: Acceleration,
    /// Speeds of the treads of the measured wheelsets.
    pub wheel_speeds: [Speed; 2],
    /// What part of its load each of them passes on to the rail, forward positive.
    pub adhesion: [f64; 2],
    /// Coefficient of friction at each of them as long as it does not creep.
    pub friction: [f64; 2],
    /// What each of them does.
    pub wheels: [WheelTruth; 2],
}

/// What a wheelset really does. It rolls if its creepage is below 1 % or 0.1 m/s.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WheelTruth {
    /// It turns as the train moves.
    Rolling,
    /// It turns faster.
    Slip,
    /// It turns slower.
    Slide,
    /// It does not turn, and the train moves.
    Locked,
}

/// Where the energy of a run came from and went (J): what motors gave is what the rest adds up to.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LineEnergy {
    /// Motors gave it.
    pub driven_j: f64,
    /// Brakes took it.
    pub braked_j: f64,
    /// Creepage of the measured wheelsets took it.
    pub crept_j: f64,
    /// Resistance took it.
    pub resisted_j: f64,
    /// It went into height.
    pub climbed_j: f64,
    /// It went into motion and rotation: more at the end than at the beginning.
    pub gained_j: f64,
}

/// Something that happened.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineEvent {
    /// The end of the sampling period in which it happened.
    pub time: Timestamp,
    /// What it was.
    pub what: LineEventKind,
}

/// What can happen.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum LineEventKind {
    /// A measured wheelset (0 or 1) does something else from here on.
    Wheel {
        /// Which.
        wheelset: usize,
        /// What it does now.
        does: WheelTruth,
    },
    /// The converter of the measured bogie begins to pull its wheels away by so much more than the train brakes.
    DrawnAway {
        /// Beyond the deceleration that is commanded.
        extra: Acceleration,
    },
    /// The measured bogie follows the train's commands again.
    FollowsAgain,
    /// The fault of the scenario shows from here on.
    FaultBegins,
    /// It is over.
    FaultEnds,
    /// A balise was passed and not read.
    BaliseMissed,
}

/// Creepage below which a wheelset rolls: this part of the speed, or this much (m/s).
const ROLLING_PART: f64 = 0.01;
const ROLLING_M_PER_S: f64 = 0.1;

impl WheelTruth {
    /// What a wheelset does whose tread runs at `wheel` while the train moves at `train` (m/s).
    pub(crate) fn of(wheel: f64, train: f64) -> Self {
        let creep = (wheel - train) * if train < 0.0 { -1.0 } else { 1.0 };
        if creep.abs() <= ROLLING_M_PER_S.max(ROLLING_PART * train.abs()) {
            Self::Rolling
        } else if creep > 0.0 {
            Self::Slip
        } else if wheel == 0.0 {
            Self::Locked
        } else {
            Self::Slide
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wheel_is_judged_by_its_difference_from_the_train_in_either_direction() {
        let judged =
            [(10.05, 10.0), (10.2, 10.0), (9.0, 10.0), (0.0, 10.0), (-3.0, -2.0), (-1.0, -2.0), (0.0, 0.05)];
        assert_eq!(
            judged.map(|(wheel, train)| WheelTruth::of(wheel, train)),
            [
                WheelTruth::Rolling,
                WheelTruth::Slip,
                WheelTruth::Slide,
                WheelTruth::Locked,
                WheelTruth::Slip,
                WheelTruth::Slide,
                WheelTruth::Rolling,
            ]
        );
    }
}
