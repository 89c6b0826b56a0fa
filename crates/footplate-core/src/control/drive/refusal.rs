//! Why an order is not carried out, and what to order instead.

use alloc::string::String;
use core::fmt;

use crate::ids::{SpeedStep, TrainId, TurnoutId};
use crate::time::TimeSpan;
use crate::track::PathError;
use crate::units::{Length, Ratio, Speed};

use super::order::Gap;

/// Why an order was rejected, or given up later. Places are named so that `Layout::landmark` can read them.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Refusal {
    /// The train is not part of this session.
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
        /// The step ordered.
        step: SpeedStep,
        /// The highest step of this train.
        highest: SpeedStep,
    },
    /// The train does not move at this step, or not reliably.
    StepDoesNotMove {
        /// The step ordered.
        step: SpeedStep,
    },
    /// The probability is out of range.
    IllegalProbability {
        /// The probability ordered.
        found: Ratio,
    },
    /// The distance is out of range.
    IllegalDistance {
        /// The distance ordered.
        found: Length,
    },
    /// The place cannot be located with the turnouts as they are.
    Place(PathError),
    /// No path leads there with the turnouts as they are.
    NoPath {
        /// The target.
        target: String,
        /// The sensor from which the path starts.
        from: String,
        /// A turnout ahead whose position is unknown.
        unknown: Option<TurnoutId>,
    },
    /// No path leads there from the train's position, with any turnout positions and reversals.
    Unreachable {
        /// The train.
        train: TrainId,
        /// The target.
        target: String,
    },
    /// The train cannot stop that soon.
    TooNear {
        /// The target.
        target: String,
        /// The nearest place at which it can stop.
        nearest: String,
        /// How far that is beyond the target.
        beyond: Length,
        /// The length of the circuit, if the train passes the target again.
        round: Option<Length>,
    },
    /// The move is shorter than this train can move.
    MoveTooShort {
        /// The shortest possible move.
        shortest: Length,
    },
    /// The train does not get as far as the target.
    OutOfReach {
        /// The target.
        target: String,
    },
    /// The train is in danger, or could meet one that is: it is kept at rest until that is resolved.
    InDanger {
        /// The train that was ordered to move.
        train: TrainId,
    },
    /// Something moved that this session does not drive, where the train could meet it.
    TrackNotClear,
    /// The station does not answer: no command can be sent.
    NoAnswer,
    /// Sensors report at random: no train could be located by them.
    Noise,
    /// Track power is off.
    NoPower,
    /// The position of the train is unknown.
    Lost {
        /// The train.
        train: TrainId,
    },
    /// The train may be on a turnout that it trailed: it is set for another leg, and would derail the train going back.
    OnTrailedPoints {
        /// The train.
        train: TrainId,
        /// The turnout.
        turnout: TurnoutId,
    },
    /// Where the train is could not be said if it reversed here, because a turnout behind it is set for another leg.
    PositionLost {
        /// The train.
        train: TrainId,
        /// The turnout behind it, ...
        turnout: TurnoutId,
        /// ... and how it has to be set.
        curved: bool,
    },
    /// The position of another train is unknown: no train can be kept clear of it.
    OtherNowhere {
        /// The train that was ordered to move.
        train: TrainId,
        /// The train of unknown position.
        other: TrainId,
    },
    /// The position of a turnout is unknown, and with it on which track a train is that may be on it.
    TurnoutUnknown {
        /// The turnout.
        turnout: TurnoutId,
        /// The train.
        train: TrainId,
    },
    /// The commands to a turnout were not sent.
    TurnoutNotSent {
        /// The turnout.
        turnout: TurnoutId,
    },
    /// It has not come to its destination for so long.
    NotArrived {
        /// The train.
        train: TrainId,
        /// That time.
        within: TimeSpan,
    },
    /// The train was stopped before the end of the track.
    TrackEnds {
        /// The train.
        train: TrainId,
        /// The name of the end.
        end: String,
    },
    /// The train was stopped before its end of authority.
    AtLimit {
        /// The train.
        train: TrainId,
    },
    /// The order is for a train at rest, and the train moves.
    StillMoves {
        /// The train.
        train: TrainId,
    },
    /// A train is on the turnout, or will be before it is thrown.
    TurnoutOccupied {
        /// The turnout.
        turnout: TurnoutId,
        /// The train.
        train: TrainId,
    },
    /// A train is on the other turnout in the same place, which is curved and would have to be set straight first.
    PartnerOccupied {
        /// The turnout.
        turnout: TurnoutId,
        /// The other turnout.
        partner: TurnoutId,
        /// The train on it.
        train: TrainId,
    },
    /// The train cannot be at rest there that soon.
    TooSoon {
        /// The target.
        target: String,
        /// The shortest possible time.
        earliest: TimeSpan,
    },
    /// The train cannot take that long.
    TooSlow {
        /// The target.
        target: String,
        /// The longest possible time.
        latest: TimeSpan,
    },
    /// The leader follows this train, directly or behind others.
    FollowsInCircle {
        /// The train that was ordered to follow.
        train: TrainId,
        /// The train ahead.
        leader: TrainId,
    },
    /// The gap is too short for the train to stop behind its leader.
    GapTooShort {
        /// The train ahead.
        leader: TrainId,
        /// The shortest safe gap, in the same unit.
        shortest: Gap,
    },
    /// The speed is not between those of two steps of the train.
    SpeedOutOfRange {
        /// The speed ordered.
        found: Speed,
        /// The lowest speed that can be held.
        lowest: Speed,
        /// The highest.
        highest: Speed,
    },
    /// No sensor reported the train within the time in which one should have.
    NotFound {
        /// The train.
        train: TrainId,
        /// That time.
        within: TimeSpan,
    },
}

impl Refusal {
    /// Whether it holds all trains for a while, and says nothing against the order.
    pub(in crate::control) const fn is_passing(&self) -> bool {
        matches!(
            self,
            Self::NoPower | Self::NoAnswer | Self::Noise | Self::InDanger { .. } | Self::TrackNotClear
        )
    }

    /// The train that occupies a turnout, if that is the reason.
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
                write!(f, "train {train} is stopped for safety: an earlier message says why and what to do")
            }
            Self::TrackNotClear => f.write_str(
                "something moved that Footplate does not drive: check the track, then enter `power on`, or `place` the train that it is",
            ),
            Self::NoAnswer => f.write_str("the station does not answer"),
            Self::Noise => f.write_str("sensors report at random: wait until none has for 3 s, then enter it again"),
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
            Self::NoPath { target, from, unknown: Some(turnout) } => write!(
                f,
                "no known path from `{from}` to `{target}`: the position of turnout {turnout} is \
                 unknown; throw it first"
            ),
            Self::NoPath { target, from, unknown: None } => {
                write!(
                    f,
                    "no path from `{from}` to `{target}` with the turnouts in their present \
                     positions: throw turnouts, for example `turnout all straight`, or let `go` throw them"
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
            Self::OnTrailedPoints { train, turnout } => write!(
                f,
                "train {train} may be on turnout {turnout}, which is set for another leg than it came from and would \
                 derail it going back: run it ahead, off the turnout, first"
            ),
            Self::PositionLost { train, turnout, curved } => {
                let leg = if *curved { "curved" } else { "straight" };
                write!(
                    f,
                    "the position of train {train} would be lost if it reversed here: set `turnout {turnout} {leg}` first"
                )
            }
            Self::OtherNowhere { train, other } => write!(
                f,
                "train {train} cannot be kept clear of train {other}, whose position is unknown: run \
                 that train over a sensor, for example with `speed {other} 6`, or enter its position, \
                 for example `place {other} at C13`"
            ),
            Self::TurnoutUnknown { turnout, train } => write!(
                f,
                "the position of turnout {turnout} is unknown and train {train} may be on it: enter its position, for \
                 example `turnout {turnout} straight`, or run the train over the next sensor"
            ),
            Self::TurnoutNotSent { turnout } => write!(
                f,
                "the commands to turnout {turnout} were not sent: the line garbles data, or this link does not have its address; \
                 check cable and adapter, then the address in the layout, or choose a place that needs no turnout {turnout}"
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
