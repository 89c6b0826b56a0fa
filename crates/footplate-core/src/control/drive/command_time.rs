//! The time at which a command must be sent so that its result meets a target, found by root bracketing.

use crate::link::UniformNormal;
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::Rest;
use crate::units::Length;

use super::order::Aim;

/// The tolerance of the target: a hundredth of the spread of stops.
const TARGET_TOLERANCE: Length = Length::from_mm(0.05);
/// The tolerance of the time: a fraction of one bit on a 2400-baud line.
const TIME_RESOLUTION: TimeSpan = TimeSpan::from_us(100);
/// The first step beyond the earliest time; each further step is twice as long.
const FIRST_STEP: TimeSpan = TimeSpan::from_ms(500);
/// The longest time that a stop is planned ahead: a long session.
const HORIZON: TimeSpan = TimeSpan::from_s(7_200.0);
/// Each iteration cuts off at least this part of the bracket.
const SHORTEST_PART: f64 = 0.02;
/// Enough to halve the horizon down to [`TIME_RESOLUTION`], with room for iterations that do not halve.
const MAX_ITERATIONS: usize = 60;

/// The time to command, or why there is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum CommandTime {
    /// The command must be sent at this time, with this predicted rest.
    At(Timestamp, Rest),
    /// Even the earliest command leads to a rest beyond the target, by this length at the quantile of the aim.
    TooLate(Rest, Length),
    /// The train does not get so far.
    Never,
}

impl Aim {
    /// The quantile of the rest that shall meet the target, in standard deviations beyond the median.
    pub(super) fn margin(self) -> f64 {
        match self {
            Self::Median => 0.0,
            Self::NotBeyond(share) => {
                UniformNormal { deviation: 1.0, width: 0.0 }.quantile(1.0 - share.as_parts())
            }
        }
    }
}

/// Finds the time from `earliest` on at which `beyond` changes its sign. `beyond` predicts the rest after a command
/// sent at a time, and how far beyond the target the aimed quantile of it lies; `None` where the path ends first. A
/// later command never leads to a nearer rest, so that a root is bracketed; false position with the Illinois rule
/// (Dowell and Jarratt, 1971) refines it.
pub(super) fn command_time(
    earliest: Timestamp,
    mut beyond: impl FnMut(Timestamp) -> Option<(Rest, Length)>,
) -> CommandTime {
    let Some((rest, first)) = beyond(earliest) else { return CommandTime::Never };
    if first > TARGET_TOLERANCE {
        return CommandTime::TooLate(rest, first);
    }
    let mut low = End { at: earliest, miss: first.as_m(), weight: 1.0 };
    let mut best = (earliest, rest);
    let mut step = FIRST_STEP;
    let mut high = loop {
        let at = earliest + step;
        match beyond(at) {
            Some((rest, miss)) if miss < Length::ZERO => {
                low = End { at, miss: miss.as_m(), weight: 1.0 };
                best = (at, rest);
            }
            // Beyond the end of the path the miss is unknown: assume the size of the other end's.
            found => {
                break End { at, miss: found.map_or(-low.miss, |(_, miss)| miss.as_m()), weight: 1.0 };
            }
        }
        if step >= HORIZON {
            return CommandTime::Never;
        }
        step += step;
    };
    for _ in 0..MAX_ITERATIONS {
        let width = high.at - low.at;
        if low.miss.abs() <= TARGET_TOLERANCE.as_m() || width <= TIME_RESOLUTION {
            break;
        }
        let (short, ahead) = (-low.miss * low.weight, high.miss * high.weight);
        let part = (short / (short + ahead)).clamp(SHORTEST_PART, 1.0 - SHORTEST_PART);
        let at = low.at + TimeSpan::from_s(width.as_s() * part);
        match beyond(at) {
            Some((rest, miss)) if miss <= TARGET_TOLERANCE => {
                best = (at, rest);
                low = End { at, miss: miss.as_m(), weight: 1.0 };
                if miss.abs() <= TARGET_TOLERANCE {
                    break;
                }
                high.weight *= 0.5;
            }
            found => {
                high = End { at, miss: found.map_or(-low.miss, |(_, miss)| miss.as_m()), weight: 1.0 };
                low.weight *= 0.5;
            }
        }
    }
    CommandTime::At(best.0, best.1)
}

/// One end of the bracket.
struct End {
    at: Timestamp,
    /// Distance beyond the target (m) at this end, negative short of it.
    miss: f64,
    /// Weight of the miss in the next interpolation: halved each time that the other end moves.
    weight: f64,
}
