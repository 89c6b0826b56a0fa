//! What to do when a train stalls, is lifted or lost, and when a turnout did not move.

use alloc::vec::Vec;

use super::activity::{Activity, Stage};
use super::calibrator::Calibrator;
use super::notice::{CalibrationNotice, Ending, Mishap};
use crate::calibration::motion::StepUse;
use crate::estimation::PassedContact;
use crate::event::Approach;
use crate::ids::{SpeedStep, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{HopId, Leg};
use crate::units::{Length, Speed};

/// A contact is late when it is this much later than expected ...
const LATE: TimeSpan = TimeSpan::from_ms(1_500);

/// ... and half of the time again that it was expected to take.
const LATE_PART: f64 = 0.5;

/// Doubt of when a contact is due that is worth waiting for.
const LONGEST_DOUBT: TimeSpan = TimeSpan::from_ms(4_000);

/// A train that was pushed up should get to the next contact within this, at the slowest.
const PUSHED_SPEED: Speed = Speed::from_mm_per_s(100.0);

/// Pushed up this often without a contact, the train is not on the track any more.
const MOST_PUSHES: u8 = 2;

/// Before a lost train is looked for, it stands; whoever lifted it may put it down meanwhile.
const WAIT_FOR_LOST: TimeSpan = TimeSpan::from_ms(6_000);

/// A length is off by more than a survey explains when it is so many of its standard deviations off, ...
const ODD: f64 = 4.0;

/// ... and by more than curves and dirt make of it (published factors of edges: most within 10 %) ...
const ODD_PART: f64 = 0.12;

/// ... and surely so, in standard deviations of what is felt.
const SURE: f64 = 3.0;

/// One such hop may be a mistake of the survey.
const FEWEST_ODD: usize = 2;

impl Calibrator<'_> {
    /// Works out by when the next contact has to come.
    pub(super) fn expect_contact(&mut self, now: Timestamp) {
        self.due_by = None;
        let runs = match &self.activity {
            Activity::Joining => true,
            Activity::Trying(trial) => !matches!(
                trial.stage,
                Stage::Braking { .. } | Stage::BrakingAgain { .. } | Stage::Moving { .. }
            ),
            _ => false,
        };
        if !runs || self.stance.step == SpeedStep::STAND {
            return;
        }
        let since = self.tracker.last_time().map_or(self.told_at, |last| last.max(self.told_at));
        let due = self.locator.next_contact(self.ground(), self.model(), now);
        let due_by = match due {
            Some(due) => {
                let doubt = TimeSpan::from_s(2.0 * due.uncertainty.as_s()).min(LONGEST_DOUBT);
                let part = TimeSpan::from_s(LATE_PART * (due.time - since).as_s().max(0.0));
                due.time + doubt + part + LATE
            }
            None => {
                // No forecast: the longest that the hop would take at half the speed, from rest.
                let hop = self.tracker.last().and_then(|node| self.ground().hop_from(node));
                let length = hop.map_or(super::gain::TYPICAL_HOP, |hop| hop.length);
                let speed = self.model().speed(self.stance.step, Approach::Below).value;
                let slowest = (0.5 * speed).max(Speed::from_mm_per_s(20.0));
                self.steady_at.max(since) + length / slowest + LATE
            }
        };
        let pushed = self.tracker.last().and_then(|node| self.ground().hop_from(node));
        let pushed = pushed.map(|hop| self.told_at + hop.length / PUSHED_SPEED + LATE);
        self.due_by =
            Some(if self.pushes > 0 { pushed.unwrap_or(due_by).min(due_by) } else { due_by }.max(now));
    }

    /// No contact by the time it was due at the latest.
    pub(super) fn miss_contact(&mut self, now: Timestamp) {
        self.due_by = None;
        let step = self.stance.step;
        if self.pushes >= MOST_PUSHES || step >= self.model().highest() {
            self.lose(now);
            return;
        }
        self.pushed_from = self.pushed_from.or(Some(step));
        self.pushes += 1;
        // The experiment is spoilt: what follows the next contact is planned anew.
        self.activity = Activity::Joining;
        if let Some(next) = SpeedStep::new(step.get() + 1) {
            self.tell(now, next);
        }
    }

    /// Nobody knows where the train is: it is told to stand, and looked for after a while.
    pub(super) fn lose(&mut self, now: Timestamp) {
        self.report_mishap(Mishap::Lost { last: self.tracker.last() });
        self.fit.interrupt();
        self.locator.lose();
        self.tracker.lose();
        self.pushes = 0;
        self.pushed_from = None;
        self.hold_line(None);
        self.tell(now, SpeedStep::STAND);
        self.activity = Activity::Waiting { until: now + WAIT_FOR_LOST };
        self.say_progress(now);
    }

    /// A contact after the train was pushed up: the one that had been due means it had stalled, a later one that the due
    /// one was missed.
    pub(super) fn note_pushes(&mut self, passed: &PassedContact) {
        let Some(step) = self.pushed_from.take() else { return };
        self.pushes = 0;
        if passed.missed == 0 {
            self.fit.note_use(step, StepUse::Unreliable);
            self.fit.interrupt();
            self.report_mishap(Mishap::Stalled { step });
        }
    }

    /// The step at which the train passed a contact moves it, if it had been told long enough ago.
    pub(super) fn note_that_it_moves(&mut self, now: Timestamp) {
        let step = self.stance.step;
        let is_steady = now >= self.steady_at && step > SpeedStep::STAND;
        if is_steady && self.model().uses(step) == StepUse::Untried {
            self.fit.note_use(step, StepUse::Moves);
        }
    }

    /// A turnout lies otherwise than it was told.
    pub(super) fn took_other_leg(&mut self, turnout: TurnoutId, leg: Leg) {
        self.turnouts.set(turnout, leg);
        self.asked_turnouts.remove(&turnout);
        let failures = self.failures.entry(turnout).or_default();
        *failures = failures.saturating_add(1);
        self.report_mishap(Mishap::WrongLeg { turnout, wanted: Leg::from_curved(!leg.is_curved()) });
    }

    /// Says if several hops of the lap take times that their surveyed lengths cannot explain; again when more do.
    ///
    /// Only lengths beside each other count: on another layout all of them would be off by as much as its total is.
    pub(super) fn check_lengths(&mut self) {
        let Some(circuit) = &self.circuit else { return };
        let model = self.fit.model();
        let survey = self.layout.survey().uncertainty;
        let lap = circuit.lap.iter().filter_map(|id| self.layout.hop(*id));
        let felt: Vec<(HopId, Length, Length, Length)> = lap
            .map(|hop| {
                let [felt, doubt] = model.length(&self.sections, &hop);
                (hop.id, hop.length, felt, doubt)
            })
            .filter(|(_, surveyed, ..)| *surveyed > Length::ZERO)
            .collect();
        let mut ratios: Vec<f64> = felt.iter().map(|(_, surveyed, felt, _)| *felt / *surveyed).collect();
        ratios.sort_unstable_by(f64::total_cmp);
        let Some(scale) = ratios.get(ratios.len() / 2).copied().filter(|scale| *scale > 0.0) else { return };
        let hops: Vec<(HopId, Length, Length)> = felt
            .into_iter()
            .map(|(id, surveyed, felt, doubt)| (id, surveyed, felt / scale, doubt))
            .filter(|(_, surveyed, felt, doubt)| {
                let off = (*felt - *surveyed).abs();
                off > SURE * *doubt && off > ODD * survey && off > ODD_PART * *surveyed
            })
            .map(|(id, surveyed, felt, _)| (id, surveyed, felt))
            .collect();
        let is_news = hops.len() != self.odd_lengths;
        if hops.len() >= FEWEST_ODD && is_news {
            self.odd_lengths = hops.len();
            self.report_mishap(Mishap::LengthsDiffer { hops });
        }
    }

    /// The train stops for good.
    pub(super) fn end(&mut self, now: Timestamp, ending: Ending) {
        if self.finished.is_some() || matches!(self.activity, Activity::Ending { .. }) {
            return;
        }
        self.hold_line(None);
        self.tell(now, SpeedStep::STAND);
        let stands = now + self.stops_within();
        self.ending = Some(ending);
        self.due_by = None;
        self.activity = Activity::Ending { until: stands };
        self.say_progress(now);
    }

    /// The train stands: the last fit, and the table.
    pub(super) fn finish(&mut self) {
        self.fit.refit(&self.sections);
        let ending = self.ending.take().unwrap_or(Ending::Told);
        self.activity = Activity::Finished;
        self.finished = Some(ending.clone());
        let accuracy = self.accuracy();
        self.say(CalibrationNotice::Finished { ending, accuracy });
    }
}
