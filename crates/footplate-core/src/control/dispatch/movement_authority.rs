//! Movement authorities: the runs of a train with the track that they reserve, and the places where it can stop.

use alloc::vec::Vec;

use crate::ids::TurnoutId;
use crate::track::{Layout, Position, TurnoutNeed, TurnoutStates};
use crate::units::Length;

use super::itinerary::{Itinerary, Pace, Run};
use super::path::{OccupiedPath, Path};
use super::reservation::Reservation;

/// The start of a path search, with the needs of the train.
#[derive(Debug, Clone)]
pub(super) struct Start {
    pub(super) place: Position,
    pub(super) occupied: OccupiedPath,
    pub(super) envelope: ClearanceEnvelope,
    pub(super) pace: Pace,
    /// Turnouts that cannot be thrown for its first run, in their positions: the train is too near, or its position
    /// is measured over them.
    pub(super) frozen: Vec<TurnoutNeed>,
    /// Its position once reversed, if it may reverse. A train that a sensor did not report runs ahead to be detected,
    /// and back only if no path leads ahead: it may be further back than estimated, and none of its reserved turnouts
    /// is thrown then. A train on a turnout that it trailed continues: the turnout would derail it going back.
    pub(super) reversed: Option<Position>,
    /// Whether it may back away from turnouts that it is too near to throw: not twice without a detection in between,
    /// because its position would become more and more uncertain.
    pub(super) may_back_away: bool,
}

/// The lengths of a train along the track, which reservations cover.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainLengths {
    /// From the pickup to the farther end of the train.
    pub overhang: Length,
    /// The pickup itself.
    pub pickup: Length,
}

impl TrainLengths {
    /// A long locomotive of the gauge (250 mm over buffers, as Märklin's longest without a tender) with its pickup
    /// anywhere under it.
    pub const LONG_LOCOMOTIVE: Self =
        Self { overhang: Length::from_mm(215.0), pickup: Length::from_mm(45.0) };

    /// From the leading end of the pickup to the front of the train, whichever end leads.
    #[must_use]
    pub const fn ahead(self) -> Length {
        self.overhang
    }

    /// From the leading end of the pickup to the rear of the train.
    #[must_use]
    pub fn behind(self) -> Length {
        self.overhang + self.pickup
    }
}

/// Margin of every reservation: sensors are surveyed within 5 mm, edges within 10 mm, and train lengths within one or
/// two centimetres.
pub(super) const SLACK: Length = Length::from_mm(20.0);

/// The track that a train needs around the leading end of its pickup.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ClearanceEnvelope {
    /// With the uncertainty of its position now.
    pub(super) ahead: Length,
    pub(super) behind: Length,
    /// Without it.
    pub(super) front: Length,
    pub(super) rear: Length,
    /// Its overrun: it may come to rest this far beyond its stop.
    pub(super) overrun: Length,
}

impl ClearanceEnvelope {
    /// For a train with these lengths; `uncertainty` is one standard deviation of its position.
    pub(super) fn of(lengths: TrainLengths, uncertainty: Length, overrun: Length) -> Self {
        let (front, rear) = (lengths.ahead() + SLACK, lengths.behind() + SLACK);
        let margin = uncertainty * CERTAIN;
        Self { ahead: front + margin, behind: rear + margin, front, rear, overrun }
    }
}

/// Bound on the error of a position, in standard deviations: exceeded once in 2000 times.
const CERTAIN: f64 = 3.3;

/// The authority for one run.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MovementAuthority {
    pub(super) reverses: bool,
    /// From behind the rear of the train at its start to beyond its front at rest.
    pub(super) path: Path,
    /// The distances of its pickup on the path: at the start and at the stop.
    pub(super) start: Length,
    pub(super) stop: Length,
    /// The bound of its rear at the start.
    pub(super) begin: Length,
    /// From here on the path was checked for other trains; the train occupies and has reserved the track before.
    pub(super) taken_from: Length,
    /// The end of authority of its pickup, and of its front.
    pub(super) limit: Length,
    pub(super) end: Length,
    pub(super) needs: Vec<TurnoutNeed>,
    pub(super) taken: Reservation,
}

impl MovementAuthority {
    /// The reservation from its rear on.
    pub(super) fn takes_beyond(&self, layout: &Layout, from: Length) -> Reservation {
        self.path.reservation(layout, from, self.end)
    }
}

/// The authorities of an itinerary; `None` if the track ends too soon for one of its runs.
pub(super) fn granted(
    layout: &Layout,
    turnouts: &TurnoutStates,
    itinerary: &Itinerary,
    begins: &Start,
) -> Option<Vec<MovementAuthority>> {
    let envelope = begins.envelope;
    let mut runs: Vec<MovementAuthority> = Vec::new();
    for run in &itinerary.runs {
        let before = runs.last();
        let (path, start) = path_of(layout, turnouts, run, before, begins)?;
        let stop = stop_on(layout, run, start)?;
        let limit = stop + envelope.overrun;
        let end = limit + envelope.front;
        if path.length() < end {
            return None;
        }
        let begin = start - envelope.behind;
        // The turnouts behind it matter only if it reverses.
        let needs = path.needs(layout, if run.reverses { begin } else { start }, end);
        // It has reserved the track under it; track that a larger uncertainty adds may be reserved for another train.
        let taken_from = if runs.is_empty() { start } else { begin };
        let mut taken = path.reservation(layout, taken_from, end);
        let left = if runs.is_empty() { left_turnout(layout, run, begins) } else { None };
        if let Some(turnout) = left {
            taken.release_turnout(layout, turnout);
        }
        let mut granted = MovementAuthority {
            reverses: run.reverses,
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
        // Its position is measured from the node behind it once it has reversed.
        if run.reverses {
            let edge = run.start.edge;
            let own = layout.needs_of(edge).find(|need| need.facing);
            if let Some(need) = own {
                if left.is_none() {
                    granted.taken.take_turnout(layout, need.turnout);
                }
                if !granted.needs.iter().any(|known| known.turnout == need.turnout) {
                    granted.needs.push(need);
                }
            }
        }
        // The track beyond its stop may need a turnout in another position than its path: it would be thrown
        // repeatedly.
        if contradicts(layout, &granted.needs) {
            return None;
        }
        // It does not stop on a turnout that it trails: it could not run back.
        let frozen: &[_] = if runs.is_empty() { &begins.frozen } else { &[] };
        let known = || frozen.iter().chain(&granted.needs);
        let is_set_otherwise =
            |need: &TurnoutNeed| known().any(|known| known.turnout == need.turnout && known.leg != need.leg);
        if granted
            .path
            .trailed(layout, stop - envelope.behind - envelope.overrun, end)
            .any(|need| is_set_otherwise(&need))
        {
            return None;
        }
        runs.push(granted);
    }
    Some(runs)
}

/// The turnout on whose leg a first run begins, away from its toe. The train may leave even if a train on the other
/// leg, as near to the toe, has reserved it, too: otherwise both would wait for ever.
fn left_turnout(layout: &Layout, run: &Run, begins: &Start) -> Option<TurnoutId> {
    let need = layout.needs_of(run.start.edge).find(|need| need.facing && begins.frozen.contains(need))?;
    let mut later = run.edges.iter().skip(1).flat_map(|edge| layout.needs_of(*edge));
    (!later.any(|later| later.turnout == need.turnout)).then_some(need.turnout)
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

/// The path of a run, and the distance of its start. The track behind the train was ahead of it before it reversed.
fn path_of(
    layout: &Layout,
    turnouts: &TurnoutStates,
    run: &Run,
    before: Option<&MovementAuthority>,
    begins: &Start,
) -> Option<(Path, Length)> {
    let envelope = begins.envelope;
    let (mut path, start) = match before {
        None => {
            let behind = envelope.behind + run.start.offset;
            Path::around(layout, turnouts, run.start, &begins.occupied, behind, Length::ZERO)
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
        path.reach(layout, turnouts, stop + envelope.overrun + envelope.front);
        path
    };
    Some((path, start))
}

/// The distance of the stop of a run that begins at `start` on its path.
fn stop_on(layout: &Layout, run: &Run, start: Length) -> Option<Length> {
    let (last, before) = run.edges.split_last()?;
    debug_assert_eq!(*last, run.stop.edge, "a run ends on its last edge");
    let before: Length = before.iter().filter_map(|edge| layout.edge(*edge)).map(|edge| edge.length).sum();
    Some(start - run.start.offset + before + run.stop.offset)
}

/// The reservation of a train at rest.
pub(super) fn standstill_reservation(
    layout: &Layout,
    turnouts: &TurnoutStates,
    place: Position,
    occupied: &OccupiedPath,
    envelope: ClearanceEnvelope,
) -> Reservation {
    let (path, at) = Path::around(layout, turnouts, place, occupied, envelope.behind, envelope.ahead);
    path.reservation(layout, at - envelope.behind, at + envelope.ahead)
}

/// The distance between two places that are tried: less than the lengths of trains differ.
const PLACES_EVERY: Length = Length::from_mm(100.0);
/// The uncertainty of the position of a train after a future stop, one standard deviation.
pub(super) const PARKED: Length = Length::from_mm(15.0);
/// The usual error of a stop.
pub(super) const STOP_ERROR: Length = Length::from_mm(40.0);

/// All places on a layout that are long enough for a train, each once, and whether it is clear of all turnouts there.
pub(super) fn parking_places(layout: &Layout, envelope: ClearanceEnvelope) -> Vec<(Position, bool)> {
    let turnouts = TurnoutStates::unknown();
    let envelope = ClearanceEnvelope {
        ahead: envelope.ahead + STOP_ERROR,
        behind: envelope.behind + STOP_ERROR,
        ..envelope
    };
    let mut places = Vec::new();
    for (id, edge) in layout.edges().filter(|(id, _)| *id < id.twin()) {
        let mut offset = PLACES_EVERY / 2.0;
        while offset < edge.length {
            let place = Position { edge: id, offset };
            let taken = standstill_reservation(layout, &turnouts, place, &OccupiedPath::default(), envelope);
            let length: Length = taken.spans().map(|(_, span)| span.to - span.from).sum();
            if length >= envelope.ahead + envelope.behind - Length::from_mm(1.0) {
                places.push((place, taken.turnouts().next().is_none()));
            }
            offset += PLACES_EVERY;
        }
    }
    places
}
