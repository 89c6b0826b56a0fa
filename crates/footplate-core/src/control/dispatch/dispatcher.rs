//! The dispatcher: sends trains to their destinations, each on track that is reserved for it alone.

use alloc::collections::{BTreeMap, BTreeSet, VecDeque};
use alloc::vec::Vec;

use crate::control::drive::{Driver, Order, OrderId, Refusal};
use crate::control::supervise::{LinkNews, Remeasured, Watchdog};
use crate::control::{Machine, Output};
use crate::event::Event;
use crate::ids::{FunctionNumber, TrainId, TurnoutId};
use crate::model::MotionModel;
use crate::time::{TimeSpan, Timestamp};
use crate::track::Position;
use crate::tracking::PathPoint;
use crate::units::Length;

use super::dispatched_train::{Assignment, DispatchedTrain, Journey, State};
use super::movement_authority::{ClearanceEnvelope, PARKED, TrainLengths, parking_places};
use super::path::OccupiedPath;
use super::reservation::{Blocks, Reservation};
use super::route_setting::TurnoutCommand;
use crate::control::Notice;

/// How often the dispatcher acts while a train waits or runs.
pub(super) const ACT_EVERY: TimeSpan = TimeSpan::from_ms(200);

/// Waiting trains are examined again after this time, even if nothing has changed.
const RECONSIDER_AFTER: TimeSpan = TimeSpan::from_s(1.0);

/// How long a script waits, and how long an interrupted order is tried again, unless that is set: a creeping train completes
/// one round of a layout within it.
pub const WAIT_LIMIT: TimeSpan = TimeSpan::from_s(600.0);

/// The most rounds of consequences at one time; the rest waits for the next call.
const MAX_ROUNDS: usize = 50;

/// Keeps trains apart and sends them to their destinations.
#[derive(Debug, Clone)]
pub struct Dispatcher {
    pub(super) watchdog: Watchdog,
    /// Trains in danger that wait for clearance to creep.
    pub(super) awaiting_creep: BTreeSet<TrainId>,
    pub(super) trains: BTreeMap<TrainId, DispatchedTrain>,
    /// The last commands to each turnout.
    pub(super) commanded: BTreeMap<TurnoutId, TurnoutCommand>,
    /// Turnouts whose command was not sent yet, with the train and the time of the request.
    pub(super) throwing: BTreeMap<TurnoutId, (TrainId, Timestamp)>,
    pub(super) outputs: VecDeque<Output<Notice>>,
    /// How long an interrupted order is tried again.
    pub(super) wait_limit: TimeSpan,
    /// Whether anything has changed since trains at rest were last examined.
    pub(super) has_changed: bool,
    /// How often a train was moved only to give the next search other places to begin from.
    pub(super) shuffled: usize,
    /// The number of thorough searches for moves so far: waiting trains take turns.
    pub(super) searches: usize,
    /// When the last thorough search for moves failed.
    pub(super) last_failed_search: Option<Timestamp>,
    /// The number of thorough searches in a row that failed.
    pub(super) failed_searches: u8,
    /// The blocks that are reserved as a whole; `None` if track is reserved to the millimetre.
    blocks: Option<Blocks>,
    next_check: Option<Timestamp>,
    /// When trains at rest were last examined.
    dispatched_at: Option<Timestamp>,
}

impl Dispatcher {
    /// Dispatches the trains of a driver. Its turnout positions are assumed, and commanded again before they are used.
    pub fn new(now: Timestamp, driver: Driver) -> Self {
        Self::over(now, Watchdog::unwatched(driver, now))
    }

    /// The same with a [`Watchdog`] over the driver: while a train is in danger no other starts, and it is located and
    /// measured again once all others are at rest.
    pub fn watched(now: Timestamp, driver: Driver) -> Self {
        let mut watchdog = Watchdog::new(driver, now);
        watchdog.ask_before_creeping();
        Self::over(now, watchdog)
    }

    fn over(now: Timestamp, watchdog: Watchdog) -> Self {
        let layout = watchdog.driver().layout();
        let is_set = |turnout| {
            Some((turnout, TurnoutCommand::remembered(now, watchdog.driver().turnouts().get(turnout)?)))
        };
        let commanded = layout.turnouts().filter_map(|(turnout, _)| is_set(turnout)).collect();
        let ids: Vec<TrainId> = watchdog.driver().trains().collect();
        let mut dispatcher = Self {
            watchdog,
            awaiting_creep: BTreeSet::new(),
            trains: BTreeMap::new(),
            commanded,
            throwing: BTreeMap::new(),
            outputs: VecDeque::new(),
            wait_limit: WAIT_LIMIT,
            has_changed: true,
            shuffled: 0,
            searches: 0,
            last_failed_search: None,
            failed_searches: 0,
            blocks: None,
            next_check: None,
            dispatched_at: None,
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
        let envelope = ClearanceEnvelope::of(lengths, PARKED, Length::ZERO);
        let places = parking_places(self.watchdog.driver().layout(), envelope);
        if let Some(known) = self.trains.get_mut(&train) {
            known.parking = places;
        }
        if self.trains.get(&train).is_some_and(DispatchedTrain::rests) {
            self.reserve_standstill(now, train);
        }
    }

    /// From now on reserves the track between sensors as a whole, with all its turnouts, as block systems do. By
    /// default trains reserve track to the millimetre, which lets more of them run.
    pub fn reserve_blocks(&mut self) {
        self.blocks = Some(Blocks::of(self.watchdog.driver().layout()));
    }

    /// Whether no other train has reserved any of this track.
    pub(super) fn is_free_for(&self, id: TrainId, taken: &Reservation) -> bool {
        self.trains.values().all(|other| other.id == id || !other.reservation.meets(taken))
    }

    /// The reservation for the track that a train needs: extended to whole blocks if blocks are reserved.
    pub(super) fn reserved(&self, needed: Reservation) -> Reservation {
        match &self.blocks {
            Some(blocks) => blocks.around(self.watchdog.driver().layout(), &needed),
            None => needed,
        }
    }

    /// The driver of the trains.
    pub const fn driver(&self) -> &Driver {
        self.watchdog.driver()
    }

    /// See [`Watchdog::is_interrupted`].
    pub fn is_interrupted(&self, now: Timestamp, train: TrainId) -> bool {
        self.watchdog.is_interrupted(now, train)
    }

    /// See [`Watchdog::is_in_danger`].
    pub fn is_in_danger(&self, train: TrainId) -> bool {
        self.watchdog.is_in_danger(train)
    }

    /// The reservation of a train: no other train may enter it.
    pub fn reservation(&self, train: TrainId) -> Option<&Reservation> {
        self.trains.get(&train).map(|train| &train.reservation)
    }

    /// The journey of a train that has not ended, with its order.
    pub fn journey(&self, train: TrainId) -> Option<(OrderId, Journey)> {
        self.trains.get(&train)?.assigned.map(|assigned| (assigned.order, assigned.journey))
    }

    /// See [`Driver::set_model`].
    pub fn set_model(&mut self, model: MotionModel) {
        self.watchdog.set_model(model);
    }

    /// See [`Watchdog::take_remeasured`].
    pub fn take_remeasured(&mut self, train: TrainId) -> Option<Remeasured> {
        self.watchdog.take_remeasured(train)
    }

    /// Sets the position of a train, as an operator entered it.
    pub fn place(&mut self, now: Timestamp, train: TrainId, at: PathPoint, uncertainty: Length) {
        self.drop_interrupted(train);
        self.watchdog.place(now, train, at, uncertainty);
        // A train whose speed or direction is in danger is measured again, wherever it was placed.
        let is_in_danger = self.watchdog.is_in_danger(train);
        if !is_in_danger {
            self.awaiting_creep.remove(&train);
        }
        if let Some(known) = self.trains.get_mut(&train) {
            known.state = if is_in_danger { State::InDanger } else { State::Resting };
            known.detected_since_reversal = false;
            known.detected_since_start = true;
            known.authorities.clear();
            known.unobstructed_s = None;
            known.waiting_reported = false;
            known.reservation = Reservation::empty();
            known.occupied = OccupiedPath::default();
        }
        // No train runs on to where another stands.
        let under = self.trains.get(&train).map(|placed| self.track_under(now, placed));
        if is_in_danger && let (Some(known), Some(under)) = (self.trains.get_mut(&train), &under) {
            known.reservation = under.clone();
        }
        self.reserve_standstill(now, train);
        under.into_iter().for_each(|under| drop(self.stop_on(now, train, &under)));
    }

    /// Whether nothing is known of where a train is: neither its position, nor track that is reserved for it.
    pub fn is_nowhere(&self, now: Timestamp, train: TrainId) -> bool {
        self.reservation(train).is_none_or(Reservation::is_empty)
            && self.watchdog.driver().locate(train, now).is_none()
    }

    /// Sends a train to a place as soon as a path is free. Replaces its present journey.
    ///
    /// # Errors
    /// Why the train cannot go there.
    pub fn go(&mut self, now: Timestamp, train: TrainId, journey: Journey) -> Result<OrderId, Refusal> {
        let layout = self.watchdog.driver().layout();
        let place =
            layout.locate(journey.target, self.watchdog.driver().turnouts()).map_err(Refusal::Place)?;
        if !self.trains.contains_key(&train) {
            return Err(Refusal::UnknownTrain { train });
        }
        if self.is_nowhere(now, train) {
            return Err(Refusal::Lost { train });
        }
        if let Some(other) = self.trains.keys().copied().find(|other| self.is_nowhere(now, *other)) {
            return Err(Refusal::OtherNowhere { train, other });
        }
        self.set_unknown_turnouts(now)?;
        self.give_back(now, train);
        self.drop_interrupted(train);
        let order = self.watchdog.driver_mut().number();
        if let Some(known) = self.trains.get_mut(&train) {
            known.assigned = Some(Assignment { order, journey, place, since: now, queued_at: now });
            known.waiting_reported = false;
            known.unobstructed_s = None;
        }
        self.has_changed = true;
        self.act(now);
        Ok(order)
    }

    /// Switches the track power off or on; see [`Watchdog::switch_power`].
    pub fn switch_power(&mut self, now: Timestamp, on: bool) {
        self.watchdog.switch_power(now, on);
        self.act(now);
    }

    /// Switches a function of a train; see [`Watchdog::switch_function`].
    pub fn switch_function(&mut self, now: Timestamp, train: TrainId, function: FunctionNumber, on: bool) {
        self.watchdog.switch_function(train, function, on);
        self.act(now);
    }

    /// Takes news of the link; see [`Watchdog::handle_link`]. A silent station may not have set a turnout.
    pub fn handle_link(&mut self, now: Timestamp, news: LinkNews) {
        if matches!(news, LinkNews::Silent | LinkNews::Answers) {
            self.distrust_turnouts();
        }
        self.watchdog.handle_link(now, news);
        self.act(now);
    }

    /// Cancels the journey of a train. It still runs to its end of authority.
    pub fn cancel_journey(&mut self, now: Timestamp, train: TrainId) {
        if let Some(known) = self.trains.get_mut(&train) {
            known.assigned = None;
        }
        self.act(now);
    }

    /// Passes an order on to the driver. Rejects an order for a reserved turnout, unless its train is driven by hand.
    /// No train runs beyond its reservation: the track ahead of it is reserved as far as it is free, over the
    /// turnouts as set.
    ///
    /// # Errors
    /// As [`Driver::order`], and if the turnout is reserved.
    pub fn order(&mut self, now: Timestamp, order: Order) -> Result<OrderId, Refusal> {
        let taken = self.give(now, order)?;
        order.train().into_iter().for_each(|train| self.drop_interrupted(train));
        self.act(now);
        Ok(taken)
    }

    /// Passes an order on to the driver.
    pub(super) fn give(&mut self, now: Timestamp, order: Order) -> Result<OrderId, Refusal> {
        if let Order::Turnout { turnout, .. } = order
            && let Some(holder) = self.trains.values().find(|train| train.keeps(turnout))
        {
            return Err(Refusal::TurnoutOccupied { turnout, train: holder.id });
        }
        if let Order::Reverse { train, .. } = order
            && self.watchdog.driver().is_at_rest(train, now)
            && let Some(turnout) = self.trailed_points_under(now, train)
        {
            return Err(Refusal::OnTrailedPoints { train, turnout });
        }
        // A refused order ends no journey.
        self.watchdog.check(now, &order)?;
        if let Some(train) = order.train() {
            self.take_by_hand(now, train)?;
        }
        let taken = self.watchdog.carry_out(now, order);
        if let (Order::Reverse { train, .. }, Ok(_)) = (order, &taken) {
            self.note_reversal(train);
        }
        taken
    }

    /// The track that a train needs around it, with the present uncertainty of its position.
    pub(super) fn envelope(&self, now: Timestamp, train: &DispatchedTrain) -> ClearanceEnvelope {
        let located = self.watchdog.driver().locate(train.id, now);
        let uncertainty = located.map_or(Length::ZERO, |located| located.uncertainty);
        ClearanceEnvelope::of(train.lengths, uncertainty, self.overrun(train.id, uncertainty))
    }

    /// Reserves the track under a train at rest, and the turnouts over which its position is measured.
    pub(super) fn reserve_standstill(&mut self, now: Timestamp, id: TrainId) {
        self.release_anchors(now, id);
        let Some(train) = self.trains.get(&id) else { return };
        let Some(place) = self.watchdog.driver().position(id, now) else { return };
        let layout = self.watchdog.driver().layout();
        let mut reservation = self.track_under(now, train);
        self.reserve_anchors(now, id, place, &mut reservation);
        // A larger uncertainty takes no track of another train: this train is within its earlier reservation.
        let is_free = self.is_free_for(id, &reservation);
        if let Some(train) = self.trains.get_mut(&id).filter(|train| is_free || train.reservation.is_empty())
        {
            train.reserve(layout, reservation);
        }
        self.has_changed = true;
    }

    /// Reserves the turnouts between a train and the node from which its position is measured: thrown, they would
    /// change it.
    pub(super) fn reserve_anchors(
        &self,
        now: Timestamp,
        id: TrainId,
        place: Position,
        reservation: &mut Reservation,
    ) {
        let layout = self.watchdog.driver().layout();
        // Turnouts already requested for it will be thrown, whatever its later orders.
        let requested =
            self.throwing.iter().filter(|(_, (train, _))| *train == id).map(|(turnout, _)| *turnout);
        let requested = requested.filter(|turnout| self.is_being_thrown(now, *turnout));
        let anchors = self.anchors(now, id, place).into_iter();
        anchors.chain(requested).for_each(|turnout| reservation.take_turnout(layout, turnout));
    }

    /// Releases the turnouts behind a train at rest that was detected, except the one whose leg it is on.
    pub(super) fn release_anchors(&mut self, now: Timestamp, id: TrainId) {
        let Some(place) = self.watchdog.driver().position(id, now) else { return };
        let own = self.watchdog.driver().layout().needs_of(place.edge).filter(|need| need.facing).count();
        if self.watchdog.driver().missed_sensor(id, now).is_none() && self.anchors(now, id, place).len() > own
        {
            self.watchdog.count_from_behind(now, id);
        }
    }

    /// The facing turnouts on the path to a place from the node from which the train's position is measured.
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

    pub(super) fn notify(&mut self, notice: Notice) {
        self.outputs.push_back(Output::Notice(notice));
    }

    /// Handles all notices of the watchdog, and acts until nothing changes any more.
    pub(super) fn act(&mut self, now: Timestamp) {
        if self.dispatched_at.is_none_or(|last| now - last >= RECONSIDER_AFTER) {
            self.has_changed |= self.trains.values().any(|train| train.rests() && train.assigned.is_some());
        }
        for _ in 0..MAX_ROUNDS {
            self.record_paths(now);
            while let Some(output) = self.watchdog.poll_output() {
                match output {
                    // A journey is resumed by the dispatcher.
                    Output::Notice(Notice::Cancelled { train, .. }) if self.journey(train).is_some() => {}
                    Output::Notice(notice) => {
                        self.notify(notice.clone());
                        self.handle_notice(now, &notice);
                    }
                    for_the_line => self.outputs.push_back(for_the_line),
                }
            }
            self.advance_trains(now);
            if self.permit_creeping(now) || self.resume_interrupted(now) {
                continue;
            }
            if core::mem::take(&mut self.has_changed) && !self.watchdog.has_danger() {
                self.dispatched_at = Some(now);
                self.dispatch_waiting(now);
                continue;
            }
            break;
        }
        let report_waiting = self
            .trains
            .values()
            .any(|train| !matches!(train.state, State::Resting | State::Lost) || train.has_order());
        self.next_check = report_waiting.then_some(now + ACT_EVERY);
    }

    /// Records the edges that trains come over.
    fn record_paths(&mut self, now: Timestamp) {
        let layout = self.watchdog.driver().layout();
        for train in self.trains.values_mut() {
            if let Some(place) = self.watchdog.driver().position(train.id, now) {
                train.occupied.record(layout, place);
            }
        }
    }

    /// Commands a train to stop at once.
    pub(super) fn halt(&mut self, now: Timestamp, id: TrainId) {
        self.watchdog.halt(now, id);
        self.set_halting(now, id);
    }

    /// After a stop command: the train keeps its reservation until it is at rest.
    pub(super) fn set_halting(&mut self, now: Timestamp, id: TrainId) {
        let is_seen = self.watchdog.driver().missed_sensor(id, now).is_none();
        if let Some(train) = self.trains.get_mut(&id) {
            let confirmed = match train.state {
                State::Running { confirmed, .. } | State::Halting { confirmed, .. } => confirmed,
                State::ByHand => is_seen && train.detected_since_start,
                _ => false,
            };
            train.authorities.clear();
            train.kept = train.reservation.clone();
            train.state = State::Halting { confirmed, strayed: false };
        }
    }
}

impl Machine for Dispatcher {
    type Notice = Notice;

    fn handle_event(&mut self, now: Timestamp, event: &Event) {
        self.watchdog.handle_event(now, event);
        self.act(now);
    }

    fn handle_timeout(&mut self, now: Timestamp) {
        self.watchdog.handle_timeout(now);
        self.act(now);
    }

    fn poll_output(&mut self) -> Option<Output<Notice>> {
        self.outputs.pop_front()
    }

    fn next_timeout(&self) -> Option<Timestamp> {
        [self.watchdog.next_timeout(), self.next_check].into_iter().flatten().min()
    }
}
