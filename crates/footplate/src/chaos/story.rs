//! All lives of one seed, and their result.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

use anyhow::{Context, bail};
use footplate_core::control::{Dispatcher, Driver};
use footplate_core::model::MotionModel;
use footplate_core::track::{Layout, Leg, TurnoutStates};
use footplate_core::{Length, NodeId, TimeSpan, Timestamp, TrainId};
use footplate_eval::seeds::Choice;
use footplate_eval::testbed::PreparedTrains;
use footplate_eval::traffic::{HAND, LENGTHS, place_by_hand};
use footplate_sim::{LivingLayout, LivingSwitches, StationSwitches};
use footplate_store::Store;

use super::disk::FaultyDisk;
use super::failure::{Failure, FailureKind};
use super::files::StoreDisk;
use super::life::{Life, Spell};
use super::line::{FaultyLine, SharedStation};
use super::pair::Pair;
use super::people::{People, SEEN_AFTER, Seen, SharedDisk};
use super::plan::{Plan, Planned, PlannedLife};
use super::promises::Promises;
use super::selection::Selection;
use super::transport::cable_to;
use crate::commands::{recall_directions, stop_all};
use crate::guardian::WardLink;
use crate::link::{Address, Link, OpenSession, Quirks, SimulatedStation, StationKind, open_session};
use crate::runtime::{Ended, Runtime};

/// Trains of every story.
const TRAINS: [TrainId; 3] = [TrainId(24), TrainId(58), TrainId(1)];
/// Track time in which each was calibrated.
const BUDGET: TimeSpan = TimeSpan::from_ms(120_000);
/// The number of stories with the same trains and rails.
pub(crate) const STORIES_A_STAGE: u64 = 32;
/// The distance of a train beyond a sensor at the beginning.
const PAST: Length = Length::from_mm(150.0);
const TRIES: usize = 1_000;
/// The longest time from a stop command to standstill.
const BRAKES_WITHIN: TimeSpan = TimeSpan::from_ms(4_000);
/// The calendar of the computer when a story begins; any other would do.
const CALENDAR: Timestamp = Timestamp::from_s(1.7e9);

/// Trains and rails, drawn and calibrated once for several stories.
pub(crate) struct Stage<'l> {
    number: u64,
    layout: &'l Layout,
    world: LivingLayout<'l>,
    models: BTreeMap<TrainId, MotionModel>,
}

impl<'l> Stage<'l> {
    /// The number of the stage of a seed.
    pub(crate) const fn number_of(seed: u64) -> u64 {
        seed / STORIES_A_STAGE
    }

    /// Draws trains and rails, and calibrates the trains.
    ///
    /// # Errors
    /// When there is no room for the trains on the layout.
    pub(crate) fn set(layout: &'l Layout, number: u64) -> anyhow::Result<Self> {
        let switches = LivingSwitches::well_kept();
        let rehearsal = PreparedTrains::prepare(layout, number, &TRAINS, &switches, BUDGET)?;
        let (world, models) = (rehearsal.world().clone(), rehearsal.models.clone());
        Ok(Self { number, layout, world, models })
    }
}

/// The result of a seed.
#[derive(Debug, Default)]
pub(crate) struct Fate {
    pub(crate) seed: u64,
    pub(crate) station: StationKind,
    /// Track time, in s.
    pub(crate) seconds: f64,
    pub(crate) lives: u32,
    pub(crate) deaths: u32,
    pub(crate) arrivals: u32,
    pub(crate) alarms: u32,
    pub(crate) grants: u32,
    pub(crate) intrusions: u32,
    /// Places of rest, and times of reports, that were promised with 95 %.
    pub(crate) stops: Promises,
    pub(crate) times: Promises,
    /// Incidents while no command could reach the station.
    pub(crate) out_of_reach: u32,
    /// From each death until all trains were stopped, in ms.
    pub(crate) stopped_ms: Vec<f64>,
    /// Violated invariants.
    pub(crate) failures: Vec<Failure>,
    /// All troubles that the seed draws, in words; the first has number 1.
    pub(crate) troubles: Vec<String>,
    /// The events of the story.
    pub(crate) notes: Vec<(Timestamp, String)>,
}

/// Runs the story of a seed, with all of its troubles or only some. `store` is the path of its store, which does not exist yet.
///
/// # Errors
/// When the store of a new session cannot be made, there is no room for the trains, or a selected trouble does not exist.
pub(crate) fn story(
    stage: &Stage<'_>,
    seed: u64,
    only: Option<&Selection>,
    store: &Path,
) -> anyhow::Result<Fate> {
    let mut choice = Choice::new(seed.wrapping_mul(0x2545_f491_4f6c_dd1d));
    let mut plan = Plan::draw(seed, &mut choice);
    let troubles = plan.troubles();
    if let Some(only) = only {
        let unknown = only.numbers().find(|number| *number > troubles.len());
        if let Some(number) = unknown {
            bail!("--only: seed {seed} has no trouble {number}; it has {}", troubles.len());
        }
        plan.select(only);
    }
    let mut world = stage.world.clone();
    put_trains(stage, &mut world, &mut choice)?;
    let mut teller = Teller {
        stage,
        address: format!("sim:track-a?station={}", plan.station.key()).parse().map_err(anyhow::Error::msg)?,
        station: Rc::new(RefCell::new(SimulatedStation::new(
            plan.station,
            world,
            stage.number,
            StationSwitches::default(),
            Quirks::default(),
        ))),
        files: StoreDisk::under(store, seed)?,
        choice,
        fate: Fate { seed, station: plan.station, troubles, ..Fate::default() },
    };
    let began = teller.now();
    teller.note(format!("a {}", plan.station.key()));
    for life in &plan.lives {
        teller.live(life)?;
        if !teller.fate.failures.is_empty() {
            break;
        }
    }
    teller.fate.seconds = (teller.now() - began).as_s();
    teller.fate.notes.sort_by_key(|(at, _)| *at);
    Ok(teller.fate)
}

/// Places trains on reservations that do not overlap, clear of turnouts.
fn put_trains(stage: &Stage<'_>, world: &mut LivingLayout<'_>, choice: &mut Choice) -> anyhow::Result<()> {
    let layout = stage.layout;
    let sensors: Vec<NodeId> = layout.sensors().map(|(_, node)| node).collect();
    let turnouts: TurnoutStates = layout.turnouts().map(|(turnout, _)| (turnout, Leg::Straight)).collect();
    for (nth, train) in TRAINS.iter().enumerate() {
        let mut is_put = false;
        for _ in 0..TRIES {
            let Some(node) = choice.of(&sensors).copied() else { break };
            let at = footplate_core::track::Landmark { node, offset: PAST };
            let Ok(position) = layout.locate(at, &turnouts) else { continue };
            if world.place(*train, position, footplate_sim::living::End::Nose).is_err() {
                continue;
            }
            let dispatcher = dispatcher_of(stage, world, &TRAINS[..=nth]);
            let held = dispatcher.reservation(*train);
            let is_apart = TRAINS[..nth].iter().all(|other| {
                dispatcher.reservation(*other).zip(held).is_some_and(|(one, two)| !one.meets(two))
            });
            if is_apart && held.is_some_and(|held| held.turnouts().next().is_none()) {
                is_put = true;
                break;
            }
            world.lift(*train);
        }
        is_put.then_some(()).with_context(|| format!("there is no room for train {train}"))?;
    }
    Ok(())
}

/// The dispatcher at the start of a life: an operator enters the positions of trains and turnouts.
fn dispatcher_of(stage: &Stage<'_>, world: &LivingLayout<'_>, trains: &[TrainId]) -> Dispatcher {
    let layout = stage.layout;
    let turnouts: TurnoutStates =
        layout.turnouts().filter_map(|(turnout, _)| Some((turnout, world.lies(turnout)?))).collect();
    let mut driver = Driver::new(layout.clone(), turnouts);
    for train in trains {
        if let Some(model) = stage.models.get(train) {
            driver.add_train(model.clone());
            if let Some(at) = place_by_hand(layout, world, *train) {
                driver.place(world.now(), *train, at, HAND);
            }
        }
    }
    let mut dispatcher = Dispatcher::watched(world.now(), driver);
    for train in trains {
        dispatcher.set_lengths(world.now(), *train, LENGTHS);
    }
    dispatcher
}

/// State that all lives of a story share.
pub(super) struct Teller<'s, 'l> {
    stage: &'s Stage<'l>,
    address: Address,
    pub(super) station: SharedStation<'l>,
    /// The disk under the store.
    files: StoreDisk,
    pub(super) choice: Choice,
    pub(super) fate: Fate,
}

impl<'l> Teller<'_, 'l> {
    pub(super) fn now(&self) -> Timestamp {
        self.station.borrow().now()
    }

    pub(super) fn note(&mut self, words: String) {
        let now = self.now();
        self.fate.notes.push((now, words));
    }

    /// Notes the steps that decoders received last, and the leading ends of trains.
    pub(super) fn tell_truth(&mut self) {
        let truth = |train: &TrainId| {
            let station = self.station.borrow();
            let truth = station.world().truth().train(*train)?;
            Some(format!(
                "{train} step {} {:?} leads {:.0} mm/s",
                truth.commanded,
                truth.leads,
                truth.speed.as_mm_per_s()
            ))
        };
        let truths: Vec<String> = TRAINS.iter().filter_map(truth).collect();
        self.note(format!("really: {}", truths.join(", ")));
    }

    pub(super) fn fail(&mut self, kind: FailureKind, words: String) {
        self.note(format!("FAILED: {words}"));
        self.fate.failures.push(Failure { kind, words });
    }

    /// The calendar of the computer.
    fn calendar(&self) -> Timestamp {
        CALENDAR + (self.now() - Timestamp::ZERO)
    }

    fn session(&self, line: &dyn Link) -> anyhow::Result<OpenSession> {
        open_session(&self.address, line, self.stage.layout)
    }

    /// The line of a life, which its guardian has opened.
    fn open(
        &self,
        life: Rc<Life>,
        troubles: &[Planned],
        noise: Choice,
    ) -> anyhow::Result<WardLink<Pair<'l>>> {
        let cable = cable_to(self.fate.station)?;
        let line = FaultyLine::new(Rc::clone(&self.station), cable.clone(), &TRAINS, troubles, noise);
        let pieces = Choice::new(self.fate.seed.wrapping_add(self.fate.lives.into()));
        Ok(WardLink::over(Pair::new(line, life, pieces), cable)?)
    }

    /// Stops all trains that the previous life may have left running, as the program does first.
    fn stop_left_running(&mut self) -> anyhow::Result<()> {
        if !self.files.path.exists() {
            return Ok(());
        }
        let Some(unfinished) = Store::open(&self.files.path)?.unfinished_session()? else { return Ok(()) };
        let began = self.now();
        let life = Rc::new(Life::new(None));
        let mut line = self.open(life, &[], Choice::new(0))?;
        let mut opened = self.session(&line)?;
        recall_directions(opened.session.as_mut(), &Store::open(&self.files.path)?, [])?;
        let closing = stop_all(&mut line, opened, unfinished.trains);
        if !line.connection_mut().line.all_stopped() {
            // The end of a session takes its time; stops come first in it.
            self.fail(
                FailureKind::RanOn,
                format!("trains of the session before were not stopped at the start: {closing}"),
            );
        }
        let took = (self.now() - began).as_ms();
        self.note(format!("the next start took {took:.0} ms: {closing}"));
        Ok(())
    }

    /// Runs one life, and its guardian's actions afterwards.
    fn live(&mut self, planned: &PlannedLife) -> anyhow::Result<()> {
        self.stop_left_running()?;
        self.await_rest();
        self.check_turnouts();
        let incidents = self.station.borrow().world().incidents().len();
        self.fate.lives += 1;
        let life = Rc::new(Life::new(planned.ends.filter(|_| !planned.ends_in_farewell)));
        self.note(format!(
            "a life of {:.0} s begins, which ends by {:?}{}",
            planned.lasts.as_s(),
            planned.ends,
            if planned.ends_in_farewell { " of its farewell" } else { "" }
        ));
        let mut dispatcher = dispatcher_of(self.stage, self.station.borrow().world(), &TRAINS);
        let noise = Choice::new(self.choice.between(0.0, 1e15) as u64);
        let mut line = self.open(Rc::clone(&life), &planned.troubles, noise)?;
        let mut opened = self.session(&line)?;
        if self.files.path.exists() {
            recall_directions(opened.session.as_mut(), &Store::open(&self.files.path)?, TRAINS)?;
        }
        let calendar = self.calendar();
        let disk = FaultyDisk::begin(
            self.files.clone(),
            &TRAINS,
            Rc::clone(&life),
            &planned.troubles,
            planned.if_unkept,
            self.now(),
            calendar,
        )?;
        let disk = Rc::new(RefCell::new(disk));
        let mut recorder = SharedDisk(Rc::clone(&disk));
        let mut people = People::new(
            self.stage.layout,
            Rc::clone(&self.station),
            &TRAINS,
            &mut self.choice,
            Rc::clone(&life),
            Rc::clone(&disk),
            planned.lasts,
        );
        let mut runtime = Runtime::new(&mut line, opened, Some(&mut recorder), None);
        let ended = runtime.run(&mut dispatcher, &mut people);
        let mut died = self.station.borrow().now();
        disk.borrow_mut().close();
        if let Some(ends) = planned.ends.filter(|_| planned.ends_in_farewell) {
            life.ends_during_farewell(ends);
        }
        let was_over = life.is_over();
        // A living program stops its trains, whatever ended its loop.
        let closing = runtime.close();
        if !was_over && life.is_over() {
            died = self.station.borrow().now();
        }
        drop(runtime);
        let (seen, trouble) = (std::mem::take(&mut people.seen), people.trouble.take());
        drop(people);
        drop(recorder);
        let disk = Rc::into_inner(disk).context("a disk that is still in use")?.into_inner();
        let pair = line.connection_mut();
        self.fate.notes.extend(pair.line.notes.drain(..).chain(disk.sent()));
        self.count(seen);
        let ended = match ended {
            Ok(Ended::Finished) => "finished".to_owned(),
            Ok(ended) => ended.to_string(),
            Err(error) => format!("{error:#}"),
        };
        let (death, steps) = (life.death(), life.steps());
        self.note(format!("the loop ended after {steps} steps ({death:?}): {ended}; {closing}"));
        if let Some(trouble) = trouble {
            self.fail(FailureKind::NotKept, format!("the journal failed: {trouble}"));
        }
        self.check_incidents(incidents, &[pair.line.unreachable(), pair.without_guardian.clone()].concat());
        if let Some(wronged) = pair.wronged {
            self.fail(FailureKind::Wronged, wronged.to_owned());
        }
        self.bury(death, died, closing.is_complete(), pair, disk)
    }

    fn count(&mut self, mut seen: Seen) {
        self.fate.notes.append(&mut seen.notes);
        self.fate.arrivals += seen.arrivals;
        self.fate.alarms += seen.alarms;
        self.fate.grants += seen.grants;
        self.fate.intrusions += seen.intrusions.len() as u32;
        self.fate.stops += seen.stops;
        self.fate.times += seen.times;
        if let Some(at) = seen.stuck {
            self.fail(FailureKind::Stuck, format!("stuck without an alarm at {:.2} s", at.as_s()));
        }
    }

    /// Checks the incidents of a life. Those while no command reaches the station, and until trains have stopped after that, are
    /// counted apart: no program could have prevented them.
    fn check_incidents(&mut self, before: usize, unreachable: &[Spell]) {
        let incidents: Vec<_> =
            self.station.borrow().world().incidents().iter().skip(before).copied().collect();
        for incident in incidents {
            let is_helpless =
                |spell: &Spell| Spell { until: spell.until + BRAKES_WITHIN, ..*spell }.covers(incident.at);
            if unreachable.iter().any(is_helpless) {
                self.note(format!("out of reach: {:?} of {:?}", incident.kind, incident.train));
                self.fate.out_of_reach += 1;
                continue;
            }
            let words = format!("{:?} of {:?} at {:.2} s", incident.kind, incident.train, incident.at.as_s());
            self.fail(incident.kind.into(), words);
        }
    }

    /// The operator looks after the turnouts, as the program asks after a crash.
    fn check_turnouts(&mut self) {
        let mut station = self.station.borrow_mut();
        let laid = station.world_mut().lay_under_trains();
        let replaced = station.world_mut().replace_coils();
        drop(station);
        for turnout in laid {
            self.note(format!("a person lays turnout {turnout} for the train that stands across it"));
        }
        for turnout in replaced {
            self.note(format!("a person replaces the burnt coil of turnout {turnout}"));
        }
    }

    /// The operator waits for standstill before the next life begins, and sees only after a moment what a last stop, which may set a
    /// direction, has made of a train.
    fn await_rest(&mut self) {
        let mut station = self.station.borrow_mut();
        let (seen, until) = (station.now() + SEEN_AFTER, station.now() + TimeSpan::from_s(20.0));
        loop {
            let rests = |train: &TrainId| {
                station.world().truth().train(*train).is_none_or(|truth| truth.at_rest_since.is_some())
            };
            if station.now() >= seen && TRAINS.iter().all(rests) || station.now() >= until {
                return;
            }
            let next = station.now() + TimeSpan::from_ms(50);
            while station.now() < next {
                let _ = station.advance(next);
            }
        }
    }
}
