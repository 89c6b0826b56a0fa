//! Following a train that changes its speed, compared with followers that change their step by one.

use std::collections::BTreeMap;

use anyhow::Context;
use footplate_core::control::{Gap, Notice, Order, Refusal, TrainLengths};
use footplate_core::{Length, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_sim::living::Truth;

use super::counted::{By, Counted, cut_short};
use super::tracked::{LOOK, Odometer};
use crate::seeds::Choice;
use crate::testbed::{LongestCircuit, PreparedTrains, speed};

/// The leader runs at speeds between these (mm/s), each for a time between those (s).
const LEADS_AT: [f64; 2] = [200.0, 320.0];
const CHANGES_AFTER: [f64; 2] = [15.0, 40.0];
/// Sensors from one train to the next at the start.
const APART: usize = 2;
/// The time between the starts of two trains (s).
const HEAD_START: f64 = 3.0;
/// The time for followers to reach their gaps (s).
const FINDS_WITHIN: f64 = 60.0;
/// The simple follower runs at the step nearest to its leader's speed, and at one above or below while the error of its gap
/// is larger (s).
const STEPS_BEYOND: f64 = 0.1;
/// The longest overhang and the longest shoe of any train, measured with a ruler.
const LENGTHS: TrainLengths =
    TrainLengths { overhang: Length::from_mm(100.0), pickup: Length::from_mm(45.0) };

/// The drivers of followers.
pub(super) const DRIVERS: [By; 2] = [By::Footplate, By::Step];

/// The kind of gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kept {
    /// A time between two trains at one sensor.
    Time,
    /// A distance from buffer to buffer.
    Length,
}

impl Kept {
    /// A gap of so many seconds or millimetres.
    fn gap(self, much: f64) -> Gap {
        match self {
            Self::Time => Gap::Time(TimeSpan::from_s(much)),
            Self::Length => Gap::Way(Length::from_mm(much)),
        }
    }
}

/// One train behind another.
#[derive(Debug, Clone)]
pub(super) struct Followed {
    pub(super) by: By,
    pub(super) kept: Kept,
    pub(super) train: TrainId,
    /// Its place behind the first.
    pub(super) place: usize,
    /// The gap that was ordered first, and the accepted one (s or mm).
    pub(super) gaps: [f64; 2],
    /// The errors of the gap: at each sensor in s, or at each sample in mm; positive if it was too large.
    pub(super) off: Vec<f64>,
    /// The least distance from buffer to buffer (mm).
    pub(super) nearest: f64,
    /// How often speed supervision slowed it.
    pub(super) held_back: usize,
    pub(super) seconds: f64,
    pub(super) commands: usize,
    pub(super) trouble: Option<String>,
}

/// Keeps each gap with each driver for a time (s); the simple follower keeps times only.
pub(super) fn follow(
    prepared: &PreparedTrains<'_>,
    circuit: &LongestCircuit,
    trains: &[TrainId],
    (gaps, lasts): (&[(Kept, f64)], f64),
    choice: &mut Choice,
) -> anyhow::Result<Vec<Followed>> {
    let seed = choice.between(0.0, 1e9) as u64;
    let start = (choice.between(0.0, 1e6) as usize) % circuit.nodes.len().max(1);
    let mut all = Vec::new();
    for (kept, gap) in gaps {
        for by in DRIVERS.into_iter().filter(|by| *by == By::Footplate || *kept == Kept::Time) {
            let mut prepared = prepared.clone();
            for (nth, train) in trains.iter().enumerate() {
                let at = start + APART * (trains.len() - nth);
                let node =
                    *circuit.nodes.get(at % circuit.nodes.len()).context("a circuit without a sensor")?;
                prepared.put(*train, node, Length::from_mm(60.0))?;
            }
            let row = Row::new(prepared, trains, (*kept, *gap), by, Choice::new(seed));
            all.extend(row.run(lasts));
        }
    }
    Ok(all)
}

/// Trains in a row, each following the one ahead.
struct Row<'a, 'l> {
    prepared: PreparedTrains<'l>,
    counted: Counted,
    trains: &'a [TrainId],
    kept: Kept,
    gap: f64,
    by: By,
    choice: Choice,
    odometers: BTreeMap<TrainId, Odometer>,
    /// When the leader changes its speed.
    changes: Timestamp,
    /// When each train was detected at each sensor, for the simple follower.
    reported: BTreeMap<(TrainId, SensorId), Timestamp>,
    followed: Vec<Followed>,
}

impl<'a, 'l> Row<'a, 'l> {
    fn new(
        prepared: PreparedTrains<'l>,
        trains: &'a [TrainId],
        (kept, gap): (Kept, f64),
        by: By,
        choice: Choice,
    ) -> Self {
        let now = prepared.line.now();
        let mut counted = match by {
            By::Footplate => Counted::dispatched(now, prepared.driver()),
            By::Oracle | By::Step => Counted::bare(prepared.driver()),
        };
        trains.iter().for_each(|train| counted.set_lengths(now, *train, LENGTHS));
        let followed = (1..trains.len()).map(|place| Followed {
            by,
            kept,
            train: trains[place],
            place,
            gaps: [gap; 2],
            off: Vec::new(),
            nearest: f64::INFINITY,
            held_back: 0,
            seconds: 0.0,
            commands: 0,
            trouble: None,
        });
        let odometers = trains.iter().map(|train| (*train, Odometer::default())).collect();
        let changes = prepared.line.now();
        let followed = followed.collect();
        Self {
            prepared,
            counted,
            trains,
            kept,
            gap,
            by,
            choice,
            odometers,
            changes,
            reported: BTreeMap::new(),
            followed,
        }
    }

    fn now(&self) -> Timestamp {
        self.prepared.line.now()
    }

    fn run(mut self, lasts: f64) -> Vec<Followed> {
        let incidents = self.prepared.world().incidents().len();
        for place in 1..self.trains.len() {
            self.drive(HEAD_START);
            self.begin(place);
            // The others would run into a train that stays at rest: no figures.
            if self.followed[place - 1].trouble.is_some() {
                return self.followed;
            }
        }
        self.drive(FINDS_WITHIN);
        let (since, before) =
            (self.now(), self.trains.iter().map(|train| self.counted.steps(*train)).collect::<Vec<_>>());
        self.drive(lasts);
        let grief = self.prepared.grief_since(incidents);
        let truth = self.prepared.world().truth();
        for followed in &mut self.followed {
            let leader = self.trains[followed.place - 1];
            followed.seconds = lasts;
            followed.commands = self.counted.steps(followed.train) - before[followed.place];
            followed.trouble = grief.clone().or_else(|| followed.trouble.take());
            followed.compare(truth, leader, since, &self.odometers);
        }
        self.followed
    }

    /// Starts the next train.
    fn begin(&mut self, place: usize) {
        let [leader, train] = [self.trains[place - 1], self.trains[place]];
        if self.by == By::Step {
            let step = self.step_like(leader, train);
            let _ = self.counted.order(self.now(), Order::Speed { train, step });
            return;
        }
        let now = self.now();
        let mut order = |gap: f64| {
            let gap = self.kept.gap(gap);
            self.counted.order(now, Order::Follow { train, leader, gap })
        };
        let mut taken = order(self.gap);
        if let Err(Refusal::GapTooShort { shortest, .. }) = &taken {
            let offered = match shortest {
                Gap::Time(shortest) => 1.05 * shortest.as_s(),
                Gap::Way(shortest) => 1.05 * shortest.as_mm(),
            };
            taken = order(offered);
            self.followed[place - 1].gaps[1] = offered;
        }
        if let Err(why) = taken {
            self.followed[place - 1].trouble = Some(why.to_string());
        }
    }

    /// The step of a train that is nearest to the speed of its leader.
    fn step_like(&self, leader: TrainId, train: TrainId) -> SpeedStep {
        let step = self.counted.driver().commanded(leader);
        let leads_at = self.prepared.models.get(&leader).map_or(0.0, |model| speed(model, step));
        self.prepared.nearest_step(train, leads_at)
    }

    fn drive(&mut self, seconds: f64) {
        let until = self.now() + TimeSpan::from_s(seconds);
        while self.now() < until {
            if self.changes <= self.now() {
                let speed = self.choice.between(LEADS_AT[0], LEADS_AT[1]);
                let after = self.choice.between(CHANGES_AFTER[0], CHANGES_AFTER[1]);
                self.changes = self.now() + TimeSpan::from_s(after);
                let train = self.trains[0];
                let order = Order::Speed { train, step: self.prepared.nearest_step(train, speed) };
                let _ = self.counted.order(self.now(), order);
            }
            let look = until.min(self.now() + LOOK);
            let notice = self.counted.drive(&mut self.prepared.line, look);
            if let Some((train, _, why)) = notice.as_ref().and_then(cut_short) {
                let of = self.followed.iter_mut().find(|followed| followed.train == train);
                of.into_iter().for_each(|followed| followed.trouble = Some(why.clone()));
            }
            match notice {
                Some(Notice::HeldBack { train, .. }) => {
                    let held = self.followed.iter_mut().find(|followed| followed.train == train);
                    held.into_iter().for_each(|followed| followed.held_back += 1);
                }
                Some(Notice::Passed { train, passed, .. }) if self.by == By::Step => {
                    self.step_up_or_down(train, passed.sensor, passed.window.middle());
                }
                Some(_) => {}
                None => {
                    for (train, odometer) in &mut self.odometers {
                        odometer.look(&self.prepared.line, *train);
                    }
                }
            }
        }
    }

    fn step_up_or_down(&mut self, train: TrainId, sensor: SensorId, at: Timestamp) {
        self.reported.insert((train, sensor), at);
        let place = self.trains.iter().position(|found| *found == train).unwrap_or_default();
        let Some(leader) = place.checked_sub(1).map(|ahead| self.trains[ahead]) else { return };
        let Some(led) = self.reported.get(&(leader, sensor)) else { return };
        let late = (at - *led).as_s() - self.gap;
        let like = self.step_like(leader, train).get();
        let step = match late {
            late if late > STEPS_BEYOND => like.saturating_add(1),
            late if late < -STEPS_BEYOND => like.saturating_sub(1).max(1),
            _ => like,
        };
        if let Some(step) = SpeedStep::new(step) {
            let _ = self.counted.order(self.now(), Order::Speed { train, step });
        }
    }
}

impl Followed {
    /// Adds the true gaps and distances.
    fn compare(
        &mut self,
        truth: Truth<'_, '_>,
        leader: TrainId,
        since: Timestamp,
        odometers: &BTreeMap<TrainId, Odometer>,
    ) {
        let passes = |train: TrainId| truth.passes().iter().filter(move |pass| pass.train == Some(train));
        let mut common = None;
        for pass in passes(self.train) {
            let led = passes(leader).rfind(|led| led.sensor == pass.sensor && led.at <= pass.at);
            let Some(led) = led else { continue };
            common = Some(led.odometer_mm - pass.odometer_mm);
            if pass.at >= since && self.kept == Kept::Time {
                self.off.push((pass.at - led.at).as_s() - self.gaps[1]);
            }
        }
        let (Some(ahead), Some(engine), Some(own)) = (common, truth.engine(leader), truth.engine(self.train))
        else {
            return;
        };
        let between = (engine.shoe + engine.tail + own.nose).as_mm();
        let both = odometers.get(&leader).zip(odometers.get(&self.train));
        for (lead, follow) in
            both.into_iter().flat_map(|(one, other)| one.since(since).zip(other.since(since)))
        {
            let distance = lead.1 - follow.1 - ahead;
            self.nearest = self.nearest.min(distance - between);
            if self.kept == Kept::Length {
                // By the lengths that the driver knows.
                self.off.push(distance - (LENGTHS.ahead() + LENGTHS.behind()).as_mm() - self.gaps[1]);
            }
        }
    }
}
