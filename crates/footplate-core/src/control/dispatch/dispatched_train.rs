//! A dispatched train: its journey, its authorities and its reservation.

use alloc::collections::{BTreeSet, VecDeque};
use alloc::vec::Vec;

use crate::control::drive::OrderId;
use crate::ids::{TrainId, TurnoutId};
use crate::time::Timestamp;
use crate::track::Position;
use crate::units::Length;

use super::journey::{Journey, TrainLengths};
use super::movement_authority::MovementAuthority;
use super::occupied_path::OccupiedPath;
use super::reservation::Reservation;

/// A journey that has not ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Asked {
    pub(super) order: OrderId,
    pub(super) journey: Journey,
    pub(super) place: Position,
    pub(super) since: Timestamp,
    /// When it joined the queue: trains are examined in this order.
    pub(super) queues: Timestamp,
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
    /// Its route is being set; `ready` is when the points have moved, once all commands have left.
    Setting { ready: Option<Timestamp>, since: Timestamp },
    /// It reverses.
    Turning { order: OrderId },
    /// It runs. Its rear end has certainly come as far as `rear` on the path; `confirmed`: a sensor has said so.
    Running { order: OrderId, rear: Length, confirmed: bool },
    /// It was commanded to stop, without a plan for afterwards. `confirmed`: a sensor reported it; `strayed`: on track that was
    /// not reserved for it.
    Halting { confirmed: bool, strayed: bool },
    /// A person drives it.
    ByHand,
    /// Its place is unknown.
    Lost,
    /// Its watchdog stopped it, and locates and measures it again.
    InDanger,
}

/// A train that is dispatched.
#[derive(Debug, Clone)]
pub(super) struct DispatchedTrain {
    pub(super) id: TrainId,
    pub(super) lengths: TrainLengths,
    pub(super) asked: Option<Asked>,
    pub(super) purpose: Purpose,
    /// The journey that its runs were authorised for; another may have been ordered since.
    pub(super) granted_for: Option<OrderId>,
    /// The last run to its destination, of a train that was stopped before its end.
    pub(super) last_run: Option<MovementAuthority>,
    /// The authorised runs, the present one first.
    pub(super) course: VecDeque<MovementAuthority>,
    pub(super) state: State,
    /// Its reservation.
    pub(super) held: Reservation,
    /// What it had reserved before and may still be on.
    pub(super) kept: Reservation,
    /// Turnouts that cannot be thrown for its present run because it is on them.
    pub(super) skipped: BTreeSet<TurnoutId>,
    /// Places where it can be at rest, each with whether it is clear of all turnouts.
    pub(super) parking: Vec<(Position, bool)>,
    /// The path by which it came.
    pub(super) came: OccupiedPath,
    /// How often others have stepped aside for it since it last left, or went to the end of the queue.
    pub(super) rooms_made: u32,
    /// No train is moved for it before this: a search failed.
    pub(super) no_room_until: Timestamp,
    /// Whether a sensor has reported it since it reversed, or since a person placed it.
    pub(super) seen_since_turn: bool,
    /// Whether a sensor has reported it since it last left. Until then it may still be there: trains get stuck on dirt.
    pub(super) seen_since_start: bool,
    /// A sensor did not report it, and no path leads ahead: it looks back.
    pub(super) looks_back: bool,
    /// It has run a short distance ahead for the same reason since a sensor reported it last.
    pub(super) has_looked_ahead: bool,
    /// The running time from here without other trains, in seconds; `None` until it was calculated.
    pub(super) unobstructed_s: Option<f64>,
    /// The factor on its overrun: above 1 after it was stopped at its end of authority.
    pub(super) caution: f64,
    /// When it was last examined while it waited.
    pub(super) looked_at: Timestamp,
    /// It gets no authority before this.
    pub(super) not_before: Timestamp,
    /// How many times in a row its authority was withdrawn.
    pub(super) withdrawn: u8,
    /// Whether a notice has said that it waits.
    pub(super) waits_said: bool,
}

impl DispatchedTrain {
    pub(super) fn new(id: TrainId, lengths: TrainLengths) -> Self {
        Self {
            id,
            lengths,
            asked: None,
            purpose: Purpose::Journey,
            granted_for: None,
            last_run: None,
            course: VecDeque::new(),
            state: State::Resting,
            held: Reservation::empty(),
            kept: Reservation::empty(),
            skipped: BTreeSet::new(),
            parking: Vec::new(),
            came: OccupiedPath::default(),
            rooms_made: 0,
            no_room_until: Timestamp::ZERO,
            seen_since_turn: false,
            seen_since_start: true,
            looks_back: false,
            has_looked_ahead: false,
            unobstructed_s: None,
            caution: 1.0,
            looked_at: Timestamp::ZERO,
            not_before: Timestamp::ZERO,
            withdrawn: 0,
            waits_said: false,
        }
    }

    /// Whether it is at rest without authority.
    pub(super) fn rests(&self) -> bool {
        self.state == State::Resting
    }

    /// Whether a turnout is reserved for it.
    pub(super) fn keeps(&self, turnout: TurnoutId) -> bool {
        self.state != State::ByHand && self.held.takes(turnout)
    }

    /// Whether it can be given an authority now.
    pub(super) fn is_ready(&self, now: Timestamp) -> bool {
        self.rests() && self.not_before <= now
    }
}
