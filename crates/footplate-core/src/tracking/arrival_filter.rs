//! Where a train is in the present run, how fast it runs and how long the hops are that it runs over, known together.
//!
//! A Kalman filter over the letters of [`MotionFilter`] and, beside them, `δ`: by how much each section run over is longer than
//! surveyed. A train that passes a sensor at `t` measures all of them at once:
//!
//! ```text
//! x(t) − Σ (L + δ) = 0
//! ```
//!
//! with `L` the surveyed lengths since the sensor before. A fast train and a short hop look alike at one sensor; their
//! covariance is kept, so that the next sensors distinguishes them. See `docs/theory/forecasting.md`.

use super::arrival::Arrival;
use super::filter_state::N as MOTION_LETTERS;
use super::motion_filter::MotionFilter;
use crate::ids::SpeedStep;
use crate::linalg::Gaussian;
use crate::model::MotionModel;
use crate::model::survey::SectionIndex;
use crate::track::Reach;

/// Sections that are known together with the motion: more than a circuit of a course track has.
const SECTIONS: usize = 28;
const LETTERS: usize = MOTION_LETTERS + SECTIONS;
/// Where a train is before its first sensor (m): anywhere within a lap of a large layout.
const ANYWHERE_M: f64 = 10.0;
/// Hops to the next sensor: one, and one more for each sensor that may stay silent.
const MOST_HOPS: usize = crate::track::MAX_MISSED + 1;
/// The shortest distance between two sensors that is accepted (m); closer ones cannot be distinguished.
const SHORTEST_M: f64 = 0.01;

/// The present run.
#[derive(Debug, Clone)]
pub(super) struct ArrivalFilter {
    following: MotionFilter<LETTERS>,
    /// The model of the train when the run began.
    model: MotionModel,
    /// Which section each companion is of, and when it was met last.
    sections: [Option<(usize, u32)>; SECTIONS],
    /// By how much it is longer than surveyed (m).
    longer: [f64; SECTIONS],
    passages: u32,
    /// Whether the place of the train is known.
    is_placed: bool,
    /// Time of the last passage (s).
    passed: f64,
}

/// The path to the next sensor: its length (m), and the companions that it depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ahead {
    length: f64,
    slopes: [(usize, f64); MOST_HOPS],
    count: usize,
}

impl Ahead {
    fn slopes(&self) -> &[(usize, f64)] {
        self.slopes.get(..self.count).unwrap_or_default()
    }
}

impl ArrivalFilter {
    /// A run begins at a time (s): the train runs steadily at a step for long, or stands at step 0.
    pub(super) fn begin(model: &MotionModel, time: f64, step: SpeedStep) -> Self {
        let anywhere = Gaussian { mean: 0.0, variance: ANYWHERE_M * ANYWHERE_M };
        let following = if step == SpeedStep::STAND {
            MotionFilter::at_rest(time, anywhere)
        } else {
            MotionFilter::running(model, time, step.get(), anywhere)
        };
        Self {
            following: following.keep_apart(model),
            model: model.clone(),
            sections: [None; SECTIONS],
            longer: [0.0; SECTIONS],
            passages: 0,
            is_placed: false,
            passed: time,
        }
    }

    /// A command has left the line.
    pub(super) fn command(&mut self, sent: f64, step: SpeedStep) {
        self.following.command(&self.model, sent, step.get());
    }

    /// The model was fitted anew. Where the train is and how fast it runs stays as the run has shown it.
    pub(super) fn exchange(&mut self, model: &MotionModel) {
        self.following.exchange(&self.model, model);
        self.model = model.clone();
    }

    /// Whether the place of the train is known.
    pub(super) const fn is_placed(&self) -> bool {
        self.is_placed
    }

    /// The speed (m/s) at which it runs, or to which the present change leads.
    pub(super) fn settled_speed(&self) -> Gaussian {
        self.following.settled_speed()
    }

    /// Whether it ran steadily when it passed the last sensor, and was commanded nothing since.
    pub(super) fn is_settled(&self) -> bool {
        self.following.is_settled(&self.model, self.passed)
    }

    /// The path over some hops. Sections met for the first time are taken from `prior`: by how much (m) each is longer.
    pub(super) fn ahead(
        &mut self,
        sections: &SectionIndex,
        path: &Reach,
        prior: impl Fn(usize) -> Gaussian,
    ) -> Ahead {
        let mut ahead = Ahead { length: path.length.as_m(), slopes: [(0, 0.0); MOST_HOPS], count: 0 };
        for section in path.hops().iter().filter_map(|hop| sections.section(*hop)) {
            let companion = self.companion(section, &prior);
            ahead.length += self.longer.get(companion).copied().unwrap_or(0.0);
            if let Some(slot) = ahead.slopes.get_mut(ahead.count) {
                *slot = (companion, 1.0);
                ahead.count += 1;
            }
        }
        ahead.length = ahead.length.max(SHORTEST_M);
        ahead
    }

    /// The place of a section among the companions; the one met longest ago makes room for a new one.
    fn companion(&mut self, section: usize, prior: &impl Fn(usize) -> Gaussian) -> usize {
        let known = self.sections.iter().position(|slot| slot.is_some_and(|(of, _)| of == section));
        let place = known.unwrap_or_else(|| {
            let oldest = self.sections.iter().enumerate().min_by_key(|(_, slot)| slot.map(|(_, met)| met));
            let place = oldest.map_or(0, |(place, _)| place);
            let expected = prior(section);
            if let Some(slot) = self.longer.get_mut(place) {
                *slot = expected.mean;
            }
            self.following.keep_beside(place, expected.variance);
            place
        });
        if let Some(slot) = self.sections.get_mut(place) {
            *slot = Some((section, self.passages + 1));
        }
        place
    }

    /// When it passes the sensor at the end of a path; the sensor trips at its place to a variance (m²). `None` if the train
    /// comes to rest before.
    pub(super) fn arrival(&self, ahead: &Ahead, scatter: f64) -> Option<Arrival> {
        let place = Gaussian { mean: ahead.length, variance: scatter };
        self.following.arrives(&self.model, place, ahead.slopes(), self.passed)
    }

    /// It passed that sensor at a mean time (s, with its variance).
    pub(super) fn pass(&mut self, ahead: &Ahead, time: f64, variance: f64, scatter: f64) {
        let place = Gaussian { mean: ahead.length, variance: scatter };
        let length = |longer: &[f64; SECTIONS]| -> f64 {
            ahead.slopes().iter().filter_map(|(companion, _)| longer.get(*companion)).sum()
        };
        let before = length(&self.longer);
        self.following.pass_beside(&self.model, time, variance, place, ahead.slopes(), &mut self.longer);
        let learnt = length(&self.longer) - before;
        let back = ahead.slopes.map(|(companion, by)| (companion, -by));
        let back = back.get(..ahead.count).unwrap_or_default();
        self.following.shift_beside(-ahead.length - learnt, back);
        self.passages += 1;
        self.passed = time;
    }

    /// It is at a sensor at a mean time, and nothing is known of the path there.
    pub(super) fn appear(&mut self, time: f64, variance: f64, scatter: f64) {
        self.following = self.following.at(&self.model, time);
        if self.is_placed {
            self.following.widen_place(ANYWHERE_M * ANYWHERE_M);
        }
        let place = Gaussian { mean: 0.0, variance: scatter };
        self.following.pass_beside(&self.model, time, variance, place, &[], &mut self.longer);
        self.is_placed = true;
        self.passages += 1;
        self.passed = time;
    }

    /// Its speed is learnt anew: so much is added to the variance of ln of it.
    pub(super) fn widen_speed(&mut self, variance: f64) {
        self.following.widen_speed(variance);
    }

    /// It is off by more (m) than any interval allows. Whether a change of speed is not complete that may be why: its uncertainty
    /// is widened then.
    pub(super) fn widen_change(&mut self, time: f64, off: f64) -> bool {
        self.following.widen_change(&self.model, time, off)
    }
}
