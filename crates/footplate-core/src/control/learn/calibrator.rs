//! The calibrator: events in, commands and notices out.

use alloc::collections::{BTreeMap, VecDeque};
use alloc::vec::Vec;

use super::accuracy::{StepAccuracy, steps, usable_steps};
use super::activity::Activity;
use super::circuits::Passes;
use super::identity::Identity;
use super::notice::{CalibrationNotice, Ending, Fault, Progress};
use super::planner::{KNOWN_FROM, Planner, Throttle};
use super::settings::CalibratorSettings;
use super::tracker::{ReportClass, Tracker};
use crate::control::{Machine, Output};
use crate::event::{Approach, Command, Event, EventKind, Report};
use crate::ids::{NodeId, SensorId, SpeedStep, TrainId, TurnoutId};
use crate::link::{DetectionWindow, PollTiming};
use crate::model::MotionFit;
use crate::model::survey::{SectionIndex, SurveyTest};
use crate::model::{MotionModel, StepUse};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Circuit, Layout, Leg, TurnoutStates};
use crate::tracking::{Locator, TrackContext};

/// A command that has not been sent after this time is requested again.
const COMMAND_PATIENCE: TimeSpan = TimeSpan::from_ms(3_000);

/// Calibrates one train on one layout.
#[derive(Debug, Clone)]
pub struct Calibrator<'l> {
    pub(super) layout: &'l Layout,
    /// The lengths of the layout as surveyed, ...
    pub(super) surveyed: SectionIndex,
    /// ... and with uncertainties corrected by the path lengths of the train.
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
    /// The command sent last, when it was sent, and when the speed is steady at it.
    pub(super) throttle: Throttle,
    pub(super) commanded_at: Timestamp,
    pub(super) steady_at: Timestamp,
    /// A step that was requested and has not been sent yet.
    pub(super) requested: Option<(SpeedStep, Timestamp)>,
    /// Turnouts that were requested recently.
    pub(super) requested_turnouts: BTreeMap<TurnoutId, (Leg, Timestamp)>,
    /// How often a turnout was found in another position than commanded.
    pub(super) failures: BTreeMap<TurnoutId, u8>,
    /// The train has stalled if no sensor reports it by then.
    pub(super) due_by: Option<Timestamp>,
    /// How often its step was raised since the last detection, and from which step.
    pub(super) pushes: u8,
    pub(super) pushed_from: Option<SpeedStep>,
    /// How often it reversed without a detection.
    pub(super) reversals: u8,
    /// Since when it runs to a circuit whose turnouts are not set.
    pub(super) joins_since: Option<Timestamp>,
    /// The speeds of earlier sessions, and those of this one beside them.
    pub(super) identity: Identity,
    pub(super) started: Option<Timestamp>,
    pub(super) finished: Option<Ending>,
    pub(super) ending: Option<Ending>,
    /// Number of hops that were reported to have other lengths than surveyed.
    pub(super) odd_lengths: usize,
    watched: Option<SensorId>,
    outputs: VecDeque<Output<CalibrationNotice>>,
}

impl<'l> Calibrator<'l> {
    /// A calibration of the train of a fit, which may be empty or from an earlier session. It begins with the first
    /// `handle_…`.
    pub fn new(layout: &'l Layout, settings: CalibratorSettings, mut fit: MotionFit) -> Self {
        let train = fit.model().train();
        note_moving_steps(&mut fit);
        let identity = Identity::of(fit.model());
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
            activity: Activity::NotStarted,
            throttle: Throttle::AT_REST,
            commanded_at: Timestamp::ZERO,
            steady_at: Timestamp::ZERO,
            requested: None,
            requested_turnouts: BTreeMap::new(),
            failures: BTreeMap::new(),
            due_by: None,
            pushes: 0,
            pushed_from: None,
            reversals: 0,
            joins_since: None,
            identity,
            started: None,
            finished: None,
            ending: None,
            odd_lengths: 0,
            watched: None,
            outputs: VecDeque::new(),
        }
    }

    /// Sets the turnout positions that are known from before.
    pub fn set_turnouts(&mut self, turnouts: TurnoutStates) {
        self.turnouts = turnouts;
    }

    /// The known turnout positions.
    pub const fn turnouts(&self) -> &TurnoutStates {
        &self.turnouts
    }

    /// The fit of the train's motion.
    pub const fn fit(&self) -> &MotionFit {
        &self.fit
    }

    /// Returns the fit of the train's motion.
    #[must_use]
    pub fn into_fit(self) -> MotionFit {
        self.fit
    }

    /// The sections of the layout as surveyed.
    pub const fn surveyed(&self) -> &SectionIndex {
        &self.surveyed
    }

    /// The position of the train.
    pub const fn locator(&self) -> &Locator {
        &self.locator
    }

    /// Why the calibration ended; `None` until the train is at rest.
    pub const fn ending(&self) -> Option<&Ending> {
        self.finished.as_ref()
    }

    /// The progress of the calibration.
    pub fn progress(&self, now: Timestamp) -> Progress {
        let elapsed = self.started.map_or(TimeSpan::ZERO, |started| now - started);
        let left = (self.settings.budget - elapsed).max(TimeSpan::ZERO);
        Progress { phase: self.activity.phase(), elapsed, left, accuracy: self.accuracy() }
    }

    /// The accuracy of the steps that move the train, lowest first.
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

    pub(super) fn notify(&mut self, notice: CalibrationNotice) {
        self.outputs.push_back(Output::Notice(notice));
    }

    pub(super) fn report_fault(&mut self, fault: Fault) {
        self.notify(CalibrationNotice::Mishap(fault));
    }

    /// Requests a step, unless it was commanded already.
    pub(super) fn issue(&mut self, now: Timestamp, step: SpeedStep) {
        if self.requested.is_none() && self.throttle.step == step && self.commanded_at > Timestamp::ZERO {
            return;
        }
        self.requested = Some((step, now));
        self.outputs.push_back(Output::Command(Command::Speed { train: self.train, step }));
    }

    pub(super) fn command(&mut self, command: Command) {
        self.outputs.push_back(Output::Command(command));
    }

    pub(super) fn hold_line(&mut self, until: Option<Timestamp>) {
        self.outputs.push_back(Output::HoldLine(until));
    }

    /// Asks the line to watch the next sensor, if that has changed.
    pub(super) fn watch_next(&mut self) {
        let next =
            self.tracker.last().and_then(|node| self.context().hop_from(node)).and_then(|hop| hop.sensor);
        let next = next.filter(|_| self.throttle.step > SpeedStep::STAND);
        if next != self.watched {
            self.watched = next;
            self.outputs.push_back(Output::Watch(next));
        }
    }

    /// A speed command to this train was sent.
    fn handle_speed_sent(&mut self, now: Timestamp, event: &Event, step: SpeedStep) {
        let context =
            TrackContext { layout: self.layout, sections: &self.sections, turnouts: &self.turnouts };
        self.fit.take(self.layout, &self.turnouts, event);
        self.locator.handle_command(context, self.fit.model(), event);
        let before = self.throttle.step;
        self.commanded_at = event.time;
        self.steady_at = event.time + self.model().settles_within(before, step);
        self.throttle = match step.cmp(&before) {
            core::cmp::Ordering::Equal => self.throttle,
            _ if step == SpeedStep::STAND => Throttle::AT_REST,
            core::cmp::Ordering::Greater => Throttle { step, approach: Approach::Below },
            core::cmp::Ordering::Less => Throttle { step, approach: Approach::Above },
        };
        if self.requested.is_some_and(|(requested, _)| requested == step) {
            self.requested = None;
        }
        self.expect_detection(now);
        self.watch_next();
        self.on_speed_sent(now);
    }

    fn handle_report(&mut self, now: Timestamp, event: &Event, report: Report) {
        let interval = report.poll_interval.unwrap_or(PollTiming::ASSUMED.period).abs();
        let window = DetectionWindow { after: event.time - interval, until: event.time };
        let context =
            TrackContext { layout: self.layout, sections: &self.sections, turnouts: &self.turnouts };
        let Some(sensor) = self.tracker.passed(context, report.sensor) else {
            return self.found_without_direction(now);
        };
        let report = Report { sensor, ..report };
        let event = &Event { kind: EventKind::Sensor(report), ..*event };
        let model = self.fit.model();
        let before = self.tracker.last();
        match self.tracker.classify(context, &self.locator, model, report.sensor, window) {
            ReportClass::Again => {}
            ReportClass::First(_) => self.accept(now, event, report.sensor, window),
            ReportClass::Passed(node) => {
                self.learn_legs(before, node);
                self.accept(now, event, report.sensor, window);
            }
            ReportClass::ByOtherLeg { turnout, leg, .. } => {
                self.took_other_leg(turnout, leg);
                self.accept(now, event, report.sensor, window);
            }
            ReportClass::Moved { from, to } => {
                self.report_fault(Fault::Moved { from, to });
                self.fit.interrupt();
                self.locator.lose();
                if self.throttle.step == SpeedStep::STAND {
                    self.lose(now);
                } else {
                    // The experiment is lost: continue from the new position.
                    self.hold_line(None);
                    self.activity = Activity::Joining;
                    self.circuit = None;
                    self.accept(now, event, report.sensor, window);
                }
            }
            ReportClass::Unexplained => self.report_fault(Fault::Unexplained { sensor: report.sensor }),
            ReportClass::WrongLayout { seen, expected } => {
                self.fit.interrupt();
                self.end(now, Ending::WrongLayout { seen, expected });
            }
        }
    }

    /// A block is free that the train has left: its length shows if its speed was steady since.
    fn handle_release(&mut self, event: &Event, report: Report) {
        let interval = report.poll_interval.unwrap_or(PollTiming::ASSUMED.period).abs();
        let window = DetectionWindow { after: event.time - interval, until: event.time };
        let release = self.locator.release_of(self.context(), self.model(), report.sensor, window);
        let left = window.after - self.model().train_length().longest_delay();
        if let Some(release) = release.filter(|_| left >= self.steady_at) {
            self.fit.take_release(&release);
        }
    }

    /// Sets the positions of turnouts that the train passed and that were unknown.
    fn learn_legs(&mut self, from: Option<NodeId>, to: NodeId) {
        let hop = from.and_then(|from| self.only_hop(from, to));
        for need in hop.iter().flat_map(|hop| hop.needs).filter(|need| need.facing) {
            self.turnouts.set(need.turnout, need.leg);
        }
    }

    /// The train passed a sensor.
    fn accept(&mut self, now: Timestamp, event: &Event, sensor: SensorId, window: DetectionWindow) {
        let context =
            TrackContext { layout: self.layout, sections: &self.sections, turnouts: &self.turnouts };
        let passed = self.locator.pass(context, self.fit.model(), sensor, window);
        self.note_pushes(&passed);
        self.compare_speed(now, passed.missed, window.until);
        self.fit.take(self.layout, &self.turnouts, event);
        self.note_that_it_moves(now);
        if passed.missed > 0 {
            self.report_fault(Fault::Missed { count: passed.missed, before: sensor });
        }
        self.expect_detection(now);
        self.watch_next();
        if let Some(node) = self.tracker.last() {
            self.count_passage(node);
            self.on_passage(now, node);
        }
    }
}

/// Steps with detections in earlier sessions move the train.
fn note_moving_steps(fit: &mut MotionFit) {
    let moved: Vec<SpeedStep> = steps(fit.model())
        .filter(|step| fit.model().uses(*step) == StepUse::Untried)
        .filter(|step| {
            let detections = |approach| fit.model().speed(*step, approach).count;
            detections(Approach::Below) + detections(Approach::Above) >= KNOWN_FROM
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
            EventKind::Speed { train, step } if train == self.train => {
                self.handle_speed_sent(now, event, step);
            }
            EventKind::Reverse { train } if train == self.train => self.handle_reversed(now, event),
            EventKind::Turnout { turnout, curved } => {
                self.turnouts.set(turnout, Leg::from_curved(curved));
                self.requested_turnouts.remove(&turnout);
                self.expect_detection(now);
            }
            EventKind::Sensor(report) if self.finished.is_none() => self.handle_report(now, event, report),
            EventKind::Freed(report) => self.handle_release(event, report),
            _ => {}
        }
        self.on_clock(now);
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.begin(now);
        self.on_clock(now);
        if let Some((step, since)) = self.requested
            && now - since >= COMMAND_PATIENCE
        {
            self.requested = Some((step, now));
            self.command(Command::Speed { train: self.train, step });
        }
    }

    fn poll_output(&mut self) -> Option<Output<CalibrationNotice>> {
        self.outputs.pop_front()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        let patience = self.requested.map(|(_, since)| since + COMMAND_PATIENCE);
        [self.due_activity(), patience].into_iter().flatten().min()
    }
}
