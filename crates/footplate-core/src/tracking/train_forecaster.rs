//! One train as it is known: its motion model, the present run, how its sensors scatter and which paths it takes.

use super::DriftTest;
use super::arrival::Arrival;
use super::arrival_filter::ArrivalFilter;
use super::forecast::{Forecast, ForecastPhase};
use super::polls::Polls;
use super::predictor::{Hit, Verdict};
use super::route_memory::RouteMemory;
use crate::estimate::Estimate;
use crate::event::{Event, EventKind, Report};
use crate::ids::{DecoderSteps, SensorId, SpeedStep, TrainId};
use crate::linalg::Gaussian;
use crate::link::UniformNormal;
use crate::model::survey::SectionIndex;
use crate::model::{Drive, Passage};
use crate::model::{MotionFit, SensorScatter};
use crate::model::{MotionModel, PATH_LENGTH_SPREAD};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Layout, Reach, TurnoutStates};
use crate::units::Speed;

/// A report that one forecast in this many allows is rejected.
const GATE: f64 = 1e-5;
/// One standard deviation of ln speed that is added when the gate opens again or a drift was found.
const REOPENED: f64 = 0.05;
/// How much longer a section feels to one train than to another: 8 mm over ten sections and five published trains.
const OWN_LENGTH_M: f64 = 0.008;

/// A train is placed by a report whose window is at most this many poll periods wide.
const LONGEST_WINDOW: f64 = 4.0;
/// Within a run the model is fitted again after so many sensors, and after a quarter more than so far: a recording of any
/// length costs a few dozen fits.
const FEWEST_BETWEEN_FITS: u32 = 12;
/// A steady run counts as two for the fit after so many hops: its speed wanders, and every few seconds cost a number.
const LONGEST_STEADY_HOPS: u32 = 64;

/// One train as it is known.
#[derive(Debug, Clone)]
pub struct TrainForecaster {
    /// What forecasts are made by: that of the last fit, or one from elsewhere that was made of more.
    model: MotionModel,
    fit: MotionFit,
    filter: ArrivalFilter,
    scatter: SensorScatter,
    drift: DriftTest,
    routes: RouteMemory,
    drive: Drive,
    /// Sensors passed in all runs, and at how many the next fit within a run is due.
    passages: u32,
    next_fit: u32,
    /// Where the clock of `filter` begins: with the first entry of the run.
    epoch: Option<Timestamp>,
    /// Hops run at the settled speed of the step.
    settled_hops: u32,
    was_rejected: bool,
    date: Timestamp,
}

impl TrainForecaster {
    pub(super) fn new(train: TrainId) -> Self {
        let fit = MotionFit::new(train, DecoderSteps::with(SpeedStep::STAND).highest());
        let model = fit.model().clone();
        let filter = ArrivalFilter::begin(&model, 0.0, SpeedStep::STAND);
        Self {
            model,
            fit,
            filter,
            scatter: SensorScatter::default(),
            drift: DriftTest::default(),
            routes: RouteMemory::default(),
            drive: Drive { step: SpeedStep::STAND, from: SpeedStep::STAND, commanded: None },
            passages: 0,
            next_fit: FEWEST_BETWEEN_FITS,
            epoch: None,
            settled_hops: 0,
            was_rejected: false,
            date: Timestamp::ZERO,
        }
    }

    /// The train.
    pub const fn train(&self) -> TrainId {
        self.model.train()
    }

    /// Its motion, as of the last run that ended.
    pub const fn model(&self) -> &MotionModel {
        &self.model
    }

    /// Takes over a model from elsewhere. It counts until the runs of this train have passed more sensors than it was made of.
    pub(super) fn know(&mut self, model: MotionModel) {
        // The runs to come are fitted for the same decoder, or that fit would replace the model by one of another decoder.
        if model.highest() != self.fit.model().highest() {
            self.fit = MotionFit::new(self.train(), model.highest());
        }
        self.model = model;
    }

    /// The steady speed of the step as the present run has shown it up to the last detection. `None` before the first hop
    /// at a settled speed. The count is of such hops.
    pub fn running_speed(&self) -> Option<Estimate<Speed>> {
        if self.settled_hops == 0 {
            return None;
        }
        let speed = self.filter.settled_speed();
        Some(Estimate {
            value: Speed::from_m_per_s(speed.mean),
            uncertainty: Speed::from_m_per_s(libm::sqrt(speed.variance)),
            count: self.settled_hops,
            date: self.date,
        })
    }

    pub(super) fn begin_run(&mut self, step: SpeedStep) {
        self.drive = Drive { step, from: step, commanded: None };
        self.settled_hops = 0;
        self.was_rejected = false;
        self.epoch = None;
        self.meet(step);
        self.fit.begin_run(step);
        self.filter = ArrivalFilter::begin(&self.model, 0.0, step);
    }

    pub(super) fn end_run(&mut self, sections: &SectionIndex) {
        self.refit(sections);
    }

    /// What the runs so far have shown of the train goes into its model, unless that was made of more.
    fn refit(&mut self, sections: &SectionIndex) {
        if self.passages < self.model.sensors_passed() {
            return;
        }
        self.fit.refit(sections);
        self.model = self.fit.model().clone();
        self.filter.exchange(&self.model);
        self.next_fit = self.passages + FEWEST_BETWEEN_FITS.max(self.passages / 4);
    }

    /// A step that its decoder was not thought to have: it has more, and all steps mean another speed.
    fn meet(&mut self, step: SpeedStep) {
        if step > self.model.highest() {
            self.fit = MotionFit::new(self.train(), DecoderSteps::with(step).highest());
            self.model = self.fit.model().clone();
            self.filter = ArrivalFilter::begin(&self.model, 0.0, SpeedStep::STAND);
        }
    }

    /// On the clock of `filter` (s).
    fn seconds(&mut self, time: Timestamp) -> f64 {
        (time - *self.epoch.get_or_insert(time)).as_s()
    }

    /// A command for another step was sent.
    pub(super) fn command(
        &mut self,
        layout: &Layout,
        sections: &SectionIndex,
        turnouts: &TurnoutStates,
        event: &Event,
        drive: Drive,
    ) {
        self.meet(drive.step);
        if self.passages >= self.next_fit && self.filter.is_settled() {
            self.refit(sections);
        }
        self.drive = drive;
        self.settled_hops = 0;
        self.fit.take(layout, turnouts, event);
        let sent = self.seconds(event.time);
        self.filter.command(sent, drive.step);
    }

    /// A person measured where it came to rest, or it was reversed.
    pub(super) fn note(&mut self, layout: &Layout, turnouts: &TurnoutStates, event: &Event) {
        self.fit.take(layout, turnouts, event);
    }

    /// The train passed a sensor; `prior` says by how much (m) to expect a section to be longer than surveyed.
    pub(super) fn pass(
        &mut self,
        layout: &Layout,
        sections: &SectionIndex,
        turnouts: &TurnoutStates,
        passage: Passage,
        polls: Polls,
        prior: impl Fn(&MotionModel, usize) -> Gaussian,
    ) -> Hit {
        self.date = passage.window.until;
        self.passages = self.passages.saturating_add(1);
        let report = Report { sensor: passage.sensor, poll_interval: Some(passage.window.width()) };
        self.fit.take(
            layout,
            turnouts,
            &Event { time: passage.window.until, kind: EventKind::Sensor(report) },
        );
        let named = passage.path.as_ref().and_then(|path| self.routes.named(layout, path));
        let hit = |forecast, verdict, drift| Hit { passage, forecast, named, verdict, drift };
        let (time, variance) = (self.seconds(passage.window.middle()), passage.window.variance_s2());
        let scatter = self.scatter.variance(passage.sensor, self.drive.step);
        let Some(path) = passage.path.filter(|_| self.filter.is_placed()) else {
            // The first poll after a pause reports what is long past: no place to count from.
            if self.filter.is_placed() || passage.window.width().as_s() < LONGEST_WINDOW * polls.period.as_s()
            {
                self.filter.appear(time, variance, scatter);
            }
            return hit(None, Verdict::First, None);
        };
        let ahead = self.filter.ahead(sections, &path, |section| prior(&self.model, section));
        let Some(due) = self.filter.arrival(&ahead, scatter) else {
            // By all that is known the train stops short of it, so there was no forecast.
            self.filter.appear(time, variance, scatter);
            return hit(None, Verdict::First, None);
        };
        let is_changing = !self.filter.is_settled();
        let forecast = self.forecast_of(passage.sensor, &path, &due, is_changing, polls);
        // Judged by what was known before the hit.
        let stated = self.foreseeable(forecast);
        let late = time - due.time;
        let probability = forecast.probability_by(passage.window.until);
        let too_wild = probability.min(1.0 - probability) < GATE;
        self.routes.remember(layout, &path, self.drive.step);
        if too_wild {
            let reopened = self.was_rejected;
            self.was_rejected = !reopened;
            let off = -late * due.speed;
            if is_changing && self.filter.widen_change(time, off) {
                self.filter.pass(&ahead, time, variance, scatter);
            } else if reopened {
                self.filter.widen_speed(REOPENED * REOPENED);
                self.filter.pass(&ahead, time, variance, scatter);
            } else {
                self.filter.appear(time, variance, scatter);
            }
            let verdict = if reopened { Verdict::Reopened } else { Verdict::Rejected };
            return hit(stated, verdict, None);
        }
        self.was_rejected = false;
        let mut drift = None;
        if !is_changing {
            self.settled_hops += 1;
            if self.settled_hops.is_multiple_of(LONGEST_STEADY_HOPS) {
                self.fit.interrupt();
            }
            drift = self.drift.take(late / libm::sqrt(due.variance + variance));
            let squared = due.speed * due.speed;
            let motion = (due.variance * squared - scatter).max(0.0);
            let miss = late * due.speed;
            let explained = [motion, variance * squared];
            self.scatter.take(passage.sensor, self.drive.step, miss * miss, explained);
        }
        if drift.is_some() {
            self.filter.widen_speed(REOPENED * REOPENED);
        }
        self.filter.pass(&ahead, time, variance, scatter);
        hit(stated, Verdict::Learnt, drift)
    }

    /// A forecast of a steady train counts as one when it was ever seen to run.
    fn foreseeable(&self, forecast: Forecast) -> Option<Forecast> {
        let is_known = self.settled_hops > 0 || self.model.sensors_passed() > 0;
        (is_known || forecast.phase == ForecastPhase::Change).then_some(forecast)
    }

    fn forecast_of(
        &self,
        sensor: SensorId,
        path: &Reach,
        due: &Arrival,
        is_changing: bool,
        polls: Polls,
    ) -> Forecast {
        let phase = if is_changing {
            ForecastPhase::Change
        } else if self.routes.has_passed(path, self.drive.step) {
            ForecastPhase::Steady
        } else {
            ForecastPhase::FirstLap
        };
        let detection = self.epoch.unwrap_or(Timestamp::ZERO) + TimeSpan::from_s(due.time);
        let time = detection + TimeSpan::from_ns(polls.period.as_ns() / 2);
        Forecast {
            sensor,
            time,
            report: polls.rhythm.and_then(|rhythm| rhythm.poll_after(detection)).unwrap_or(time),
            spread: UniformNormal { deviation: libm::sqrt(due.variance), width: polls.period.as_s() },
            speed: Speed::from_m_per_s(due.speed),
            phase,
        }
    }
}

/// By how much a section is longer than surveyed for a train (m): as its model says, or, where it never was, from the survey and
/// from what other trains found there. Each of those tells of it only as well as trains are alike.
pub(super) fn expected_length<'t>(
    model: &MotionModel,
    others: impl Iterator<Item = &'t TrainForecaster>,
    sections: &SectionIndex,
    section: usize,
) -> Gaussian {
    if let Some((mean, variance)) = model.section(section) {
        return Gaussian { mean, variance };
    }
    let spread = PATH_LENGTH_SPREAD * sections.surveyed_length(section);
    let survey = sections.survey_variance(section) + spread * spread;
    let own = OWN_LENGTH_M * OWN_LENGTH_M;
    let (mut weight, mut sum, mut alike) = (1.0 / survey.max(f64::MIN_POSITIVE), 0.0, 0.0);
    for (by, variance) in others.filter_map(|other| other.model.section(section)) {
        weight += 1.0 / (variance + own);
        sum += by / (variance + own);
        alike = own;
    }
    Gaussian { mean: sum / weight, variance: 1.0 / weight + alike }
}
