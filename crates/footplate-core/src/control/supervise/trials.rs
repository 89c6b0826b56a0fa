//! The measurements of a recovery, the speeds at a few steps, and what it found.

use alloc::boxed::Box;
use alloc::vec::Vec;

use crate::event::Approach;
use crate::ids::{NodeId, SpeedStep};
use crate::link::DetectionWindow;
use crate::model::{ChangedNumbers, MeasuredRatio, MotionFit, MotionModel, StepUse};
use crate::time::{TimeSpan, Timestamp};
use crate::units::{Length, Speed};

/// A train creeps at most at this speed, ...
const CREEP_AT_MOST: Speed = Speed::from_mm_per_s(150.0);
/// ... and at least at this one, because slower steps may not start it.
const CREEP_AT_LEAST: Speed = Speed::from_mm_per_s(80.0);
/// Speeds at which it is measured: a low one that every train has, ...
const LOW: Speed = Speed::from_mm_per_s(140.0);
/// ... and a high one from which it stops within a metre.
const HIGH: Speed = Speed::from_mm_per_s(430.0);
/// A speed is measured over this many hops, ...
const HOPS: u8 = 3;
/// ... or over two, if they are this long together.
const LONG_ENOUGH: Length = Length::from_mm(1_200.0);
/// A ratio this close to 1 is no change: three standard deviations from run to run.
const SAME: f64 = 0.02;
/// See [`SAME`]: in standard deviations of the measurement.
const SAME_DEVIATIONS: f64 = 3.0;
/// The relative standard deviation of speeds from run to run.
const RUN_DEVIATION: f64 = 0.006;
/// Factor on the predicted duration of speed changes: the model may be that of another train.
const SETTLES_PART: f64 = 1.3;
/// See [`SETTLES_PART`].
const SETTLES_MORE: TimeSpan = TimeSpan::from_ms(400);

/// Whether a measured speed is that of the model.
pub(super) fn is_same(measured: &MeasuredRatio) -> bool {
    libm::log(measured.ratio).abs() <= SAME.max(SAME_DEVIATIONS * measured.deviation)
}

/// What a recovery found of a train that is no longer as it was: its fit goes on from there.
#[derive(Debug, Clone)]
pub enum Remeasured {
    /// The same train, changed.
    Changed(ChangedNumbers),
    /// Another train, with the fit to what it has done since.
    Another(Box<MotionFit>),
}

/// The steps that a recovery uses.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Steps {
    pub(super) creep: SpeedStep,
    pub(super) middle: SpeedStep,
    pub(super) low: SpeedStep,
    pub(super) high: SpeedStep,
}

impl Steps {
    pub(super) fn of(model: &MotionModel) -> Self {
        let all = || (1..=model.highest().get()).filter_map(SpeedStep::new);
        let speed = |step: SpeedStep| model.steady_speed(step, Approach::Below);
        let mut usable: Vec<SpeedStep> = all().filter(|step| model.uses(*step) == StepUse::Moves).collect();
        if usable.is_empty() {
            usable = all().filter(|step| model.uses(*step) != StepUse::Unreliable).collect();
        }
        let first = usable.first().copied().unwrap_or(model.highest());
        let least = |from: Speed| usable.iter().find(|step| speed(**step) >= from).copied().unwrap_or(first);
        let creep = Some(least(CREEP_AT_LEAST)).filter(|step| speed(*step) <= CREEP_AT_MOST).unwrap_or(first);
        let low = least(LOW);
        let high = usable.iter().rev().find(|step| speed(**step) <= HIGH).copied().unwrap_or(low).max(low);
        let between = Speed::from_mm_per_s(libm::sqrt(speed(low).as_mm_per_s() * speed(high).as_mm_per_s()));
        Self { creep, middle: least(between).clamp(low, high), low, high }
    }
}

/// A measurement of a speed: from sensor to sensor, once it has settled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SpeedTrial {
    pub(super) step: SpeedStep,
    approach: Approach,
    settled: Option<Timestamp>,
    first: Option<DetectionWindow>,
    last: Option<(NodeId, DetectionWindow)>,
    distance: Length,
    hops: u8,
}

impl SpeedTrial {
    pub(super) const fn new(step: SpeedStep, from: SpeedStep) -> Self {
        let approach = if from.get() > step.get() { Approach::Above } else { Approach::Below };
        Self { step, approach, settled: None, first: None, last: None, distance: Length::ZERO, hops: 0 }
    }

    /// The command was sent.
    pub(super) fn commanded(&mut self, model: &MotionModel, from: SpeedStep, at: Timestamp) {
        let settles = TimeSpan::from_s(model.settles_within(from, self.step).as_s() * SETTLES_PART);
        self.settled = Some(at + settles + SETTLES_MORE);
    }

    /// A passage of a sensor, with the distance from the one before.
    pub(super) fn pass(&mut self, node: NodeId, window: DetectionWindow, hop: Option<Length>) {
        if self.settled.is_none_or(|settled| window.after < settled) {
            return;
        }
        match (self.first, hop) {
            (Some(_), Some(hop)) => {
                self.distance += hop;
                self.hops += 1;
            }
            // The first passage, or one that does not follow the last: start here.
            _ => {
                self.first = Some(window);
                self.distance = Length::ZERO;
                self.hops = 0;
            }
        }
        self.last = Some((node, window));
    }

    /// The sensor from which the next hop counts.
    pub(super) fn last(&self) -> Option<NodeId> {
        self.last.map(|(node, _)| node)
    }

    pub(super) fn is_over(&self) -> bool {
        self.hops >= HOPS || self.hops >= 2 && self.distance >= LONG_ENOUGH
    }

    /// The measured ratio of speeds.
    pub(super) fn ratio(&self, model: &MotionModel) -> Option<MeasuredRatio> {
        let (first, (_, last)) = (self.first?, self.last?);
        let took = (last.middle() - first.middle()).as_s();
        let known = model.steady_speed(self.step, self.approach).as_m_per_s();
        if self.hops == 0 || took <= 0.0 || known <= 0.0 {
            return None;
        }
        let polling = libm::sqrt(first.variance_s2() + last.variance_s2()) / took;
        let ratio = self.distance.as_m() / took / known;
        Some(MeasuredRatio { step: self.step, ratio, deviation: libm::hypot(polling, RUN_DEVIATION) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_speed_is_measured_over_three_hops_or_over_two_of_1200_mm_together() {
        let step = SpeedStep::new(8).unwrap();
        let over = |hops_mm: &[f64]| {
            let mut trial = SpeedTrial::new(step, SpeedStep::STAND);
            trial.settled = Some(Timestamp::ZERO);
            let window = |second: u16| {
                let after = Timestamp::from_s(f64::from(second));
                DetectionWindow { after, until: after + TimeSpan::from_ms(60) }
            };
            trial.pass(NodeId(0), window(1), None);
            for (second, mm) in (2..).zip(hops_mm) {
                trial.pass(NodeId(second), window(second), Some(Length::from_mm(*mm)));
            }
            trial.is_over()
        };
        assert!(!over(&[1_300.0]));
        assert!(!over(&[600.0, 599.0]));
        assert!(over(&[600.0, 600.0]));
        assert!(over(&[200.0, 200.0, 200.0]));
    }
}
