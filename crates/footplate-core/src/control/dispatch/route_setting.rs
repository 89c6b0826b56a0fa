//! Route setting: each turnout of a run is commanded twice, so that one that fails now and then does not matter.

use alloc::collections::BTreeSet;
use alloc::vec::Vec;

use crate::control::drive::{Order, Refusal};
use crate::ids::{TrainId, TurnoutId};
use crate::time::{TimeSpan, Timestamp};
use crate::track::{Leg, NodeKind, TurnoutNeed};
use crate::units::Length;

use super::dispatched_train::{DispatchedTrain, State};
use super::dispatcher::Dispatcher;
use super::path::edge_from;
use super::turnout_command::{SURE, TurnoutCommand};

/// From the command until the points have moved: solenoids take 0.1 to 0.3 s.
const MOVES: TimeSpan = TimeSpan::from_ms(350);
/// A command to a turnout leaves within this: two polls, and the solenoids of a dozen others before it.
const TOLD_WITHIN: TimeSpan = TimeSpan::from_s(5.0);
/// The authority is withdrawn when a turnout cannot be thrown for this long: a train is nearer to it than was estimated.
const PATIENCE: TimeSpan = TimeSpan::from_s(8.0);

/// A turnout whose unknown position leaves open where the train before it, or on it, is.
pub(super) struct UnknownTurnout {
    turnout: TurnoutId,
    train: TrainId,
    /// Whether the train is at rest before it, clear of it.
    pub(super) is_clear: bool,
}

impl Dispatcher {
    /// Throws the turnouts of the present run of a train. Returns whether all of them lie right by now.
    pub(super) fn set(&mut self, now: Timestamp, id: TrainId) -> bool {
        let Some(train) = self.trains.get(&id) else { return false };
        let (Some(run), State::Setting { ready, since }) = (train.course.front(), train.state) else {
            return false;
        };
        let place = self.watchdog.driver().position(id, now);
        let anchors = place.map(|place| self.anchors(now, id, place)).unwrap_or_default();
        let needs: Vec<TurnoutNeed> =
            run.needs.iter().filter(|need| !self.gives_way(now, train, need, &anchors)).copied().collect();
        let wanted = self.with_partners(&needs);
        let mut frozen = anchors;
        if !train.seen_since_start {
            frozen.extend(train.kept.turnouts());
        }
        let mut held_down = self.watchdog.driver().turnouts_under(id, now);
        held_down.extend(&frozen);
        let lies = |need: &TurnoutNeed| self.watchdog.driver().turnouts().get(need.turnout) == Some(need.leg);
        // A turnout under the train stays as it is, however sure that is.
        let stays = |need: &TurnoutNeed| held_down.contains(&need.turnout) && lies(need);
        let is_missing = |need: &TurnoutNeed| !self.is_sure(*need) && !stays(need);
        let missing: Vec<TurnoutNeed> = wanted.into_iter().filter(is_missing).collect();
        if missing.is_empty() {
            let ready = ready.unwrap_or(if now == since { now } else { now + MOVES });
            if ready > now {
                self.set_state(id, State::Setting { ready: Some(ready), since });
            }
            return ready <= now;
        }
        if self.is_in_its_own_way(now, id, &missing, &held_down) {
            return false;
        }
        for need in missing {
            // A second command that fails could leave moving points halfway.
            let moves =
                |commanded: &TurnoutCommand| commanded.leg == need.leg && now - commanded.last < MOVES;
            if self.is_being_thrown(now, need.turnout) || self.commanded.get(&need.turnout).is_some_and(moves)
            {
                continue;
            }
            let order = Order::Turnout { turnout: need.turnout, curved: need.leg.is_curved() };
            let taken = if frozen.contains(&need.turnout) {
                Err(Refusal::TurnoutOccupied { turnout: need.turnout, train: id })
            } else {
                self.watchdog.order(now, order)
            };
            match taken {
                Ok(_) => {
                    self.throwing.insert(need.turnout, (id, now));
                }
                // The train is on the points and trails them.
                Err(_) if !need.facing && held_down.contains(&need.turnout) => {
                    if let Some(train) = self.trains.get_mut(&id) {
                        train.skipped.insert(need.turnout);
                    }
                }
                Err(why) if now - since > PATIENCE => {
                    self.withdraw(now, id, Some(why));
                    return false;
                }
                Err(_) => {}
            }
        }
        false
    }

    /// Withdraws the authority of a train that is too near to a turnout of its run: waiting does not help, another path may.
    /// Not while a command to a turnout is under way, which no train would have reserved then.
    fn is_in_its_own_way(
        &mut self,
        now: Timestamp,
        id: TrainId,
        missing: &[TurnoutNeed],
        held_down: &BTreeSet<TurnoutId>,
    ) -> bool {
        if missing.iter().any(|need| self.is_being_thrown(now, need.turnout)) {
            return false;
        }
        let lies = |need: &TurnoutNeed| self.watchdog.driver().turnouts().get(need.turnout) == Some(need.leg);
        let blocked =
            missing.iter().find(|need| need.facing && held_down.contains(&need.turnout) && !lies(need));
        let Some(turnout) = blocked.map(|need| need.turnout) else { return false };
        self.withdraw(now, id, Some(Refusal::TurnoutOccupied { turnout, train: id }));
        true
    }

    /// Whether a command to a turnout may still be under way. One that was lost on the line is given again.
    pub(super) fn is_being_thrown(&self, now: Timestamp, turnout: TurnoutId) -> bool {
        self.throwing.get(&turnout).is_some_and(|(_, since)| now - *since < TOLD_WITHIN)
    }

    /// Whether a train trails points that cannot be thrown, as it is on them, or on those in the same place.
    fn gives_way(
        &self,
        now: Timestamp,
        train: &DispatchedTrain,
        need: &TurnoutNeed,
        anchors: &BTreeSet<TurnoutId>,
    ) -> bool {
        if need.facing {
            return false;
        }
        let partner = self.partner(need).filter(|partner| !self.watchdog.driver().turnouts().allow(*partner));
        let is_held_down = |turnout| {
            anchors.contains(&turnout)
                || self.watchdog.driver().turnouts_under(train.id, now).contains(&turnout)
        };
        train.skipped.contains(&need.turnout) || partner.is_some_and(|partner| is_held_down(partner.turnout))
    }

    /// The need of the turnout in the same place.
    fn partner(&self, need: &TurnoutNeed) -> Option<TurnoutNeed> {
        let turnout = self
            .watchdog
            .driver()
            .layout()
            .never_curved_with(need.turnout)
            .filter(|_| need.leg.is_curved())?;
        Some(TurnoutNeed { turnout, leg: Leg::Straight, facing: true })
    }

    /// The needs of a run, each turnout after the one in the same place that has to lie straight for it.
    fn with_partners(&self, needs: &[TurnoutNeed]) -> Vec<TurnoutNeed> {
        needs.iter().flat_map(|need| self.partner(need).into_iter().chain([*need])).collect()
    }

    fn is_sure(&self, need: TurnoutNeed) -> bool {
        self.commanded
            .get(&need.turnout)
            .is_some_and(|commanded| commanded.leg == need.leg && commanded.times >= SURE)
    }

    /// Sets turnouts of unknown position that keep trains at rest from having a place: one on the hop that a train is on
    /// leaves open which track that leads to. Straight does as well as curved.
    ///
    /// # Errors
    /// A train may be on such a turnout.
    pub(super) fn set_unknown_turnouts(&mut self, now: Timestamp) -> Result<(), Refusal> {
        let rests = self.trains.values().filter(|train| train.rests());
        let unknown: Vec<UnknownTurnout> =
            rests.filter_map(|train| self.unknown_turnout_ahead(now, train.id)).collect();
        if let Some(UnknownTurnout { turnout, train, .. }) = unknown.iter().find(|unknown| !unknown.is_clear)
        {
            return Err(Refusal::TurnoutUnknown { turnout: *turnout, train: *train });
        }
        for UnknownTurnout { turnout, train, .. } in unknown {
            if self.is_being_thrown(now, turnout) {
                continue;
            }
            self.watchdog.order(now, Order::Turnout { turnout, curved: false })?;
            self.throwing.insert(turnout, (train, now));
            let layout = self.watchdog.driver().layout();
            if let Some(train) = self.trains.get_mut(&train) {
                train.held.take_turnout(layout, turnout);
            }
        }
        Ok(())
    }

    /// The first turnout of unknown position on the hop that a train is on; `None` where the train has a place, or none is
    /// the reason that it has not.
    pub(super) fn unknown_turnout_ahead(&self, now: Timestamp, train: TrainId) -> Option<UnknownTurnout> {
        let driver = self.watchdog.driver();
        let located = driver.locate(train, now).filter(|_| driver.position(train, now).is_none())?;
        let front = located.at.way + self.room(now, self.trains.get(&train)?).ahead;
        let (layout, turnouts) = (driver.layout(), driver.turnouts());
        let (mut node, mut distance) = (located.at.node, Length::ZERO);
        for _ in 0..layout.edges().len() {
            if let NodeKind::Branch(turnout) = layout.node(node)?.kind
                && turnouts.get(turnout).is_none()
            {
                return Some(UnknownTurnout {
                    turnout,
                    train,
                    is_clear: located.at_rest && front < distance,
                });
            }
            let edge = layout.edge(edge_from(layout, turnouts, node)?)?;
            distance += edge.length;
            node = edge.to;
        }
        None
    }

    /// A command to a turnout has left.
    pub(super) fn turnout_told(&mut self, now: Timestamp, turnout: TurnoutId, curved: bool) {
        let asked_for = self.throwing.remove(&turnout);
        if let Some((id, _)) =
            asked_for.filter(|(id, _)| self.trains.get(id).is_some_and(DispatchedTrain::rests))
        {
            self.stand(now, id);
        }
        let leg = Leg::from_curved(curved);
        let times = self
            .commanded
            .get(&turnout)
            .filter(|commanded| commanded.leg == leg)
            .map_or(0, |commanded| commanded.times);
        self.commanded.insert(turnout, TurnoutCommand { leg, times: times.saturating_add(1), last: now });
    }

    /// A train has shown how a turnout lies.
    pub(super) fn turnout_shown(&mut self, now: Timestamp, turnout: TurnoutId, curved: bool) {
        self.commanded.insert(turnout, TurnoutCommand::sure(now, Leg::from_curved(curved)));
    }

    pub(super) fn set_state(&mut self, id: TrainId, state: State) {
        if let Some(train) = self.trains.get_mut(&id) {
            train.state = state;
        }
    }
}
