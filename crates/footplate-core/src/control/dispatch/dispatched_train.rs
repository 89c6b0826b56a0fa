//! One train as its dispatcher sees it: what it shall do, what it has been granted and what it holds.

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

/// A journey that was asked for and has not ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Asked {
    pub(super) order: OrderId,
    pub(super) journey: Journey,
    pub(super) place: Position,
    pub(super) since: Timestamp,
    /// Since when it has been waiting for its turn: others that came to wait later are looked at later.
    pub(super) queues: Timestamp,
}

/// Why a train runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    Journey,
    /// To make room for another, or itself.
    Aside(TrainId),
}

/// How far a train is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum State {
    /// It stands, and nothing has been granted to it.
    Resting,
    /// Turnouts are being thrown for its next run; when they will have moved, once all have been told.
    Setting { ready: Option<Timestamp>, since: Timestamp },
    /// It turns around.
    Turning { order: OrderId },
    /// It runs. Its rear end has certainly come as far as this on the way, and whether a contact has said so.
    Running { order: OrderId, rear: Length, confirmed: bool },
    /// It was commanded to stop, and nothing is known of where it will go then; whether a contact said where it is, and whether
    /// that was on track that it had not been granted.
    Halting { confirmed: bool, strayed: bool },
    /// Somebody drives it by hand.
    ByHand,
    /// Nobody knows where it is.
    Lost,
    /// It is not as it was: its watchdog brings it back.
    InDanger,
}

/// A train that is dispatched.
#[derive(Debug, Clone)]
pub(super) struct DispatchedTrain {
    pub(super) id: TrainId,
    pub(super) lengths: TrainLengths,
    pub(super) asked: Option<Asked>,
    pub(super) purpose: Purpose,
    /// The journey that its runs were granted for; another may have been asked for since.
    pub(super) granted_for: Option<OrderId>,
    /// The last run to its destination, of a train that comes to rest before the end of it.
    pub(super) last_run: Option<MovementAuthority>,
    /// The runs granted, the present one first.
    pub(super) course: VecDeque<MovementAuthority>,
    pub(super) state: State,
    /// All that it holds.
    pub(super) held: Reservation,
    /// What it held before and still might be on.
    pub(super) kept: Reservation,
    /// Turnouts that cannot be thrown for its present run because it stands on them.
    pub(super) skipped: BTreeSet<TurnoutId>,
    /// Where it can stand, and whether clear of all turnouts.
    pub(super) parking: Vec<(Position, bool)>,
    /// Where it came from.
    pub(super) came: OccupiedPath,
    /// How often others stepped aside for it since it set out last, or went to the end of the queue.
    pub(super) rooms_made: u32,
    /// Nobody is sent out of its way before this: it was tried in vain.
    pub(super) no_room_until: Timestamp,
    /// Whether a contact has reported it since it turned around, or since a person put it there.
    pub(super) seen_since_turn: bool,
    /// Whether a contact has reported it since it set out last. Until then it may not have left at all: starts get stuck on dirt.
    pub(super) seen_since_start: bool,
    /// It was not seen where it should have been, and ahead of it there is nowhere to be seen: it is looked for behind.
    pub(super) looks_back: bool,
    /// How long it would take from where it stands if nobody were in its way, in seconds; `None` until it was looked for.
    pub(super) unobstructed_s: Option<f64>,
    /// How many times as much it is given to come to rest in as usual: it was stopped for its limit.
    pub(super) caution: f64,
    /// When it was last looked at while it waited.
    pub(super) looked_at: Timestamp,
    /// Nothing is granted to it before this.
    pub(super) not_before: Timestamp,
    /// How many times in a row what was granted to it could not be begun.
    pub(super) withdrawn: u8,
    /// Whether it was said that it waits.
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
            unobstructed_s: None,
            caution: 1.0,
            looked_at: Timestamp::ZERO,
            not_before: Timestamp::ZERO,
            withdrawn: 0,
            waits_said: false,
        }
    }

    /// Whether it stands and can be given something to do.
    pub(super) fn rests(&self) -> bool {
        self.state == State::Resting
    }

    /// Whether nobody else may throw a turnout because it was granted this, or stands there.
    pub(super) fn keeps(&self, turnout: TurnoutId) -> bool {
        self.state != State::ByHand && self.held.takes(turnout)
    }

    /// Whether that can be now.
    pub(super) fn is_ready(&self, now: Timestamp) -> bool {
        self.rests() && self.not_before <= now
    }
}
