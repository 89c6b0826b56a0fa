//! Movement authorities: the runs of a train, with the track that they reserve.

use alloc::vec::Vec;

use crate::track::{Layout, Position, TurnoutNeed, TurnoutStates};
use crate::units::Length;

use super::itinerary::Pace;
use super::itinerary::{Itinerary, Run};
use super::journey::TrainLengths;
use super::occupied_path::OccupiedPath;
use super::path::Path;
use super::reservation::Reservation;

/// Where a path search begins, and what the train needs.
#[derive(Debug, Clone)]
pub(super) struct Start {
    pub(super) place: Position,
    pub(super) came: OccupiedPath,
    pub(super) room: ClearanceEnvelope,
    pub(super) pace: Pace,
    /// Turnouts that are not thrown for its first run, as they lie: the train is too near, or its place is counted over them.
    pub(super) frozen: Vec<TurnoutNeed>,
    /// Its place once reversed, if it may reverse. A train that a sensor did not report is looked for ahead, and behind only
    /// if no path leads ahead: it may have come less far, and none of its reserved turnouts is thrown then. A train on a
    /// turnout that it trailed goes on: the turnout would derail it on the way back.
    pub(super) turned: Option<Position>,
    /// Whether it may back away from turnouts that it is too near to throw: not twice without a sensor between, as its place
    /// would become ever more uncertain.
    pub(super) may_back_away: bool,
}

/// Margin of every reservation: sensors are off their places by 5 mm, edges by 10 mm, and trains were measured to a
/// centimetre or two.
pub(super) const SLACK: Length = Length::from_mm(20.0);

/// The track that a train needs around the leading end of its pickup.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ClearanceEnvelope {
    /// With the uncertainty of its place now.
    pub(super) ahead: Length,
    pub(super) behind: Length,
    /// Without it.
    pub(super) front: Length,
    pub(super) rear: Length,
    /// How far it may come to rest beyond its stop.
    pub(super) overrun: Length,
}

impl ClearanceEnvelope {
    /// For a train with these lengths; `uncertainty` is one standard deviation of its place.
    pub(super) fn of(lengths: TrainLengths, uncertainty: Length, overrun: Length) -> Self {
        let (front, rear) = (lengths.ahead() + SLACK, lengths.behind() + SLACK);
        let doubt = uncertainty * CERTAIN;
        Self { ahead: front + doubt, behind: rear + doubt, front, rear, overrun }
    }
}

/// Standard deviations to either side of the estimated place that a reservation covers: a train is beyond once in 2000.
const CERTAIN: f64 = 3.3;

/// The authority for one run.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MovementAuthority {
    pub(super) turns: bool,
    /// From behind the train's rear end to beyond its front end when it has come to rest.
    pub(super) path: Path,
    /// Where its pickup is on the path, and where it is to stop.
    pub(super) start: Length,
    pub(super) stop: Length,
    /// Where its rear end may be at the start.
    pub(super) begin: Length,
    /// From here on the path was checked for other trains; the train has reserved what is before, as it is on it.
    pub(super) taken_from: Length,
    /// The end of authority of its pickup, and of its front end.
    pub(super) limit: Length,
    pub(super) end: Length,
    pub(super) needs: Vec<TurnoutNeed>,
    pub(super) taken: Reservation,
}

impl MovementAuthority {
    /// The reservation from a point on, where its rear end is.
    pub(super) fn takes_beyond(&self, layout: &Layout, from: Length) -> Reservation {
        self.path.reservation(layout, from, self.end)
    }
}

/// The authorities of an itinerary; `None` where the track ends too soon for one of its runs.
pub(super) fn granted(
    layout: &Layout,
    turnouts: &TurnoutStates,
    itinerary: &Itinerary,
    begins: &Start,
) -> Option<Vec<MovementAuthority>> {
    let room = begins.room;
    let mut runs: Vec<MovementAuthority> = Vec::new();
    for run in &itinerary.runs {
        let before = runs.last();
        let (path, start) = path_of(layout, turnouts, run, before, begins)?;
        let stop = stop_on(layout, run, start)?;
        let limit = stop + room.overrun;
        let end = limit + room.front;
        if path.length() < end {
            return None;
        }
        let begin = start - room.behind;
        // The turnouts behind it matter only when it goes back.
        let needs = path.needs(layout, if run.turns { begin } else { start }, end);
        // It has reserved what it is on; what a grown uncertainty adds to that may be reserved for another train.
        let taken_from = if runs.is_empty() { start } else { begin };
        let taken = path.reservation(layout, taken_from, end);
        let mut granted = MovementAuthority {
            turns: run.turns,
            path,
            start,
            stop,
            begin,
            taken_from,
            limit,
            end,
            needs,
            taken,
        };
        // Its place is counted from the node behind it once it has reversed.
        if run.turns {
            let edge = run.start.edge;
            let own = layout.needs_of(edge).find(|need| need.facing);
            if let Some(need) = own {
                granted.taken.take_turnout(layout, need.turnout);
                if !granted.needs.iter().any(|known| known.turnout == need.turnout) {
                    granted.needs.push(need);
                }
            }
        }
        // The track beyond its stop may need a turnout in the other position than its path: it would be thrown to and fro.
        if contradicts(layout, &granted.needs) {
            return None;
        }
        // It does not stop on a turnout that it trails: it could not go back.
        let frozen: &[_] = if runs.is_empty() { &begins.frozen } else { &[] };
        let known = || frozen.iter().chain(&granted.needs);
        let lies_otherwise =
            |need: &TurnoutNeed| known().any(|known| known.turnout == need.turnout && known.leg != need.leg);
        if granted
            .path
            .trailed(layout, stop - room.behind - room.overrun, end)
            .any(|need| lies_otherwise(&need))
        {
            return None;
        }
        runs.push(granted);
    }
    Some(runs)
}

/// Whether a turnout is needed in both positions, or both turnouts of one place curved.
fn contradicts(layout: &Layout, needs: &[TurnoutNeed]) -> bool {
    needs.iter().any(|need| {
        let partner = layout.never_curved_with(need.turnout).filter(|_| need.leg.is_curved());
        needs.iter().any(|other| {
            other.turnout == need.turnout && other.leg != need.leg
                || Some(other.turnout) == partner && other.leg.is_curved()
        })
    })
}

/// The path of a run and where on it the run begins. Behind the train is what was ahead of it before it reversed.
fn path_of(
    layout: &Layout,
    turnouts: &TurnoutStates,
    run: &Run,
    before: Option<&MovementAuthority>,
    begins: &Start,
) -> Option<(Path, Length)> {
    let room = begins.room;
    let (mut path, start) = match before {
        None => {
            let behind = room.behind + run.start.offset;
            Path::around(layout, turnouts, run.start, &begins.came, behind, Length::ZERO)
        }
        Some(before) => {
            let mut path = Path::default();
            let stops_on = run.start.edge.twin();
            let beyond: Vec<_> = before.path.edges().rev().take_while(|edge| *edge != stops_on).collect();
            beyond.iter().for_each(|edge| path.push(layout, edge.twin()));
            let start = path.length() + run.start.offset;
            path.push(layout, run.start.edge);
            (path, start)
        }
    };
    let path = {
        path.cut_after(run.start.edge);
        run.edges.iter().skip(1).for_each(|edge| path.push(layout, *edge));
        let stop = stop_on(layout, run, start)?;
        path.reach(layout, turnouts, stop + room.overrun + room.front);
        path
    };
    Some((path, start))
}

/// Where a run ends on the path on which it begins at `start`.
fn stop_on(layout: &Layout, run: &Run, start: Length) -> Option<Length> {
    let (last, before) = run.edges.split_last()?;
    debug_assert_eq!(*last, run.stop.edge, "a run ends on its last edge");
    let before: Length = before.iter().filter_map(|edge| layout.edge(*edge)).map(|edge| edge.length).sum();
    Some(start - run.start.offset + before + run.stop.offset)
}

/// The reservation of a train at rest.
pub(super) fn standing(
    layout: &Layout,
    turnouts: &TurnoutStates,
    place: Position,
    came: &OccupiedPath,
    room: ClearanceEnvelope,
) -> Reservation {
    let (path, at) = Path::around(layout, turnouts, place, came, room.behind, room.ahead);
    path.reservation(layout, at - room.behind, at + room.ahead)
}
