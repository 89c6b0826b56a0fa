//! Faults during a calibration: a train that stalls, is lifted or lost, and a turnout that did not move.

use alloc::vec::Vec;

use super::activity::{Activity, Stage};
use super::calibrator::Calibrator;
use super::notice::{CalibrationNotice, Ending, Fault};
use crate::event::Approach;
use crate::ids::{SpeedStep, TurnoutId};
use crate::model::StepUse;
use crate::model::survey::{OddSection, SurveyTest};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Hop, HopId, Leg};
use crate::tracking::PassedSensor;
use crate::units::{Length, Speed};

/// A detection is overdue this long after its predicted time ...
const LATE: TimeSpan = TimeSpan::from_ms(1_500);

/// ... plus this part of the predicted time itself.
const LATE_PART: f64 = 0.5;

/// A larger uncertainty of the predicted time is not waited for.
const MAX_UNCERTAINTY: TimeSpan = TimeSpan::from_ms(4_000);

/// A train that was pushed up a step reaches the next sensor at this speed at least.
const PUSHED_SPEED: Speed = Speed::from_mm_per_s(100.0);

/// At a step that is faster than this a train stalls on dirt, not because the step is too low for it: model trains
/// that move at all stall below some 50 mm/s, and a late report of a faster one says nothing of the step.
const SLOW_STEP: Speed = Speed::from_mm_per_s(100.0);

/// After this many pushes without a detection the train counts as lost.
const MAX_PUSHES: u8 = 2;

/// The search for a lost train begins after this time at rest: it may have been lifted, and is put down meanwhile.
const WAIT_FOR_LOST: TimeSpan = TimeSpan::from_ms(6_000);

/// One hop with another length may be an error of the survey.
const FEWEST_ODD: usize = 2;

impl Calibrator<'_> {
    /// Sets the time by which the next detection must have come.
    pub(super) fn expect_detection(&mut self, now: Timestamp) {
        self.due_by = None;
        let runs = match &self.activity {
            Activity::Joining => true,
            Activity::Trying(trial) => !matches!(
                trial.stage,
                Stage::Braking { .. } | Stage::BrakingAgain { .. } | Stage::Moving { .. }
            ),
            _ => false,
        };
        if !runs || self.throttle.step == SpeedStep::STAND {
            return;
        }
        let since = self.tracker.last_time().map_or(self.commanded_at, |last| last.max(self.commanded_at));
        let due = self.locator.next_sensor(self.context(), self.model(), now);
        let due_by = match due {
            Some(due) => {
                let margin = TimeSpan::from_s(2.0 * due.uncertainty.as_s()).min(MAX_UNCERTAINTY);
                let part = TimeSpan::from_s(LATE_PART * (due.time - since).as_s().max(0.0));
                due.time + margin + part + LATE
            }
            None => {
                // Without a prediction: the time that the hop takes from rest at half the speed.
                let hop = self.tracker.last().and_then(|node| self.context().hop_from(node));
                let length = hop.map_or(super::experiment::TYPICAL_HOP, |hop| self.longest(&hop));
                let speed = self.model().steady_speed(self.throttle.step, Approach::Below);
                let slowest = (0.5 * speed).max(Speed::from_mm_per_s(20.0));
                self.steady_at.max(since) + length / slowest + LATE
            }
        };
        let pushed = self.tracker.last().and_then(|node| self.context().hop_from(node));
        let pushed = pushed.map(|hop| self.commanded_at + self.longest(&hop) / PUSHED_SPEED + LATE);
        self.due_by =
            Some(if self.pushes > 0 { pushed.unwrap_or(due_by).min(due_by) } else { due_by }.max(now));
    }

    /// An upper bound of a hop's length (95 %).
    fn longest(&self, hop: &Hop<'_>) -> Length {
        if self.sections.is_measured(hop.id) {
            return hop.length;
        }
        let [length, uncertainty] = self.model().length(&self.sections, hop);
        length + 2.0 * uncertainty
    }

    /// No detection came by the time it was due at the latest.
    pub(super) fn miss_detection(&mut self, now: Timestamp) {
        self.due_by = None;
        let step = self.throttle.step;
        if self.pushes >= MAX_PUSHES || step >= self.model().highest() {
            self.lose(now);
            return;
        }
        self.pushed_from = self.pushed_from.or(Some(step));
        self.pushes += 1;
        // The experiment is lost: the planner continues after the next detection.
        self.activity = Activity::Joining;
        self.issue(now, self.model().next_knot(step));
    }

    /// The train is lost: it is commanded to stop, and searched for after a while.
    pub(super) fn lose(&mut self, now: Timestamp) {
        self.report_fault(Fault::Lost { last: self.tracker.last() });
        self.fit.interrupt();
        self.locator.lose();
        self.tracker.lose();
        self.pushes = 0;
        self.pushed_from = None;
        self.hold_line(None);
        self.issue(now, SpeedStep::STAND);
        self.activity = Activity::Waiting { until: now + WAIT_FOR_LOST };
        self.report_progress(now);
    }

    /// A detection after the train was pushed up: of the sensor that was due, it shows that the train had stalled; of
    /// a later one, that the detection was missed.
    pub(super) fn note_pushes(&mut self, passed: &PassedSensor) {
        let Some(step) = self.pushed_from.take() else { return };
        self.pushes = 0;
        if passed.missed == 0 {
            if self.may_be_slow(step) {
                self.fit.note_use(step, StepUse::Unreliable);
            }
            self.fit.interrupt();
            self.report_fault(Fault::Stalled { step });
        }
    }

    /// Whether a step may be so slow that the train stalls for it: within one standard deviation.
    fn may_be_slow(&self, step: SpeedStep) -> bool {
        let speed = self.model().speed(step, Approach::Below);
        speed.value - speed.uncertainty < SLOW_STEP
    }

    /// A step moves the train if the train passed a sensor once it was steady at that step.
    pub(super) fn note_that_it_moves(&mut self, now: Timestamp) {
        let step = self.throttle.step;
        let is_steady = now >= self.steady_at && step > SpeedStep::STAND;
        if is_steady && self.model().uses(step) == StepUse::Untried {
            self.fit.note_use(step, StepUse::Moves);
        }
    }

    /// The train passed a sensor: compares its mean speed since the last one, if it was steady, with that of earlier sessions.
    pub(super) fn compare_speed(&mut self, now: Timestamp, missed: usize, at: Timestamp) {
        let is_steady = now >= self.steady_at && self.requested.is_none();
        let here = self.tracker.last().filter(|_| is_steady).map(|node| (node, at, self.throttle.step));
        let Some((from, since, known)) = self.identity.advance(here) else { return };
        let hop = here.and_then(|(to, ..)| self.only_hop(from, to)).filter(|_| missed == 0 && at > since);
        let Some(hop) = hop else { return };
        let speed = self.model().length(&self.sections, &hop)[0] / (at - since);
        if let Some(ratio) = self.identity.compare(speed / known) {
            self.report_fault(Fault::OtherSpeeds { ratio });
        }
    }

    /// A turnout is not in its commanded position.
    pub(super) fn took_other_leg(&mut self, turnout: TurnoutId, leg: Leg) {
        self.turnouts.set(turnout, leg);
        self.requested_turnouts.remove(&turnout);
        let failures = self.failures.entry(turnout).or_default();
        *failures = failures.saturating_add(1);
        self.report_fault(Fault::WrongLeg { turnout, wanted: Leg::from_curved(!leg.is_curved()) });
    }

    /// Fits again and compares the layout's lengths with path lengths. Lengths that contradict each other count for
    /// less, and a notice names them whenever there are more than before.
    pub(super) fn refit(&mut self) {
        self.fit.refit(&self.surveyed);
        let test = SurveyTest::of(&self.surveyed, self.model().sections());
        if test != self.survey_test {
            self.sections = test.applied_to(&self.surveyed);
            self.fit.widen_by_lengths(test.clone());
            self.survey_test = test;
            self.fit.refit(&self.surveyed);
        }
        let hops: Vec<(HopId, Length, Length)> =
            self.survey_test.odd.iter().filter_map(|odd| self.odd_hop(odd)).collect();
        if hops.len() >= FEWEST_ODD && hops.len() > self.odd_lengths {
            self.odd_lengths = hops.len();
            self.report_fault(Fault::LengthsDiffer { hops });
        }
    }

    /// A hop over a section whose length contradicts the layout, the layout's length, and the path length.
    fn odd_hop(&self, odd: &OddSection) -> Option<(HopId, Length, Length)> {
        let mut hops = self.layout.hops().filter(|hop| self.sections.section(hop.id) == Some(odd.section));
        Some((hops.next()?.id, Length::from_m(odd.surveyed), Length::from_m(odd.path_length)))
    }

    /// Ends the calibration: the train stops.
    pub(super) fn end(&mut self, now: Timestamp, ending: Ending) {
        if self.finished.is_some() || matches!(self.activity, Activity::Ending { .. }) {
            return;
        }
        self.hold_line(None);
        self.issue(now, SpeedStep::STAND);
        let is_at_rest = now + self.stops_within();
        self.ending = Some(ending);
        self.due_by = None;
        self.activity = Activity::Ending { until: is_at_rest };
        self.report_progress(now);
    }

    /// The train is at rest: the last fit, and the result.
    pub(super) fn finish(&mut self) {
        self.refit();
        let ending = self.ending.take().unwrap_or(Ending::Told);
        self.activity = Activity::Finished;
        self.finished = Some(ending.clone());
        let accuracy = self.accuracy();
        self.notify(CalibrationNotice::Finished { ending, accuracy });
    }
}
