//! Corrects the distance and the diameters by balises.

use super::balise_link::{BaliseLink, BaliseVerdict, DistanceInterval};
use super::diameter::{BaliseAccuracy, WheelDiameters};
use super::wheels::{Range, Wheelset};
use crate::time::Timestamp;
use crate::units::Length;

/// Effort up to which creepage is too small to matter for diameters.
const LITTLE_EFFORT: f64 = 0.1;

/// Diameters and distances by balises.
#[derive(Debug, Clone)]
pub(super) struct Places {
    diameters: WheelDiameters,
    link: BaliseLink,
    /// Distances by pulses and assumed diameters (m).
    counted: [f64; 2],
}

/// The motion of one wheel in a period.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rolled {
    /// Distance by its pulses and its assumed diameter (m, negative backwards).
    pub(super) nominal: f64,
    /// It was read and rolls.
    pub(super) rolls: bool,
}

impl Places {
    pub(super) fn new(wheelsets: [Wheelset; 2], accuracy: BaliseAccuracy) -> Self {
        Self {
            diameters: WheelDiameters::new(wheelsets, accuracy),
            link: BaliseLink::new(accuracy),
            counted: [0.0; 2],
        }
    }

    /// The estimated diameters.
    pub(super) fn diameters(&self) -> &WheelDiameters {
        &self.diameters
    }

    /// Adds the motion of both wheels in a period.
    pub(super) fn roll(&mut self, time: Timestamp, wheels: [Rolled; 2], effort: Option<f64>) {
        for (counted, wheel) in self.counted.iter_mut().zip(wheels) {
            *counted += wheel.nominal;
        }
        let rolling = wheels.map(|wheel| wheel.rolls);
        let little = effort.is_some_and(|effort| effort.abs() < LITTLE_EFFORT);
        self.diameters.roll(time, self.counted.map(Length::from_m), rolling, little);
    }

    /// Checks a balise that the train passed in the last period, in which it ran `ran`. Returns the corrected distance if the
    /// balise is accepted.
    pub(super) fn pass(
        &mut self,
        time: Timestamp,
        place: Length,
        ran: Length,
        now: &DistanceInterval,
    ) -> Option<DistanceInterval> {
        self.diameters.pass(time, place);
        match self.link.pass(place, ran, now) {
            BaliseVerdict::Accepted(interval) | BaliseVerdict::Contradicts(interval) => Some(interval),
            BaliseVerdict::Unexpected { .. } => None,
        }
    }

    /// True over assumed diameter of each wheel: the estimate and its bounds.
    pub(super) fn scales(&self) -> [(f64, Range); 2] {
        self.diameters
            .scales()
            .map(|scale| (scale.estimate.value, Range { low: scale.interval.low, high: scale.interval.high }))
    }
}
