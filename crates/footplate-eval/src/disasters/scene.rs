//! A watched train on a simulated layout that something happens to, beside the truth.

use std::cell::Cell;

use footplate_core::control::{Notice, Order, OrderId, Outcome, StopOrder, Watchdog};
use footplate_core::track::{Landmark, Layout};
use footplate_core::{Length, NodeId, SpeedStep, TimeSpan, Timestamp, TrainId};

use super::kind::{Kind, places_along};
use crate::choice::Choice;
use crate::rehearsal::{Rehearsal, Way};

/// The train that something happens to.
pub(super) const TRAIN: TrainId = TrainId(24);
/// Another one, that stands.
pub(super) const OTHER: TrainId = TrainId(58);
/// About how fast it runs (mm/s).
const RUNS_AT: f64 = 280.0;
/// How long it runs before anything happens (s), beside what is drawn.
const RUNS_BEFORE: [f64; 2] = [12.0, 25.0];
/// How long a faultless run is (s).
const FAULTLESS: f64 = 240.0;
/// Nobody waits for longer than this until a train is known again (s).
const PATIENCE: f64 = 420.0;
/// A stop that is not carried out by then has failed (s).
const STOP_PATIENCE: f64 = 90.0;
/// Stops before, and stops after.
const STOPS: usize = 3;

/// What came of one.
#[derive(Debug, Clone, Default)]
pub(super) struct Outcomes {
    /// False alarms, and the time (s) in which there could have been any.
    pub(super) false_alarms: usize,
    pub(super) watched_s: f64,
    /// From what happened until it was noticed (s), and the way run in between (mm).
    pub(super) noticed: Option<[f64; 2]>,
    /// From what happened until the train was known again (s), and as what.
    pub(super) recovered: Option<(f64, &'static str)>,
    pub(super) needed_person: bool,
    /// Errors of stops (mm) before and after.
    pub(super) before: Vec<f64>,
    pub(super) after: Vec<f64>,
    /// What went wrong with trains, and that the power was taken.
    pub(super) mishaps: usize,
    pub(super) powered_off: bool,
    /// What was said, for whoever wants to know why.
    pub(super) said: Vec<String>,
}

/// One run.
pub(super) struct Scene<'l> {
    layout: &'l Layout,
    stage: Rehearsal<'l>,
    watchdog: Watchdog,
    choice: Choice,
    step: SpeedStep,
    lap_mm: f64,
    /// What had gone wrong before, while trains were calibrated.
    mishaps: usize,
    pub(super) result: Outcomes,
    recovered_at: Cell<Option<Timestamp>>,
    noticed_at: Cell<Option<Timestamp>>,
    happened: Option<Timestamp>,
}

impl<'l> Scene<'l> {
    /// Puts the train on a loop and another one beside it.
    pub(super) fn new(
        layout: &'l Layout,
        stage: &Rehearsal<'l>,
        way: &Way,
        seed: u64,
    ) -> anyhow::Result<Self> {
        let mut stage = stage.clone();
        let mut choice = Choice::new(seed);
        let start = choice.of(&way.nodes).copied().unwrap_or(NodeId(0));
        stage.put(TRAIN, start, Length::from_mm(60.0))?;
        for (node, offset) in &way.beside {
            if stage.put(OTHER, *node, *offset).is_ok() {
                break;
            }
        }
        let watchdog = Watchdog::new(stage.driver(), stage.line.now());
        let step = stage.models.get(&TRAIN).map_or(SpeedStep::STAND, |model| {
            let off = |step: &SpeedStep| {
                (model.speed(*step, footplate_core::Approach::Below).value.as_mm_per_s() - RUNS_AT).abs()
            };
            let all = (1..=model.highest().get()).filter_map(SpeedStep::new);
            all.min_by(|one, other| off(one).total_cmp(&off(other))).unwrap_or(SpeedStep::STAND)
        });
        let lap_mm = way.edges.iter().map(|edge| stage.world().truth().track().length(*edge).as_mm()).sum();
        let mishaps = stage.world().mishaps().len();
        Ok(Self {
            layout,
            stage,
            watchdog,
            choice,
            step,
            lap_mm,
            mishaps,
            result: Outcomes::default(),
            recovered_at: Cell::new(None),
            noticed_at: Cell::new(None),
            happened: None,
        })
    }

    fn now(&self) -> Timestamp {
        self.stage.line.now()
    }

    /// Lets things happen until a time or a notice.
    fn drive(&mut self, until: Timestamp) -> Option<Notice> {
        let notice = self.stage.line.drive_hearing(&mut self.watchdog, until, |watchdog, now, notice| {
            if let Some(news) = notice.news() {
                watchdog.handle_link(now, news);
            }
        })?;
        self.note(&notice);
        Some(notice)
    }

    fn note(&mut self, notice: &Notice) {
        let now = self.now();
        match notice {
            Notice::Danger { train: TRAIN, .. } => match self.happened {
                None => self.result.false_alarms += 1,
                Some(_) if self.noticed_at.get().is_none() => self.noticed_at.set(Some(now)),
                Some(_) => {}
            },
            Notice::Recovered { train: TRAIN, outcome, .. } => {
                self.recovered_at.set(Some(now));
                if let Some(happened) = self.happened {
                    let what = match outcome {
                        Outcome::AsBefore => "as before",
                        Outcome::Rescaled { .. } => "rescaled",
                        _ => "learnt anew",
                    };
                    self.result.recovered = Some(((now - happened).as_s(), what));
                }
            }
            Notice::NeedsOperator { .. } => self.result.needed_person = true,
            Notice::PowerOff { .. } => self.result.powered_off = true,
            Notice::Passed { .. } | Notice::Planned(_) | Notice::TurnoutThrown { .. } => return,
            _ => {}
        }
        self.result.said.push(format!("{:.1} {notice:?}", (now - Timestamp::ZERO).as_s()));
    }

    fn wait(&mut self, seconds: f64) {
        let until = self.now() + TimeSpan::from_s(seconds);
        while self.now() < until {
            let _ = self.drive(until);
        }
    }

    fn run_again(&mut self) {
        let order = Order::Speed { train: TRAIN, step: self.step };
        let _ = self.watchdog.order(self.now(), order);
    }

    /// One stop somewhere ahead: how far beyond it the train came to rest, in mm.
    fn stop(&mut self) -> Option<f64> {
        let located = self.watchdog.driver().locate(TRAIN, self.now())?;
        let mut ahead: Vec<(NodeId, Length)> = Vec::new();
        let mut node = located.at.node;
        for _ in 0..12 {
            let hop = self.layout.open_hops_from(node, self.watchdog.driver().turnouts()).next()?;
            hop.sensor?;
            ahead.push((hop.from, hop.length));
            node = hop.to;
        }
        let (node, length) = *self.choice.of(ahead.get(4..)?)?;
        let target = Landmark { node, offset: length * self.choice.between(0.0, 1.0) };
        let stop = StopOrder { step: Some(self.step), ..StopOrder::at(TRAIN, target) };
        let order = self.watchdog.order(self.now(), Order::Stop(stop)).ok()?;
        self.until_done(order)?;
        self.wait(3.0);
        let sensor = self.layout.sensor_at(node)?;
        let past = self.stage.world().truth().past(TRAIN, sensor)?;
        let error = (past - target.offset).as_mm();
        // A contact that it has not come by yet is a round behind it.
        Some(if error < -0.5 * self.lap_mm { error + self.lap_mm } else { error })
    }

    fn until_done(&mut self, order: OrderId) -> Option<()> {
        let until = self.now() + TimeSpan::from_s(STOP_PATIENCE);
        while self.now() < until {
            match self.drive(until) {
                Some(Notice::Done(done)) if done.order == order => {
                    return Some(());
                }
                Some(Notice::GivenUp { order: given_up, .. }) if given_up == order => {
                    return None;
                }
                _ => {}
            }
        }
        None
    }

    /// Everything, in turn.
    pub(super) fn run(mut self, kind: Kind, way: &Way, seed: u64) -> anyhow::Result<Outcomes> {
        let began = self.now();
        for _ in 0..STOPS {
            let error = self.stop();
            self.result.before.extend(error);
        }
        self.run_again();
        let before = self.choice.between(RUNS_BEFORE[0], RUNS_BEFORE[1]);
        self.wait(before);
        if kind == Kind::Faultless {
            self.wait(FAULTLESS);
            self.result.watched_s = (self.now() - began).as_s();
            self.result.mishaps = self.stage.world().mishaps().len() - self.mishaps;
            return Ok(self.result);
        }
        self.result.watched_s = (self.now() - began).as_s();
        self.recovered_at.set(None);
        let happened = self.now();
        let odometer = |scene: &Self| {
            scene.stage.world().truth().train(TRAIN).map_or(0.0, |truth| truth.odometer.as_mm())
        };
        let ran = odometer(&self);
        let places = places_along(self.layout, &way.edges);
        kind.befall(&mut self.stage.line.station, TRAIN, &places, seed, &mut self.choice)?;
        // Another engine has an odometer of its own.
        let ran = if kind == Kind::Swapped { odometer(&self) } else { ran };
        self.result.said.push(format!("{:.1} --- {}", (happened - Timestamp::ZERO).as_s(), kind.says()));
        self.happened = Some(happened);
        let patience = happened + TimeSpan::from_s(PATIENCE);
        while self.now() < patience && self.recovered_at.get().is_none() && !self.result.needed_person {
            let _ = self.drive(patience);
            if let (Some(at), None) = (self.noticed_at.get(), self.result.noticed) {
                self.result.noticed = Some([(at - happened).as_s(), odometer(&self) - ran]);
            }
        }
        if self.recovered_at.get().is_some() {
            self.wait(1.0);
            for _ in 0..STOPS {
                let error = self.stop();
                self.result.after.extend(error);
            }
        }
        self.result.mishaps = self.stage.world().mishaps().len() - self.mishaps;
        Ok(self.result)
    }
}
