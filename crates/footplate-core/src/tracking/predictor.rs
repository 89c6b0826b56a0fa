//! Walks a recording, forecasts every report and learns from it.

use alloc::vec::Vec;

use super::Drift;
use super::forecast::Forecast;
use super::polls::Polls;
use super::train_forecaster::{TrainForecaster, expected_length};
use crate::event::{Event, EventKind};
use crate::ids::{SensorId, SpeedStep, TrainId};
use crate::link::PollTimingEstimator;
use crate::model::MotionModel;
use crate::model::survey::SectionIndex;
use crate::model::{Passage, PassageTracker, Sighting};
use crate::track::Layout;

/// What became of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Verdict {
    /// The first passage of a run, or the first after the train's place was lost: nothing to compare with.
    First,
    /// It was as forecast, within what chance allows, and was learnt from.
    Learnt,
    /// It came at a time that one forecast in a hundred thousand allows; only its place was taken over.
    Rejected,
    /// It was rejected like the one before it: the gate is open again and the speed is learnt anew.
    Reopened,
}

/// One passage of a sensor, beside what had been forecast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// The passage.
    pub passage: Passage,
    /// What had been forecast for this sensor before it reported; `None` when nothing could be.
    pub forecast: Option<Forecast>,
    /// The sensor that had been named as the next; it differs after a missed detection or another path.
    pub named: Option<SensorId>,
    /// What became of it.
    pub verdict: Verdict,
    /// The forecasts have been going wrong to one side for long: the future is no longer like the past.
    pub drift: Option<Drift>,
}

/// Everything learnt so far, and the present train.
#[derive(Debug, Clone)]
pub struct Predictor {
    sections: SectionIndex,
    trains: Vec<TrainForecaster>,
    /// Which of `trains` the run is of, and its tracker.
    present: Option<(usize, PassageTracker)>,
    timing: PollTimingEstimator,
}

impl Predictor {
    /// Knows the layout and nothing of any train.
    pub fn new(layout: &Layout) -> Self {
        Self {
            sections: SectionIndex::of(layout),
            trains: Vec::new(),
            present: None,
            timing: PollTimingEstimator::default(),
        }
    }

    /// A run begins: `train` has been running at `step` for long, or stands at step 0. The run's clock has
    /// nothing to do with any before.
    pub fn begin_run(&mut self, train: TrainId, step: SpeedStep) {
        self.end_run();
        let place = self.place_of(train);
        if let Some(model) = self.trains.get_mut(place) {
            model.begin_run(step);
        }
        self.timing.restart();
        self.present = Some((place, PassageTracker::new(train, step, self.timing.clone())));
    }

    /// The run is over: what it showed of the train goes into its motion model.
    pub fn end_run(&mut self) {
        if let Some((place, tracker)) = self.present.take() {
            self.timing = tracker.timing().clone();
            if let Some(train) = self.trains.get_mut(place) {
                train.end_run(&self.sections);
            }
        }
    }

    /// The next entry of the run. A hit where it is a report of a passage; `None` for all else and outside
    /// a run.
    pub fn take(&mut self, layout: &Layout, event: &Event) -> Option<Hit> {
        let (place, tracker) = self.present.as_mut()?;
        let before = tracker.drive();
        let polls = Polls::of(tracker.timing());
        let sighting = tracker.take(layout, event);
        let (now, turnouts) = (tracker.drive(), tracker.turnouts());
        let (others, rest) = self.trains.split_at_mut_checked(*place)?;
        let (train, more) = rest.split_first_mut()?;
        match sighting {
            Some(Sighting::Passage(passage)) => {
                let others = || others.iter().chain(more.iter());
                let prior =
                    |model: &MotionModel, section| expected_length(model, others(), &self.sections, section);
                Some(train.pass(layout, &self.sections, turnouts, passage, polls, prior))
            }
            Some(_) => None,
            None => {
                if now != before {
                    train.command(layout, &self.sections, turnouts, event, now);
                } else if matches!(event.kind, EventKind::Stopped { .. } | EventKind::Reverse { .. }) {
                    train.note(layout, turnouts, event);
                }
                None
            }
        }
    }

    /// What is known of a train.
    pub fn train(&self, train: TrainId) -> Option<&TrainForecaster> {
        self.trains.iter().find(|model| model.train() == train)
    }

    /// Takes over a model from elsewhere, such as a calibration. It counts until the runs of its train have passed more sensors
    /// than it was made of.
    pub fn know(&mut self, model: MotionModel) {
        let place = self.place_of(model.train());
        if let Some(train) = self.trains.get_mut(place) {
            train.know(model);
        }
    }

    /// All trains seen, in the order of their first run.
    pub fn trains(&self) -> impl Iterator<Item = &TrainForecaster> {
        self.trains.iter()
    }

    /// The sections by which lengths are kept.
    pub const fn sections(&self) -> &SectionIndex {
        &self.sections
    }

    fn place_of(&mut self, train: TrainId) -> usize {
        self.trains.iter().position(|model| model.train() == train).unwrap_or_else(|| {
            self.trains.push(TrainForecaster::new(train));
            self.trains.len() - 1
        })
    }
}
