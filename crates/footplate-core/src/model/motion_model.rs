//! The motion model of one train, and what follows from it.

use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;

use super::parameters::{Answers, between_knots, knots, prior_means, stride};
use super::priors::end_of_stop;
use super::priors::section_variance;
use super::scatter::{MEDIUM_SPEED, Scatter, WATCHED_FROM};
use super::segment::{Pace, Segment, SpeedCommand};
use super::sensor_scatter::SensorVariances;
use super::spread::Spread;
use super::stop_offset::{StopOffsets, stop_offset_share};
use super::survey::SectionIndex;
use super::train_length::{BlockRelease, TrainLength};
use super::variation::Variation;
use crate::estimate::Estimate;
use crate::event::Approach;
use crate::ids::{EdgeId, SensorId, SpeedStep, TrainId};
use crate::linalg::Gaussian;
use crate::time::{TimeSpan, Timestamp};
use crate::track::Hop;
use crate::units::{Acceleration, Length, Speed};

/// Whether a step moves the train.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum StepUse {
    /// Not tried yet.
    Untried,
    /// It moves the train.
    Moves,
    /// The train did not start, or stalled, at this step: not to be used.
    Unreliable,
}

/// Stopping distance and time from a steady speed, from when the command left the line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StopForecast {
    /// The stopping distance, as path length.
    pub distance: Length,
    /// One standard deviation of its uncertainty.
    pub doubt: Length,
    /// One standard deviation of single stops.
    pub scatter: Length,
    /// The time.
    pub time: TimeSpan,
    /// Stops from this step that were measured.
    pub count: u32,
}

impl StopForecast {
    /// One standard deviation of the next stop.
    pub fn deviation(&self) -> Length {
        Length::from_m(libm::hypot(self.doubt.as_m(), self.scatter.as_m()))
    }
}

/// How one train answers its commands on one layout.
///
/// All distances are path lengths: a hop is as long as speed times time of the train over it ([`length`](Self::length)), curves
/// and slopes included. A stop takes the same path length in a curve as on the straight.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotionModel {
    train: TrainId,
    highest: SpeedStep,
    pub(crate) values: Vec<f64>,
    pub(crate) spread: Spread,
    /// By how much sections are longer than surveyed (m), with the variance.
    pub(crate) sections: BTreeMap<usize, (f64, f64)>,
    /// By how much stops are longer because of the track that they run over.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) stop_offsets: StopOffsets,
    /// How long the train is, from releases of blocks.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "TrainLength::is_unknown"))]
    pub(crate) train_length: TrainLength,
    /// By how much more than usual the laws of stops and of starts leave over: factors on a standard deviation.
    pub(crate) residual_scales: [f64; 2],
    pub(super) uses: Vec<StepUse>,
    /// Sensors passed and stops made at each step, from below and from above.
    pub(crate) counts: Vec<[Counts; 2]>,
    /// The scatter of stops and starts.
    pub(crate) scatter: Scatter,
    /// The scatter of sensors.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) sensor_variances: SensorVariances,
    /// The change of each number for one standard deviation of the survey's scale.
    pub(crate) scale: Vec<f64>,
    pub(crate) date: Timestamp,
}

/// Measurements at one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Counts {
    pub(crate) contacts: u32,
    pub(crate) stops: u32,
}

/// The shortest time of a stop (s), also of one from rest.
const LEAST_STOP_S: f64 = 0.5;

/// A ramp counts as one if it lasts this many standard deviations of its time (95 % of normal errors are smaller).
const DECISIVE: f64 = 2.0;

impl MotionModel {
    /// The prior of any model train.
    pub fn unknown(train: TrainId, highest: SpeedStep) -> Self {
        let steps = usize::from(highest.get());
        Self {
            train,
            highest,
            values: prior_means(steps),
            spread: Spread::prior(steps),
            sections: BTreeMap::new(),
            stop_offsets: StopOffsets::default(),
            train_length: TrainLength::default(),
            residual_scales: [1.0; 2],
            uses: vec![StepUse::Untried; steps + 1],
            counts: vec![[Counts::default(); 2]; steps + 1],
            scatter: Scatter::USUAL,
            sensor_variances: SensorVariances::default(),
            scale: vec![0.0; super::parameters::count(steps)],
            date: Timestamp::ZERO,
        }
    }

    /// The train.
    pub const fn train(&self) -> TrainId {
        self.train
    }

    /// How long it is, from releases of blocks.
    pub const fn train_length(&self) -> &TrainLength {
        &self.train_length
    }

    /// Takes the release of a block behind the train. Returns whether it agrees with those before.
    pub fn take_release(&mut self, release: &BlockRelease) -> bool {
        self.train_length.take(release)
    }

    /// Keeps the length that another copy of the model has measured later.
    pub(crate) const fn keep_length(&mut self, other: &Self) {
        self.train_length = self.train_length.or_newer(other.train_length);
    }

    /// The highest step of its decoder.
    pub const fn highest(&self) -> SpeedStep {
        self.highest
    }

    pub(crate) fn steps(&self) -> usize {
        usize::from(self.highest.get())
    }

    pub(crate) fn answers(&self) -> Answers<'_> {
        Answers::new(&self.values, self.steps())
    }

    /// The steps that have numbers of their own, lowest first: all 14 of a decoder of 14 steps, every second of 28, every ninth of
    /// 126. Calibration measures these; between them the model interpolates.
    pub fn knots(&self) -> impl DoubleEndedIterator<Item = SpeedStep> + use<> {
        let (knots, stride) = (knots(self.steps()), self.stride());
        (1..=knots as u8).filter_map(move |knot| SpeedStep::new(knot.saturating_mul(stride)))
    }

    /// Steps from one of these to the next: 1 for a decoder of 14 steps.
    pub fn stride(&self) -> u8 {
        stride(self.steps()) as u8
    }

    /// The next higher step with numbers of its own; of the highest, itself.
    pub(crate) fn next_knot(&self, step: SpeedStep) -> SpeedStep {
        let next = (step.get() / self.stride() + 1).saturating_mul(self.stride());
        SpeedStep::new(next).unwrap_or(self.highest).min(self.highest)
    }

    /// The next lower and the next higher step with numbers of their own, if the step has none.
    fn knots_around(&self, step: SpeedStep) -> Option<[SpeedStep; 2]> {
        let below = step.get() / self.stride() * self.stride();
        let around = [SpeedStep::new(below)?, SpeedStep::new(below.checked_add(self.stride())?)?];
        (below < step.get() && below > 0 && around[1] <= self.highest).then_some(around)
    }

    fn counts_at(&self, step: SpeedStep, approach: Approach) -> Counts {
        let from_above = usize::from(approach == Approach::Above);
        let at = |step: SpeedStep| {
            let both = self.counts.get(usize::from(step.get())).copied().unwrap_or_default();
            both.get(from_above).copied().unwrap_or_default()
        };
        let Some([low, high]) = self.knots_around(step) else { return at(step) };
        let (own, low, high) = (at(step), at(low), at(high));
        Counts {
            contacts: own.contacts + low.contacts.min(high.contacts),
            stops: own.stops + low.stops.min(high.stops),
        }
    }

    /// Its steady speed at a step; the count is of sensors passed at it. An unknown approach counts as from below.
    pub fn speed(&self, step: SpeedStep, approach: Approach) -> Estimate<Speed> {
        let (place, above) = (usize::from(step.get()), approach == Approach::Above);
        let speed = |answers: &Answers<'_>| answers.speed(place, above);
        Estimate {
            value: Speed::from_m_per_s(speed(&self.answers())),
            uncertainty: Speed::from_m_per_s(self.with_interpolation(
                step,
                self.deviation_with_scale(speed),
                speed(&self.answers()),
            )),
            count: self.counts_at(step, approach).contacts,
            date: self.date,
        }
    }

    /// A standard deviation at a step, with that of the interpolated speed added: `by_speed` is the slope in ln speed.
    fn with_interpolation(&self, step: SpeedStep, deviation: f64, by_speed: f64) -> f64 {
        let between = between_knots(usize::from(step.get()), self.steps());
        if between > 0.0 { libm::hypot(deviation, between * by_speed) } else { deviation }
    }

    /// The most likely steady speed at a step. Without the uncertainty, whose calculation takes a hundred times as long.
    pub(crate) fn steady_speed(&self, step: SpeedStep, approach: Approach) -> Speed {
        let above = approach == Approach::Above;
        Speed::from_m_per_s(self.answers().speed(usize::from(step.get()), above))
    }

    /// One standard deviation of a function of the model's numbers, in surveyed lengths: the error of the survey's scale is
    /// included.
    pub(crate) fn deviation_with_scale(&self, of: impl Fn(&Answers<'_>) -> f64) -> f64 {
        let slopes = self.spread.slopes(&self.values, self.steps(), of);
        let by_scale: f64 =
            slopes.iter().filter_map(|(place, slope)| Some(slope * self.scale.get(*place)?)).sum();
        libm::hypot(libm::sqrt(self.spread.variance_along(&slopes)), by_scale)
    }

    /// The model for a later session: the process noise between two sessions is added.
    #[must_use]
    pub fn for_later_session(&self) -> Self {
        let mut later = self.clone();
        later.spread.widen(&Variation::between_sessions(), &self.values, self.steps());
        later
    }

    /// One standard deviation (s) of the time of starts from rest.
    pub(crate) fn start_scatter(&self) -> f64 {
        self.scatter.of_start()
    }

    /// By how much an even change of speed of a running train is late: delay of the command plus lag behind the decoder.
    pub fn change_delay(&self, is_faster: bool) -> Estimate<TimeSpan> {
        let late = |answers: &Answers<'_>| {
            let (lag, _) = answers.lag_and_ramp(is_faster, 0.0, 0.0);
            answers.delay(is_faster) + lag
        };
        Estimate {
            value: TimeSpan::from_s(late(&self.answers()).max(0.0)),
            uncertainty: TimeSpan::from_s(self.deviation_with_scale(late)),
            count: self.sensors_passed(),
            date: self.date,
        }
    }

    /// The even acceleration of the train's decoder from one step to another, negative for slowing down: the speeds'
    /// difference by the time of the ramp. `None` if the model cannot tell the ramp from a jump.
    pub fn ramp_acceleration(&self, from: SpeedStep, to: SpeedStep) -> Option<Estimate<Acceleration>> {
        let gain = |answers: &Answers<'_>| {
            answers.speed(usize::from(to.get()), to < from) - answers.speed(usize::from(from.get()), false)
        };
        let ramp = |answers: &Answers<'_>| {
            let steps = f64::from(to.get()) - f64::from(from.get());
            answers.lag_and_ramp(to > from, gain(answers), steps).1
        };
        // 1/a is as good as normal where the ramp is short, a is not.
        let slowness = |answers: &Answers<'_>| ramp(answers) / gain(answers);
        let (value, deviation) = (slowness(&self.answers()), self.deviation_with_scale(slowness));
        let is_a_ramp = ramp(&self.answers()) > 0.0 && value.abs() > DECISIVE * deviation;
        is_a_ramp.then(|| Estimate {
            value: Acceleration::from_m_per_s2(1.0 / value),
            uncertainty: Acceleration::from_m_per_s2(deviation / (value * value)),
            count: self.sensors_passed(),
            date: self.date,
        })
    }

    /// Whether a step moves the train, by experience at this step, or at the two that it is interpolated between.
    pub fn uses(&self, step: SpeedStep) -> StepUse {
        let at =
            |step: SpeedStep| self.uses.get(usize::from(step.get())).copied().unwrap_or(StepUse::Unreliable);
        match (at(step), self.knots_around(step)) {
            (StepUse::Untried, Some(around)) if around.map(at) == [StepUse::Moves; 2] => StepUse::Moves,
            (found, _) => found,
        }
    }

    /// Records whether a step moved the train.
    pub fn note_use(&mut self, step: SpeedStep, found: StepUse) {
        if let Some(slot) = self.uses.get_mut(usize::from(step.get())) {
            *slot = found;
        }
    }

    /// How it stops from its steady speed at a step.
    pub fn stop(&self, step: SpeedStep, approach: Approach) -> StopForecast {
        let above = approach == Approach::Above;
        let speed = self.answers().speed(usize::from(step.get()), above);
        let (distance, time) = distance_and_time_to_rest(&self.answers(), step.get(), above);
        let by_numbers =
            self.deviation_with_scale(|answers| distance_and_time_to_rest(answers, step.get(), above).0);
        StopForecast {
            distance: Length::from_m(distance.max(0.0)),
            doubt: Length::from_m(libm::hypot(
                self.with_interpolation(step, by_numbers, distance),
                end_of_stop(speed),
            )),
            scatter: Length::from_m(libm::hypot(
                self.forecast_scatter(speed),
                libm::sqrt(self.stop_offset(core::iter::empty(), speed).variance),
            )),
            time: TimeSpan::from_s(time.max(LEAST_STOP_S)),
            count: self.counts_at(step, approach).stops,
        }
    }

    /// The most likely distance to rest, without the uncertainty.
    pub(crate) fn stop_distance(&self, step: SpeedStep, approach: Approach) -> Length {
        let above = approach == Approach::Above;
        Length::from_m(distance_and_time_to_rest(&self.answers(), step.get(), above).0.max(0.0))
    }

    /// The most likely time to rest, without the uncertainty.
    pub(crate) fn stop_time(&self, step: SpeedStep, approach: Approach) -> TimeSpan {
        let above = approach == Approach::Above;
        TimeSpan::from_s(distance_and_time_to_rest(&self.answers(), step.get(), above).1.max(LEAST_STOP_S))
    }

    /// One standard deviation (m) of where stops from a speed (m/s) end.
    pub(crate) fn forecast_scatter(&self, speed: f64) -> f64 {
        let stops = self.stops();
        let compared = f64::from(stops.saturating_sub(WATCHED_FROM)) / f64::from(stops.max(1));
        self.scatter.of_forecast(speed, compared)
    }

    /// All stops that were measured.
    pub(crate) fn stops(&self) -> u32 {
        self.counts.iter().flatten().map(|counts| counts.stops).sum()
    }

    /// Variance (m²) of where a sensor trips about its usual place.
    pub(crate) fn sensor_variance(&self, sensor: Option<SensorId>) -> f64 {
        self.sensor_variances.of(sensor)
    }

    /// By how much (m) a stop from a speed (m/s) is longer that runs over some edges: each with the part of the effect that comes
    /// from it. What is left of the effect comes from unknown track.
    pub(crate) fn stop_offset(&self, edges: impl Iterator<Item = (EdgeId, f64)>, speed: f64) -> Gaussian {
        let mut sum = Gaussian { mean: 0.0, variance: 0.0 };
        let mut left: f64 = 1.0;
        for (edge, part) in edges {
            let offset = self.stop_offsets.of(usize::from(edge.0));
            sum.mean += part * offset.mean;
            sum.variance += part * part * offset.variance;
            left -= part;
        }
        let left = left.max(0.0);
        let share = stop_offset_share(speed);
        let variance = sum.variance + left * left * self.stop_offsets.variance();
        Gaussian { mean: share * sum.mean, variance: share * share * variance }
    }

    /// One standard deviation of the scatter of stops that the model does not explain, as broken promises show it: loads, wear,
    /// laws that the model lacks, decoders that are late by chance. It is part of every stop's scatter; this is that of a stop from
    /// a medium speed.
    pub fn unexplained_scatter(&self) -> Length {
        Length::from_m(self.scatter.unexplained(MEDIUM_SPEED))
    }

    /// How long it takes, from the command's leaving the line, to be steady at a step coming from another.
    pub fn settles_within(&self, from: SpeedStep, to: SpeedStep) -> TimeSpan {
        TimeSpan::from_s(self.change(from, to).settled().max(LEAST_STOP_S))
    }

    /// The same until the change has shown, so that another would not interrupt it.
    pub(crate) fn shows_within(&self, from: SpeedStep, to: SpeedStep) -> TimeSpan {
        TimeSpan::from_s(self.change(from, to).shown())
    }

    /// The change from one step, at which it runs steadily, to another that is commanded at zero.
    fn change(&self, from: SpeedStep, to: SpeedStep) -> Segment {
        let answers = self.answers();
        let commanded =
            SpeedCommand { sent: 0.0, from: from.get(), to: to.get(), at_rest: from == SpeedStep::STAND };
        let pace = Pace::steady(answers.speed(usize::from(from.get()), false));
        Segment::of(&commanded, &answers, pace)
    }

    /// The path length of a hop, and one standard deviation of it.
    pub fn length(&self, sections: &SectionIndex, hop: &Hop<'_>) -> [Length; 2] {
        let section = sections.section(hop.id);
        let known = section.and_then(|section| self.sections.get(&section).copied());
        let (by, variance) =
            known.or_else(|| Some((0.0, section_variance(sections, section?)))).unwrap_or_default();
        let length = (hop.length.as_m() + by).max(0.0);
        [Length::from_m(length), Length::from_m(libm::sqrt(variance.max(0.0)))]
    }

    /// The sections it ran over: by how much their path length exceeds the surveyed length (m), with the variance.
    pub fn sections(&self) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        self.sections.iter().map(|(section, (longer, variance))| (*section, *longer, *variance))
    }

    /// Sets by how much a section's path length exceeds the surveyed length (m), with the variance.
    pub(crate) fn set_section(&mut self, section: usize, longer: f64, variance: f64) {
        self.sections.insert(section, (longer, variance));
    }

    /// By how much a section's path length exceeds the surveyed length (m), with the variance.
    pub(crate) fn section(&self, section: usize) -> Option<(f64, f64)> {
        self.sections.get(&section).copied()
    }
}

/// The stopping distance (m), from the command on, and the time to rest (s).
pub(super) fn distance_and_time_to_rest(answers: &Answers<'_>, step: u8, above: bool) -> (f64, f64) {
    let speed = answers.speed(usize::from(step), above);
    let segment = stop_from(answers, step, speed);
    (speed * segment.begins + segment.distance_to_rest(), segment.settled())
}

/// A stop from a steady speed (m/s) at a step, commanded at time zero.
pub(super) fn stop_from(answers: &Answers<'_>, step: u8, speed: f64) -> Segment {
    Segment::of(&SpeedCommand { sent: 0.0, from: step, to: 0, at_rest: false }, answers, Pace::steady(speed))
}
