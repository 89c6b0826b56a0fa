//! Composes the picture of the current state, the histories and the detections from the state of a driver.

use std::collections::BTreeMap;
use std::sync::Arc;

use footplate_core::control::learn::CalibrationNotice;
use footplate_core::control::{Dispatcher, Driver};
use footplate_core::model::MotionModel;
use footplate_core::track::Layout;
use footplate_core::tracking::DriftTest;
use footplate_core::tracking::{DueSensor, PassedSensor, PathPoint};
use footplate_core::{FunctionNumber, HALF_95, Length, SensorId, TimeSpan, Timestamp, TrainId};
use footplate_wire::ReportedFunctions;
use serde::Serialize;

use super::alarm::{Alarm, Grade};
use super::alarm_list::{ActiveAlarm, AlarmList};
use super::board::Board;
use super::calibration_picture::CalibrationPicture;
use super::crossing_picture::held_at_crossings;
use super::history::Sample;
use super::picture::{
    Picture, SessionState, TrainTask, block_states, ignored_sensors, millis, paint_train, tenths,
};
use super::spans::reserved_spans;
use super::travelled_distance::TravelledDistance;

/// How long a detection is highlighted (s).
const FLASH_S: f64 = 1.5;
/// The sampling interval of the histories: 10 Hz.
const SAMPLE_INTERVAL: TimeSpan = TimeSpan::from_ms(100);
/// How often changed motion models are published.
const MODEL_INTERVAL: TimeSpan = TimeSpan::from_ms(1_000);

/// A detection of a train.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TrainPassed {
    pub(crate) train: TrainId,
    /// The detection, beside its prediction.
    pub(crate) passed: PassedSensor,
    /// The detection that is due next.
    pub(crate) next: Option<DueSensor>,
}

/// Publishes the state of a driver on a board.
#[derive(Debug)]
pub(crate) struct Painter {
    board: Arc<Board>,
    /// The last detection of each sensor.
    flashes: BTreeMap<SensorId, Timestamp>,
    /// Detections that are not published yet.
    unpublished: Vec<TrainPassed>,
    distances: BTreeMap<TrainId, TravelledDistance>,
    /// What the station has reported of each train's functions.
    functions: BTreeMap<TrainId, ReportedFunctions>,
    samples: Vec<(TrainId, Sample)>,
    sampled: Option<Timestamp>,
    drifts: BTreeMap<TrainId, DriftTest>,
    alarms: AlarmList,
    /// Whether the blocks are occupied whose state is known, by their detectors.
    blocks: BTreeMap<SensorId, bool>,
    /// When the session began, by the clock of the link.
    began: Option<Timestamp>,
    models: BTreeMap<TrainId, MotionModel>,
    models_published: Option<Timestamp>,
    /// Whether the driver only displays trains: the commanded step is then the one that was sent to the train.
    display_only: bool,
    calibration: Option<CalibrationPicture>,
}

/// The begin or the end of an alarm, as sent to browsers.
#[derive(Debug, Serialize)]
struct TimedAlarm<'a> {
    t_s: f64,
    /// The number of the alarm in the list.
    #[serde(skip_serializing_if = "Option::is_none")]
    id: Option<u64>,
    #[serde(flatten)]
    alarm: &'a Alarm,
}

/// A detection, as sent to browsers.
#[derive(Debug, Serialize)]
struct PassedPicture<'l> {
    train: u16,
    contact: &'l str,
    /// The middle and the width of the time window of the detection.
    t_s: f64,
    window_ms: f64,
    /// Delay against the prediction, and half its 95 % interval.
    late_ms: Option<f64>,
    late_half_ms: Option<f64>,
    /// How far before the sensor the train was predicted to be at the detection.
    short_mm: Option<f64>,
    missed: usize,
    /// Distance travelled so far.
    #[serde(rename = "way_mm")]
    distance_mm: f64,
    /// The drift statistic relative to its alarm threshold, 0 to 1.
    drift: f64,
    /// The mean speed since the sensor before, from the surveyed length alone: (time, mm/s).
    mean: Option<[f64; 2]>,
    next: Option<DuePicture<'l>>,
}

/// The detection that is due next.
#[derive(Debug, Serialize)]
struct DuePicture<'l> {
    contact: &'l str,
    t_s: f64,
    half_ms: f64,
}

/// The numbers of the functions in a set.
fn numbers(functions: u32) -> Vec<u8> {
    FunctionNumber::all().filter(|function| function.is_in(functions)).map(FunctionNumber::get).collect()
}

impl Painter {
    pub(crate) fn new(board: &Arc<Board>) -> Self {
        Self {
            board: Arc::clone(board),
            flashes: BTreeMap::new(),
            unpublished: Vec::new(),
            distances: BTreeMap::new(),
            functions: BTreeMap::new(),
            samples: Vec::new(),
            sampled: None,
            drifts: BTreeMap::new(),
            alarms: AlarmList::default(),
            blocks: BTreeMap::new(),
            began: None,
            models: BTreeMap::new(),
            models_published: None,
            display_only: false,
            calibration: None,
        }
    }

    /// A painter for trains that another machine drives.
    pub(crate) fn following(board: &Arc<Board>) -> Self {
        Self { display_only: true, ..Self::new(board) }
    }

    /// Takes in a notice of a calibration; `said` is the line that was printed for it.
    pub(crate) fn handle_calibration(
        &mut self,
        layout: &Layout,
        now: Timestamp,
        train: TrainId,
        notice: &CalibrationNotice,
        said: &str,
    ) {
        if let CalibrationNotice::Mishap(fault) = notice {
            self.alarm(now, &Alarm::of_fault(layout, train, fault).said(said));
        }
        self.calibration.get_or_insert_default().hear(notice);
    }

    /// Takes in what the station has reported of a train's functions.
    pub(crate) fn hear_of_functions(&mut self, train: TrainId, reported: ReportedFunctions) {
        self.functions.insert(train, reported);
    }

    /// Ends the display of a calibration.
    pub(super) fn end_calibration(&mut self) {
        self.calibration = None;
    }

    /// Takes in a detection.
    pub(crate) fn passed(&mut self, passed: TrainPassed) {
        self.flashes.insert(passed.passed.sensor, passed.passed.window.middle());
        self.alarms.detect(passed.train, passed.passed.sensor, passed.passed.window.middle());
        self.unpublished.push(passed);
    }

    /// Takes in whether blocks are occupied, by their detectors.
    pub(crate) fn see_blocks(&mut self, states: impl Iterator<Item = (SensorId, bool)>) {
        self.blocks.extend(states);
    }

    /// Raises an alarm, or resolves those that a message of the kind `over` is about.
    pub(crate) fn alarm(&mut self, now: Timestamp, alarm: &Alarm) {
        let t_s = self.seconds(now);
        if alarm.grade == Grade::Over {
            // The end of an alarm is published only if the alarm was.
            if self.alarms.resolve(alarm) > 0 {
                self.board.publish("alarm", &TimedAlarm { t_s, id: None, alarm });
            }
            return;
        }
        let id = Some(self.alarms.raise(now, t_s, alarm));
        self.board.publish("alarm", &TimedAlarm { t_s, id, alarm });
    }

    /// Ends an alarm for the operator; returns whether it was active.
    pub(crate) fn end_alarm(&mut self, now: Timestamp, id: u64) -> bool {
        let ended = self.alarms.end(id);
        self.publish_over(now, ended.iter().cloned());
        ended.is_some()
    }

    /// The active alarms in one line for the prompt; `None` without alarms.
    pub(crate) fn alarm_summary(&self) -> Option<String> {
        self.alarms.summary()
    }

    fn publish_over(&self, now: Timestamp, ended: impl IntoIterator<Item = ActiveAlarm>) {
        let t_s = self.seconds(now);
        for ActiveAlarm { id, alarm, .. } in ended {
            self.board.publish("alarm", &TimedAlarm { t_s, id: Some(id), alarm: &alarm.over() });
        }
    }

    /// Seconds since the session began.
    fn seconds(&self, at: Timestamp) -> f64 {
        millis((at - self.began.unwrap_or(at)).as_s())
    }

    /// Publishes the state at `now`, which must not precede the last detection.
    pub(crate) fn paint(
        &mut self,
        dispatcher: &Dispatcher,
        session: SessionState,
        now: Timestamp,
        began: Timestamp,
    ) {
        self.paint_driven(dispatcher.driver(), Some(dispatcher), session, now, began);
    }

    /// Publishes trains without a dispatcher, which have no reservations.
    pub(crate) fn paint_undispatched(
        &mut self,
        driver: &Driver,
        tasks: BTreeMap<TrainId, TrainTask>,
        now: Timestamp,
        began: Timestamp,
    ) {
        let session = SessionState { tasks, ..SessionState::default() };
        self.paint_driven(driver, None, session, now, began);
    }

    fn paint_driven(
        &mut self,
        driver: &Driver,
        dispatcher: Option<&Dispatcher>,
        session: SessionState,
        now: Timestamp,
        began: Timestamp,
    ) {
        self.began = Some(began);
        for passed in std::mem::take(&mut self.unpublished) {
            self.publish_detection(driver, &passed, began);
        }
        let is_in_danger = |train| dispatcher.is_some_and(|dispatcher| dispatcher.is_in_danger(train));
        let resolved = self.alarms.settle(now, driver, is_in_danger);
        self.publish_over(now, resolved);
        let reserved = |train| {
            dispatcher
                .and_then(|dispatcher| dispatcher.reservation(train))
                .map_or_else(Vec::new, reserved_spans)
        };
        let is_due = |last: Option<Timestamp>, between| last.is_none_or(|last| now - last >= between);
        let is_sampled = is_due(self.sampled, SAMPLE_INTERVAL);
        let mut trains = Vec::new();
        for train in driver.trains() {
            let located = driver.locate(train, now);
            let travelled = located.map(|located| self.travelled(driver, train, located.at));
            let commanded =
                located.filter(|_| self.display_only).map_or_else(|| driver.commanded(train), |at| at.step);
            let task = session.tasks.get(&train);
            let mut picture = paint_train(driver, train, task, now, commanded, travelled, reserved(train));
            let reported = self.functions.get(&train).copied().unwrap_or_default();
            let switched = session.functions.get(&train).copied().unwrap_or_default();
            picture.functions = numbers(switched & !reported.known | reported.on);
            picture.functions_reported = numbers(reported.known);
            trains.push(picture);
            if is_sampled {
                let sample = Sample::of((now - began).as_s(), commanded, located.as_ref(), travelled);
                self.samples.push((train, sample));
            }
        }
        if is_sampled {
            self.sampled = Some(now);
            self.board.remember(&mut self.samples);
        }
        if is_due(self.models_published, MODEL_INTERVAL) {
            self.models_published = Some(now);
            self.publish_models(driver);
        }
        let seconds_since = |at: Timestamp| (now - at).as_s();
        self.flashes.retain(|_, at| seconds_since(*at) < FLASH_S);
        self.board.show(&Picture {
            t_s: millis((now - began).as_s()),
            written_until_s: self.board.written_until(now).map(|at| millis((at - began).as_s())),
            trains,
            turnouts: driver
                .layout()
                .turnouts()
                .map(|(turnout, _)| {
                    let leg = driver.turnouts().get(turnout);
                    (turnout.0, leg.map(|leg| if leg.is_curved() { "curved" } else { "straight" }))
                })
                .collect(),
            blocks: block_states(driver, &self.blocks),
            ignored: ignored_sensors(driver),
            calibration: self.calibration.clone(),
            alarms: self.alarms.ranked(),
            crossings_held: dispatcher.map_or_else(Vec::new, |of| held_at_crossings(of, now)),
            schedules: session.schedules,
            passed: self.flashes.iter().map(|(sensor, at)| (sensor.0, millis(seconds_since(*at)))).collect(),
        });
    }

    /// The distance that a train has travelled.
    fn travelled(&mut self, driver: &Driver, train: TrainId, at: PathPoint) -> Length {
        let travelled = self.distances.entry(train).or_insert_with(|| TravelledDistance::from(at));
        travelled.advance_to(driver.layout(), at)
    }

    fn publish_detection(&mut self, driver: &Driver, passed: &TrainPassed, began: Timestamp) {
        let TrainPassed { train, passed, next } = passed;
        let layout = driver.layout();
        let time = passed.window.middle();
        let since = |time: Timestamp| millis((time - began).as_s());
        let Some(node) = layout.sensor_node(passed.sensor) else { return };
        let at = PathPoint { node, distance: Length::ZERO };
        let travelled = self.distances.entry(*train).or_insert_with(|| TravelledDistance::from(at));
        let mean = travelled.pass_sensor(layout, node, time);
        let at_sensor = travelled.at_sensor();
        let drift = self.drifts.entry(*train).or_default();
        let alarm = passed.late.and_then(|[late, uncertainty]| drift.take(late.as_s() / uncertainty.as_s()));
        let level = drift.level();
        if let Some(drift) = alarm {
            self.alarm(time, &Alarm::drifts(*train, drift));
        }
        self.board.publish(
            "passed",
            &PassedPicture {
                train: train.0,
                contact: layout.sensor_name(passed.sensor),
                t_s: since(time),
                window_ms: tenths(passed.window.width().as_ms()),
                late_ms: passed.late.map(|[late, _]| tenths(late.as_ms())),
                late_half_ms: passed.late.map(|[_, uncertainty]| tenths(HALF_95 * uncertainty.as_ms())),
                short_mm: passed.short.map(|short| tenths(short.as_mm())),
                missed: passed.missed,
                drift: millis(level),
                distance_mm: tenths(at_sensor.as_mm()),
                mean: mean.map(|(at, speed)| [since(at), tenths(speed.as_mm_per_s())]),
                next: next.map(|next| DuePicture {
                    contact: layout.sensor_name(next.sensor),
                    t_s: since(next.time),
                    half_ms: tenths(HALF_95 * next.uncertainty.as_ms()),
                }),
            },
        );
    }

    fn publish_models(&mut self, driver: &Driver) {
        for model in driver.trains().filter_map(|train| driver.model(train)) {
            if self.models.get(&model.train()) != Some(model) {
                self.models.insert(model.train(), model.clone());
                self.board.know(model);
            }
        }
    }
}
