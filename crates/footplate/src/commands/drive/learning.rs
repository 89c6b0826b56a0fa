//! What trains teach while they are driven.

use std::collections::BTreeMap;

use footplate_core::control::Driver;
use footplate_core::model::MotionModel;
use footplate_core::model::survey::SectionIndex;
use footplate_core::model::{MotionFit, Refit};
use footplate_core::track::Layout;
use footplate_core::tracking::PassedContact;
use footplate_core::{Event, EventKind, Report, SpeedStep, TrainId};

/// Fits that go on from what was known at the beginning.
#[derive(Debug)]
pub(super) struct Learning {
    fits: BTreeMap<TrainId, MotionFit>,
    sections: SectionIndex,
    /// Fits under way.
    under_way: BTreeMap<TrainId, Refit>,
    /// Steps told to a train since it stood last.
    changes: BTreeMap<TrainId, usize>,
}

/// A run with more changes of step than this teaches nothing that others do not: a train that is held at a speed between two
/// steps changes every second, and a fit weighs every change of a run against every contact.
const MOST_CHANGES: usize = 16;

impl Learning {
    pub(super) fn new(layout: &Layout, fits: Vec<MotionFit>) -> Self {
        let fits = fits.into_iter().map(|fit| (fit.model().train(), fit)).collect();
        Self {
            fits,
            sections: SectionIndex::of(layout),
            under_way: BTreeMap::new(),
            changes: BTreeMap::new(),
        }
    }

    /// A command to a train has left.
    pub(super) fn take(&mut self, driver: &Driver, event: &Event) {
        match event.kind {
            EventKind::Speed { train, step } => {
                let changes = self.changes.entry(train).or_default();
                let was_restless = *changes > MOST_CHANGES;
                *changes = if step == SpeedStep::STAND { 0 } else { *changes + 1 };
                if *changes > MOST_CHANGES || was_restless {
                    self.interrupt(train);
                } else {
                    self.learn(train, driver, event);
                }
            }
            EventKind::Reverse { train } => self.learn(train, driver, event),
            _ => {}
        }
    }

    /// A contact was judged to have been closed by a train. Where it was before is not known if it was just found.
    pub(super) fn passed(&mut self, train: TrainId, driver: &Driver, passed: &PassedContact) {
        if passed.late.is_none() {
            self.interrupt(train);
        }
        if self.changes.get(&train).is_some_and(|changes| *changes > MOST_CHANGES) {
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

    /// What a train did last follows from nothing that is known.
    pub(super) fn interrupt(&mut self, train: TrainId) {
        if let Some(fit) = self.fits.get_mut(&train) {
            fit.interrupt();
        }
    }

    /// A train is not what it was: nothing is learnt of it any more in this session, and what was is not kept.
    pub(super) fn forget(&mut self, train: TrainId) {
        self.fits.remove(&train);
        self.under_way.remove(&train);
    }

    /// All fits, with the chain of what trains did broken: nobody knows what becomes of them until they are driven again.
    pub(super) fn handed_over(&self) -> Vec<MotionFit> {
        let fits = self.fits.values().cloned();
        fits.map(|mut fit| {
            fit.interrupt();
            fit
        })
        .collect()
    }

    /// Begins to fit to all that a train did so far.
    pub(super) fn begin_fit(&mut self, train: TrainId) {
        if let Some(fit) = self.fits.get(&train) {
            self.under_way.insert(train, fit.begin_refit(&self.sections));
        }
    }

    /// Whether any fit is under way.
    pub(super) fn is_fitting(&self) -> bool {
        !self.under_way.is_empty()
    }

    /// Whether that of a train is.
    pub(super) fn is_fitting_to(&self, train: TrainId) -> bool {
        self.under_way.contains_key(&train)
    }

    /// Does the next part of a fit under way, which takes milliseconds; gives the model if that was the last part.
    pub(super) fn go_on(&mut self) -> Option<MotionModel> {
        let mut first = self.under_way.first_entry()?;
        first.get_mut().go_on();
        if !first.get().is_over() {
            return None;
        }
        let (train, refit) = first.remove_entry();
        let fit = self.fits.get_mut(&train)?;
        fit.adopt(refit);
        Some(fit.model().clone())
    }

    /// What is known of a train by now. Takes a while: not for between two reports.
    pub(super) fn model(&mut self, train: TrainId) -> Option<MotionModel> {
        self.under_way.remove(&train);
        let fit = self.fits.get_mut(&train)?;
        fit.refit(&self.sections);
        Some(fit.model().clone())
    }
}
