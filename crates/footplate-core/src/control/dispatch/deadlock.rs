//! Deadlocks: which trains step aside, and where to.
//!
//! A running train has reserved all the track to its destination and comes to rest there. So a train can only wait
//! for ever for trains at rest, and those can be moved. The search finds a short sequence of moves, each possible
//! after those before it, that leaves a free path for the waiting train: breadth first, the quickest of the shortest.

use alloc::vec::Vec;

use crate::ids::TrainId;
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Landmark, Position};

use super::dispatched_train::{DispatchedTrain, Purpose};
use super::dispatcher::Dispatcher;
use super::granting::Proposal;
use super::itinerary::SHORTEST_RUN;
use super::movement_authority::{ClearanceEnvelope, PARKED, STOP_ERROR, Start, standstill_reservation};
use super::path::OccupiedPath;
use super::reservation::{Obstacles, Reservation};
use crate::control::Notice;

/// The limits of a search. It fails beyond them until something has changed.
#[derive(Debug, Clone, Copy)]
struct Effort {
    /// Path searches.
    tried: usize,
    /// Moves in one sequence.
    moves: usize,
    /// Places that one train may step aside to, the quickest to reach first.
    places: usize,
    /// Whether a train may step aside to a place that overlaps its reservation: a detection on its run reduces that.
    near: bool,
    /// Scenes kept for the next move, of those in which the last move was not enough.
    kept: usize,
}

/// While other trains run: takes a few milliseconds.
const USUAL: Effort = Effort { tried: 150, moves: 2, places: 6, near: false, kept: 4 };
/// If no train runs, and none would: a tenth of a second does not matter.
const THOROUGH: Effort = Effort { tried: 1_500, moves: 4, places: 12, near: true, kept: 16 };
/// After a failed search, no train steps aside for the same train for this long.
const AFTER_FAILED_SEARCH: TimeSpan = TimeSpan::from_s(6.0);

/// A train that still waits after others have stepped aside this often goes to the end of the queue.
const ROOMS_IN_A_ROW: u32 = 4;

/// After this many failed thorough searches a train that no sensor has confirmed is located again.
const MAX_FAILED_SEARCHES: u8 = 4;

/// The next thorough search comes this long after a failed one.
const SEARCHES_AGAIN: TimeSpan = TimeSpan::from_s(15.0);

/// A train at rest at a real or a hypothetical place.
#[derive(Debug, Clone)]
struct RestingTrain {
    id: TrainId,
    place: Position,
    reservation: Reservation,
}

/// The penalty for a place on a turnout, in seconds.
const ON_TURNOUT_S: f64 = 30.0;

/// Places of all trains at rest, and the moves that lead there.
#[derive(Debug, Clone)]
struct Scene {
    resting_trains: Vec<RestingTrain>,
    moves: Vec<(TrainId, Position)>,
    seconds: f64,
}

impl Dispatcher {
    /// Moves trains at rest off the path of a train, if only trains at rest block it.
    pub(super) fn make_room(&mut self, now: Timestamp, id: TrainId, targets: &[Position], wish: &Proposal) {
        let mut blocking =
            self.trains.values().filter(|other| other.id != id && wish.meets(&other.reservation));
        let all_rest = blocking.all(|other| other.is_ready(now));
        let another_makes_room = self
            .trains
            .values()
            .any(|train| train.makes_room_for().is_some() && !train.authorities.is_empty());
        if !all_rest || another_makes_room {
            return;
        }
        if self.trains.get(&id).is_none_or(|train| now < train.no_room_until) {
            return;
        }
        if !self.resolve_deadlock(now, id, targets, wish, USUAL)
            && let Some(train) = self.trains.get_mut(&id)
        {
            train.no_room_until = now + AFTER_FAILED_SEARCH;
        }
    }

    /// Searches for moves that leave a free path for a train, and begins the first. Returns whether there are any.
    fn resolve_deadlock(
        &mut self,
        now: Timestamp,
        id: TrainId,
        targets: &[Position],
        wish: &Proposal,
        effort: Effort,
    ) -> bool {
        let found = self.resolved_deadlock(now, id, targets, wish, effort).and_then(|moves| {
            let (first, place) = moves.first().copied()?;
            // One whose authority was withdrawn a moment ago would be sent again and again within the same instant.
            self.trains.get(&first).filter(|train| train.is_ready(now))?;
            let start = self.start(now, first)?;
            let proposal =
                self.propose(&start, &self.both_directions(place), &self.obstacles_of_others(first))?;
            self.is_free(first, &proposal).then_some((moves, place, proposal))
        });
        let Some((moves, place, proposal)) = found else { return false };
        let moves: Vec<TrainId> = moves.into_iter().map(|(train, _)| train).collect();
        if let Some(first) = moves.first().copied() {
            self.notify(Notice::Deadlock { train: id, moves });
            if let Some(train) = self.trains.get_mut(&id) {
                train.times_aside = train.times_aside.saturating_add(1);
                if let Some(assigned) =
                    train.assigned.as_mut().filter(|_| train.times_aside >= ROOMS_IN_A_ROW)
                {
                    assigned.queued_at = now;
                    train.times_aside = 0;
                }
            }
            self.send_aside(now, first, id, place, proposal);
        }
        true
    }

    /// If no train runs and no sequence of moves was found: makes a thorough search for one waiting train after the
    /// other. If it fails, too, one train goes to any other place, so that the next search begins from other places.
    pub(super) fn shuffle(&mut self, now: Timestamp, waiting: &[TrainId]) {
        if self.trains.values().any(|train| !train.authorities.is_empty()) {
            return;
        }
        let turn = self.searches.checked_rem(waiting.len()).and_then(|turn| waiting.get(turn));
        let Some(id) = turn.copied() else { return };
        let is_due = self.last_failed_search.is_none_or(|last| now - last >= SEARCHES_AGAIN);
        if is_due
            && let Some((targets, start)) = self.targets(id).zip(self.start(now, id))
            && let Some(wish) = self.wish(id, &start, &targets)
        {
            self.searches += 1;
            if self.resolve_deadlock(now, id, &targets, &wish, THOROUGH) {
                return;
            }
            self.last_failed_search = Some(now);
            if self.suspect_position(now) {
                return;
            }
            // A larger overrun is not worth a deadlock.
            self.trains.values_mut().for_each(|train| train.caution = 1.0);
        }
        let ready: Vec<TrainId> =
            self.trains.values().filter(|train| train.is_ready(now)).map(|train| train.id).collect();
        for nth in 0..ready.len() {
            let turn = (self.shuffled + nth) % ready.len().max(1);
            let Some(mover) = ready.get(turn).copied() else { continue };
            if let Some((place, proposal)) = self.elsewhere(now, mover) {
                self.shuffled += nth + 1;
                self.notify(Notice::Deadlock { train: id, moves: Vec::new() });
                self.send_aside(now, mover, id, place, proposal);
                return;
            }
        }
        if is_due {
            self.notify(Notice::Deadlocked { train: id });
        }
    }

    /// After a failed search the estimated position of a train may be wrong. A train that a sensor did not report, or
    /// that may not have started at all, may run back to be detected; after [`MAX_FAILED_SEARCHES`] searches the
    /// first of them is located again. Returns whether there is one.
    fn suspect_position(&mut self, now: Timestamp) -> bool {
        self.failed_searches = self.failed_searches.saturating_add(1);
        let is_unseen = |train: &&DispatchedTrain| {
            let unseen = self.watchdog.driver().missed_sensor(train.id, now).is_some();
            train.is_ready(now) && (unseen || !train.detected_since_start)
        };
        let unseen: Vec<TrainId> = self.trains.values().filter(is_unseen).map(|train| train.id).collect();
        if unseen.iter().any(|id| self.look_back(*id)) {
            return true;
        }
        let Some(first) = unseen.first().copied().filter(|_| self.failed_searches >= MAX_FAILED_SEARCHES)
        else {
            return false;
        };
        self.failed_searches = 0;
        self.lose(now, first);
        true
    }

    /// A place that a train at rest can go to now: one of the quickest to reach, a different one each time.
    fn elsewhere(&self, now: Timestamp, id: TrainId) -> Option<(Position, Proposal)> {
        let start = self.start(now, id)?;
        let obstacles = self.obstacles_of_others(id);
        let reached = self.search(&start, &obstacles).from(Some(start.place), self.reversed(&start));
        let train = self.trains.get(&id)?;
        // The place that it is at gives the next search nothing new: it would be sent there again and again.
        let is_here = |place: &Position| {
            let near =
                |here: Position| here.edge == place.edge && (here.offset - place.offset).abs() < SHORTEST_RUN;
            self.both_directions(start.place).into_iter().any(near)
        };
        let places = train.parking.iter().filter(|(place, _)| !is_here(place));
        let places = places.filter_map(|(place, is_clear)| {
            let itinerary =
                reached.to(&self.both_directions(*place)).into_iter().next().filter(|_| *is_clear)?;
            let proposal = self.proposal(&start, itinerary)?;
            self.is_free(id, &proposal).then_some((*place, proposal))
        });
        let mut places: Vec<(Position, Proposal)> = places.collect();
        places.sort_by(|(_, one), (_, other)| one.itinerary.seconds.total_cmp(&other.itinerary.seconds));
        let nth = self.shuffled.checked_rem(places.len())?;
        (nth < places.len()).then(|| places.swap_remove(nth))
    }

    fn send_aside(
        &mut self,
        now: Timestamp,
        id: TrainId,
        makes_room_for: TrainId,
        place: Position,
        proposal: Proposal,
    ) {
        let to = Landmark { node: self.node_before(place), offset: place.offset };
        self.notify(Notice::StepsAside { train: id, makes_room_for, to });
        self.grant(now, id, Purpose::Aside(makes_room_for), proposal);
    }

    pub(super) fn obstacles_of_others(&self, id: TrainId) -> Obstacles {
        let mut obstacles = Obstacles::default();
        let others = self.trains.values().filter(|other| other.id != id);
        others.for_each(|other| obstacles.add(&other.reservation, f64::INFINITY));
        obstacles
    }

    pub(super) fn is_free(&self, id: TrainId, proposal: &Proposal) -> bool {
        proposal.runs.iter().all(|run| self.is_free_for(id, &run.taken))
    }

    fn both_directions(&self, place: Position) -> Vec<Position> {
        [Some(place), self.watchdog.driver().layout().reversed(place)].into_iter().flatten().collect()
    }

    fn node_before(&self, place: Position) -> crate::ids::NodeId {
        self.watchdog.driver().layout().edge(place.edge).map_or(crate::ids::NodeId(0), |edge| edge.from)
    }

    /// Moves that leave a free path for a train.
    fn resolved_deadlock(
        &self,
        now: Timestamp,
        id: TrainId,
        targets: &[Position],
        wish: &Proposal,
        effort: Effort,
    ) -> Option<Vec<(TrainId, Position)>> {
        let resting = self.trains.values().filter(|train| train.rests());
        let resting_trains = resting.filter_map(|train| {
            let place = self.watchdog.driver().position(train.id, now)?;
            Some(RestingTrain { id: train.id, place, reservation: train.reservation.clone() })
        });
        let mut fixed = Obstacles::default();
        let is_placed = |train: &DispatchedTrain| self.watchdog.driver().position(train.id, now).is_some();
        let moving = || self.trains.values().filter(|train| !train.rests() || !is_placed(train));
        moving().for_each(|train| fixed.add(&train.reservation, f64::INFINITY));
        let is_fixed_free = |taken: &Reservation| moving().all(|train| !train.reservation.meets(taken));
        let mut tried = 0;
        let mut scenes =
            alloc::vec![Scene { resting_trains: resting_trains.collect(), moves: Vec::new(), seconds: 0.0 }];
        for _ in 0..effort.moves {
            let mut next: Vec<Scene> = Vec::new();
            let mut best: Option<Scene> = None;
            for scene in &scenes {
                for (nth, mover) in scene.resting_trains.iter().enumerate() {
                    let is_blocking =
                        mover.id == id || wish.meets(&mover.reservation) || !scene.moves.is_empty();
                    if !is_blocking && scenes.len() == 1 && best.is_some() {
                        continue;
                    }
                    for (place, reservation, seconds) in self.refuges(now, scene, nth, &fixed, wish, effort) {
                        if !is_fixed_free(&reservation) {
                            continue;
                        }
                        tried += 1;
                        if tried > effort.tried {
                            return best.map(|best| best.moves);
                        }
                        let mut after = scene.clone();
                        after.moves.push((mover.id, place));
                        after.seconds += seconds;
                        if let Some(moved) = after.resting_trains.get_mut(nth) {
                            moved.place = place;
                            moved.reservation = reservation;
                        }
                        if let Some(seconds) = self.running_time(now, id, targets, &after, &fixed) {
                            after.seconds += seconds;
                            if best.as_ref().is_none_or(|best| after.seconds < best.seconds) {
                                best = Some(after);
                            }
                        } else {
                            next.push(after);
                        }
                    }
                }
            }
            if let Some(best) = best {
                return Some(best.moves);
            }
            next.sort_by(|one, other| one.seconds.total_cmp(&other.seconds));
            next.truncate(effort.kept);
            scenes = next;
        }
        None
    }

    /// Places that a train of a scene can go to: off the waiting train's path first, then the quickest to reach.
    fn refuges(
        &self,
        now: Timestamp,
        scene: &Scene,
        nth: usize,
        fixed: &Obstacles,
        wish: &Proposal,
        effort: Effort,
    ) -> Vec<(Position, Reservation, f64)> {
        let Some(mover) = scene.resting_trains.get(nth) else { return Vec::new() };
        let Some(start) = self.hypothetical(now, mover) else { return Vec::new() };
        let mut obstacles = fixed.clone();
        let others = || scene.resting_trains.iter().filter(|other| other.id != mover.id);
        others().for_each(|other| obstacles.add(&other.reservation, f64::INFINITY));
        let reached = self.search(&start, &obstacles).from(Some(start.place), self.reversed(&start));
        let layout = self.watchdog.driver().layout();
        let Some(train) = self.trains.get(&mover.id) else { return Vec::new() };
        let envelope = ClearanceEnvelope::of(train.lengths, PARKED, start.envelope.overrun);
        let envelope = ClearanceEnvelope {
            ahead: envelope.ahead + STOP_ERROR,
            behind: envelope.behind + STOP_ERROR,
            ..envelope
        };
        // Off the waiting train's path first, then clear of turnouts, then the quickest.
        let mut places: Vec<(bool, Position, Reservation, f64)> = Vec::new();
        for (place, is_clear) in train.parking.iter().copied() {
            let directions = self.both_directions(place);
            let soonest = directions.iter().filter_map(|place| reached.seconds_to(*place)).reduce(f64::min);
            let Some(seconds) = soonest else { continue };
            let reservation = self.reserved(standstill_reservation(
                layout,
                self.watchdog.driver().turnouts(),
                place,
                &OccupiedPath::default(),
                envelope,
            ));
            // A place that overlaps the reservation counts only if it frees the path, as at the end of a siding.
            let frees_path = wish.meets(&mover.reservation) && !wish.meets(&reservation);
            if frees_path || effort.near || !reservation.meets(&mover.reservation) {
                let seconds = if is_clear { seconds } else { seconds + ON_TURNOUT_S };
                places.push((wish.meets(&reservation), place, reservation, seconds));
            }
        }
        places.sort_by(|one, other| one.0.cmp(&other.0).then(one.3.total_cmp(&other.3)));
        // On a leg it needs the turnout, too: its position is measured over it.
        let can_go = |(_, place, mut reservation, seconds): (bool, Position, Reservation, f64)| {
            let itinerary = reached.to(&self.both_directions(place)).into_iter().next()?;
            let proposal = self.proposal(&start, itinerary)?;
            let stop = proposal.itinerary.runs.last()?.stop;
            let own = layout.needs_of(stop.edge).filter(|need| need.facing);
            own.for_each(|need| reservation.take_turnout(layout, need.turnout));
            others().all(|other| !proposal.meets(&other.reservation)).then_some((place, reservation, seconds))
        };
        places.into_iter().filter_map(can_go).take(effort.places).collect()
    }

    /// The running time to its destination in a scene; `None` if the path is blocked.
    fn running_time(
        &self,
        now: Timestamp,
        id: TrainId,
        targets: &[Position],
        scene: &Scene,
        fixed: &Obstacles,
    ) -> Option<f64> {
        let resting_train = scene.resting_trains.iter().find(|resting_train| resting_train.id == id)?;
        let start = self.hypothetical(now, resting_train)?;
        let mut obstacles = fixed.clone();
        let others = || scene.resting_trains.iter().filter(|other| other.id != id);
        others().for_each(|other| obstacles.add(&other.reservation, f64::INFINITY));
        let found = self.propose(&start, targets, &obstacles)?;
        others().all(|other| !found.meets(&other.reservation)).then_some(found.itinerary.seconds)
    }

    fn hypothetical(&self, now: Timestamp, resting_train: &RestingTrain) -> Option<Start> {
        let start = self.start(now, resting_train.id)?;
        if start.place == resting_train.place {
            return Some(start);
        }
        let lengths = self.trains.get(&resting_train.id)?.lengths;
        let envelope = ClearanceEnvelope::of(lengths, PARKED, start.envelope.overrun);
        let reversed = self.watchdog.driver().reversed_position_at(resting_train.place);
        Some(Start {
            place: resting_train.place,
            envelope,
            frozen: Vec::new(),
            reversed,
            occupied: OccupiedPath::default(),
            ..start
        })
    }
}
