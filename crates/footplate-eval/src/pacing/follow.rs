//! Three trains in a row behind one that changes its speed, beside followers that go a step up or down.

use std::collections::BTreeMap;

use anyhow::Context;
use footplate_core::control::{Gap, Notice, Order, Refusal, TrainLengths};
use footplate_core::{Length, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_sim::living::Truth;

use super::counted::{Counted, cut_short};
use super::hold::{speed, steps};
use super::tracked::{LOOK, Odometer};
use crate::seeds::Choice;
use crate::testbed::{LongestCircuit, PreparedTrains};

/// The leader runs at speeds between these (mm/s), each for a time between those (s).
const LEADS_AT: [f64; 2] = [200.0, 320.0];
const CHANGES_AFTER: [f64; 2] = [15.0, 40.0];
/// Contacts from one train to the next when they are put down.
const APART: usize = 2;
/// The leader is on its way for so long (s) before the next follows it.
const HEAD_START: f64 = 3.0;
/// Followers find their gaps within this (s).
const FINDS_WITHIN: f64 = 60.0;
/// The other follower runs at the step that is nearest to its leader's speed, and one above or below while it is off by more
/// (s).
const STEPS_BEYOND: f64 = 0.1;
/// A person measures the trains with a ruler: the longest overhang and the longest shoe of any of them.
const LENGTHS: TrainLengths =
    TrainLengths { overhang: Length::from_mm(100.0), pickup: Length::from_mm(45.0) };

/// What is said of trains that touched, derailed or ran off the track.
pub(super) const GRIEF: &str = "they came to grief";

/// Who drove.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum By {
    /// The driver.
    Driver,
    /// A step up or down at a contact.
    Steps,
}

impl By {
    pub(super) const ALL: [Self; 2] = [Self::Driver, Self::Steps];

    pub(super) const fn key(self) -> &'static str {
        match self {
            Self::Driver => "footplate",
            Self::Steps => "a step up or down",
        }
    }
}

/// What is to be kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kept {
    /// A time from contact to contact.
    Time,
    /// A length from bumper to bumper.
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
    /// The gap that was asked for first, and the one that was kept (s or mm).
    pub(super) gaps: [f64; 2],
    /// How much later than asked the train came by each contact (s), or how much farther behind than asked it was at each
    /// look (mm).
    pub(super) off: Vec<f64>,
    /// The least distance from bumper to bumper (mm).
    pub(super) nearest: f64,
    /// How often it was held back.
    pub(super) held_back: usize,
    pub(super) seconds: f64,
    pub(super) commands: usize,
    pub(super) trouble: Option<String>,
}

/// All gaps by everybody, for so long (s). Who goes up or down by steps keeps times.
pub(super) fn follow(
    stage: &PreparedTrains<'_>,
    way: &LongestCircuit,
    trains: &[TrainId],
    (gaps, lasts): (&[(Kept, f64)], f64),
    choice: &mut Choice,
) -> anyhow::Result<Vec<Followed>> {
    let seed = choice.between(0.0, 1e9) as u64;
    let start = (choice.between(0.0, 1e6) as usize) % way.nodes.len().max(1);
    let mut all = Vec::new();
    for (kept, gap) in gaps {
        for by in By::ALL.into_iter().filter(|by| *by == By::Driver || *kept == Kept::Time) {
            let mut stage = stage.clone();
            for (nth, train) in trains.iter().enumerate() {
                let at = start + APART * (trains.len() - nth);
                let node = *way.nodes.get(at % way.nodes.len()).context("a way without a contact")?;
                stage.put(*train, node, Length::from_mm(60.0))?;
            }
            let row = Row::new(stage, trains, (*kept, *gap), by, Choice::new(seed));
            all.extend(row.run(lasts));
        }
    }
    Ok(all)
}

/// Trains in a row.
struct Row<'a, 'l> {
    stage: PreparedTrains<'l>,
    counted: Counted,
    trains: &'a [TrainId],
    kept: Kept,
    gap: f64,
    by: By,
    choice: Choice,
    odometers: BTreeMap<TrainId, Odometer>,
    /// When the leader changes its speed.
    changes: Timestamp,
    /// When each train was reported at each contact, for those that go up or down by steps.
    reported: BTreeMap<(TrainId, SensorId), Timestamp>,
    followed: Vec<Followed>,
}

impl<'a, 'l> Row<'a, 'l> {
    fn new(
        stage: PreparedTrains<'l>,
        trains: &'a [TrainId],
        (kept, gap): (Kept, f64),
        by: By,
        choice: Choice,
    ) -> Self {
        let now = stage.line.now();
        let mut counted = match by {
            By::Driver => Counted::dispatched(now, stage.driver()),
            By::Steps => Counted::bare(stage.driver()),
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
        let changes = stage.line.now();
        let followed = followed.collect();
        Self {
            stage,
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
        self.stage.line.now()
    }

    fn run(mut self, lasts: f64) -> Vec<Followed> {
        let incidents = self.stage.world().incidents().len();
        for place in 1..self.trains.len() {
            self.drive(HEAD_START);
            self.begin(place);
            // A train that stands where others come round would be run into: no row, no figures.
            if self.followed[place - 1].trouble.is_some() {
                return self.followed;
            }
        }
        self.drive(FINDS_WITHIN);
        let (since, before) =
            (self.now(), self.trains.iter().map(|train| self.counted.steps(*train)).collect::<Vec<_>>());
        self.drive(lasts);
        let grief = self.stage.world().incidents().len() > incidents;
        let truth = self.stage.world().truth();
        for followed in &mut self.followed {
            let leader = self.trains[followed.place - 1];
            followed.seconds = lasts;
            followed.commands = self.counted.steps(followed.train) - before[followed.place];
            if grief {
                followed.trouble.get_or_insert_with(|| GRIEF.to_owned());
            }
            followed.compare(truth, leader, since, &self.odometers);
        }
        self.followed
    }

    /// One more train follows.
    fn begin(&mut self, place: usize) {
        let [leader, train] = [self.trains[place - 1], self.trains[place]];
        if self.by == By::Steps {
            let step = self.counted.driver().commanded(leader);
            let leads_at = self.stage.models.get(&leader).map_or(0.0, |model| speed(model, step));
            let step = self.nearest(train, leads_at);
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

    fn nearest(&self, train: TrainId, mm_per_s: f64) -> SpeedStep {
        let model = self.stage.models.get(&train);
        let off = |step: &SpeedStep| model.map_or(0.0, |model| (speed(model, *step) - mm_per_s).abs());
        let nearest =
            model.and_then(|model| steps(model).min_by(|one, other| off(one).total_cmp(&off(other))));
        nearest.unwrap_or(SpeedStep::STAND)
    }

    fn drive(&mut self, seconds: f64) {
        let until = self.now() + TimeSpan::from_s(seconds);
        while self.now() < until {
            if self.changes <= self.now() {
                let speed = self.choice.between(LEADS_AT[0], LEADS_AT[1]);
                let after = self.choice.between(CHANGES_AFTER[0], CHANGES_AFTER[1]);
                self.changes = self.now() + TimeSpan::from_s(after);
                let train = self.trains[0];
                let order = Order::Speed { train, step: self.nearest(train, speed) };
                let _ = self.counted.order(self.now(), order);
            }
            let look = until.min(self.now() + LOOK);
            let notice = self.counted.drive(&mut self.stage.line, look);
            if let Some((train, _, why)) = notice.as_ref().and_then(cut_short) {
                let of = self.followed.iter_mut().find(|followed| followed.train == train);
                of.into_iter().for_each(|followed| followed.trouble = Some(why.clone()));
            }
            match notice {
                Some(Notice::HeldBack { train, .. }) => {
                    let held = self.followed.iter_mut().find(|followed| followed.train == train);
                    held.into_iter().for_each(|followed| followed.held_back += 1);
                }
                Some(Notice::Passed { train, passed, .. }) if self.by == By::Steps => {
                    self.step_up_or_down(train, passed.sensor, passed.window.middle());
                }
                Some(_) => {}
                None => {
                    for (train, odometer) in &mut self.odometers {
                        odometer.look(&self.stage.line, *train);
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
        let told = self.counted.driver().commanded(leader);
        let leads_at = self.stage.models.get(&leader).map_or(0.0, |model| speed(model, told));
        let like = self.nearest(train, leads_at).get();
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
    /// Gaps and distances as they truly were.
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
            let way = lead.1 - follow.1 - ahead;
            self.nearest = self.nearest.min(way - between);
            if self.kept == Kept::Length {
                // By the lengths that the driver has been told.
                self.off.push(way - (LENGTHS.ahead() + LENGTHS.behind()).as_mm() - self.gaps[1]);
            }
        }
    }
}
