//! A dispatched train: its journey, its authorities and its reservation.

use alloc::collections::{BTreeSet, VecDeque};
use alloc::vec::Vec;

use crate::control::drive::{Aim, Order, OrderId};
use crate::ids::{TrainId, TurnoutId};
use crate::time::Timestamp;
use crate::track::{Landmark, Layout, Position};
use crate::units::Length;

use super::movement_authority::{MovementAuthority, TrainLengths};
use super::path::OccupiedPath;
use super::reservation::Reservation;

/// A destination, by any path and with any number of reversals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Journey {
    /// The target of the leading end of the pickup.
    pub target: Landmark,
    /// The quantile of the predicted rest that shall be there.
    pub aim: Aim,
    /// Whether the train has to face in the landmark's direction. Otherwise it arrives from the quicker side.
    pub faces: bool,
}

impl Journey {
    /// A stop with its median at a place, from the quicker side.
    pub const fn to(target: Landmark) -> Self {
        Self { target, aim: Aim::Median, faces: false }
    }
}

/// A journey that has not ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Assignment {
    pub(super) order: OrderId,
    pub(super) journey: Journey,
    pub(super) place: Position,
    pub(super) since: Timestamp,
    /// When it joined the queue: trains are examined in this order.
    pub(super) queued_at: Timestamp,
}

/// An order that a recovery interrupted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct InterruptedOrder {
    pub(super) id: OrderId,
    pub(super) order: Order,
    /// When its train was recovered, and when it was given again last.
    pub(super) since: Timestamp,
    pub(super) tried: Option<Timestamp>,
}

/// Why a train runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    Journey,
    /// To make room for another train, or for itself.
    Aside(TrainId),
}

/// What a train is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum State {
    /// At rest, without authority.
    Resting,
    /// Its route is being set; `ready` is when the points have moved, once all commands were sent.
    Setting { ready: Option<Timestamp>, since: Timestamp },
    /// It reverses.
    Reversing { order: OrderId },
    /// It runs. Its rear is certainly beyond `rear` on the path; `confirmed`: a sensor has reported it.
    Running { order: OrderId, rear: Length, confirmed: bool },
    /// It was commanded to stop. `confirmed`: a sensor reported it; `strayed`: it is on track that was not reserved
    /// for it.
    Halting { confirmed: bool, strayed: bool },
    /// An operator drives it.
    ByHand,
    /// Its position is unknown.
    Lost,
    /// Its watchdog stopped it, and locates and measures it again.
    InDanger,
}

/// A train that is dispatched.
#[derive(Debug, Clone)]
pub(super) struct DispatchedTrain {
    pub(super) id: TrainId,
    pub(super) lengths: TrainLengths,
    pub(super) assigned: Option<Assignment>,
    pub(super) purpose: Purpose,
    /// The order that a recovery interrupted and that is given again.
    pub(super) interrupted: Option<InterruptedOrder>,
    /// When it shall be at rest by its last order to arrive.
    pub(super) arrives_by: Option<Timestamp>,
    /// The journey that its authorities are for; another may have been ordered since.
    pub(super) authorised_for: Option<OrderId>,
    /// The last run to its destination, if it was stopped before its end.
    pub(super) last_run: Option<MovementAuthority>,
    /// The authorities of its runs, the present one first.
    pub(super) authorities: VecDeque<MovementAuthority>,
    pub(super) state: State,
    /// Its reservation.
    pub(super) reservation: Reservation,
    /// Track that it had reserved before, on which it may still be: see [`reserve`](Self::reserve).
    pub(super) kept: Reservation,
    /// Turnouts that it trails on its present run, because they cannot be thrown under it.
    pub(super) skipped: BTreeSet<TurnoutId>,
    /// Places where it can stop, each with whether it is clear of all turnouts there.
    pub(super) parking: Vec<(Position, bool)>,
    /// The edges that it occupies or came over.
    pub(super) occupied: OccupiedPath,
    /// How often others have stepped aside for it since it last started, or went to the end of the queue.
    pub(super) times_aside: u32,
    /// No train steps aside for it before this time, because a search failed.
    pub(super) no_room_until: Timestamp,
    /// Whether a sensor has reported it since it reversed or was placed.
    pub(super) detected_since_reversal: bool,
    /// Whether a sensor has reported it since it last started; of a train driven by hand, since it last ran. Until then it may still
    /// be there: trains stall on dirt.
    pub(super) detected_since_start: bool,
    /// Its last run ended while its position depended on an ambiguous detection: it keeps the track of that run meanwhile.
    pub(super) ambiguous_at_rest: bool,
    /// A sensor did not report it, and no path leads ahead: it may run back to be detected.
    pub(super) looks_back: bool,
    /// It has run a short distance ahead to be detected, since its last detection.
    pub(super) has_looked_ahead: bool,
    /// The running time without other trains, in seconds; `None` until it was calculated.
    pub(super) unobstructed_s: Option<f64>,
    /// The factor on its overrun; above 1 after a stop at its end of authority.
    pub(super) caution: f64,
    /// When it was last examined while it waited.
    pub(super) examined_at: Timestamp,
    /// It gets no authority before this time.
    pub(super) not_before: Timestamp,
    /// How many times in a row its authority was withdrawn.
    pub(super) withdrawn: u8,
    /// Whether it was reported to wait.
    pub(super) waiting_reported: bool,
}

impl DispatchedTrain {
    pub(super) fn new(id: TrainId, lengths: TrainLengths) -> Self {
        Self {
            id,
            lengths,
            assigned: None,
            purpose: Purpose::Journey,
            interrupted: None,
            arrives_by: None,
            authorised_for: None,
            last_run: None,
            authorities: VecDeque::new(),
            state: State::Resting,
            reservation: Reservation::empty(),
            kept: Reservation::empty(),
            skipped: BTreeSet::new(),
            parking: Vec::new(),
            occupied: OccupiedPath::default(),
            times_aside: 0,
            no_room_until: Timestamp::ZERO,
            detected_since_reversal: false,
            detected_since_start: true,
            ambiguous_at_rest: false,
            looks_back: false,
            has_looked_ahead: false,
            unobstructed_s: None,
            caution: 1.0,
            examined_at: Timestamp::ZERO,
            not_before: Timestamp::ZERO,
            withdrawn: 0,
            waiting_reported: false,
        }
    }

    /// Reserves track for it at rest, and the track of its runs since a sensor reported it last: it may have stalled on any of that.
    pub(super) fn reserve(&mut self, layout: &Layout, standstill: Reservation) {
        if self.detected_since_start {
            self.kept = Reservation::empty();
        }
        self.reservation = standstill;
        self.reservation.add(layout, &self.kept);
    }

    /// Whether it has a journey, or an order that is given again.
    pub(super) const fn has_order(&self) -> bool {
        self.assigned.is_some() || self.interrupted.is_some()
    }

    /// The train that it steps aside for.
    pub(super) fn makes_room_for(&self) -> Option<TrainId> {
        match self.purpose {
            Purpose::Aside(train) => Some(train),
            _ => None,
        }
    }

    /// Whether it is at rest without authority.
    pub(super) fn rests(&self) -> bool {
        self.state == State::Resting
    }

    /// Whether a turnout is reserved for it.
    pub(super) fn keeps(&self, turnout: TurnoutId) -> bool {
        self.state != State::ByHand && self.reservation.takes(turnout)
    }

    /// Whether it can get an authority now.
    pub(super) fn is_ready(&self, now: Timestamp) -> bool {
        self.rests() && self.not_before <= now
    }
}
