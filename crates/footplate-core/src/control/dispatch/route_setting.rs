//! Route setting: each turnout of a run is commanded twice, so that an occasional failure has no effect.

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

/// The number of commands to each turnout. One that fails once in 300 fails twice in a row once in 90 000, if its
/// failures are independent; others are found when a train takes the other leg.
pub(super) const SURE: u8 = 2;

/// The last commands to a turnout.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TurnoutCommand {
    pub(super) leg: Leg,
    /// The number of commands to this leg in a row.
    pub(super) times: u8,
    pub(super) last: Timestamp,
}

impl TurnoutCommand {
    /// A remembered position: the turnout is commanded again before it is used.
    pub(super) const fn remembered(now: Timestamp, leg: Leg) -> Self {
        Self { leg, times: 0, last: now }
    }

    /// A position that a train has shown.
    pub(super) const fn confirmed(now: Timestamp, leg: Leg) -> Self {
        Self { leg, times: SURE, last: now }
    }
}

/// From the command until the points have moved: solenoids take 0.1 to 0.3 s.
const POINTS_MOVE: TimeSpan = TimeSpan::from_ms(350);
/// A turnout command is sent within this time: two polls, and the solenoids of a dozen others before it.
const SENT_WITHIN: TimeSpan = TimeSpan::from_s(5.0);
/// A journey is given up if the commands to a turnout were not sent for this long, although the station answers: the line
/// garbles data, or the link has no such turnout address. That is three commands.
const NEVER_SENT: TimeSpan = TimeSpan::from_s(15.0);
/// An authority is withdrawn if a turnout cannot be thrown for this long: a train is nearer to it than estimated.
const PATIENCE: TimeSpan = TimeSpan::from_s(8.0);

/// A turnout of unknown position that a train at rest is before or on, so that its position is unknown.
pub(super) struct UnknownTurnout {
    turnout: TurnoutId,
    train: TrainId,
    /// Whether the train is at rest before it, clear of it.
    pub(super) is_clear: bool,
}

impl Dispatcher {
    /// Throws the turnouts of the present run of a train. Returns whether all of them are in position.
    pub(super) fn set(&mut self, now: Timestamp, id: TrainId) -> bool {
        let Some(train) = self.trains.get(&id) else { return false };
        let (Some(run), State::Setting { ready, since }) = (train.authorities.front(), train.state) else {
            return false;
        };
        let place = self.watchdog.driver().position(id, now);
        let anchors = place.map(|place| self.anchors(now, id, place)).unwrap_or_default();
        let needs: Vec<TurnoutNeed> = run
            .needs
            .iter()
            .filter(|need| !self.is_trailed_in_place(now, train, need, &anchors))
            .copied()
            .collect();
        let wanted = self.with_partners(&needs);
        let mut frozen = anchors;
        if !train.detected_since_start {
            frozen.extend(train.kept.turnouts());
        }
        let mut locked = self.watchdog.driver().turnouts_under(id, now);
        locked.extend(&frozen);
        let is_set =
            |need: &TurnoutNeed| self.watchdog.driver().turnouts().get(need.turnout) == Some(need.leg);
        // A turnout under the train stays in its position, even if that was not confirmed.
        let stays = |need: &TurnoutNeed| locked.contains(&need.turnout) && is_set(need);
        let is_missing = |need: &TurnoutNeed| !self.is_certain(*need) && !stays(need);
        let missing: Vec<TurnoutNeed> = wanted.into_iter().filter(is_missing).collect();
        if missing.is_empty() {
            let ready = ready.unwrap_or(if now == since { now } else { now + POINTS_MOVE });
            if ready > now {
                self.set_state(id, State::Setting { ready: Some(ready), since });
            }
            return ready <= now;
        }
        if self.blocks_itself(now, id, &missing, &locked) {
            return false;
        }
        if now - since >= NEVER_SENT
            && !self.watchdog.is_interrupted(now, id)
            && let Some(turnout) = self.not_sent(now, &missing)
        {
            self.throwing.remove(&turnout);
            self.cannot_go(now, id, Refusal::TurnoutNotSent { turnout });
            return false;
        }
        for need in missing {
            // A second command that fails could leave moving points halfway.
            let moves =
                |commanded: &TurnoutCommand| commanded.leg == need.leg && now - commanded.last < POINTS_MOVE;
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
                Err(_) if !need.facing && locked.contains(&need.turnout) => {
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

    /// A turnout whose last command was not sent in time.
    fn not_sent(&self, now: Timestamp, missing: &[TurnoutNeed]) -> Option<TurnoutId> {
        let is_late =
            |turnout: &TurnoutId| self.throwing.contains_key(turnout) && !self.is_being_thrown(now, *turnout);
        missing.iter().map(|need| need.turnout).find(is_late)
    }

    /// Withdraws the authority of a train that is too near to a turnout of its run: another path may help, waiting
    /// does not. Not while a turnout command is pending, because no train would have reserved that turnout then.
    fn blocks_itself(
        &mut self,
        now: Timestamp,
        id: TrainId,
        missing: &[TurnoutNeed],
        locked: &BTreeSet<TurnoutId>,
    ) -> bool {
        if missing.iter().any(|need| self.is_being_thrown(now, need.turnout)) {
            return false;
        }
        let is_set =
            |need: &TurnoutNeed| self.watchdog.driver().turnouts().get(need.turnout) == Some(need.leg);
        let blocked =
            missing.iter().find(|need| need.facing && locked.contains(&need.turnout) && !is_set(need));
        let Some(turnout) = blocked.map(|need| need.turnout) else { return false };
        self.withdraw(now, id, Some(Refusal::TurnoutOccupied { turnout, train: id }));
        true
    }

    /// Whether a turnout command may still be pending. A command that was lost on the line is repeated.
    pub(super) fn is_being_thrown(&self, now: Timestamp, turnout: TurnoutId) -> bool {
        self.throwing.get(&turnout).is_some_and(|(_, since)| now - *since < SENT_WITHIN)
    }

    /// Whether a train trails points that cannot be thrown because it is on them, or on those in the same place.
    fn is_trailed_in_place(
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
        let is_locked = |turnout| {
            anchors.contains(&turnout)
                || self.watchdog.driver().turnouts_under(train.id, now).contains(&turnout)
        };
        train.skipped.contains(&need.turnout) || partner.is_some_and(|partner| is_locked(partner.turnout))
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

    /// The needs of a run, each turnout after the one in the same place that has to be straight for it.
    fn with_partners(&self, needs: &[TurnoutNeed]) -> Vec<TurnoutNeed> {
        needs.iter().flat_map(|need| self.partner(need).into_iter().chain([*need])).collect()
    }

    fn is_certain(&self, need: TurnoutNeed) -> bool {
        self.commanded
            .get(&need.turnout)
            .is_some_and(|commanded| commanded.leg == need.leg && commanded.times >= SURE)
    }

    /// Sets turnouts of unknown position on the hops of trains at rest, whose positions would be unknown otherwise.
    /// Straight is as good as curved.
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
                train.reservation.take_turnout(layout, turnout);
            }
        }
        Ok(())
    }

    /// The first turnout of unknown position on the hop that a train is on; `None` if the position of the train is
    /// known, or unknown for another reason.
    pub(super) fn unknown_turnout_ahead(&self, now: Timestamp, train: TrainId) -> Option<UnknownTurnout> {
        let driver = self.watchdog.driver();
        let located = driver.locate(train, now).filter(|_| driver.position(train, now).is_none())?;
        let front = located.at.distance + self.envelope(now, self.trains.get(&train)?).ahead;
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

    /// A turnout command was sent.
    pub(super) fn turnout_commanded(&mut self, now: Timestamp, turnout: TurnoutId, curved: bool) {
        let requested = self.throwing.remove(&turnout);
        if let Some((id, _)) =
            requested.filter(|(id, _)| self.trains.get(id).is_some_and(DispatchedTrain::rests))
        {
            self.reserve_standstill(now, id);
        }
        let leg = Leg::from_curved(curved);
        let known = self.commanded.get(&turnout).filter(|commanded| commanded.leg == leg);
        let times = known.map_or(1, |known| {
            // The session repeats a command that was lost: these are one command.
            let is_repeated = known.times > 0 && now - known.last < POINTS_MOVE;
            known.times.saturating_add(u8::from(!is_repeated))
        });
        self.commanded.insert(turnout, TurnoutCommand { leg, times, last: now });
    }

    /// A train has shown the position of a turnout.
    pub(super) fn turnout_observed(&mut self, now: Timestamp, turnout: TurnoutId, curved: bool) {
        self.commanded.insert(turnout, TurnoutCommand::confirmed(now, Leg::from_curved(curved)));
    }

    pub(super) fn set_state(&mut self, id: TrainId, state: State) {
        if let Some(train) = self.trains.get_mut(&id) {
            train.state = state;
        }
    }
}
