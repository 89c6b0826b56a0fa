//! The operator, who sends trains to places and helps them, and the checks of every step.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use footplate_core::control::{Dispatcher, Journey, LinkNews, Notice, Reservation};
use footplate_core::track::{Landmark, Layout};
use footplate_core::{Command, Length, NodeId, TimeSpan, Timestamp, TrainId, TurnoutId};
use footplate_eval::seeds::Choice;
use footplate_eval::traffic::{HAND, is_on_reserved_track, place_by_hand};
use footplate_store::Direction;
use footplate_wire::{CommandError, LinkNotice};

use super::disk::FaultyDisk;
use super::life::Life;
use super::line::SharedStation;
use super::promises::Promises;
use crate::runtime::{Attendant, Recorder, Wish};

/// How often true positions are compared with reservations.
const LOOK: TimeSpan = TimeSpan::from_ms(50);
/// The operator helps a train, or switches the power on, this long after the alarm.
const HELP_AFTER: TimeSpan = TimeSpan::from_ms(15_000);
/// The program is stuck if all trains are at rest for this long, one has a journey, and no alarm is active. Twice the time
/// that the dispatcher takes to resolve a deadlock.
const STUCK_AFTER: TimeSpan = TimeSpan::from_ms(120_000);
/// The operator enters the position of a train at the earliest this long after it was commanded to reverse: before that its decoder has
/// not heard the command, and the operator has not seen its effect.
pub(super) const SEEN_AFTER: TimeSpan = TimeSpan::from_ms(1_000);
/// A turnout that was commanded lies as commanded after this time.
const MOVES_WITHIN: TimeSpan = TimeSpan::from_ms(1_000);
const TRIES: usize = 100;

/// Violations and counts.
#[derive(Debug, Clone, Default)]
pub(super) struct Seen {
    pub(super) arrivals: u32,
    pub(super) alarms: u32,
    /// Entries of trains into track that was not reserved for them.
    pub(super) intrusions: Vec<(Timestamp, TrainId)>,
    pub(super) grants: u32,
    /// Places of rest, and times of reports, that were promised with 95 %.
    pub(super) stops: Promises,
    pub(super) times: Promises,
    /// When the program was stuck without an alarm.
    pub(super) stuck: Option<Timestamp>,
    pub(super) notes: Vec<(Timestamp, String)>,
}

/// The operator of the railway in one life of the program.
pub(super) struct People<'p, 'l> {
    pub(super) layout: &'l Layout,
    pub(super) station: SharedStation<'l>,
    pub(super) trains: &'p [TrainId],
    pub(super) choice: &'p mut Choice,
    pub(super) life: Rc<Life>,
    pub(super) disk: Rc<RefCell<FaultyDisk>>,
    pub(super) ends: Timestamp,
    pub(super) seen: Seen,
    is_inside: BTreeMap<TrainId, bool>,
    /// Turnouts that lie otherwise than the program assumes, since when, and whether that was noted.
    misjudged: BTreeMap<TurnoutId, (Timestamp, bool)>,
    moves: BTreeMap<TrainId, bool>,
    /// Whether each train has reversed, by the program's commands, and since when.
    reversed: BTreeMap<TrainId, (bool, Timestamp)>,
    /// Trains with an active alarm, and since when.
    troubled: BTreeMap<TrainId, Timestamp>,
    without_power: Option<Timestamp>,
    is_silent: bool,
    moved: Timestamp,
    looked: Timestamp,
    has_sent: bool,
    incidents: usize,
    news: Vec<LinkNews>,
    pub(super) trouble: Option<String>,
}

impl<'p, 'l> People<'p, 'l> {
    pub(super) fn new(
        layout: &'l Layout,
        station: SharedStation<'l>,
        trains: &'p [TrainId],
        choice: &'p mut Choice,
        life: Rc<Life>,
        disk: Rc<RefCell<FaultyDisk>>,
        lasts: TimeSpan,
    ) -> Self {
        let now = station.borrow().now();
        let incidents = station.borrow().world().incidents().len();
        Self {
            layout,
            station,
            trains,
            choice,
            life,
            disk,
            ends: now + lasts,
            seen: Seen::default(),
            is_inside: BTreeMap::new(),
            misjudged: BTreeMap::new(),
            moves: BTreeMap::new(),
            reversed: BTreeMap::new(),
            troubled: BTreeMap::new(),
            without_power: None,
            is_silent: false,
            moved: now,
            looked: now,
            has_sent: false,
            incidents,
            news: Vec::new(),
            trouble: None,
        }
    }

    fn tell(&mut self, now: Timestamp, words: String) {
        self.seen.notes.push((now, words));
    }

    fn alarm(&mut self, now: Timestamp, train: TrainId) {
        self.seen.alarms += 1;
        self.troubled.entry(train).or_insert(now);
    }

    fn send(&mut self, now: Timestamp, dispatcher: &mut Dispatcher, train: TrainId) {
        let sensors: Vec<NodeId> = self.layout.sensors().map(|(_, node)| node).collect();
        for _ in 0..TRIES {
            let Some(node) = self.choice.of(&sensors).copied() else { return };
            let length = self.layout.outgoing(node).edges().next().and_then(|edge| self.layout.edge(edge));
            let longest = length.map_or(0.0, |edge| edge.length.as_mm());
            let offset = Length::from_mm(self.choice.between(0.0, longest));
            if dispatcher.go(now, train, Journey::to(Landmark { node, offset })).is_ok() {
                return;
            }
        }
    }

    fn look(&mut self, now: Timestamp, dispatcher: &mut Dispatcher) {
        self.looked = now;
        let station = Rc::clone(&self.station);
        let station = station.borrow();
        let world = station.world();
        for (turnout, _) in self.layout.turnouts() {
            let (lies, assumed) = (world.lies(turnout), dispatcher.driver().turnouts().get(turnout));
            if assumed.is_none() || lies == assumed {
                self.misjudged.remove(&turnout);
                continue;
            }
            let (since, is_noted) = self.misjudged.entry(turnout).or_insert((now, false));
            if now - *since >= MOVES_WITHIN && !std::mem::replace(is_noted, true) {
                self.tell(
                    now,
                    format!("turnout {turnout} lies {lies:?}, and the program assumes {assumed:?}"),
                );
            }
        }
        for train in self.trains {
            let is_inside = is_on_reserved_track(self.layout, world, dispatcher, *train);
            if self.is_inside.insert(*train, is_inside) == Some(true) && !is_inside {
                self.seen.intrusions.push((now, *train));
                let held = dispatcher.reservation(*train);
                let turnouts = held.into_iter().flat_map(Reservation::turnouts);
                let legs: Vec<_> = turnouts.map(|turnout| (turnout, world.lies(turnout))).collect();
                let at = place_by_hand(self.layout, world, *train);
                self.tell(
                    now,
                    format!("train {train} is on track that is not reserved for it: {at:?}; its turnouts lie {legs:?}"),
                );
            }
            let moves = world.truth().train(*train).is_some_and(|truth| truth.at_rest_since.is_none());
            if moves {
                self.moved = now;
            }
            if self.moves.insert(*train, moves) != Some(moves) {
                self.tell(
                    now,
                    format!(
                        "really: train {train} {} at {:?}; estimated at {:?}",
                        if moves { "moves" } else { "is at rest" },
                        place_by_hand(self.layout, world, *train),
                        dispatcher.driver().locate(*train, now).map(|located| located.at),
                    ),
                );
            }
            let is_reversed = dispatcher.driver().is_reversed(*train);
            let (before, since) = self.reversed.entry(*train).or_insert((is_reversed, now));
            if *before != is_reversed {
                (*before, *since) = (is_reversed, now);
            }
            let is_seen = now - *since >= SEEN_AFTER;
            // The operator enters the true position.
            if is_seen && self.troubled.get(train).is_some_and(|since| now - *since >= HELP_AFTER) {
                let stands = world.truth().train(*train).is_some_and(|truth| truth.at_rest_since.is_some());
                if stands && let Some(at) = place_by_hand(self.layout, world, *train) {
                    self.troubled.remove(train);
                    dispatcher.place(now, *train, at, HAND);
                    self.tell(now, format!("a person says where train {train} is"));
                }
            }
        }
        if self.without_power.is_some_and(|since| now - since >= HELP_AFTER) {
            self.without_power = None;
            dispatcher.switch_power(now, true);
            self.tell(now, "a person switches the power on".to_owned());
        }
        let wants = self.trains.iter().any(|train| dispatcher.journey(*train).is_some());
        let is_explained = !self.troubled.is_empty() || self.without_power.is_some() || self.is_silent;
        if is_explained || !wants {
            self.moved = now;
        }
        if now - self.moved >= STUCK_AFTER && self.seen.stuck.is_none() {
            self.seen.stuck = Some(now);
        }
    }
}

impl Attendant<Dispatcher> for People<'_, '_> {
    fn hear(&mut self, now: Timestamp, notice: Notice) {
        match &notice {
            Notice::Passed { train, passed, .. } => {
                self.tell(now, format!("train {train} passed sensor {}", passed.sensor));
            }
            Notice::Planned(_) | Notice::Waits { .. } => {}
            _ => self.tell(now, format!("{notice:?}")),
        }
        match notice {
            Notice::Arrived { .. } => {
                self.seen.arrivals += 1;
                self.has_sent = false;
            }
            Notice::RouteSet { .. } => self.seen.grants += 1,
            Notice::Done(finished) => {
                self.seen.stops.judge_stop(self.layout, self.station.borrow().world(), &finished);
            }
            Notice::Passed { passed, .. } => self.seen.times.judge_time(&passed),
            Notice::ReservedAsUnknown { train }
            | Notice::NeedsOperator { train, .. }
            | Notice::AsksToCreep { train }
            | Notice::Deadlocked { train }
            | Notice::Lost { train } => self.alarm(now, train),
            Notice::PowerOff { .. } | Notice::UnauthorisedMovement { .. } => {
                self.seen.alarms += 1;
                self.without_power.get_or_insert(now);
            }
            Notice::Recovered { train, .. } => {
                self.troubled.remove(&train);
            }
            Notice::GivenUp { .. } => self.has_sent = false,
            _ => {}
        }
    }

    fn hear_of_line(&mut self, now: Timestamp, notice: &LinkNotice) {
        self.tell(now, format!("line: {notice}"));
        match notice {
            LinkNotice::Silent { .. } | LinkNotice::NotReady { .. } => self.is_silent = true,
            LinkNotice::Answers => self.is_silent = false,
            LinkNotice::PowerLost | LinkNotice::Restarted => {
                self.without_power.get_or_insert(now);
            }
            _ => {}
        }
        self.seen.alarms += u32::from(notice.news().is_some());
        self.news.extend(notice.news());
    }

    fn hear_of_refusal(&mut self, now: Timestamp, command: Command, error: CommandError) {
        self.tell(now, format!("{command:?} was refused: {error}"));
    }

    fn read(&mut self, words: &str) {
        let now = self.station.borrow().now();
        self.tell(now, words.to_owned());
    }

    fn attend(&mut self, now: Timestamp, dispatcher: &mut Dispatcher) -> Wish {
        if !self.life.step() || self.life.is_orphan() {
            return Wish::Finish;
        }
        for news in self.news.drain(..) {
            dispatcher.handle_link(now, news);
        }
        if let Err(error) = self.disk.borrow_mut().advance(now) {
            self.trouble = Some(format!("{error:#}"));
            return Wish::Finish;
        }
        if !std::mem::replace(&mut self.has_sent, true) {
            for train in self.trains {
                if dispatcher.journey(*train).is_none() {
                    self.send(now, dispatcher, *train);
                }
            }
        }
        if now - self.looked >= LOOK {
            self.look(now, dispatcher);
        }
        let has_incident = self.station.borrow().world().incidents().len() > self.incidents;
        if now >= self.ends || has_incident { Wish::Finish } else { Wish::GoOn }
    }
}

/// The disk, shared by the recording loop and the operator.
pub(super) struct SharedDisk(pub(super) Rc<RefCell<FaultyDisk>>);

impl Recorder for SharedDisk {
    fn record(&mut self, events: &[footplate_core::Event]) -> anyhow::Result<()> {
        self.0.borrow_mut().record(events)
    }

    fn record_direction(&mut self, direction: Direction) {
        self.0.borrow_mut().record_direction(direction);
    }
}
