//! When a command has to leave so that its outcome meets a target, by the outcome of any other time.

use crate::link::UniformNormal;
use crate::time::{TimeSpan, Timestamp};
use crate::tracking::Rest;
use crate::units::Length;

use super::order::Aim;

/// A command this near to where it belongs is in its place: a thousandth of what stops scatter by.
const TARGET_TOLERANCE: Length = Length::from_mm(0.05);
/// No command is planned finer than the station's clock of bits is: 1/2400 s.
const TIME_RESOLUTION: TimeSpan = TimeSpan::from_us(100);
/// The first step beyond the earliest time; twice as far each time that is too soon.
const FIRST_STEP: TimeSpan = TimeSpan::from_ms(500);
/// No stop is planned for later than this, the length of a long session.
const HORIZON: TimeSpan = TimeSpan::from_s(7_200.0);
/// Of what is left at least this part is cut off by each step.
const SHORTEST_PART: f64 = 0.02;
/// Halvings of the horizon until it is finer than [`TIME_RESOLUTION`], with room for those that do not halve.
const MAX_ITERATIONS: usize = 60;

/// When to command, or why there is no such time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum CommandTime {
    /// The command has to leave at this time, and this comes of it.
    At(Timestamp, Rest),
    /// Even at the earliest time the train would come to rest beyond, by this much in the sense of the aim.
    TooLate(Rest, Length),
    /// The train does not come so far.
    Never,
}

impl Aim {
    /// How many standard deviations beyond the middle of all rests the part of them lies that shall meet the target.
    pub(super) fn margin(self) -> f64 {
        match self {
            Self::Median => 0.0,
            Self::NotBeyond(share) => {
                UniformNormal { deviation: 1.0, width: 0.0 }.quantile(1.0 - share.as_parts())
            }
        }
    }
}

/// The whole spread of a rest: what is not known and what no knowledge would narrow.
pub(super) fn spread(rest: &Rest) -> Length {
    Length::from_m(libm::hypot(rest.doubt.as_m(), rest.scatter.as_m()))
}

/// Finds the time from `earliest` on at which `beyond` changes its sign: the rest that would come of a command that
/// leaves then, and how far beyond the target the part of it lies that is aimed with; `None` where the way ends before
/// the train does. A later command never ends nearer, so that halving finds it; lines through the ends find it sooner
/// (the Illinois rule: Dowell and Jarratt, 1971).
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
            // Where the way ends nobody can say how far beyond that would be: as far as it was short.
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

/// One end of the span in which the time is looked for.
struct End {
    at: Timestamp,
    /// How far beyond the target this time leads (m), negative short of it.
    miss: f64,
    /// What that counts when the next time is chosen: half as much each time that the other end was moved.
    weight: f64,
}
