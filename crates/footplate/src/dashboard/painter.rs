//! Paints what a driver knows: the picture of now, what was along the way, and the contacts that trains passed.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use footplate_core::control::learn::CalibrationNotice;
use footplate_core::control::{Dispatcher, Driver};
use footplate_core::model::MotionModel;
use footplate_core::track::Layout;
use footplate_core::tracking::DriftTest;
use footplate_core::tracking::{DueContact, PassedContact, WayPoint};
use footplate_core::{HALF_95, Length, SensorId, TimeSpan, Timestamp, TrainId};
use serde::Serialize;

use super::alarm::{Alarm, Grade};
use super::board::Board;
use super::calibration_picture::CalibrationPicture;
use super::history::Sample;
use super::picture::{Picture, TrainTask, millis, paint_train, tenths};
use super::spans::{Span, held_spans};
use super::way_travelled::WayTravelled;

/// A contact is shown as just passed for so long (s).
const FLASHES_S: f64 = 1.5;
/// How often it is kept where trains are: ten times a second.
const BETWEEN_SAMPLES: TimeSpan = TimeSpan::from_ms(100);
/// How often it is looked whether a train is known better.
const BETWEEN_MODELS: TimeSpan = TimeSpan::from_ms(1_000);

/// A train passed a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TrainPassed {
    pub(crate) train: TrainId,
    /// Beside what had been expected.
    pub(crate) passed: PassedContact,
    /// What comes next.
    pub(crate) next: Option<DueContact>,
}

/// Leaves on a board what a driver knows.
#[derive(Debug)]
pub(crate) struct Painter {
    board: Arc<Board>,
    /// When each contact was passed last.
    flashes: BTreeMap<SensorId, Timestamp>,
    /// What has not been told yet.
    fresh: Vec<TrainPassed>,
    ways: BTreeMap<TrainId, WayTravelled>,
    samples: Vec<(TrainId, Sample)>,
    sampled: Option<Timestamp>,
    drifts: BTreeMap<TrainId, DriftTest>,
    /// Of which trains something was said that is not over, or of the line (`None`).
    alarmed: BTreeSet<Option<TrainId>>,
    /// The line's clock when the session began, once that is known.
    began: Option<Timestamp>,
    models: BTreeMap<TrainId, MotionModel>,
    looked_at_models: Option<Timestamp>,
    /// Somebody else tells the trains what to do: what a train was told is what has left for it.
    follows: bool,
    calibration: Option<CalibrationPicture>,
}

/// An alarm as the browser gets it.
#[derive(Debug, Serialize)]
struct TimedAlarm<'a> {
    t_s: f64,
    #[serde(flatten)]
    alarm: &'a Alarm,
}

/// A passed contact as the browser gets it.
#[derive(Debug, Serialize)]
struct PassedPicture<'l> {
    train: u16,
    contact: &'l str,
    /// The middle of the time in which it closed, and the width of that.
    t_s: f64,
    window_ms: f64,
    /// Later than predicted, and half the 95 % interval of that.
    late_ms: Option<f64>,
    late_half_ms: Option<f64>,
    /// Short of the contact when it was predicted there.
    short_mm: Option<f64>,
    missed: usize,
    /// How far the train has come.
    way_mm: f64,
    /// How far the errors are on their way to a drift alarm, 0 to 1.
    drift: f64,
    /// The mean speed since the contact before, by the surveyed length alone: when, and how much.
    mean: Option<[f64; 2]>,
    next: Option<DuePicture<'l>>,
}

/// The contact that is due.
#[derive(Debug, Serialize)]
struct DuePicture<'l> {
    contact: &'l str,
    t_s: f64,
    half_ms: f64,
}

impl Painter {
    pub(crate) fn new(board: &Arc<Board>) -> Self {
        Self {
            board: Arc::clone(board),
            flashes: BTreeMap::new(),
            fresh: Vec::new(),
            ways: BTreeMap::new(),
            samples: Vec::new(),
            sampled: None,
            drifts: BTreeMap::new(),
            alarmed: BTreeSet::new(),
            began: None,
            models: BTreeMap::new(),
            looked_at_models: None,
            follows: false,
            calibration: None,
        }
    }

    /// Of trains that somebody else drives.
    pub(crate) fn following(board: &Arc<Board>) -> Self {
        Self { follows: true, ..Self::new(board) }
    }

    /// Takes in what the calibration of a train says, and in which words that is said elsewhere.
    pub(crate) fn hear_calibration(
        &mut self,
        layout: &Layout,
        now: Timestamp,
        train: TrainId,
        notice: &CalibrationNotice,
        said: &str,
    ) {
        if let CalibrationNotice::Mishap(mishap) = notice {
            self.alarm(now, &Alarm::of_mishap(layout, train, mishap).said(said));
        }
        self.calibration.get_or_insert_default().hear(notice);
    }

    /// The calibration is over.
    pub(super) fn calibrates_no_more(&mut self) {
        self.calibration = None;
    }

    /// A train passed a contact.
    pub(crate) fn passed(&mut self, passed: TrainPassed) {
        self.flashes.insert(passed.passed.sensor, passed.passed.window.middle());
        self.fresh.push(passed);
    }

    /// Something is not as it should be, with a train or with the line, or is so again.
    pub(crate) fn alarm(&mut self, now: Timestamp, alarm: &Alarm) {
        let is_news = match alarm.grade {
            Grade::Over => self.alarmed.remove(&alarm.train),
            Grade::Danger | Grade::Warning => {
                self.alarmed.insert(alarm.train);
                true
            }
        };
        // That something is over matters to those who have heard of it.
        if is_news {
            let t_s = millis((now - self.began.unwrap_or(now)).as_s());
            self.board.tell("alarm", &TimedAlarm { t_s, alarm });
        }
    }

    /// Leaves the picture of a moment that is not before the last entry, and what has become of it since.
    pub(crate) fn paint(
        &mut self,
        dispatcher: &Dispatcher,
        tasks: &BTreeMap<TrainId, TrainTask>,
        now: Timestamp,
        began: Timestamp,
    ) {
        let held = |train| dispatcher.holds(train).map_or_else(Vec::new, held_spans);
        self.paint_driven(dispatcher.driver(), held, tasks, now, began);
    }

    /// The same of trains that nobody dispatches: they hold nothing.
    pub(crate) fn paint_alone(
        &mut self,
        driver: &Driver,
        tasks: &BTreeMap<TrainId, TrainTask>,
        now: Timestamp,
        began: Timestamp,
    ) {
        self.paint_driven(driver, |_| Vec::new(), tasks, now, began);
    }

    fn paint_driven(
        &mut self,
        driver: &Driver,
        held: impl Fn(TrainId) -> Vec<Span>,
        tasks: &BTreeMap<TrainId, TrainTask>,
        now: Timestamp,
        began: Timestamp,
    ) {
        self.began = Some(began);
        for passed in std::mem::take(&mut self.fresh) {
            self.tell_passed(driver, &passed, began);
        }
        let is_due = |last: Option<Timestamp>, between| last.is_none_or(|last| now - last >= between);
        let is_sampled = is_due(self.sampled, BETWEEN_SAMPLES);
        let mut trains = Vec::new();
        for train in driver.trains() {
            let located = driver.locate(train, now);
            let way = located.map(|located| self.way(driver, train, located.at));
            let told = located.filter(|_| self.follows).map_or_else(|| driver.commanded(train), |at| at.step);
            trains.push(paint_train(driver, train, tasks.get(&train), now, told, way, held(train)));
            if is_sampled {
                let sample = Sample::of((now - began).as_s(), told, located.as_ref(), way);
                self.samples.push((train, sample));
            }
        }
        if is_sampled {
            self.sampled = Some(now);
            self.board.remember(&mut self.samples);
        }
        if is_due(self.looked_at_models, BETWEEN_MODELS) {
            self.looked_at_models = Some(now);
            self.look_at_models(driver);
        }
        let seconds_since = |at: Timestamp| (now - at).as_s();
        self.flashes.retain(|_, at| seconds_since(*at) < FLASHES_S);
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
            calibration: self.calibration.clone(),
            passed: self.flashes.iter().map(|(sensor, at)| (sensor.0, millis(seconds_since(*at)))).collect(),
        });
    }

    /// How far a train has come.
    fn way(&mut self, driver: &Driver, train: TrainId, at: WayPoint) -> Length {
        let way = self.ways.entry(train).or_insert_with(|| WayTravelled::from(at));
        way.goes_on(driver.layout(), at)
    }

    fn tell_passed(&mut self, driver: &Driver, passed: &TrainPassed, began: Timestamp) {
        let TrainPassed { train, passed, next } = passed;
        let layout = driver.layout();
        let time = passed.window.middle();
        let since = |time: Timestamp| millis((time - began).as_s());
        let Some(node) = layout.sensor_node(passed.sensor) else { return };
        let at = WayPoint { node, way: Length::ZERO };
        let way = self.ways.entry(*train).or_insert_with(|| WayTravelled::from(at));
        let mean = way.passes(layout, node, time);
        let at_contact = way.at_contact();
        let drift = self.drifts.entry(*train).or_default();
        let alarm = passed.late.and_then(|[late, doubt]| drift.take(late.as_s() / doubt.as_s()));
        let level = drift.level();
        if let Some(drift) = alarm {
            self.alarm(time, &Alarm::drifts(*train, drift));
        }
        self.board.tell(
            "passed",
            &PassedPicture {
                train: train.0,
                contact: layout.sensor_name(passed.sensor),
                t_s: since(time),
                window_ms: tenths(passed.window.width().as_ms()),
                late_ms: passed.late.map(|[late, _]| tenths(late.as_ms())),
                late_half_ms: passed.late.map(|[_, doubt]| tenths(HALF_95 * doubt.as_ms())),
                short_mm: passed.short.map(|short| tenths(short.as_mm())),
                missed: passed.missed,
                drift: millis(level),
                way_mm: tenths(at_contact.as_mm()),
                mean: mean.map(|(at, speed)| [since(at), tenths(speed.as_mm_per_s())]),
                next: next.map(|next| DuePicture {
                    contact: layout.sensor_name(next.sensor),
                    t_s: since(next.time),
                    half_ms: tenths(HALF_95 * next.uncertainty.as_ms()),
                }),
            },
        );
    }

    fn look_at_models(&mut self, driver: &Driver) {
        for model in driver.trains().filter_map(|train| driver.model(train)) {
            if self.models.get(&model.train()) != Some(model) {
                self.models.insert(model.train(), model.clone());
                self.board.know(model);
            }
        }
    }
}
