//! Speeds of one locomotive by throttle setting, as another program measured them.

use footplate_core::model::{MotionFit, MotionModel, StatedMotion, StatedSpeed};
use footplate_core::{Speed, SpeedStep, TimeSpan, TrainId};
use serde::{Deserialize, Serialize};

/// No model train is faster (mm/s): more than 900 km/h in H0, 1700 km/h in N. Programs that learn by themselves from bouncing
/// sensors have stored 34 m/s.
pub const FASTEST_MM_S: f64 = 3_000.0;
/// Fewest speeds too fast that look like another unit, if nothing else is there.
const OTHER_UNIT_FROM: usize = 1;

/// What another program states about the speeds of one locomotive.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SpeedProfile {
    /// The file that it was read from.
    pub source: String,
    /// The decoder's address, if the file names one.
    pub train: Option<TrainId>,
    /// The highest step of the decoder, if it was stated with the import.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub highest: Option<SpeedStep>,
    /// The entries, in the order of the file.
    pub speeds: Vec<ProfileSpeed>,
    /// The time (s) of the decoder's ramp from rest to its highest step, if the file states its momentum.
    pub speeding_up_s: Option<f64>,
    /// The same from its highest step to rest.
    pub slowing_down_s: Option<f64>,
    /// What a reader should know about the file.
    #[serde(skip)]
    pub notes: Vec<ProfileNote>,
}

/// One entry: a throttle setting and its speeds. At least one speed is there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ProfileSpeed {
    /// The line of the file, counted from 1.
    pub line: u64,
    /// The throttle setting, from 0 (stop) to 1 (highest step).
    pub throttle: f64,
    /// Forward (mm/s).
    pub forward_mm_s: Option<f64>,
    /// Reverse (mm/s).
    pub reverse_mm_s: Option<f64>,
    /// One standard deviation (mm/s), if the file states it.
    pub uncertainty_mm_s: Option<f64>,
}

/// Something that was not used, or that a person should look at.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ProfileNote {
    /// A speed faster than any model train.
    TooFast {
        /// The line.
        line: u64,
        /// The speed (mm/s).
        speed_mm_s: f64,
    },
    /// A speed at throttle 0.
    AtStop {
        /// The line.
        line: u64,
        /// The speed (mm/s).
        speed_mm_s: f64,
    },
    /// An overrun time, whose meaning differs from program to program.
    Overrun {
        /// The line.
        line: u64,
        /// The text.
        value: String,
    },
    /// Momentum of the decoder by its CVs, as a ramp over all steps.
    Momentum {
        /// From rest to the highest step (s).
        speeding_up_s: f64,
        /// From the highest step to rest (s).
        slowing_down_s: f64,
    },
}

impl std::fmt::Display for ProfileNote {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::TooFast { line, speed_mm_s } => write!(
                f,
                "line {line}: {speed_mm_s} mm/s is not used: no model train is faster than {FASTEST_MM_S:.0} mm/s"
            ),
            Self::AtStop { line, speed_mm_s } => {
                write!(
                    f,
                    "line {line}: {speed_mm_s} mm/s at throttle 0 is not used: the train is at rest there"
                )
            }
            Self::Overrun { line, value } => write!(
                f,
                "line {line}: the overrun time {value} is not used: its unit differs between versions of JMRI"
            ),
            Self::Momentum { speeding_up_s, slowing_down_s } => write!(
                f,
                "momentum by the CVs: about {speeding_up_s:.1} s from rest to full speed, {slowing_down_s:.1} s to rest \
                 (0 is not known); used with an uncertainty of 60 %"
            ),
        }
    }
}

impl SpeedProfile {
    /// Adds an entry as the file states it; zero speeds were not measured. Speeds that cannot be are left out with a note.
    pub(super) fn push(&mut self, entry: ProfileSpeed) {
        let [forward_mm_s, reverse_mm_s] = [entry.forward_mm_s, entry.reverse_mm_s].map(|speed| {
            let speed_mm_s = speed.filter(|speed| *speed > 0.0)?;
            if entry.throttle <= 0.0 {
                self.notes.push(ProfileNote::AtStop { line: entry.line, speed_mm_s });
                return None;
            }
            if speed_mm_s > FASTEST_MM_S {
                self.notes.push(ProfileNote::TooFast { line: entry.line, speed_mm_s });
                return None;
            }
            Some(speed_mm_s)
        });
        if forward_mm_s.or(reverse_mm_s).is_some() {
            self.speeds.push(ProfileSpeed { forward_mm_s, reverse_mm_s, ..entry });
        }
    }

    /// Whether all speeds of the file were faster than a model train: they are in another unit.
    pub(super) fn is_other_unit(&self) -> bool {
        let too_fast = self.notes.iter().filter(|note| matches!(note, ProfileNote::TooFast { .. }));
        self.speeds.is_empty() && too_fast.count() >= OTHER_UNIT_FROM
    }

    /// The motion model of a train that begins with this profile and has not run yet.
    pub fn beginning(&self, train: TrainId, highest: SpeedStep) -> MotionModel {
        let mut fit = MotionFit::new(train, highest);
        fit.take_stated(&self.stated().0);
        fit.model().clone()
    }

    /// The measurements for a motion fit, and which entry each is of. A motion model has one speed for both directions, so forward
    /// and reverse are two measurements of it, unless one number was written for both.
    pub fn stated(&self) -> (StatedMotion, Vec<usize>) {
        let mut of = Vec::new();
        let mut motion = StatedMotion {
            speeding_up: self.speeding_up_s.map(TimeSpan::from_s),
            slowing_down: self.slowing_down_s.map(TimeSpan::from_s),
            speeds: Vec::new(),
        };
        for (place, entry) in self.speeds.iter().enumerate() {
            let reverse = entry.reverse_mm_s.filter(|reverse| entry.forward_mm_s != Some(*reverse));
            for speed in [entry.forward_mm_s, reverse].into_iter().flatten() {
                motion.speeds.push(StatedSpeed {
                    throttle: entry.throttle,
                    speed: Speed::from_mm_per_s(speed),
                    uncertainty: entry.uncertainty_mm_s.map(Speed::from_mm_per_s),
                });
                of.push(place);
            }
        }
        (motion, of)
    }
}
