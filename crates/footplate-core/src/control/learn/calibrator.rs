//! The machine: entries in, commands and notices out.

use alloc::collections::{BTreeMap, VecDeque};
use alloc::vec::Vec;

use super::accuracy::{StepAccuracy, usable_steps};
use super::activity::Activity;
use super::notice::{CalibrationNotice, Ending, Mishap, Progress};
use super::planner::{KNOWN_FROM, Planner, Stance};
use super::settings::CalibratorSettings;
use super::surveying::Passes;
use super::tracker::{Tracker, Verdict};
use crate::control::{Machine, Output};
use crate::event::{Approach, Command, Event, EventKind, Report};
use crate::ids::{NodeId, SensorId, SpeedStep, TrainId, TurnoutId};
use crate::link::{ContactWindow, PollTiming};
use crate::model::MotionFit;
use crate::model::survey::{SectionIndex, SurveyTest};
use crate::model::{MotionModel, StepUse};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Circuit, Layout, Leg, TurnoutStates};
use crate::tracking::{Locator, TrackContext};

/// A command that was asked for and has not left after this is asked for again.
const COMMAND_PATIENCE: TimeSpan = TimeSpan::from_ms(3_000);

/// Calibrates one train on one layout.
#[derive(Debug, Clone)]
pub struct Calibrator<'l> {
    pub(super) layout: &'l Layout,
    /// The layout's lengths as it says them, ...
    pub(super) surveyed: SectionIndex,
    /// ... and as far as they are believed after what the train made of them.
    pub(super) sections: SectionIndex,
    pub(super) survey_test: SurveyTest,
    pub(super) passes: Passes,
    pub(super) settings: CalibratorSettings,
    pub(super) train: TrainId,
    pub(super) fit: MotionFit,
    pub(super) locator: Locator,
    pub(super) turnouts: TurnoutStates,
    pub(super) tracker: Tracker,
    pub(super) planner: Planner,
    pub(super) circuit: Option<Circuit>,
    pub(super) activity: Activity,
    /// What the train was commanded last, since when, and when it is steady at it.
    pub(super) stance: Stance,
    pub(super) commanded_at: Timestamp,
    pub(super) steady_at: Timestamp,
    /// A step that was asked for and has not left yet.
    pub(super) asked: Option<(SpeedStep, Timestamp)>,
    /// Turnouts that were asked for lately.
    pub(super) asked_turnouts: BTreeMap<TurnoutId, (Leg, Timestamp)>,
    /// How often a turnout was found on the other leg than it was told.
    pub(super) failures: BTreeMap<TurnoutId, u8>,
    /// The train has stalled if no contact comes by then.
    pub(super) due_by: Option<Timestamp>,
    /// How often it was pushed up since the last contact, and from which step.
    pub(super) pushes: u8,
    pub(super) pushed_from: Option<SpeedStep>,
    /// How often it was turned around without a contact.
    pub(super) turns: u8,
    pub(super) started: Option<Timestamp>,
    pub(super) finished: Option<Ending>,
    pub(super) ending: Option<Ending>,
    /// Hops of which it was said that their lengths differ.
    pub(super) odd_lengths: usize,
    watched: Option<SensorId>,
    outputs: VecDeque<Output<CalibrationNotice>>,
}

impl<'l> Calibrator<'l> {
    /// A calibration of the train that a fit is about: from nothing, or on from what it knows already. It begins with
    /// the first `handle_…`.
    #[must_use]
    pub fn new(layout: &'l Layout, settings: CalibratorSettings, mut fit: MotionFit) -> Self {
        let train = fit.model().train();
        note_what_moved(&mut fit);
        Self {
            layout,
            surveyed: SectionIndex::of(layout),
            sections: SectionIndex::of(layout),
            survey_test: SurveyTest::default(),
            passes: Passes::default(),
            settings,
            train,
            fit,
            locator: Locator::new(train),
            turnouts: TurnoutStates::unknown(),
            tracker: Tracker::default(),
            planner: Planner::default(),
            circuit: None,
            activity: Activity::Asleep,
            stance: Stance::STANDS,
            commanded_at: Timestamp::ZERO,
            steady_at: Timestamp::ZERO,
            asked: None,
            asked_turnouts: BTreeMap::new(),
            failures: BTreeMap::new(),
            due_by: None,
            pushes: 0,
            pushed_from: None,
            turns: 0,
            started: None,
            finished: None,
            ending: None,
            odd_lengths: 0,
            watched: None,
            outputs: VecDeque::new(),
        }
    }

    /// Tells how the turnouts lie where that is known from before.
    pub fn set_turnouts(&mut self, turnouts: TurnoutStates) {
        self.turnouts = turnouts;
    }

    /// How the turnouts lie as far as is known.
    #[must_use]
    pub const fn turnouts(&self) -> &TurnoutStates {
        &self.turnouts
    }

    /// What is known of the train.
    #[must_use]
    pub const fn fit(&self) -> &MotionFit {
        &self.fit
    }

    /// Gives back what is known of the train.
    #[must_use]
    pub fn into_fit(self) -> MotionFit {
        self.fit
    }

    /// The sections of the layout, with what their lengths are worth after what the train made of them.
    #[must_use]
    pub const fn sections(&self) -> &SectionIndex {
        &self.sections
    }

    /// How the lengths of the layout compare with those that the train ran over.
    #[must_use]
    pub const fn survey_test(&self) -> &SurveyTest {
        &self.survey_test
    }

    /// Where the train is, for whoever drives it next.
    #[must_use]
    pub const fn locator(&self) -> &Locator {
        &self.locator
    }

    /// Why it ended, once the train stands.
    #[must_use]
    pub const fn ending(&self) -> Option<&Ending> {
        self.finished.as_ref()
    }

    /// How far it is.
    #[must_use]
    pub fn progress(&self, now: Timestamp) -> Progress {
        let elapsed = self.started.map_or(TimeSpan::ZERO, |started| now - started);
        let left = (self.settings.budget - elapsed).max(TimeSpan::ZERO);
        Progress { phase: self.activity.phase(), elapsed, left, accuracy: self.accuracy() }
    }

    /// What is known of the steps that move the train, lowest first.
    #[must_use]
    pub fn accuracy(&self) -> Vec<StepAccuracy> {
        let usable = usable_steps(self.model());
        let highest = usable.last().copied();
        let mut lines = Vec::new();
        for step in usable {
            for approach in [Approach::Below, Approach::Above] {
                if approach == Approach::Below || Some(step) != highest {
                    lines.push(self.line(step, approach));
                }
            }
        }
        lines
    }

    pub(super) fn line(&self, step: SpeedStep, approach: Approach) -> StepAccuracy {
        StepAccuracy::of(self.model(), step, approach, self.planner.stops(step, approach))
    }

    pub(super) const fn model(&self) -> &MotionModel {
        self.fit.model()
    }

    pub(super) const fn context(&self) -> TrackContext<'_> {
        TrackContext { layout: self.layout, sections: &self.sections, turnouts: &self.turnouts }
    }

    pub(super) fn say(&mut self, notice: CalibrationNotice) {
        self.outputs.push_back(Output::Notice(notice));
    }

    pub(super) fn report_mishap(&mut self, mishap: Mishap) {
        self.say(CalibrationNotice::Mishap(mishap));
    }

    /// Tells the train a step, unless it was told so already.
    pub(super) fn issue(&mut self, now: Timestamp, step: SpeedStep) {
        if self.asked.is_none() && self.stance.step == step && self.commanded_at > Timestamp::ZERO {
            return;
        }
        self.asked = Some((step, now));
        self.outputs.push_back(Output::Command(Command::Speed { train: self.train, step }));
    }

    pub(super) fn command(&mut self, command: Command) {
        self.outputs.push_back(Output::Command(command));
    }

    pub(super) fn hold_line(&mut self, until: Option<Timestamp>) {
        self.outputs.push_back(Output::HoldLine(until));
    }

    /// Asks for the contact that comes next, if that is another one than before.
    pub(super) fn watch_next(&mut self) {
        let next =
            self.tracker.last().and_then(|node| self.context().hop_from(node)).and_then(|hop| hop.sensor);
        let next = next.filter(|_| self.stance.step > SpeedStep::STAND);
        if next != self.watched {
            self.watched = next;
            self.outputs.push_back(Output::Watch(next));
        }
    }

    /// A command to this train has left.
    fn handle_told(&mut self, now: Timestamp, event: &Event, step: SpeedStep) {
        let context =
            TrackContext { layout: self.layout, sections: &self.sections, turnouts: &self.turnouts };
        self.fit.take(self.layout, &self.turnouts, event);
        self.locator.handle_command(context, self.fit.model(), event);
        let before = self.stance.step;
        self.commanded_at = event.time;
        self.steady_at = event.time + self.model().settles_within(before, step);
        self.stance = match step.cmp(&before) {
            core::cmp::Ordering::Equal => self.stance,
            _ if step == SpeedStep::STAND => Stance::STANDS,
            core::cmp::Ordering::Greater => Stance { step, approach: Approach::Below },
            core::cmp::Ordering::Less => Stance { step, approach: Approach::Above },
        };
        if self.asked.is_some_and(|(asked, _)| asked == step) {
            self.asked = None;
        }
        self.expect_contact(now);
        self.watch_next();
        self.on_told(now);
    }

    fn handle_report(&mut self, now: Timestamp, event: &Event, report: Report) {
        let interval = report.poll_interval.unwrap_or(PollTiming::ASSUMED.period).abs();
        let window = ContactWindow { after: event.time - interval, until: event.time };
        let context =
            TrackContext { layout: self.layout, sections: &self.sections, turnouts: &self.turnouts };
        let model = self.fit.model();
        let before = self.tracker.last();
        match self.tracker.judge(context, &self.locator, model, report.sensor, window) {
            Verdict::Again => {}
            Verdict::First(_) => self.accept(now, event, report.sensor, window),
            Verdict::Passed(node) => {
                self.learn_legs(before, node);
                self.accept(now, event, report.sensor, window);
            }
            Verdict::ByOtherLeg { turnout, leg, .. } => {
                self.took_other_leg(turnout, leg);
                self.accept(now, event, report.sensor, window);
            }
            Verdict::Moved { from, to } => {
                self.report_mishap(Mishap::Moved { from, to });
                self.fit.interrupt();
                self.locator.lose();
                if self.stance.step == SpeedStep::STAND {
                    self.lose(now);
                } else {
                    // Whatever was tried is spoilt: go on from where it is now.
                    self.hold_line(None);
                    self.activity = Activity::Joining;
                    self.circuit = None;
                    self.accept(now, event, report.sensor, window);
                }
            }
            Verdict::Unexplained => self.report_mishap(Mishap::Unexplained { sensor: report.sensor }),
            Verdict::WrongLayout { seen, expected } => {
                self.fit.interrupt();
                self.end(now, Ending::WrongLayout { seen, expected });
            }
        }
    }

    /// Where the train went over a turnout of which nobody knew how it lay, it is known now.
    fn learn_legs(&mut self, from: Option<NodeId>, to: NodeId) {
        let Some(from) = from else { return };
        let mut ways = self.layout.hops_from(from).filter(|hop| hop.to == to && hop.is_open(&self.turnouts));
        let (Some(hop), None) = (ways.next(), ways.next()) else { return };
        for need in hop.needs.iter().filter(|need| need.facing) {
            self.turnouts.set(need.turnout, need.leg);
        }
    }

    /// The train passed a contact.
    fn accept(&mut self, now: Timestamp, event: &Event, sensor: SensorId, window: ContactWindow) {
        let context =
            TrackContext { layout: self.layout, sections: &self.sections, turnouts: &self.turnouts };
        let passed = self.locator.pass(context, self.fit.model(), sensor, window);
        self.note_pushes(&passed);
        self.fit.take(self.layout, &self.turnouts, event);
        self.note_that_it_moves(now);
        if passed.missed > 0 {
            self.report_mishap(Mishap::Missed { count: passed.missed, before: sensor });
        }
        self.expect_contact(now);
        self.watch_next();
        if let Some(node) = self.tracker.last() {
            self.count_passage(node);
            self.on_passage(now, node);
        }
    }
}

/// Steps at which contacts were passed in earlier sessions move the train.
fn note_what_moved(fit: &mut MotionFit) {
    let moved: Vec<SpeedStep> = fit
        .model()
        .knots()
        .filter(|step| fit.model().uses(*step) == StepUse::Untried)
        .filter(|step| {
            let contacts = |approach| fit.model().speed(*step, approach).count;
            contacts(Approach::Below) + contacts(Approach::Above) >= KNOWN_FROM
        })
        .collect();
    for step in moved {
        fit.note_use(step, StepUse::Moves);
    }
}

impl Machine for Calibrator<'_> {
    type Notice = CalibrationNotice;

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        self.begin(now);
        match event.kind {
            EventKind::Speed { train, step } if train == self.train => self.handle_told(now, event, step),
            EventKind::Reverse { train } if train == self.train => self.handle_turned(now, event),
            EventKind::Turnout { turnout, curved } => {
                self.turnouts.set(turnout, Leg::from_curved(curved));
                self.asked_turnouts.remove(&turnout);
                self.expect_contact(now);
            }
            EventKind::Sensor(report) if self.finished.is_none() => self.handle_report(now, event, report),
            _ => {}
        }
        self.on_clock(now);
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.begin(now);
        self.on_clock(now);
        if let Some((step, since)) = self.asked
            && now - since >= COMMAND_PATIENCE
        {
            self.asked = Some((step, now));
            self.command(Command::Speed { train: self.train, step });
        }
    }

    fn poll_output(&mut self) -> Option<Output<CalibrationNotice>> {
        self.outputs.pop_front()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        let patience = self.asked.map(|(_, since)| since + COMMAND_PATIENCE);
        [self.due_activity(), patience].into_iter().flatten().min()
    }
}
