//! The runs that a train has been granted, with the track that they take.

use alloc::vec::Vec;

use crate::track::{Layout, Position, TurnoutNeed, TurnoutStates};
use crate::units::Length;

use super::itinerary::Pace;
use super::itinerary::{Itinerary, Run};
use super::journey::TrainLengths;
use super::occupied_path::OccupiedPath;
use super::path::Path;
use super::reservation::Reservation;

/// Where a train begins to look for a way, and what it needs.
#[derive(Debug, Clone)]
pub(super) struct Start {
    pub(super) place: Position,
    pub(super) came: OccupiedPath,
    pub(super) room: ClearanceEnvelope,
    pub(super) pace: Pace,
    /// Turnouts that are not thrown for its first run, as they lie: it is too near, or its place is counted over them.
    pub(super) frozen: Vec<TurnoutNeed>,
    /// Where it is once it has turned around, if it may. Who was not seen where it should have been is looked for ahead,
    /// and behind only if that leads nowhere: it may have come less far, and nothing is thrown then of all that it holds.
    /// Who stands on points that gave way to it goes on: they would not give way to it when it comes back.
    pub(super) turned: Option<Position>,
    /// Whether it may back away from turnouts that it stands too near to throw: not twice without a contact between, or its
    /// place would become ever less sure.
    pub(super) may_back_away: bool,
}

/// How much more of the track is taken than a train is believed to need: contacts are off their places by 5 mm, edges
/// by 10 mm, and trains were measured to a centimetre or two.
pub(super) const SLACK: Length = Length::from_mm(20.0);

/// What a train needs around the leading end of its pickup.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ClearanceEnvelope {
    /// With what is not known of its place now.
    pub(super) ahead: Length,
    pub(super) behind: Length,
    /// Of its own.
    pub(super) front: Length,
    pub(super) rear: Length,
    /// By how much it may come to rest off the place where it should.
    pub(super) overrun: Length,
}

impl ClearanceEnvelope {
    /// A train with these lengths, of which one standard deviation of the place is this.
    pub(super) fn of(lengths: TrainLengths, uncertainty: Length, overrun: Length) -> Self {
        let (front, rear) = (lengths.ahead() + SLACK, lengths.behind() + SLACK);
        let doubt = uncertainty * CERTAIN;
        Self { ahead: front + doubt, behind: rear + doubt, front, rear, overrun }
    }
}

/// A train is no further than so many standard deviations behind, or beyond, where it is believed to be, but for one
/// time in 2000 each.
const CERTAIN: f64 = 3.3;

/// One run of a course.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MovementAuthority {
    pub(super) turns: bool,
    /// From behind the train's rear end to beyond its front end when it has come to rest.
    pub(super) path: Path,
    /// Where its pickup is on that way, and where it shall be.
    pub(super) start: Length,
    pub(super) stop: Length,
    /// Where its rear end may be in the beginning.
    pub(super) begin: Length,
    /// From where on its way was looked at for others: what is before that the train holds as it stands on it.
    pub(super) taken_from: Length,
    /// Its pickup shall not pass this, and nothing of the train what is taken.
    pub(super) limit: Length,
    pub(super) end: Length,
    pub(super) needs: Vec<TurnoutNeed>,
    pub(super) taken: Reservation,
}

impl MovementAuthority {
    /// What it takes from a point on, where its rear end is.
    pub(super) fn takes_beyond(&self, layout: &Layout, from: Length) -> Reservation {
        self.path.reservation(layout, from, self.end)
    }
}

/// The runs of an itinerary on the track; `None` where the track ends too soon for one of them.
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
        // What it came over matters again only when it goes back.
        let needs = path.needs(layout, if run.turns { begin } else { start }, end);
        // What it stands on it holds already; another may hold what a doubt that has grown since would add to that.
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
        // Its place is counted from the node behind it once it has turned around.
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
        // What it takes beyond its stop may need a turnout otherwise than its way does: it would be thrown to and fro.
        if contradicts(layout, &granted.needs) {
            return None;
        }
        // Where points give way to it it does not stop: it could not go back.
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

/// Whether a turnout is needed both ways, or both of a pair in one place curved.
fn contradicts(layout: &Layout, needs: &[TurnoutNeed]) -> bool {
    needs.iter().any(|need| {
        let partner = layout.never_curved_with(need.turnout).filter(|_| need.leg.is_curved());
        needs.iter().any(|other| {
            other.turnout == need.turnout && other.leg != need.leg
                || Some(other.turnout) == partner && other.leg.is_curved()
        })
    })
}

/// The whole way of a run and where on it the run begins. What is behind the train is what was ahead of it before it
/// turned around.
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

/// Where a run ends on the way on which it begins at a point.
fn stop_on(layout: &Layout, run: &Run, start: Length) -> Option<Length> {
    let (last, before) = run.edges.split_last()?;
    debug_assert_eq!(*last, run.stop.edge, "a run ends on its last edge");
    let before: Length = before.iter().filter_map(|edge| layout.edge(*edge)).map(|edge| edge.length).sum();
    Some(start - run.start.offset + before + run.stop.offset)
}

/// What a train at rest takes.
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
