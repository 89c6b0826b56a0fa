//! Why an order is not carried out, and what could be asked instead.

use alloc::string::String;
use core::fmt;

use crate::ids::{SpeedStep, TrainId, TurnoutId};
use crate::time::TimeSpan;
use crate::track::WayError;
use crate::units::{Length, Ratio, Speed};

use super::order::Gap;

/// Why an order was refused, or given up on the way. Places are named so that `Layout::landmark` reads them.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Refusal {
    /// No such train is driven here.
    UnknownTrain {
        /// The train.
        train: TrainId,
    },
    /// The layout has no such turnout.
    UnknownTurnout {
        /// The turnout.
        turnout: TurnoutId,
    },
    /// The decoder has no such step.
    StepTooHigh {
        /// The step asked for.
        step: SpeedStep,
        /// The highest of this train.
        highest: SpeedStep,
    },
    /// The train does not move at this step, or not reliably.
    StepDoesNotMove {
        /// The step asked for.
        step: SpeedStep,
    },
    /// A probability that is none, or that no stop can keep.
    IllegalProbability {
        /// What was asked for.
        found: Ratio,
    },
    /// A distance to move that is not ahead.
    IllegalDistance {
        /// What was asked for.
        found: Length,
    },
    /// The place cannot be found on the track as the turnouts lie.
    Place(WayError),
    /// No way leads there as the turnouts lie.
    NoWay {
        /// The target.
        target: String,
        /// The contact from which a way was looked for.
        from: String,
        /// A turnout ahead of which nobody knows how it lies.
        unknown: Option<TurnoutId>,
    },
    /// No way leads there from where the train stands, however turnouts are thrown and wherever it turns around.
    Unreachable {
        /// The train.
        train: TrainId,
        /// The target.
        target: String,
    },
    /// The train cannot come to rest so soon.
    TooNear {
        /// The target.
        target: String,
        /// The first place at which it can.
        nearest: String,
        /// How far beyond the target that is.
        beyond: Length,
        /// The way round: the same place can be reached on the next round.
        round: Option<Length>,
    },
    /// So short a move cannot be made.
    MoveTooShort {
        /// The shortest that can.
        shortest: Length,
    },
    /// The train would have to run before it can be told how far it is.
    OutOfReach {
        /// The target.
        target: String,
    },
    /// The train is in danger, or could meet one that is: it is held until that is over.
    InDanger {
        /// The train that was asked to move.
        train: TrainId,
    },
    /// The station does not answer: nothing can be told.
    NoAnswer,
    /// The power is off the track.
    NoPower,
    /// Nobody knows where the train is.
    Lost {
        /// The train.
        train: TrainId,
    },
    /// Nobody knows where another train is, so that nothing can be kept clear of it.
    OtherNowhere {
        /// The train that was to be sent somewhere.
        train: TrainId,
        /// The train that nobody has seen yet.
        other: TrainId,
    },
    /// The position of a turnout is unknown, and with it on which track a train is that may be on it.
    TurnoutUnknown {
        /// The turnout.
        turnout: TurnoutId,
        /// The train.
        train: TrainId,
    },
    /// It has not come to its destination for so long.
    NotArrived {
        /// The train.
        train: TrainId,
        /// How long it was waited for.
        within: TimeSpan,
    },
    /// The track ends ahead of the train, which has been stopped for that.
    TrackEnds {
        /// The train.
        train: TrainId,
        /// Where.
        end: String,
    },
    /// The train would have passed its limit, and has been stopped for that.
    AtLimit {
        /// The train.
        train: TrainId,
    },
    /// The train still moves, and this is for a train at rest.
    StillMoves {
        /// The train.
        train: TrainId,
    },
    /// A train is on the turnout, or will be before it has been thrown.
    TurnoutOccupied {
        /// The turnout.
        turnout: TurnoutId,
        /// The train.
        train: TrainId,
    },
    /// The other turnout in the same place lies curved, and a train is on it.
    PartnerOccupied {
        /// The turnout.
        turnout: TurnoutId,
        /// The one that would have to lie straight first.
        partner: TurnoutId,
        /// The train on that.
        train: TrainId,
    },
    /// The train cannot stand there so soon.
    TooSoon {
        /// The target.
        target: String,
        /// The shortest time in which it can.
        earliest: TimeSpan,
    },
    /// The train cannot be as slow as that.
    TooSlow {
        /// The target.
        target: String,
        /// The longest time that it can take.
        latest: TimeSpan,
    },
    /// The leader follows this train, directly or behind others.
    FollowsInCircle {
        /// The train that was asked to follow.
        train: TrainId,
        /// The one that it should follow.
        leader: TrainId,
    },
    /// The train could not stop in time behind its leader.
    GapTooShort {
        /// The leader.
        leader: TrainId,
        /// The shortest gap that can be kept safely, in the same form.
        shortest: Gap,
    },
    /// No steps of the train bracket the speed.
    SpeedOutOfRange {
        /// What was asked for.
        found: Speed,
        /// The slowest that can be held ...
        lowest: Speed,
        /// ... and the fastest.
        highest: Speed,
    },
    /// No contact reported the train within the time in which one should have.
    NotFound {
        /// The train.
        train: TrainId,
        /// How long it was looked for.
        within: TimeSpan,
    },
}

impl Refusal {
    /// The train that is on a turnout that cannot be thrown for it.
    pub(in crate::control) const fn occupier(&self) -> Option<TrainId> {
        match self {
            Self::TurnoutOccupied { train, .. } | Self::PartnerOccupied { train, .. } => Some(*train),
            _ => None,
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InDanger { train } => {
                write!(f, "train {train} is stopped for safety until the incident is resolved")
            }
            Self::NoAnswer => f.write_str("the station does not answer"),
            Self::NoPower => f.write_str("track power is off: enter `power on`"),
            Self::UnknownTrain { train } => write!(f, "train {train} is not part of this session"),
            Self::UnknownTurnout { turnout } => write!(f, "the layout has no turnout {turnout}"),
            Self::StepTooHigh { step, highest } => {
                write!(f, "step {step} is too high: the highest step of this train is {highest}")
            }
            Self::StepDoesNotMove { step } => {
                write!(f, "step {step} does not move this train reliably: use a higher step")
            }
            Self::IllegalProbability { found } => {
                write!(f, "probability {} % is out of range: use 0.0001 % to 50 %", found.as_percent())
            }
            Self::IllegalDistance { found } => {
                write!(f, "distance {} mm is out of range: use 1 mm to 100000 mm", found.as_mm())
            }
            Self::Place(error) => error.fmt(f),
            Self::NoWay { target, from, unknown: Some(turnout) } => write!(
                f,
                "no known path from `{from}` to `{target}`: the position of turnout {turnout} is \
                 unknown; throw it first"
            ),
            Self::NoWay { target, from, unknown: None } => {
                write!(
                    f,
                    "no path from `{from}` to `{target}` with the turnouts in their present \
                           positions"
                )
            }
            Self::Unreachable { train, target } => write!(
                f,
                "no path takes train {train} to `{target}` with any turnout positions and reversals: \
                 there may be no room to stop or reverse there, or the train cannot arrive facing that \
                 direction"
            ),
            Self::TooNear { target, nearest, beyond, round } => {
                write!(
                    f,
                    "`{target}` is too close to stop at: the nearest possible place is `{nearest}`, \
                     {:.0} mm beyond it",
                    beyond.as_mm()
                )?;
                round.map_or(Ok(()), |round| {
                    write!(f, "; the train passes it again after {:.1} m", round.as_m())
                })
            }
            Self::MoveTooShort { shortest } => {
                write!(f, "the move is too short: this train can move {:.0} mm at least", shortest.as_mm())
            }
            Self::OutOfReach { target } => {
                write!(f, "the train does not get as far as `{target}` at this step")
            }
            Self::Lost { train } => write!(
                f,
                "the position of train {train} is unknown: run it over a sensor, for example with \
                 `speed {train} 6`"
            ),
            Self::OtherNowhere { train, other } => write!(
                f,
                "train {train} cannot be kept clear of train {other}, whose position is unknown: run \
                 that train over a sensor, for example with `speed {other} 6`, or enter its position, \
                 for example `place {other} at C13`"
            ),
            Self::TurnoutUnknown { turnout, train } => write!(
                f,
                "the position of turnout {turnout} is unknown and train {train} may be on it: enter how it lies, for \
                 example `turnout {turnout} straight`, or run the train over the next sensor"
            ),
            Self::NotArrived { train, within } => write!(
                f,
                "train {train} did not arrive within {:.0} s: move whatever blocks its path, and run \
                 trains with an uncertain position over a sensor",
                within.as_s()
            ),
            Self::TrackEnds { train, end } => {
                write!(f, "train {train} was stopped: the track ends at `{end}`")
            }
            Self::AtLimit { train } => {
                write!(f, "train {train} was stopped: the track ahead is not reserved for it")
            }
            Self::StillMoves { train } => {
                write!(f, "train {train} is still moving: wait until it is at rest")
            }
            Self::TurnoutOccupied { turnout, train } => {
                write!(
                    f,
                    "train {train} is on turnout {turnout} or about to reach it: wait, or stop \
                           the train first"
                )
            }
            Self::PartnerOccupied { turnout, partner, train } => write!(
                f,
                "turnout {turnout} can be curved only while turnout {partner} is straight, and train \
                 {train} is on that one: wait, or stop the train first"
            ),
            Self::TooSoon { target, earliest } => write!(
                f,
                "`{target}` cannot be reached that soon: allow at least {:.1} s",
                libm::ceil(10.0 * earliest.as_s()) / 10.0
            ),
            Self::TooSlow { target, latest } => write!(
                f,
                "a moving train cannot take that long to `{target}`: allow at most {:.1} s, or stop it \
                 first",
                libm::floor(10.0 * latest.as_s()) / 10.0
            ),
            Self::FollowsInCircle { train, leader } => {
                write!(
                    f,
                    "train {leader} already follows train {train}: give train {leader} another \
                           command first"
                )
            }
            Self::GapTooShort { leader, shortest: Gap::Time(shortest) } => write!(
                f,
                "gap to train {leader} too short to stop safely: use at least {:.1} s",
                libm::ceil(10.0 * shortest.as_s()) / 10.0
            ),
            Self::GapTooShort { leader, shortest: Gap::Way(shortest) } => write!(
                f,
                "gap to train {leader} too short to stop safely: use at least {:.0} mm",
                libm::ceil(shortest.as_mm())
            ),
            Self::SpeedOutOfRange { found, lowest, highest } => write!(
                f,
                "{:.0} mm/s cannot be held: use {:.0} to {:.0} mm/s",
                found.as_mm_per_s(),
                libm::ceil(lowest.as_mm_per_s()),
                libm::floor(highest.as_mm_per_s())
            ),
            Self::NotFound { train, within } => write!(
                f,
                "no sensor reported train {train} within {:.0} s: check that it runs and is on this \
                 layout",
                within.as_s()
            ),
        }
    }
}

impl core::error::Error for Refusal {}
