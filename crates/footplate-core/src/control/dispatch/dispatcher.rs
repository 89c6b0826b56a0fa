//! Sends trains to where they are asked to go, and grants each the track that it needs before it goes there.

use alloc::collections::{BTreeMap, BTreeSet, VecDeque};
use alloc::vec::Vec;

use crate::control::drive::{Driver, Order, OrderId, Refusal};
use crate::control::supervise::{LinkNews, Watchdog};
use crate::control::{Machine, Output};
use crate::event::Event;
use crate::ids::{SpeedStep, TrainId, TurnoutId};
use crate::model::MotionModel;
use crate::time::{TimeSpan, Timestamp};
use crate::track::Position;
use crate::tracking::WayPoint;
use crate::units::Length;

use super::blocks::Blocks;
use super::dispatched_train::{Asked, DispatchedTrain, State};
use super::journey::{Journey, TrainLengths};
use super::movement_authority::{ClearanceEnvelope, standing};
use super::parking::{PARKED, parking_places};
use super::reservation::Reservation;
use super::turnout_command::TurnoutCommand;
use crate::control::Notice;

/// How often it looks what can be done while something waits to be.
pub(super) const LOOK: TimeSpan = TimeSpan::from_ms(200);

/// Trains at rest that wait are looked at again after this long even if nothing has changed.
const AGAIN: TimeSpan = TimeSpan::from_s(1.0);

/// What follows from what at one moment is followed so far; the rest waits until the next look.
const MOST_ROUNDS: usize = 50;

/// Keeps trains apart, and sends them on their ways.
#[derive(Debug, Clone)]
pub struct Dispatcher {
    pub(super) watchdog: Watchdog,
    /// Trains that were in danger and wait to be let crawl.
    pub(super) crawlers: BTreeSet<TrainId>,
    pub(super) trains: BTreeMap<TrainId, DispatchedTrain>,
    /// How turnouts were set, and how often and when last since anything said that they lay otherwise.
    pub(super) commanded: BTreeMap<TurnoutId, TurnoutCommand>,
    /// Turnouts that were asked for and not told yet, for whom and since when.
    pub(super) throwing: BTreeMap<TurnoutId, (TrainId, Timestamp)>,
    pub(super) outputs: VecDeque<Output<Notice>>,
    /// Whether anything has changed since trains at rest were last looked at.
    pub(super) is_stirred: bool,
    /// How often trains were moved only to have other places to begin from.
    pub(super) shuffled: usize,
    /// When it last thought hard, and in vain, about who could make room for whom.
    pub(super) thought: Option<Timestamp>,
    /// How many thorough searches in a row found no move that helps.
    pub(super) searches_in_vain: u8,
    /// What is taken of a block is all of it; `None` where track is taken to the millimetre.
    blocks: Option<Blocks>,
    looks_at: Option<Timestamp>,
    /// When it last looked at trains at rest.
    arranged: Option<Timestamp>,
}

impl Dispatcher {
    /// Dispatches the trains of a driver. Turnouts are taken to lie as it says, and commanded again before they are used.
    #[must_use]
    pub fn new(now: Timestamp, driver: Driver) -> Self {
        Self::over(now, Watchdog::unwatched(driver, now))
    }

    /// The same with a [`Watchdog`] over the driver: while a train is in danger nobody sets out, and it is found and
    /// measured again once all others stand.
    #[must_use]
    pub fn watched(now: Timestamp, driver: Driver) -> Self {
        let mut watchdog = Watchdog::new(driver, now);
        watchdog.ask_before_crawling();
        Self::over(now, watchdog)
    }

    fn over(now: Timestamp, watchdog: Watchdog) -> Self {
        let layout = watchdog.driver().layout();
        let lies = |turnout| {
            Some((turnout, TurnoutCommand::remembered(now, watchdog.driver().turnouts().get(turnout)?)))
        };
        let commanded = layout.turnouts().filter_map(|(turnout, _)| lies(turnout)).collect();
        let ids: Vec<TrainId> = watchdog.driver().trains().collect();
        let mut dispatcher = Self {
            watchdog,
            crawlers: BTreeSet::new(),
            trains: BTreeMap::new(),
            commanded,
            throwing: BTreeMap::new(),
            outputs: VecDeque::new(),
            is_stirred: true,
            shuffled: 0,
            thought: None,
            searches_in_vain: 0,
            blocks: None,
            looks_at: None,
            arranged: None,
        };
        for id in ids {
            dispatcher.set_lengths(now, id, TrainLengths::LONG_LOCOMOTIVE);
        }
        dispatcher
    }

    /// Says how long a train is. Until then it is taken for a long locomotive.
    pub fn set_lengths(&mut self, now: Timestamp, train: TrainId, lengths: TrainLengths) {
        self.watchdog.driver_mut().set_reach(train, lengths.ahead(), lengths.behind());
        let known = self.trains.entry(train).or_insert_with(|| DispatchedTrain::new(train, lengths));
        known.lengths = lengths;
        let room = ClearanceEnvelope::of(lengths, PARKED, Length::ZERO);
        let places = parking_places(self.watchdog.driver().layout(), room);
        if let Some(known) = self.trains.get_mut(&train) {
            known.parking = places;
        }
        if self.trains.get(&train).is_some_and(DispatchedTrain::rests) {
            self.stand(now, train);
        }
    }

    /// Takes the track between contacts as a whole from now on, with all turnouts there, as block systems do. Without this,
    /// and better, trains take what they need to the millimetre.
    pub fn reserve_blocks(&mut self) {
        self.blocks = Some(Blocks::of(self.watchdog.driver().layout()));
    }

    /// Whether no other train holds any of what a train would take.
    pub(super) fn is_free_for(&self, id: TrainId, taken: &Reservation) -> bool {
        self.trains.values().all(|other| other.id == id || !other.held.meets(taken))
    }

    /// What is taken for a train that needs this.
    pub(super) fn reserved(&self, needed: Reservation) -> Reservation {
        match &self.blocks {
            Some(blocks) => blocks.around(self.watchdog.driver().layout(), &needed),
            None => needed,
        }
    }

    /// What drives the trains.
    #[must_use]
    pub const fn driver(&self) -> &Driver {
        self.watchdog.driver()
    }

    /// See [`Watchdog::is_interrupted`].
    #[must_use]
    pub fn is_interrupted(&self, now: Timestamp, train: TrainId) -> bool {
        self.watchdog.is_interrupted(now, train)
    }

    /// What a train holds: nobody else is let onto it.
    #[must_use]
    pub fn holds(&self, train: TrainId) -> Option<&Reservation> {
        self.trains.get(&train).map(|train| &train.held)
    }

    /// The destination of a train, as long as it has not come there.
    #[must_use]
    pub fn journey(&self, train: TrainId) -> Option<(OrderId, Journey)> {
        self.trains.get(&train)?.asked.map(|asked| (asked.order, asked.journey))
    }

    /// See [`Driver::set_model`].
    pub fn set_model(&mut self, model: MotionModel) {
        self.watchdog.set_model(model);
    }

    /// A person put a train there, or read off where it stands.
    pub fn place(&mut self, now: Timestamp, train: TrainId, at: WayPoint, uncertainty: Length) {
        self.watchdog.place(now, train, at, uncertainty);
        if let Some(known) = self.trains.get_mut(&train) {
            known.state = State::Resting;
            known.seen_since_turn = false;
            known.seen_since_start = true;
            known.course.clear();
            known.unobstructed_s = None;
            known.held = Reservation::empty();
        }
        self.stand(now, train);
    }

    /// Sends a train somewhere, as soon as there is a way. What it was asked for before ends.
    ///
    /// # Errors
    /// Why it can never go there.
    pub fn go(&mut self, now: Timestamp, train: TrainId, journey: Journey) -> Result<OrderId, Refusal> {
        let layout = self.watchdog.driver().layout();
        let place =
            layout.locate(journey.target, self.watchdog.driver().turnouts()).map_err(Refusal::Place)?;
        let Some(known) = self.trains.get(&train) else { return Err(Refusal::UnknownTrain { train }) };
        let is_nowhere = |known: &DispatchedTrain| {
            known.held.is_empty() && self.watchdog.driver().locate(known.id, now).is_none()
        };
        if is_nowhere(known) {
            return Err(Refusal::Lost { train });
        }
        if let Some(other) = self.trains.values().find(|other| is_nowhere(other)) {
            return Err(Refusal::OtherNowhere { train, other: other.id });
        }
        self.set_unknown_turnouts(now)?;
        self.give_back(now, train);
        let order = self.watchdog.driver_mut().number();
        if let Some(known) = self.trains.get_mut(&train) {
            known.asked = Some(Asked { order, journey, place, since: now, queues: now });
            known.waits_said = false;
            known.unobstructed_s = None;
        }
        self.is_stirred = true;
        self.settle(now);
        Ok(order)
    }

    /// A person takes the power from the track, or gives it back; see [`Watchdog::switch_power`].
    pub fn switch_power(&mut self, now: Timestamp, on: bool) {
        self.watchdog.switch_power(now, on);
        self.settle(now);
    }

    /// What is heard of the station's line; see [`Watchdog::handle_link`].
    pub fn handle_link(&mut self, now: Timestamp, news: LinkNews) {
        self.watchdog.handle_link(now, news);
        self.settle(now);
    }

    /// A train is not wanted at its destination any more. What it is granted it still runs.
    pub fn call_off(&mut self, now: Timestamp, train: TrainId) {
        if let Some(known) = self.trains.get_mut(&train) {
            known.asked = None;
        }
        self.settle(now);
    }

    /// Passes an order on to the driver. A turnout that a train was granted is thrown for nobody else; ahead of one that is
    /// driven by hand people throw them. No train is driven beyond what it holds: what lies ahead of it is taken as far as
    /// it is free, as the turnouts lie.
    ///
    /// # Errors
    /// As [`Driver::order`], and if the turnout is held.
    pub fn order(&mut self, now: Timestamp, order: Order) -> Result<OrderId, Refusal> {
        if let Order::Turnout { turnout, .. } = order
            && let Some(holder) = self.trains.values().find(|train| train.keeps(turnout))
        {
            return Err(Refusal::TurnoutOccupied { turnout, train: holder.id });
        }
        if let Some(train) = order.train() {
            self.take_over(now, train)?;
        }
        let taken = self.watchdog.order(now, order);
        if let (Order::Reverse { train, .. }, Ok(_)) = (order, &taken) {
            self.note_turned(train);
        }
        self.settle(now);
        taken
    }

    /// The room that a train needs, with what is not known of its place now.
    pub(super) fn room(&self, now: Timestamp, train: &DispatchedTrain) -> ClearanceEnvelope {
        let located = self.watchdog.driver().locate(train.id, now);
        let uncertainty = located.map_or(Length::ZERO, |located| located.uncertainty);
        ClearanceEnvelope::of(train.lengths, uncertainty, self.overrun(train.id, uncertainty))
    }

    /// What a train takes that has just come to rest at a known place: itself, and turnouts that decide where it is.
    pub(super) fn stand(&mut self, now: Timestamp, id: TrainId) {
        self.free_anchors(now, id);
        let Some(train) = self.trains.get(&id) else { return };
        let Some(place) = self.watchdog.driver().position(id, now) else { return };
        let room = self.room(now, train);
        let layout = self.watchdog.driver().layout();
        let mut held =
            self.reserved(standing(layout, self.watchdog.driver().turnouts(), place, &train.came, room));
        self.take_anchors(now, id, place, &mut held);
        // What is another's is not taken for a doubt that has grown: the train is within what it held.
        let is_free = self.is_free_for(id, &held);
        if let Some(train) = self.trains.get_mut(&id).filter(|train| is_free || train.held.is_empty()) {
            train.held = held;
            train.kept = Reservation::empty();
        }
        self.is_stirred = true;
    }

    /// A train is counted from a contact behind it: turnouts in between decide where it is, as far as is known, and are
    /// not thrown.
    pub(super) fn take_anchors(&self, now: Timestamp, id: TrainId, place: Position, held: &mut Reservation) {
        let layout = self.watchdog.driver().layout();
        // What was asked for it will be told, whatever it is asked to do since.
        let asked_for =
            self.throwing.iter().filter(|(_, (train, _))| *train == id).map(|(turnout, _)| *turnout);
        let asked_for = asked_for.filter(|turnout| self.is_being_thrown(now, *turnout));
        let anchors = self.anchors(now, id, place).into_iter();
        anchors.chain(asked_for).for_each(|turnout| held.take_turnout(layout, turnout));
    }

    /// A train at rest that was seen needs no turnouts behind it but the one whose leg it stands on.
    pub(super) fn free_anchors(&mut self, now: Timestamp, id: TrainId) {
        let Some(place) = self.watchdog.driver().position(id, now) else { return };
        let own = self.watchdog.driver().layout().needs_of(place.edge).filter(|need| need.facing).count();
        if self.watchdog.driver().missed_sensor(id, now).is_none() && self.anchors(now, id, place).len() > own
        {
            self.watchdog.count_from_behind(now, id);
        }
    }

    /// The turnouts from whose toes the way leads on to a train at a place, from where it is counted.
    pub(super) fn anchors(&self, now: Timestamp, id: TrainId, place: Position) -> BTreeSet<TurnoutId> {
        let layout = self.watchdog.driver().layout();
        let mut anchors = BTreeSet::new();
        let Some(mut node) = self.watchdog.driver().locate(id, now).map(|located| located.at.node) else {
            return anchors;
        };
        for _ in 0..layout.edges().len() {
            let ahead = super::path::edge_from(layout, self.watchdog.driver().turnouts(), node);
            let Some((edge, known)) = ahead.and_then(|edge| Some((edge, layout.edge(edge)?))) else { break };
            anchors.extend(layout.needs_of(edge).filter(|need| need.facing).map(|need| need.turnout));
            if edge == place.edge {
                break;
            }
            node = known.to;
        }
        anchors
    }

    pub(super) fn say(&mut self, notice: Notice) {
        self.outputs.push_back(Output::Notice(notice));
    }

    /// Hears what the driver has to say, and does what follows, until there is nothing more.
    pub(super) fn settle(&mut self, now: Timestamp) {
        if self.arranged.is_none_or(|last| now - last >= AGAIN) {
            self.is_stirred |= self.trains.values().any(|train| train.rests() && train.asked.is_some());
        }
        for _ in 0..MOST_ROUNDS {
            self.follow(now);
            while let Some(output) = self.watchdog.poll_output() {
                match output {
                    Output::Command(command) => self.outputs.push_back(Output::Command(command)),
                    Output::HoldLine(until) => self.outputs.push_back(Output::HoldLine(until)),
                    Output::Watch(sensor) => self.outputs.push_back(Output::Watch(sensor)),
                    // A journey is resumed by the dispatcher.
                    Output::Notice(Notice::Cancelled { train, .. }) if self.journey(train).is_some() => {}
                    Output::Notice(notice) => {
                        self.say(notice.clone());
                        self.hear(now, &notice);
                    }
                }
            }
            self.go_on(now);
            if self.let_crawl(now) {
                continue;
            }
            if core::mem::take(&mut self.is_stirred) && !self.watchdog.has_danger() {
                self.arranged = Some(now);
                self.arrange(now);
                continue;
            }
            break;
        }
        let waits = self
            .trains
            .values()
            .any(|train| !matches!(train.state, State::Resting | State::Lost) || train.asked.is_some());
        self.looks_at = waits.then_some(now + LOOK);
    }

    /// Takes note of how trains came to where they are.
    fn follow(&mut self, now: Timestamp) {
        let layout = self.watchdog.driver().layout();
        for train in self.trains.values_mut() {
            if let Some(place) = self.watchdog.driver().position(train.id, now) {
                train.came.follow(layout, place);
            }
        }
    }

    /// Tells a train to stop at once.
    pub(super) fn halt(&mut self, now: Timestamp, id: TrainId) {
        let _ = self.watchdog.order(now, Order::Speed { train: id, step: SpeedStep::STAND });
        self.gives_up(id);
    }

    /// A train has been commanded to stop: what it holds it keeps until it stands.
    pub(super) fn gives_up(&mut self, id: TrainId) {
        if let Some(train) = self.trains.get_mut(&id) {
            let confirmed = matches!(train.state, State::Running { confirmed: true, .. });
            train.course.clear();
            train.kept = train.held.clone();
            train.state = State::Halting { confirmed, strayed: false };
        }
    }
}

impl Machine for Dispatcher {
    type Notice = Notice;

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        self.watchdog.handle_event(now, event);
        self.settle(now);
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.watchdog.handle_timeout(now);
        self.settle(now);
    }

    fn poll_output(&mut self) -> Option<Output<Notice>> {
        self.outputs.pop_front()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        [self.watchdog.next_timeout(), self.looks_at].into_iter().flatten().min()
    }
}
