//! Movement authorities: the dispatcher reserves all the track to a destination at once, so that no train waits on
//! its path.

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use crate::control::Notice;
use crate::control::drive::Refusal;
use crate::event::Approach;
use crate::ids::{SpeedStep, TrainId};
use crate::model::{MotionModel, StepUse};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Landmark, Position, TurnoutNeed};
use crate::units::{Length, Speed};

use super::dispatched_train::{DispatchedTrain, Purpose, State};
use super::dispatcher::Dispatcher;
use super::itinerary::{Itinerary, Pace, Search};
use super::movement_authority::{ClearanceEnvelope, MovementAuthority, Start, granted};
use super::path::{OccupiedPath, Path};
use super::reservation::{Obstacles, Reservation};
use super::running::FAR;

/// Expected wait for a train at rest and for a running one, in seconds: the first has to step aside, the second
/// leaves by itself.
const RESTING_S: f64 = 20.0;
const RUNNING_S: f64 = 8.0;
/// A detour around other trains is accepted up to this multiple of the unobstructed running time, plus `LONGER_BY_S`.
const LONGER: f64 = 1.5;
const LONGER_BY_S: f64 = 10.0;
/// The path of a train that has waited this long is kept free of new reservations.
const PATIENCE: TimeSpan = TimeSpan::from_s(45.0);
/// If every train is at rest and has waited this long, the usual search has failed and a thorough one begins.
const STALLED: TimeSpan = TimeSpan::from_s(20.0);
/// A waiting train is examined at most this often: most events on the layout do not concern it.
const EXAMINE_EVERY: TimeSpan = TimeSpan::from_ms(800);
/// Reversing takes this long beyond the run itself: until standstill is certain, and the commands, in seconds.
const REVERSAL_S: f64 = 1.5;
/// Stops from higher speeds are too uncertain (20 mm at 600 mm/s).
const FASTEST: Speed = Speed::from_mm_per_s(450.0);
/// Slower trains stall on dirty rails between sensors, and delay the others.
const CREEP: Speed = Speed::from_mm_per_s(120.0);
/// The lowest cruising speed that a running time is calculated with.
const SLOWEST: Speed = Speed::from_mm_per_s(60.0);
/// The overrun in standard deviations: a stop ends beyond it once in a thousand times. With a margin, so that
/// supervision of the end of authority, which has the same limit, seldom interrupts a stop.
const OVERRUN: f64 = 3.09 + 0.5;
/// Uncertainty of the position at which a stop begins, from sensors, survey and speed: one standard deviation.
const PLACE: Length = Length::from_mm(10.0);
/// The smallest and the largest overrun: no stop is more precise than the first, and a train that needs more than the
/// second has unknown stops (with less, its end of authority would stop it repeatedly).
const OVERRUNS: [Length; 2] = [Length::from_mm(40.0), Length::from_mm(1_200.0)];

/// A path to a destination, with the authorities that it needs.
#[derive(Debug, Clone)]
pub(super) struct Proposal {
    pub(super) itinerary: Itinerary,
    pub(super) runs: Vec<MovementAuthority>,
}

impl Proposal {
    pub(super) fn meets(&self, reservation: &Reservation) -> bool {
        self.runs.iter().any(|run| run.taken.meets(reservation))
    }
}

impl Dispatcher {
    /// Examines all trains at rest with a journey, the longest waiting first. A train for which others have stepped
    /// aside several times without success goes to the end of the queue.
    pub(super) fn dispatch_waiting(&mut self, now: Timestamp) {
        // No turnout moves without power, and a station that does not answer starts no train.
        let runs = self.watchdog.is_powered() && !self.watchdog.is_silent();
        if !runs || self.has_unplaced_train(now) {
            return;
        }
        let mut waiting: Vec<(Timestamp, Timestamp, TrainId)> = self
            .trains
            .values()
            .filter(|train| train.is_ready(now))
            .filter_map(|train| Some((train.assigned?.queued_at, train.assigned?.since, train.id)))
            .collect();
        waiting.sort_unstable();
        let mut kept_free: Option<Proposal> = None;
        let mut all_wait = !waiting.is_empty();
        for (queued_at, since, id) in waiting.iter().copied() {
            // It may have stepped aside meanwhile.
            if !self.trains.get(&id).is_some_and(|train| train.is_ready(now)) {
                continue;
            }
            if self
                .trains
                .get(&id)
                .is_some_and(|train| train.waiting_reported && now - train.examined_at < EXAMINE_EVERY)
            {
                continue;
            }
            let (Some(targets), Some(start)) = (self.targets(id), self.start(now, id)) else { continue };
            let unobstructed = self.unobstructed(now, id, &start, &targets);
            let Some(unobstructed) = unobstructed else {
                let is_missed = self.watchdog.driver().missed_sensor(id, now).is_some();
                let is_unseen =
                    is_missed || self.trains.get(&id).is_some_and(|train| !train.detected_since_start);
                if !is_missed && !self.only_uncertainty_bars(id, &start, &targets) {
                    self.cannot_go(now, id, self.unreachable(id));
                } else if !(is_missed && self.look_back(id) || is_unseen && self.look_ahead(now, id, &start))
                {
                    self.lose(now, id);
                }
                continue;
            };
            let free = self.free_path(id, &start, &targets).filter(|free| {
                let allowed = unobstructed * LONGER + LONGER_BY_S + (now - since).as_s();
                // A train that blocks the next one should go.
                let blocks_next = |wish: &Proposal| {
                    self.trains.get(&id).is_some_and(|train| wish.meets(&train.reservation))
                };
                let spares = kept_free.as_ref().is_none_or(|wish| {
                    blocks_next(wish) || !free.runs.iter().any(|run| wish.meets(&run.taken))
                });
                free.itinerary.seconds <= allowed && spares
            });
            if let Some(free) = free {
                self.grant(now, id, Purpose::Journey, free);
                continue;
            }
            let Some(wish) = self.wish(id, &start, &targets) else { continue };
            self.report_waiting(id, &wish);
            self.make_room(now, id, &targets, &wish);
            let mut running = self.trains.values().filter(|train| !train.authorities.is_empty());
            let room_is_made = running.clone().any(|train| train.purpose == Purpose::Aside(id));
            // No track is kept free for a train that waits for trains at rest: they may never leave.
            let another_passes = running.any(|train| wish.meets(&train.reservation));
            if kept_free.is_none() && (room_is_made || another_passes && now - queued_at >= PATIENCE) {
                kept_free = Some(wish);
            }
        }
        all_wait &= waiting.iter().all(|(_, since, id)| {
            now - *since >= STALLED && self.trains.get(id).is_some_and(DispatchedTrain::rests)
        });
        if all_wait {
            let waiting: Vec<TrainId> = waiting.into_iter().map(|(.., id)| id).collect();
            self.shuffle(now, &waiting);
        }
    }

    /// Whether a train at rest has no position yet, because a turnout ahead of it is still being set.
    fn has_unplaced_train(&mut self, now: Timestamp) -> bool {
        let has_no_reservation = |train: &&DispatchedTrain| train.rests() && train.reservation.is_empty();
        let unplaced: Vec<TrainId> =
            self.trains.values().filter(has_no_reservation).map(|train| train.id).collect();
        unplaced.iter().for_each(|id| self.reserve_standstill(now, *id));
        // Commands lost on the line are repeated. A train that may be on such a turnout needs an operator.
        if let Err(Refusal::TurnoutUnknown { train, .. }) = self.set_unknown_turnouts(now)
            && let Some(known) = self.trains.get_mut(&train)
            && !core::mem::replace(&mut known.waiting_reported, true)
        {
            self.notify(Notice::ReservedAsUnknown { train });
        }
        self.trains.values().any(|train| train.rests() && self.unknown_turnout_ahead(now, train.id).is_some())
    }

    /// The running time without other trains, in seconds; `None` if no path leads to the destination.
    fn unobstructed(
        &mut self,
        now: Timestamp,
        id: TrainId,
        start: &Start,
        targets: &[Position],
    ) -> Option<f64> {
        let known = self.trains.get(&id)?.unobstructed_s;
        let seconds =
            known.or_else(|| Some(self.propose(start, targets, &Obstacles::default())?.itinerary.seconds));
        if let Some(train) = self.trains.get_mut(&id) {
            train.unobstructed_s = seconds;
            train.examined_at = now;
        }
        seconds
    }

    /// Whether the position of a train is very uncertain, or no sensor has reported it since it started, and nothing else bars its
    /// path: it has to be located first.
    fn only_uncertainty_bars(&self, id: TrainId, start: &Start, targets: &[Position]) -> bool {
        let Some(train) = self.trains.get(&id).filter(|_| self.watchdog.is_watching()) else { return false };
        if train.detected_since_start && start.envelope.ahead - start.envelope.front <= FAR {
            return false;
        }
        let envelope = ClearanceEnvelope::of(train.lengths, Length::ZERO, self.overrun(id, Length::ZERO));
        // Turnouts that it may stand on are not thrown; a located train stands on few.
        let located = Start { envelope, frozen: Vec::new(), ..start.clone() };
        self.propose(&located, targets, &Obstacles::default()).is_some()
    }

    /// The destinations of the journey: in one direction or in both.
    pub(super) fn targets(&self, id: TrainId) -> Option<Vec<Position>> {
        let assigned = self.trains.get(&id)?.assigned?;
        let other =
            self.watchdog.driver().layout().reversed(assigned.place).filter(|_| !assigned.journey.faces);
        Some([Some(assigned.place), other].into_iter().flatten().collect())
    }

    /// The start of a path search for a train at rest.
    pub(super) fn start(&self, now: Timestamp, id: TrainId) -> Option<Start> {
        let train = self.trains.get(&id)?;
        let place = self.watchdog.driver().position(id, now)?;
        let envelope = self.envelope(now, train);
        let in_position = |turnout| {
            let leg = self.watchdog.driver().turnouts().get(turnout)?;
            Some(TurnoutNeed { turnout, leg, facing: true })
        };
        let mut near = self.watchdog.driver().turnouts_under(id, now);
        near.extend(self.anchors(now, id, place));
        let looks_back = train.looks_back;
        if looks_back || !train.detected_since_start {
            near.extend(train.reservation.turnouts());
        }
        let frozen = near.into_iter().filter_map(in_position).collect();
        let is_certain = self.watchdog.driver().missed_sensor(id, now).is_none() || looks_back;
        let may_reverse = is_certain && !self.is_on_trailed_points(now, id);
        let reversed = self.watchdog.driver().reversed_position(id, now).filter(|_| may_reverse);
        let occupied = train.occupied.clone();
        let may_back_away = train.detected_since_reversal;
        Some(Start { place, occupied, envelope, pace: self.pace(id), frozen, reversed, may_back_away })
    }

    /// The quickest path past obstacles, with its authorities.
    pub(super) fn propose(
        &self,
        start: &Start,
        targets: &[Position],
        obstacles: &Obstacles,
    ) -> Option<Proposal> {
        let search = self.search(start, obstacles);
        let reversed = self.reversed(start);
        let proposed = |search: Search<'_>, ahead: Option<Position>| {
            let reached = search.from(ahead, reversed);
            // The quickest one may need a turnout in both positions at once.
            reached.to(targets).into_iter().find_map(|itinerary| self.proposal(start, itinerary))
        };
        let ahead = Some(start.place);
        // If turnouts just ahead are in the wrong position and cannot be thrown, the train backs away from them first.
        proposed(search, ahead)
            .or_else(|| proposed(Search { may_trail_frozen: false, ..search }, ahead))
            .or_else(|| start.may_back_away.then(|| proposed(search, None))?)
    }

    pub(super) fn proposal(&self, start: &Start, itinerary: Itinerary) -> Option<Proposal> {
        let mut runs =
            granted(self.watchdog.driver().layout(), self.watchdog.driver().turnouts(), &itinerary, start)?;
        for run in &mut runs {
            run.taken = self.reserved(core::mem::take(&mut run.taken));
        }
        Some(Proposal { itinerary, runs })
    }

    pub(super) fn search<'a>(&'a self, start: &'a Start, obstacles: &'a Obstacles) -> Search<'a> {
        let clears = start.envelope.rear + start.envelope.overrun;
        Search {
            layout: self.watchdog.driver().layout(),
            pace: start.pace,
            clears,
            beyond: start.envelope.overrun + start.envelope.front,
            turnouts: self.watchdog.driver().turnouts(),
            obstacles,
            frozen: &start.frozen,
            may_trail_frozen: true,
        }
    }

    /// The position of the leading end of the pickup once the train has reversed; `None` if it would run back over
    /// points that are set for the other leg: it trailed them on arrival, and they would derail it on departure.
    pub(super) fn reversed(&self, start: &Start) -> Option<Position> {
        let layout = self.watchdog.driver().layout();
        let reversed = start.reversed?;
        let (path, at) = Path::around(
            layout,
            self.watchdog.driver().turnouts(),
            reversed,
            &OccupiedPath::default(),
            start.envelope.behind,
            Length::ZERO,
        );
        let is_set_otherwise = |need: TurnoutNeed| {
            start.frozen.iter().any(|known| known.turnout == need.turnout && known.leg != need.leg)
        };
        // Its position is measured from the node behind it: a turnout there has to be set for it, too.
        let own = layout.needs_of(reversed.edge);
        let needs = path.needs(layout, at - start.envelope.behind, at);
        (!needs.into_iter().chain(own).any(|need| need.facing && is_set_otherwise(need))).then_some(reversed)
    }

    /// The path that a train would take if others stepped aside in time; lost trains do not.
    pub(super) fn wish(&self, id: TrainId, start: &Start, targets: &[Position]) -> Option<Proposal> {
        let mut obstacles = Obstacles::default();
        for other in self.trains.values().filter(|other| other.id != id) {
            let seconds = match other.state {
                State::Resting => RESTING_S,
                State::Lost => f64::INFINITY,
                _ => RUNNING_S,
            };
            obstacles.add(&other.reservation, seconds);
        }
        let wish = self.propose(start, targets, &obstacles);
        // A lost train will be located again.
        wish.or_else(|| self.propose(start, targets, &Obstacles::default()))
    }

    /// The quickest path that no other train has reserved.
    fn free_path(&self, id: TrainId, start: &Start, targets: &[Position]) -> Option<Proposal> {
        self.propose(start, targets, &self.obstacles_of_others(id)).filter(|found| self.is_free(id, found))
    }

    /// Grants a proposal to a train and reserves its track; its turnouts are set next.
    pub(super) fn grant(&mut self, now: Timestamp, id: TrainId, purpose: Purpose, proposal: Proposal) {
        let turns = proposal.runs.iter().filter(|run| run.reverses).count();
        let takes = TimeSpan::from_s(proposal.itinerary.seconds);
        let Some(train) = self.trains.get_mut(&id) else { return };
        train.kept = core::mem::take(&mut train.reservation);
        train.authorities = VecDeque::from(proposal.runs);
        train.purpose = purpose;
        train.authorised_for =
            train.assigned.filter(|_| purpose == Purpose::Journey).map(|assigned| assigned.order);
        train.waiting_reported = false;
        train.unobstructed_s = None;
        train.looks_back = false;
        if purpose == Purpose::Journey {
            train.times_aside = 0;
            self.failed_searches = 0;
        }
        train.last_run = None;
        train.state = State::Setting { ready: None, since: now };
        train.skipped.clear();
        self.reserve_runs(now, id);
        self.notify(Notice::RouteSet { train: id, takes, turns });
    }

    fn report_waiting(&mut self, id: TrainId, wish: &Proposal) {
        let others = self.trains.values().filter(|other| other.id != id && wish.meets(&other.reservation));
        let on: Vec<TrainId> = others.map(|other| other.id).collect();
        if let Some(train) = self.trains.get_mut(&id)
            && !core::mem::replace(&mut train.waiting_reported, true)
        {
            self.notify(Notice::Waits { train: id, on });
        }
    }

    pub(super) fn unreachable(&self, id: TrainId) -> Refusal {
        let layout = self.watchdog.driver().layout();
        let display = |landmark: Landmark| alloc::format!("{}", layout.display(landmark));
        let target = self.journey(id).map_or_else(Default::default, |(_, journey)| display(journey.target));
        Refusal::Unreachable { train: id, target }
    }

    /// The distance beyond its stop within which a train comes to rest, exceeded once in a thousand times. If no
    /// sensor is on its path, its position is as uncertain then as now.
    pub(super) fn overrun(&self, id: TrainId, uncertainty: Length) -> Length {
        let place = PLACE.max(uncertainty).as_m();
        let widest = self.watchdog.driver().widest_stop(id);
        let widest = widest.map(|widest| Length::from_m(libm::hypot(widest.as_m(), place)));
        let usual = widest.map_or(OVERRUNS[1], |widest| (widest * OVERRUN).max(OVERRUNS[0]).min(OVERRUNS[1]));
        usual * self.trains.get(&id).map_or(1.0, |train| train.caution)
    }

    /// Whether a train at rest may be further from its estimate than any overrun: its end of authority would stop it as soon as
    /// it starts, and each start and stop makes its position more uncertain.
    pub(super) fn is_too_uncertain(&self, now: Timestamp, id: TrainId) -> bool {
        let located = self.watchdog.driver().locate(id, now);
        located.is_some_and(|located| located.uncertainty * OVERRUN > OVERRUNS[1])
    }

    /// The step for a run: the fastest that settles within the distance and stops precisely enough; if the distance
    /// is too short for any, the slowest step faster than creeping.
    pub(super) fn step_for(
        &self,
        id: TrainId,
        distance: Length,
        is_certain: impl Fn(Length) -> bool,
    ) -> Option<SpeedStep> {
        let model = self.watchdog.driver().model(id)?;
        let speed = |step: SpeedStep| model.steady_speed(step, Approach::Below);
        let usable = || steps(model).filter(|step| speed(*step) >= CREEP && speed(*step) <= FASTEST);
        let spread = |step: SpeedStep| model.stop(step, Approach::Below).deviation();
        let fits = |step: SpeedStep| {
            let stop = model.stop_distance(step, Approach::Below);
            let starts = speed(step) * model.settles_within(SpeedStep::STAND, step);
            starts + stop + PLACE <= distance
        };
        usable().filter(|step| fits(*step) && is_certain(spread(*step))).last().or_else(|| usable().next())
    }

    /// The speed and durations for running times.
    fn pace(&self, id: TrainId) -> Pace {
        let Some(model) = self.watchdog.driver().model(id) else {
            return Pace { cruise: SLOWEST, start_s: 1.0, stop_s: 1.0, reversal_s: REVERSAL_S };
        };
        // Stops are most precise from medium steps.
        let usable: Vec<SpeedStep> = steps(model).collect();
        let step = usable.get(usable.len() * 2 / 3).copied().unwrap_or(model.highest());
        let cruise = model.steady_speed(step, Approach::Below);
        let cruise = if cruise > SLOWEST { cruise } else { SLOWEST };
        let (distance, time) =
            (model.stop_distance(step, Approach::Below), model.stop_time(step, Approach::Below));
        let start_s = 0.5 * model.settles_within(SpeedStep::STAND, step).as_s();
        let stop_s = (time.as_s() - (distance / cruise).as_s()).max(0.0);
        Pace { cruise, start_s, stop_s, reversal_s: REVERSAL_S }
    }
}

/// The steps that move a train, ascending.
fn steps(model: &MotionModel) -> impl Iterator<Item = SpeedStep> {
    let all = (1..=model.highest().get()).filter_map(SpeedStep::new);
    all.filter(|step| model.uses(*step) == StepUse::Moves)
}
