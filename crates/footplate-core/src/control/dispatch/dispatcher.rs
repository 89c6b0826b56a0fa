//! The dispatcher: sends trains to their destinations, each on track that is reserved for it alone.

use alloc::collections::{BTreeMap, BTreeSet, VecDeque};
use alloc::vec::Vec;

use crate::control::drive::{Driver, Order, OrderId, Refusal};
use crate::control::supervise::{LinkNews, Watchdog};
use crate::control::{Machine, Output};
use crate::event::Event;
use crate::ids::{FunctionNumber, SpeedStep, TrainId, TurnoutId};
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

/// How often the dispatcher acts while a train waits or runs.
pub(super) const LOOK: TimeSpan = TimeSpan::from_ms(200);

/// Waiting trains are examined again after this, even if nothing has changed.
const AGAIN: TimeSpan = TimeSpan::from_s(1.0);

/// The most rounds of consequences at one moment; the rest waits for the next look.
const MOST_ROUNDS: usize = 50;

/// Keeps trains apart and sends them to their destinations.
#[derive(Debug, Clone)]
pub struct Dispatcher {
    pub(super) watchdog: Watchdog,
    /// Trains in danger that wait for clearance to creep.
    pub(super) crawlers: BTreeSet<TrainId>,
    pub(super) trains: BTreeMap<TrainId, DispatchedTrain>,
    /// How each turnout was set, how often, and when last, since a train showed that it lay otherwise.
    pub(super) commanded: BTreeMap<TurnoutId, TurnoutCommand>,
    /// Turnouts whose command has not left yet, with the train and the time of the request.
    pub(super) throwing: BTreeMap<TurnoutId, (TrainId, Timestamp)>,
    pub(super) outputs: VecDeque<Output<Notice>>,
    /// Whether anything has changed since trains at rest were last examined.
    pub(super) is_stirred: bool,
    /// How often a train was moved only to change the places that a search begins from.
    pub(super) shuffled: usize,
    /// How many thorough searches for moves there were: each waiting train has its turn.
    pub(super) searched: usize,
    /// When the last thorough search for moves failed.
    pub(super) thought: Option<Timestamp>,
    /// How many thorough searches in a row found no move that helps.
    pub(super) searches_in_vain: u8,
    /// The blocks that are reserved as a whole; `None` where track is reserved to the millimetre.
    blocks: Option<Blocks>,
    looks_at: Option<Timestamp>,
    /// When trains at rest were last examined.
    arranged: Option<Timestamp>,
}

impl Dispatcher {
    /// Dispatches the trains of a driver. Turnouts are taken to lie as it says, and commanded again before they are used.
    #[must_use]
    pub fn new(now: Timestamp, driver: Driver) -> Self {
        Self::over(now, Watchdog::unwatched(driver, now))
    }

    /// The same with a [`Watchdog`] over the driver: while a train is in danger no other sets out, and it is located and
    /// measured again once all others are at rest.
    #[must_use]
    pub fn watched(now: Timestamp, driver: Driver) -> Self {
        let mut watchdog = Watchdog::new(driver, now);
        watchdog.ask_before_creeping();
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
            searched: 0,
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

    /// Sets the lengths of a train; without them it counts as a long locomotive.
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

    /// Reserves the track between sensors as a whole from now on, with all turnouts there, as block systems do. Without this
    /// trains reserve what they need to the millimetre, which is better.
    pub fn reserve_blocks(&mut self) {
        self.blocks = Some(Blocks::of(self.watchdog.driver().layout()));
    }

    /// Whether no other train has reserved any of this.
    pub(super) fn is_free_for(&self, id: TrainId, taken: &Reservation) -> bool {
        self.trains.values().all(|other| other.id == id || !other.held.meets(taken))
    }

    /// The reservation for a train that needs this: whole blocks, where blocks are reserved.
    pub(super) fn reserved(&self, needed: Reservation) -> Reservation {
        match &self.blocks {
            Some(blocks) => blocks.around(self.watchdog.driver().layout(), &needed),
            None => needed,
        }
    }

    /// The driver of the trains.
    #[must_use]
    pub const fn driver(&self) -> &Driver {
        self.watchdog.driver()
    }

    /// See [`Watchdog::is_interrupted`].
    #[must_use]
    pub fn is_interrupted(&self, now: Timestamp, train: TrainId) -> bool {
        self.watchdog.is_interrupted(now, train)
    }

    /// The reservation of a train: no other train may enter it.
    #[must_use]
    pub fn holds(&self, train: TrainId) -> Option<&Reservation> {
        self.trains.get(&train).map(|train| &train.held)
    }

    /// The journey of a train that has not ended, with its order.
    #[must_use]
    pub fn journey(&self, train: TrainId) -> Option<(OrderId, Journey)> {
        self.trains.get(&train)?.asked.map(|asked| (asked.order, asked.journey))
    }

    /// See [`Driver::set_model`].
    pub fn set_model(&mut self, model: MotionModel) {
        self.watchdog.set_model(model);
    }

    /// A person put a train there, or read its place off.
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

    /// Sends a train to a place as soon as a path is free. Its journey so far ends.
    ///
    /// # Errors
    /// Why it cannot go there.
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

    /// A person switches the track power off or on; see [`Watchdog::switch_power`].
    pub fn switch_power(&mut self, now: Timestamp, on: bool) {
        self.watchdog.switch_power(now, on);
        self.settle(now);
    }

    /// Switches a function of a train; see [`Watchdog::switch_function`].
    pub fn switch_function(&mut self, now: Timestamp, train: TrainId, function: FunctionNumber, on: bool) {
        self.watchdog.switch_function(train, function, on);
        self.settle(now);
    }

    /// Takes news of the link; see [`Watchdog::handle_link`].
    pub fn handle_link(&mut self, now: Timestamp, news: LinkNews) {
        self.watchdog.handle_link(now, news);
        self.settle(now);
    }

    /// Cancels the journey of a train. It still runs to its end of authority.
    pub fn call_off(&mut self, now: Timestamp, train: TrainId) {
        if let Some(known) = self.trains.get_mut(&train) {
            known.asked = None;
        }
        self.settle(now);
    }

    /// Passes an order on to the driver. A turnout reserved for a train is refused, except ahead of one that is driven by hand.
    /// No train runs beyond its reservation: the track ahead of it is reserved as far as it is free, as the turnouts lie.
    ///
    /// # Errors
    /// As [`Driver::order`], and if the turnout is reserved.
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

    /// The track that a train needs around it, with the present uncertainty of its place.
    pub(super) fn room(&self, now: Timestamp, train: &DispatchedTrain) -> ClearanceEnvelope {
        let located = self.watchdog.driver().locate(train.id, now);
        let uncertainty = located.map_or(Length::ZERO, |located| located.uncertainty);
        ClearanceEnvelope::of(train.lengths, uncertainty, self.overrun(train.id, uncertainty))
    }

    /// Reserves the track under a train at rest at a known place, and the turnouts over which that is counted.
    pub(super) fn stand(&mut self, now: Timestamp, id: TrainId) {
        self.free_anchors(now, id);
        let Some(train) = self.trains.get(&id) else { return };
        let Some(place) = self.watchdog.driver().position(id, now) else { return };
        let room = self.room(now, train);
        let layout = self.watchdog.driver().layout();
        let mut held =
            self.reserved(standing(layout, self.watchdog.driver().turnouts(), place, &train.came, room));
        self.take_anchors(now, id, place, &mut held);
        // A grown uncertainty takes no track of another train: this one is within what it had reserved.
        let is_free = self.is_free_for(id, &held);
        if let Some(train) = self.trains.get_mut(&id).filter(|train| is_free || train.held.is_empty()) {
            train.held = held;
            train.kept = Reservation::empty();
        }
        self.is_stirred = true;
    }

    /// The place of a train is counted from a node behind it: turnouts in between decide where it is, and are not thrown.
    pub(super) fn take_anchors(&self, now: Timestamp, id: TrainId, place: Position, held: &mut Reservation) {
        let layout = self.watchdog.driver().layout();
        // Turnouts already requested for it will be thrown, whatever its orders are since.
        let asked_for =
            self.throwing.iter().filter(|(_, (train, _))| *train == id).map(|(turnout, _)| *turnout);
        let asked_for = asked_for.filter(|turnout| self.is_being_thrown(now, *turnout));
        let anchors = self.anchors(now, id, place).into_iter();
        anchors.chain(asked_for).for_each(|turnout| held.take_turnout(layout, turnout));
    }

    /// Releases the turnouts behind a train at rest that was seen, but for the one whose leg it is on.
    pub(super) fn free_anchors(&mut self, now: Timestamp, id: TrainId) {
        let Some(place) = self.watchdog.driver().position(id, now) else { return };
        let own = self.watchdog.driver().layout().needs_of(place.edge).filter(|need| need.facing).count();
        if self.watchdog.driver().missed_sensor(id, now).is_none() && self.anchors(now, id, place).len() > own
        {
            self.watchdog.count_from_behind(now, id);
        }
    }

    /// The turnouts met at their toes on the path to a place, from the node that the train is counted from.
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

    /// Takes all notices of the watchdog, and acts on them until nothing changes any more.
    pub(super) fn settle(&mut self, now: Timestamp) {
        if self.arranged.is_none_or(|last| now - last >= AGAIN) {
            self.is_stirred |= self.trains.values().any(|train| train.rests() && train.asked.is_some());
        }
        for _ in 0..MOST_ROUNDS {
            self.follow(now);
            while let Some(output) = self.watchdog.poll_output() {
                match output {
                    // A journey is resumed by the dispatcher.
                    Output::Notice(Notice::Cancelled { train, .. }) if self.journey(train).is_some() => {}
                    Output::Notice(notice) => {
                        self.say(notice.clone());
                        self.hear(now, &notice);
                    }
                    for_the_line => self.outputs.push_back(for_the_line),
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

    /// Records the path by which trains came to where they are.
    fn follow(&mut self, now: Timestamp) {
        let layout = self.watchdog.driver().layout();
        for train in self.trains.values_mut() {
            if let Some(place) = self.watchdog.driver().position(train.id, now) {
                train.came.follow(layout, place);
            }
        }
    }

    /// Commands a train to stop at once.
    pub(super) fn halt(&mut self, now: Timestamp, id: TrainId) {
        let _ = self.watchdog.order(now, Order::Speed { train: id, step: SpeedStep::STAND });
        self.gives_up(id);
    }

    /// A train has been commanded to stop: it keeps its reservation until it is at rest.
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
