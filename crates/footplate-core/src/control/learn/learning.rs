//! Fits motion models to the events of the session while trains run.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use crate::control::Notice;
use crate::control::dispatch::Dispatcher;
use crate::control::drive::Driver;
use crate::control::supervise::Remeasured;
use crate::event::{Event, EventKind, Report};
use crate::ids::TrainId;
use crate::model::survey::SectionIndex;
use crate::model::{MotionFit, MotionModel, Refit, StepChanges};
use crate::track::Layout;
use crate::tracking::PassedSensor;

/// The fits of all trains, continued from those that the session began with.
#[derive(Debug, Clone)]
pub struct Learning {
    fits: BTreeMap<TrainId, MotionFit>,
    sections: SectionIndex,
    /// Refits that are being computed, a part at a time.
    in_progress: BTreeMap<TrainId, Refit>,
    /// Commanded steps of a train since its last standstill.
    changes: BTreeMap<TrainId, StepChanges>,
}

impl Learning {
    /// Continues from the fits that a session begins with.
    pub fn new(layout: &Layout, fits: Vec<MotionFit>) -> Self {
        let fits = fits.into_iter().map(|fit| (fit.model().train(), fit)).collect();
        Self {
            fits,
            sections: SectionIndex::of(layout),
            in_progress: BTreeMap::new(),
            changes: BTreeMap::new(),
        }
    }

    /// Takes in a command that has left for a train.
    pub fn take(&mut self, driver: &Driver, event: &Event) {
        match event.kind {
            EventKind::Speed { train, step } => {
                if self.changes.entry(train).or_default().take(step) {
                    self.interrupt(train);
                } else {
                    self.learn(train, driver, event);
                }
            }
            EventKind::Reverse { train } => self.learn(train, driver, event),
            EventKind::Freed(_) => {
                let fits = self.fits.iter_mut();
                let known = fits.filter_map(|(train, fit)| Some((fit, driver.model(*train)?)));
                known.for_each(|(fit, model)| fit.keep_length(model));
            }
            _ => {}
        }
    }

    /// Takes in what the dispatcher reports of a train. Returns the train if a recovery found it changed.
    pub fn take_notice(&mut self, dispatcher: &mut Dispatcher, notice: &Notice) -> Option<TrainId> {
        match notice {
            Notice::Passed { train, passed, .. } => self.passed(*train, dispatcher.driver(), passed),
            Notice::Lost { train } | Notice::TurnoutMismatch { train, .. } | Notice::Danger { train, .. } => {
                self.interrupt(*train);
            }
            Notice::Done(finished) if finished.unseen.is_some() => self.interrupt(finished.train),
            Notice::Recovered { train, .. } => {
                // What is being fitted is the train as it was before.
                self.go_on(*train, dispatcher.take_remeasured(*train)?);
                return Some(*train);
            }
            _ => {}
        }
        None
    }

    /// Takes in a detection of a train. A train that has only just been located has no known earlier position.
    pub fn passed(&mut self, train: TrainId, driver: &Driver, passed: &PassedSensor) {
        if passed.late.is_none()
            && let Some(fit) = self.fits.get_mut(&train)
        {
            fit.lose_place();
        }
        if self.changes.get(&train).is_some_and(|changes| changes.are_too_many()) {
            return;
        }
        let report = Report { sensor: passed.sensor, poll_interval: Some(passed.window.width()) };
        let event = Event { time: passed.window.until, kind: EventKind::Sensor(report) };
        self.learn(train, driver, &event);
    }

    fn learn(&mut self, train: TrainId, driver: &Driver, event: &Event) {
        if let Some(fit) = self.fits.get_mut(&train) {
            fit.take(driver.layout(), driver.turnouts(), event);
        }
    }

    /// Ends the current run of a train: its next events do not follow from known ones.
    pub fn interrupt(&mut self, train: TrainId) {
        if let Some(fit) = self.fits.get_mut(&train) {
            fit.interrupt();
        }
    }

    /// Goes on from what a recovery found of a train that is no longer as it was.
    fn go_on(&mut self, train: TrainId, from: Remeasured) {
        self.in_progress.remove(&train);
        match from {
            Remeasured::Changed(numbers) => {
                if let Some(fit) = self.fits.get_mut(&train) {
                    fit.change(&numbers);
                }
            }
            Remeasured::Another(mut fit) => {
                fit.interrupt();
                self.fits.insert(train, *fit);
            }
        }
    }

    /// All fits, with their current runs ended: what the trains do between sessions is unknown.
    pub fn handed_over(&self) -> Vec<MotionFit> {
        let fits = self.fits.values().cloned();
        fits.map(|mut fit| {
            fit.interrupt();
            fit
        })
        .collect()
    }

    /// Starts a refit to all events of a train so far.
    pub fn begin_refit(&mut self, train: TrainId) {
        if let Some(fit) = self.fits.get(&train) {
            self.in_progress.insert(train, fit.begin_refit(&self.sections));
        }
    }

    /// Whether any refit is being computed.
    pub fn is_refitting(&self) -> bool {
        !self.in_progress.is_empty()
    }

    /// Whether a refit of this train is being computed.
    pub fn is_refitting_to(&self, train: TrainId) -> bool {
        self.in_progress.contains_key(&train)
    }

    /// Computes the next part of a refit, which takes milliseconds; returns the model after the last part.
    pub fn advance_refit(&mut self) -> Option<MotionModel> {
        let mut first = self.in_progress.first_entry()?;
        first.get_mut().go_on();
        if !first.get().is_over() {
            return None;
        }
        let (train, refit) = first.remove_entry();
        let fit = self.fits.get_mut(&train)?;
        fit.adopt(refit);
        Some(fit.model().clone())
    }

    /// The model fitted to all events of a train. Too slow to run between two reports.
    pub fn model(&mut self, train: TrainId) -> Option<MotionModel> {
        self.in_progress.remove(&train);
        let fit = self.fits.get_mut(&train)?;
        fit.refit(&self.sections);
        Some(fit.model().clone())
    }
}
