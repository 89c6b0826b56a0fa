//! What to do when a train stalls, is lifted or lost, and when a turnout did not move.

use alloc::vec::Vec;

use super::activity::{Activity, Stage};
use super::calibrator::Calibrator;
use super::notice::{CalibrationNotice, Ending, Mishap};
use crate::event::Approach;
use crate::ids::{SpeedStep, TurnoutId};
use crate::model::StepUse;
use crate::model::survey::{OddSection, SurveyTest};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Hop, HopId, Leg};
use crate::tracking::PassedContact;
use crate::units::{Length, Speed};

/// A contact is late when it is this much later than expected ...
const LATE: TimeSpan = TimeSpan::from_ms(1_500);

/// ... and half of the time again that it was expected to take.
const LATE_PART: f64 = 0.5;

/// Doubt of when a contact is due that is worth waiting for.
const LONGEST_DOUBT: TimeSpan = TimeSpan::from_ms(4_000);

/// A train that was pushed up should get to the next contact within this, at the slowest.
const PUSHED_SPEED: Speed = Speed::from_mm_per_s(100.0);

/// At a step that is faster than this a train stalls on dirt, not because the step is too low for it: model trains that move
/// at all stall below some 50 mm/s, and a late report of a faster one says nothing of the step.
const SLOW_STEP: Speed = Speed::from_mm_per_s(100.0);

/// Pushed up this often without a contact, the train is not on the track any more.
const MOST_PUSHES: u8 = 2;

/// Before a lost train is looked for, it stands; whoever lifted it may put it down meanwhile.
const WAIT_FOR_LOST: TimeSpan = TimeSpan::from_ms(6_000);

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
        let since = self.tracker.last_time().map_or(self.commanded_at, |last| last.max(self.commanded_at));
        let due = self.locator.next_contact(self.context(), self.model(), now);
        let due_by = match due {
            Some(due) => {
                let doubt = TimeSpan::from_s(2.0 * due.uncertainty.as_s()).min(LONGEST_DOUBT);
                let part = TimeSpan::from_s(LATE_PART * (due.time - since).as_s().max(0.0));
                due.time + doubt + part + LATE
            }
            None => {
                // No forecast: the longest that the hop would take at half the speed, from rest.
                let hop = self.tracker.last().and_then(|node| self.context().hop_from(node));
                let length = hop.map_or(super::gain::TYPICAL_HOP, |hop| self.longest(&hop));
                let speed = self.model().speed(self.stance.step, Approach::Below).value;
                let slowest = (0.5 * speed).max(Speed::from_mm_per_s(20.0));
                self.steady_at.max(since) + length / slowest + LATE
            }
        };
        let pushed = self.tracker.last().and_then(|node| self.context().hop_from(node));
        let pushed = pushed.map(|hop| self.commanded_at + self.longest(&hop) / PUSHED_SPEED + LATE);
        self.due_by =
            Some(if self.pushes > 0 { pushed.unwrap_or(due_by).min(due_by) } else { due_by }.max(now));
    }

    /// A length that a hop hardly exceeds.
    fn longest(&self, hop: &Hop<'_>) -> Length {
        if self.sections.is_measured(hop.id) {
            return hop.length;
        }
        let [length, uncertainty] = self.model().length(&self.sections, hop);
        length + 2.0 * uncertainty
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
            self.issue(now, next);
        }
    }

    /// Nobody knows where the train is: it is commanded to stop, and looked for after a while.
    pub(super) fn lose(&mut self, now: Timestamp) {
        self.report_mishap(Mishap::Lost { last: self.tracker.last() });
        self.fit.interrupt();
        self.locator.lose();
        self.tracker.lose();
        self.pushes = 0;
        self.pushed_from = None;
        self.hold_line(None);
        self.issue(now, SpeedStep::STAND);
        self.activity = Activity::Waiting { until: now + WAIT_FOR_LOST };
        self.say_progress(now);
    }

    /// A contact after the train was pushed up: the one that had been due means it had stalled, a later one that the due
    /// one was missed.
    pub(super) fn note_pushes(&mut self, passed: &PassedContact) {
        let Some(step) = self.pushed_from.take() else { return };
        self.pushes = 0;
        if passed.missed == 0 {
            if self.may_be_slow(step) {
                self.fit.note_use(step, StepUse::Unreliable);
            }
            self.fit.interrupt();
            self.report_mishap(Mishap::Stalled { step });
        }
    }

    /// Whether a step may be so slow that the train stalls for it: within one standard deviation.
    fn may_be_slow(&self, step: SpeedStep) -> bool {
        let speed = self.model().speed(step, Approach::Below);
        speed.value - speed.uncertainty < SLOW_STEP
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

    /// Fits anew, and compares the lengths of the layout with what the train makes of them: where they contradict each other
    /// the layout's count for less, and it is said, again when there are more.
    pub(super) fn refit(&mut self) {
        self.fit.refit(&self.sections);
        let test = SurveyTest::of(&self.surveyed, self.model().sections());
        if test != self.survey_test {
            self.sections = test.applied_to(&self.surveyed);
            self.survey_test = test;
            self.fit.refit(&self.sections);
        }
        let hops: Vec<(HopId, Length, Length)> =
            self.survey_test.odd.iter().filter_map(|odd| self.odd_hop(odd)).collect();
        if hops.len() >= FEWEST_ODD && hops.len() > self.odd_lengths {
            self.odd_lengths = hops.len();
            self.report_mishap(Mishap::LengthsDiffer { hops });
        }
    }

    /// A hop over a section that is not as long as the layout says, the length there, and what the train makes of it.
    fn odd_hop(&self, odd: &OddSection) -> Option<(HopId, Length, Length)> {
        let mut hops = self.layout.hops().filter(|hop| self.sections.section(hop.id) == Some(odd.section));
        Some((hops.next()?.id, Length::from_m(odd.surveyed), Length::from_m(odd.felt)))
    }

    /// The train stops for good.
    pub(super) fn end(&mut self, now: Timestamp, ending: Ending) {
        if self.finished.is_some() || matches!(self.activity, Activity::Ending { .. }) {
            return;
        }
        self.hold_line(None);
        self.issue(now, SpeedStep::STAND);
        let stands = now + self.stops_within();
        self.ending = Some(ending);
        self.due_by = None;
        self.activity = Activity::Ending { until: stands };
        self.say_progress(now);
    }

    /// The train stands: the last fit, and the table.
    pub(super) fn finish(&mut self) {
        self.refit();
        let ending = self.ending.take().unwrap_or(Ending::Told);
        self.activity = Activity::Finished;
        self.finished = Some(ending.clone());
        let accuracy = self.accuracy();
        self.say(CalibrationNotice::Finished { ending, accuracy });
    }
}
