//! Granting trains the track to their destinations: all of it at once, so that nobody who has set out has to wait.

use alloc::collections::VecDeque;
use alloc::vec::Vec;

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
use super::movement_authority::{MovementAuthority, Start, granted};
use super::obstacles::Obstacles;
use super::occupied_path::OccupiedPath;
use super::reservation::Reservation;
use super::way::Way;
use crate::control::Notice;

/// What waiting for a train at rest is likely to cost, and for one that runs, in seconds: somebody has to send the one
/// away, and the other will be gone soon.
const RESTING_S: f64 = 20.0;
const RUNNING_S: f64 = 8.0;
/// A way round others is taken if it takes no longer than this many times the way through them, and this much more.
const LONGER: f64 = 1.5;
const LONGER_BY_S: f64 = 10.0;
/// Who has waited so long is next: nobody else is granted what is on its way.
const PATIENCE: TimeSpan = TimeSpan::from_s(45.0);
/// When all trains at rest have waited so long and nobody runs, nothing that was looked for will be found.
const STALLED: TimeSpan = TimeSpan::from_s(20.0);
/// Who waits is looked at again after this long, whatever happens: much does that is nothing to it.
const LOOK_AGAIN: TimeSpan = TimeSpan::from_ms(800);
/// From the end of a run until its train is taken to stand, and turning around: commands and margins of time.
const TURN_S: f64 = 1.5;
/// Stops from faster than this scatter too much to be worth it (20 mm at 600 mm/s).
const FASTEST: Speed = Speed::from_mm_per_s(450.0);
/// Slower trains stall on dirty rails, and are where nobody knows; and they keep everybody waiting.
const CRAWL: Speed = Speed::from_mm_per_s(120.0);
/// No model train is taken to run slower than this on the way.
const SLOWEST: Speed = Speed::from_mm_per_s(60.0);
/// How often a stop may end beyond what is held, as standard deviations: one in a thousand, and a little room so that
/// the guard, which looks at the same, seldom cuts a stop short.
const OVERRUN: f64 = 3.09 + 0.5;
/// What is not known of the place at which a stop begins: contacts, survey and speed, one standard deviation.
const PLACE: Length = Length::from_mm(10.0);
/// An overrun is not taken for less, nor more: nothing is known so well, and a train that needs more is one of which
/// nobody knows how it stops (its limit would stop it again and again if it were granted less than it needs).
const OVERRUNS: [Length; 2] = [Length::from_mm(40.0), Length::from_mm(1_200.0)];

/// A way to somewhere with the track that it takes.
#[derive(Debug, Clone)]
pub(super) struct Proposal {
    pub(super) itinerary: Itinerary,
    pub(super) runs: Vec<MovementAuthority>,
}

impl Proposal {
    pub(super) fn meets(&self, held: &Reservation) -> bool {
        self.runs.iter().any(|run| run.taken.meets(held))
    }
}

impl Dispatcher {
    /// Looks at all trains at rest that want to go somewhere, those that have waited longest first, unless room was made for
    /// them again and again in vain.
    pub(super) fn arrange(&mut self, now: Timestamp) {
        let mut waiting: Vec<(Timestamp, Timestamp, TrainId)> = self
            .trains
            .values()
            .filter(|train| train.is_ready(now))
            .filter_map(|train| Some((train.asked?.queues, train.asked?.since, train.id)))
            .collect();
        waiting.sort_unstable();
        let mut kept_free: Option<Proposal> = None;
        let mut all_wait = !waiting.is_empty();
        for (queues, since, id) in waiting.iter().copied() {
            // It may have been sent out of another's way meanwhile.
            if !self.trains.get(&id).is_some_and(|train| train.is_ready(now)) {
                continue;
            }
            if self
                .trains
                .get(&id)
                .is_some_and(|train| train.waits_said && now - train.looked_at < LOOK_AGAIN)
            {
                continue;
            }
            let (Some(targets), Some(start)) = (self.targets(id), self.start(now, id)) else { continue };
            let unobstructed = self.unobstructed(now, id, &start, &targets);
            let Some(unobstructed) = unobstructed else {
                if self.watchdog.driver().missed_sensor(id, now).is_none() {
                    self.cannot_go(now, id, self.no_way(id));
                } else if !self.begins_to_look_back(id) {
                    self.lose(now, id);
                }
                continue;
            };
            let free = self.free_way(id, &start, &targets).filter(|free| {
                let allowed = unobstructed * LONGER + LONGER_BY_S + (now - since).as_s();
                // Who stands in the way of the one that is next does best to go.
                let is_in_the_way =
                    |wish: &Proposal| self.trains.get(&id).is_some_and(|train| wish.meets(&train.held));
                let spares = kept_free.as_ref().is_none_or(|wish| {
                    is_in_the_way(wish) || !free.runs.iter().any(|run| wish.meets(&run.taken))
                });
                free.itinerary.seconds <= allowed && spares
            });
            if let Some(free) = free {
                self.grant(now, id, Purpose::Journey, free);
                continue;
            }
            let Some(wish) = self.wish(id, &start, &targets) else { continue };
            self.waits(id, &wish);
            self.make_room(now, id, &targets, &wish);
            let mut running = self.trains.values().filter(|train| !train.course.is_empty());
            let room_is_made = running.clone().any(|train| train.purpose == Purpose::Aside(id));
            // Nothing is kept free for who waits for trains at rest: they might stand there for ever.
            let somebody_passes = running.any(|train| wish.meets(&train.held));
            if kept_free.is_none() && (room_is_made || somebody_passes && now - queues >= PATIENCE) {
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

    /// How long a train would take if it were alone, in seconds; `None` if it could never come there.
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
            train.looked_at = now;
        }
        seconds
    }

    /// The places at which a train would have arrived.
    pub(super) fn targets(&self, id: TrainId) -> Option<Vec<Position>> {
        let asked = self.trains.get(&id)?.asked?;
        let other = self.watchdog.driver().layout().reversed(asked.place).filter(|_| !asked.journey.faces);
        Some([Some(asked.place), other].into_iter().flatten().collect())
    }

    /// Where a train at rest begins.
    pub(super) fn start(&self, now: Timestamp, id: TrainId) -> Option<Start> {
        let train = self.trains.get(&id)?;
        let place = self.watchdog.driver().position(id, now)?;
        let room = self.room(now, train);
        let as_it_lies = |turnout| {
            let leg = self.watchdog.driver().turnouts().get(turnout)?;
            Some(TurnoutNeed { turnout, leg, facing: true })
        };
        let mut near = self.watchdog.driver().turnouts_under(id, now);
        near.extend(self.anchors(now, id, place));
        let looks_back = train.looks_back;
        if looks_back || !train.seen_since_start {
            near.extend(train.held.turnouts());
        }
        let frozen = near.into_iter().filter_map(as_it_lies).collect();
        let is_sure = self.watchdog.driver().missed_sensor(id, now).is_none() || looks_back;
        let may_turn = is_sure && !self.is_on_points_that_gave_way(now, id);
        let turned = self.watchdog.driver().reversed_position(id, now).filter(|_| may_turn);
        let came = train.came.clone();
        let may_back_away = train.seen_since_turn;
        Some(Start { place, came, room, pace: self.pace(id), frozen, turned, may_back_away })
    }

    /// The soonest way past obstacles, with what it takes.
    pub(super) fn propose(
        &self,
        start: &Start,
        targets: &[Position],
        obstacles: &Obstacles,
    ) -> Option<Proposal> {
        let search = self.search(start, obstacles);
        let turned = self.turned(start);
        let proposed = |search: Search<'_>, ahead: Option<Position>| {
            let reached = search.from(ahead, turned);
            // The soonest may need a turnout both ways at once where another does not.
            reached.to(targets).into_iter().find_map(|itinerary| self.proposal(start, itinerary))
        };
        let ahead = Some(start.place);
        // Where turnouts just ahead lie otherwise and cannot be thrown, it backs away from them first.
        proposed(search, ahead)
            .or_else(|| proposed(Search { points_give_way: false, ..search }, ahead))
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
        let clears = start.room.rear + start.room.overrun;
        Search {
            layout: self.watchdog.driver().layout(),
            pace: start.pace,
            clears,
            beyond: start.room.overrun + start.room.front,
            turnouts: self.watchdog.driver().turnouts(),
            obstacles,
            frozen: &start.frozen,
            points_give_way: true,
        }
    }

    /// Where the leading end of the pickup would be if the train turned around; `None` where it would back over points
    /// that lie for the other leg. They gave way when it came, and would not when it goes.
    pub(super) fn turned(&self, start: &Start) -> Option<Position> {
        let layout = self.watchdog.driver().layout();
        let turned = start.turned?;
        let (way, at) = Way::around(
            layout,
            self.watchdog.driver().turnouts(),
            turned,
            &OccupiedPath::default(),
            start.room.behind,
            Length::ZERO,
        );
        let lies_otherwise = |need: TurnoutNeed| {
            start.frozen.iter().any(|known| known.turnout == need.turnout && known.leg != need.leg)
        };
        // Its place is counted from the node behind it: the turnout there has to lie as it does, too.
        let own = layout.needs_of(turned.edge);
        let needs = way.needs(layout, at - start.room.behind, at);
        (!needs.into_iter().chain(own).any(|need| need.facing && lies_otherwise(need))).then_some(turned)
    }

    /// The way that a train would take if others made room for it in time; those that nobody can find do not.
    pub(super) fn wish(&self, id: TrainId, start: &Start, targets: &[Position]) -> Option<Proposal> {
        let mut obstacles = Obstacles::default();
        for other in self.trains.values().filter(|other| other.id != id) {
            let seconds = match other.state {
                State::Resting => RESTING_S,
                State::Lost => f64::INFINITY,
                _ => RUNNING_S,
            };
            obstacles.add(&other.held, seconds);
        }
        let wish = self.propose(start, targets, &obstacles);
        // What is closed for good now may not be for ever.
        wish.or_else(|| self.propose(start, targets, &Obstacles::default()))
    }

    /// A way on which nobody is.
    fn free_way(&self, id: TrainId, start: &Start, targets: &[Position]) -> Option<Proposal> {
        self.propose(start, targets, &self.obstacles_of_others(id)).filter(|found| self.is_free(id, found))
    }

    /// Sends a train on its way.
    pub(super) fn grant(&mut self, now: Timestamp, id: TrainId, purpose: Purpose, proposal: Proposal) {
        let turns = proposal.runs.iter().filter(|run| run.turns).count();
        let takes = TimeSpan::from_s(proposal.itinerary.seconds);
        let Some(train) = self.trains.get_mut(&id) else { return };
        train.kept = core::mem::take(&mut train.held);
        train.course = VecDeque::from(proposal.runs);
        train.purpose = purpose;
        train.granted_for = train.asked.filter(|_| purpose == Purpose::Journey).map(|asked| asked.order);
        train.waits_said = false;
        train.unobstructed_s = None;
        train.looks_back = false;
        if purpose == Purpose::Journey {
            train.rooms_made = 0;
        }
        train.last_run = None;
        train.state = State::Setting { ready: None, since: now };
        train.skipped.clear();
        self.hold(now, id);
        self.say(Notice::RouteSet { train: id, takes, turns });
    }

    fn waits(&mut self, id: TrainId, wish: &Proposal) {
        let others = self.trains.values().filter(|other| other.id != id && wish.meets(&other.held));
        let on: Vec<TrainId> = others.map(|other| other.id).collect();
        if let Some(train) = self.trains.get_mut(&id)
            && !core::mem::replace(&mut train.waits_said, true)
        {
            self.say(Notice::Waits { train: id, on });
        }
    }

    pub(super) fn no_way(&self, id: TrainId) -> Refusal {
        let layout = self.watchdog.driver().layout();
        let display = |landmark: Landmark| alloc::format!("{}", layout.display(landmark));
        let target = self.journey(id).map_or_else(Default::default, |(_, journey)| display(journey.target));
        Refusal::Unreachable { train: id, target }
    }

    /// How far a train may come to rest beyond where it should, but for one time in a thousand.
    /// The place is no surer then than now if no contact comes on the way.
    pub(super) fn overrun(&self, id: TrainId, uncertainty: Length) -> Length {
        let place = PLACE.max(uncertainty).as_m();
        let widest = self.watchdog.driver().widest_stop(id);
        let widest = widest.map(|widest| Length::from_m(libm::hypot(widest.as_m(), place)));
        let usual = widest.map_or(OVERRUNS[1], |widest| (widest * OVERRUN).max(OVERRUNS[0]).min(OVERRUNS[1]));
        usual * self.trains.get(&id).map_or(1.0, |train| train.caution)
    }

    /// The step for a run: the fastest at which a train can have settled, and from which it stops surely enough; on ways
    /// that are too short for any the slowest that does not crawl.
    pub(super) fn step_for(
        &self,
        id: TrainId,
        way: Length,
        is_sure: impl Fn(Length) -> bool,
    ) -> Option<SpeedStep> {
        let model = self.watchdog.driver().model(id)?;
        let speed = |step: SpeedStep| model.speed(step, Approach::Below).value;
        let lively = || steps(model).filter(|step| speed(*step) >= CRAWL && speed(*step) <= FASTEST);
        let spread = |step: SpeedStep| {
            let stop = model.stop(step, Approach::Below);
            Length::from_m(libm::hypot(stop.doubt.as_m(), stop.scatter.as_m()))
        };
        let fits = |step: SpeedStep| {
            let stop = model.stop(step, Approach::Below).distance;
            let starts = speed(step) * model.settles_within(SpeedStep::STAND, step);
            starts + stop + PLACE <= way
        };
        lively().filter(|step| fits(*step) && is_sure(spread(*step))).last().or_else(|| lively().next())
    }

    /// How long a train takes for what.
    fn pace(&self, id: TrainId) -> Pace {
        let Some(model) = self.watchdog.driver().model(id) else {
            return Pace { cruise: SLOWEST, start_s: 1.0, stop_s: 1.0, turn_s: TURN_S };
        };
        // Stops are surest from the middle of the steps.
        let usable: Vec<SpeedStep> = steps(model).collect();
        let step = usable.get(usable.len() * 2 / 3).copied().unwrap_or(model.highest());
        let cruise = model.speed(step, Approach::Below).value;
        let cruise = if cruise > SLOWEST { cruise } else { SLOWEST };
        let stop = model.stop(step, Approach::Below);
        let start_s = 0.5 * model.settles_within(SpeedStep::STAND, step).as_s();
        let stop_s = (stop.time.as_s() - (stop.distance / cruise).as_s()).max(0.0);
        Pace { cruise, start_s, stop_s, turn_s: TURN_S }
    }
}

/// The steps that move a train, from below.
fn steps(model: &MotionModel) -> impl Iterator<Item = SpeedStep> {
    let all = (1..=model.highest().get()).filter_map(SpeedStep::new);
    all.filter(|step| model.uses(*step) == StepUse::Moves)
}
