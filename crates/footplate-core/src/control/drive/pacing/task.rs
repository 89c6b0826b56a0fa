//! What a train is paced for, and when it is looked at next.

use alloc::vec::Vec;

use crate::control::drive::driven_train::{DrivenTrain, LINE_TIME};
use crate::control::drive::outputs::Outputs;
use crate::control::drive::task::Goal;
use crate::estimation::Ground;
use crate::ids::{SensorId, SpeedStep};
use crate::time::{TimeSpan, Timestamp};

use super::hold::Holding;
use super::reference::GRID;
use super::step_search::StepSearch;
use super::surveyed_way::SurveyedWay;

/// From one command to a train to its next: decoders hear every command, but a change of speed that has not begun to be
/// felt is not worth another.
const SPACING: TimeSpan = TimeSpan::from_ms(200);
/// Within this time a train is paced with no more than [`IN_A_ROW`] commands: four trains then take 6 % of a 2400-baud
/// line.
const BUDGET: TimeSpan = TimeSpan::from_s(2.0);
const IN_A_ROW: usize = 3;
/// A command waits for the poll that is on the line: half of the longest, 58 ms.
const POLL_WAIT: TimeSpan = TimeSpan::from_ms(29);
/// The module of a contact is watched from this long before the contact is due: three standard deviations of an
/// expectation, and the poll of all modules that may be on the line then.
const WATCHED_BEFORE: TimeSpan = TimeSpan::from_ms(180);
/// A contact that has not reported after this long may have been missed.
const WATCHED_AFTER: TimeSpan = TimeSpan::from_ms(250);
/// Nothing is planned finer than this: a tenth of a second of 30 mm/s is 3 mm.
const FINE: f64 = 0.5 * GRID;
/// A plan is looked at again after this time (s), whether or not anything was learnt.
const AGAIN: f64 = 1.0;

/// What a train is paced for.
#[derive(Debug, Clone)]
pub(in crate::control::drive) enum Pace {
    /// To run at a speed.
    Hold(Holding),
}

/// A train that is paced.
#[derive(Debug, Clone)]
pub(in crate::control::drive) struct Pacing {
    pub(super) pace: Pace,
    /// The steps that may be commanded, slowest first.
    pub(super) usable: Vec<SpeedStep>,
    /// When it may be told something next.
    free: Timestamp,
    /// When the last commands left, oldest first.
    sent: [Option<Timestamp>; IN_A_ROW],
    /// When it is looked at next.
    pub(super) look: Option<Timestamp>,
}

impl Pacing {
    pub(super) fn new(pace: Pace, usable: Vec<SpeedStep>, now: Timestamp) -> Self {
        Self { pace, usable, free: now, sent: [None; IN_A_ROW], look: Some(now) }
    }
}

impl DrivenTrain {
    pub(super) fn paced(&self) -> Option<&Pacing> {
        self.pacing.as_ref().filter(|_| self.goal() == Some(Goal::Pace))
    }

    /// When it wants to be looked at, if nothing is reported before.
    pub(in crate::control::drive) fn next_look(&self) -> Option<Timestamp> {
        self.paced()?.look.filter(|_| self.is_told())
    }

    /// The contact that it comes to next, and from when until when its report is waited for.
    pub(in crate::control::drive) fn due_span(&self) -> Option<(SensorId, [Timestamp; 2])> {
        self.paced()?;
        let (sensor, time) = self.due()?;
        Some((sensor, [time - WATCHED_BEFORE, time + WATCHED_AFTER]))
    }

    /// A step has left the line.
    pub(in crate::control::drive) fn paced_step_left(&mut self, sent: Timestamp) {
        if let Some(pacing) = &mut self.pacing {
            pacing.sent.rotate_left(1);
            if let Some(last) = pacing.sent.last_mut() {
                *last = Some(sent);
            }
            let oldest = pacing.sent.first().copied().flatten();
            pacing.free = (sent + SPACING).max(oldest.map_or(sent, |oldest| oldest + BUDGET));
            pacing.look = Some(pacing.free);
        }
    }

    /// A contact was passed: all is looked at again.
    pub(in crate::control::drive) fn paced_passed(
        &mut self,
        ground: Ground<'_>,
        now: Timestamp,
        out: &mut Outputs,
    ) {
        let (Some(task), Some(mut pacing)) = (self.task, self.pacing.take()) else { return };
        if task.goal == Goal::Pace {
            match &mut pacing.pace {
                Pace::Hold(holding) => self.begin_line(ground, now, task.order, holding, out),
            }
            pacing.look = Some(now);
            self.pacing = Some(pacing);
        }
    }

    /// Looks at what it does against what it should do, and commands what is due.
    pub(in crate::control::drive) fn pace(&mut self, ground: Ground<'_>, now: Timestamp, out: &mut Outputs) {
        let Some(pacing) = &mut self.pacing else { return };
        pacing.look = None;
        let Some(outlook) = self.locator.outlook() else { return };
        let reference = match &mut pacing.pace {
            Pace::Hold(holding) => holding.reference(ground, now, outlook.node()),
        };
        let Some(reference) = reference else { return };
        let way = SurveyedWay::ahead(ground, &self.model, outlook.node());
        let leaves = (LINE_TIME + POLL_WAIT).as_s();
        let at = outlook.seconds(now);
        let free = (pacing.free - now).as_s().max(0.0);
        let soonest = libm::ceil((free - 1e-9) / GRID) as usize;
        let search = StepSearch::new(&self.model, &way, &reference, &pacing.usable, at, leaves);
        let choice = search.best(outlook, soonest);
        match choice.first {
            Some((0, step)) => {
                pacing.look = Some(now + SPACING);
                self.tell_step(now, step, out);
            }
            Some((grid, _)) => {
                let wait = (GRID * grid as f64 - FINE).clamp(FINE, AGAIN);
                pacing.look = Some(now + TimeSpan::from_s(wait));
            }
            None => pacing.look = Some(now + TimeSpan::from_s(AGAIN)),
        }
    }
}
