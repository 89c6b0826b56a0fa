//! One run of a supervised train with a disturbance, compared with the truth.

use std::cell::Cell;

use footplate_core::control::{Notice, Order, OrderId, Outcome, StopOrder, Watchdog};
use footplate_core::track::{Landmark, Layout};
use footplate_core::{Length, NodeId, SpeedStep, TimeSpan, Timestamp, TrainId};

use super::kind::{Kind, places_along};
use crate::seeds::Choice;
use crate::testbed::{GRIEF, LongestCircuit, PreparedTrains};

/// The disturbed train.
pub(super) const TRAIN: TrainId = TrainId(24);
/// Another train, at rest.
pub(super) const OTHER: TrainId = TrainId(58);
/// The approximate speed of the train (mm/s).
const SPEED: f64 = 280.0;
/// The range of the random time before the disturbance (s).
const TIME_BEFORE: [f64; 2] = [12.0, 25.0];
/// The duration of an undisturbed run (s).
const UNDISTURBED_TIME: f64 = 240.0;
/// The longest wait for a recovery (s).
const RECOVERY_TIMEOUT: f64 = 420.0;
/// The longest time for a stop (s).
const STOP_TIMEOUT: f64 = 90.0;
/// Stops before the disturbance, and after the recovery.
const STOPS: usize = 3;
/// Stops that show whether a train is where it is estimated: a place may be too near for the third.
const STOPS_SEEN: usize = 2;
/// A person does not see that a train stops so far (mm) from where it was ordered to: half a short locomotive.
const UNSEEN_MM: f64 = 60.0;

/// The results of one run.
#[derive(Debug, Clone, Default)]
pub(super) struct Outcomes {
    /// False alarms, and the time (s) in which any could occur.
    pub(super) false_alarms: usize,
    pub(super) watched_s: f64,
    /// From the disturbance to its detection: time (s) and distance run (mm).
    pub(super) noticed: Option<[f64; 2]>,
    /// From the disturbance to the end of the recovery (s), with its outcome.
    pub(super) recovered: Option<(f64, &'static str)>,
    pub(super) needed_operator: bool,
    /// Errors of stops (mm) before and after.
    pub(super) before: Vec<f64>,
    pub(super) after: Vec<f64>,
    /// What happened in the simulated world, in words.
    pub(super) incidents: Vec<String>,
    /// Whether the track power was switched off.
    pub(super) powered_off: bool,
    /// The notices, for debugging.
    pub(super) notices: Vec<String>,
}

impl Outcomes {
    /// What went wrong: incidents, or a disturbance that was not noticed.
    pub(super) fn failure(&self, kind: Kind) -> Option<String> {
        if !self.incidents.is_empty() {
            return Some(format!("{GRIEF}: {}", self.incidents.join("; ")));
        }
        (kind != Kind::Faultless && self.is_unnoticed()).then(|| "not noticed".to_owned())
    }

    /// Whether nothing was noticed that a person sees: a train that was put down where its next reports are due runs and stops as
    /// if nothing had happened.
    pub(super) fn is_unnoticed(&self) -> bool {
        let is_as_ordered = |mm: &f64| mm.abs() <= UNSEEN_MM;
        let stops_as_ordered = self.after.len() >= STOPS_SEEN && self.after.iter().all(is_as_ordered);
        self.noticed.is_none() && !stops_as_ordered
    }
}

/// One run.
pub(super) struct DisturbedRun<'l> {
    layout: &'l Layout,
    prepared: PreparedTrains<'l>,
    watchdog: Watchdog,
    choice: Choice,
    step: SpeedStep,
    lap_mm: f64,
    /// The number of incidents before the run, during calibration.
    incidents_before: usize,
    pub(super) result: Outcomes,
    recovered_at: Cell<Option<Timestamp>>,
    noticed_at: Cell<Option<Timestamp>>,
    disturbed_at: Option<Timestamp>,
}

impl<'l> DisturbedRun<'l> {
    /// Puts the train on the circuit and another one beside it.
    pub(super) fn new(
        layout: &'l Layout,
        prepared: &PreparedTrains<'l>,
        circuit: &LongestCircuit,
        seed: u64,
    ) -> anyhow::Result<Self> {
        let mut prepared = prepared.clone();
        let mut choice = Choice::new(seed);
        let start = choice.of(&circuit.nodes).copied().unwrap_or(NodeId(0));
        prepared.put(TRAIN, start, Length::from_mm(60.0))?;
        for (node, offset) in &circuit.beside {
            if prepared.put(OTHER, *node, *offset).is_ok() {
                break;
            }
        }
        let watchdog = Watchdog::new(prepared.driver(), prepared.line.now());
        let step = prepared.nearest_step(TRAIN, SPEED);
        let lap_mm =
            circuit.edges.iter().map(|edge| prepared.world().truth().track().length(*edge).as_mm()).sum();
        let incidents_before = prepared.world().incidents().len();
        Ok(Self {
            layout,
            prepared,
            watchdog,
            choice,
            step,
            lap_mm,
            incidents_before,
            result: Outcomes::default(),
            recovered_at: Cell::new(None),
            noticed_at: Cell::new(None),
            disturbed_at: None,
        })
    }

    fn now(&self) -> Timestamp {
        self.prepared.line.now()
    }

    /// Drives until a time or a notice.
    fn drive(&mut self, until: Timestamp) -> Option<Notice> {
        let notice =
            self.prepared.line.drive_hearing(&mut self.watchdog, until, |watchdog, now, notice| {
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
            Notice::Danger { train: TRAIN, .. } => self.note_alarm(now),
            Notice::Recovered { train: TRAIN, outcome, .. } => {
                self.recovered_at.set(Some(now));
                if let Some(disturbed_at) = self.disturbed_at {
                    let what = match outcome {
                        Outcome::AsBefore => "as before",
                        Outcome::Rescaled { .. } => "rescaled",
                        _ => "learnt anew",
                    };
                    self.result.recovered = Some(((now - disturbed_at).as_s(), what));
                }
            }
            // Nothing goes on until an operator says that the track is clear.
            Notice::UnauthorisedMovement { stopped, .. } if stopped.contains(&TRAIN) => {
                self.note_alarm(now);
                self.result.needed_operator = true;
            }
            Notice::NeedsOperator { .. } => self.result.needed_operator = true,
            Notice::PowerOff { .. } => self.result.powered_off = true,
            Notice::Passed { .. } | Notice::Planned(_) | Notice::TurnoutThrown { .. } => return,
            _ => {}
        }
        self.result.notices.push(format!("{:.1} {notice:?}", (now - Timestamp::ZERO).as_s()));
    }

    /// An alarm: false before anything has happened.
    fn note_alarm(&mut self, now: Timestamp) {
        if self.disturbed_at.is_none() {
            self.result.false_alarms += 1;
        } else if self.noticed_at.get().is_none() {
            self.noticed_at.set(Some(now));
        }
    }

    fn wait(&mut self, seconds: f64) {
        let until = self.now() + TimeSpan::from_s(seconds);
        while self.now() < until {
            let _ = self.drive(until);
        }
    }

    fn resume(&mut self) {
        let order = Order::Speed { train: TRAIN, step: self.step };
        let _ = self.watchdog.order(self.now(), order);
    }

    /// Stops at a random place ahead; returns how far beyond it the train came to rest, in mm.
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
        let past = self.prepared.world().truth().past(TRAIN, sensor)?;
        let error = (past - target.offset).as_mm();
        // A sensor that the train has not reached in this lap is a lap behind it.
        Some(if error < -0.5 * self.lap_mm { error + self.lap_mm } else { error })
    }

    fn until_done(&mut self, order: OrderId) -> Option<()> {
        let until = self.now() + TimeSpan::from_s(STOP_TIMEOUT);
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

    /// Runs the train, disturbs it, and waits for its recovery.
    pub(super) fn run(mut self, kind: Kind, circuit: &LongestCircuit, seed: u64) -> anyhow::Result<Outcomes> {
        let began = self.now();
        for _ in 0..STOPS {
            let error = self.stop();
            self.result.before.extend(error);
        }
        self.resume();
        let before = self.choice.between(TIME_BEFORE[0], TIME_BEFORE[1]);
        self.wait(before);
        if kind == Kind::Faultless {
            self.wait(UNDISTURBED_TIME);
            self.result.watched_s = (self.now() - began).as_s();
            self.result.incidents = self.prepared.incidents_since(self.incidents_before);
            return Ok(self.result);
        }
        self.result.watched_s = (self.now() - began).as_s();
        self.recovered_at.set(None);
        let disturbed_at = self.now();
        let odometer = |run_state: &Self| {
            run_state.prepared.world().truth().train(TRAIN).map_or(0.0, |truth| truth.odometer.as_mm())
        };
        let ran = odometer(&self);
        let places = places_along(self.layout, &circuit.edges);
        kind.apply(&mut self.prepared.line.station, TRAIN, &places, seed, &mut self.choice)?;
        // The exchanged engine has its own odometer.
        let ran = if kind == Kind::Swapped { odometer(&self) } else { ran };
        self.result.notices.push(format!(
            "{:.1} --- {}",
            (disturbed_at - Timestamp::ZERO).as_s(),
            kind.description()
        ));
        self.disturbed_at = Some(disturbed_at);
        let deadline = disturbed_at + TimeSpan::from_s(RECOVERY_TIMEOUT);
        while self.now() < deadline && self.recovered_at.get().is_none() && !self.result.needed_operator {
            let _ = self.drive(deadline);
            if let (Some(at), None) = (self.noticed_at.get(), self.result.noticed) {
                self.result.noticed = Some([(at - disturbed_at).as_s(), odometer(&self) - ran]);
            }
        }
        if self.recovered_at.get().is_some() || self.result.noticed.is_none() {
            self.wait(1.0);
            for _ in 0..STOPS {
                let error = self.stop();
                self.result.after.extend(error);
            }
        }
        self.result.incidents = self.prepared.incidents_since(self.incidents_before);
        Ok(self.result)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_run_says_what_happened() {
        let incidents = vec!["12.5 s: train 24 ran into train 58".to_owned()];
        let wrecked = Outcomes { incidents, ..Outcomes::default() };
        let says = "came to grief: 12.5 s: train 24 ran into train 58";
        assert_eq!(wrecked.failure(Kind::Faultless).as_deref(), Some(says));
        assert_eq!(wrecked.failure(Kind::Swapped).as_deref(), Some(says), "before that it was not noticed");
        assert_eq!(Outcomes::default().failure(Kind::Swapped).as_deref(), Some("not noticed"));
        let stopped = |mm: f64| Outcomes { after: vec![4.0, mm, -12.0], ..Outcomes::default() };
        assert_eq!(
            stopped(31.0).failure(Kind::Swapped),
            None,
            "it runs and stops as if nothing had happened"
        );
        assert_eq!(stopped(-140.0).failure(Kind::Swapped).as_deref(), Some("not noticed"));
        assert_eq!(Outcomes::default().failure(Kind::Faultless), None);
    }
}
