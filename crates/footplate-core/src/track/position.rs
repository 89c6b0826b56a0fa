//! Positions: points on the rails with a direction of travel, and the distances between them.

use alloc::borrow::ToOwned;
use alloc::string::String;
use core::fmt;

use crate::ids::{EdgeId, NodeId, TurnoutId};
use crate::track::{Edge, Layout, Leg, NodeKind, OutgoingEdges, TurnoutStates};
use crate::units::Length;

/// Sums of lengths are rounded; a path that is longer than the track by no more than this ends at the end of the track.
const ROUNDING: Length = Length::from_mm(1e-6);

/// A point on the rails with a direction of travel.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Position {
    /// Its edge.
    pub edge: EdgeId,
    /// Distance from the start of the edge, from zero to its length.
    pub offset: Length,
}

/// Why a path cannot be followed to its end.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum PathError {
    /// A node or edge of another layout.
    NotOnLayout,
    /// The distance is not a finite number.
    NotFinite,
    /// A turnout of unknown position decides where the path leads.
    TurnoutUnknown {
        /// The turnout.
        turnout: TurnoutId,
        /// The remaining distance at the turnout.
        left: Length,
    },
    /// The track ends before the path does.
    TrackEnds {
        /// The name of the node where it ends.
        node: String,
        /// The remaining distance at the end of the track.
        left: Length,
    },
}

impl fmt::Display for PathError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotOnLayout => f.write_str("the position is not on this layout"),
            Self::NotFinite => f.write_str("a distance should be a finite number"),
            Self::TurnoutUnknown { turnout, left } => write!(
                f,
                "the position of turnout {turnout}, {:.0} mm before the end of the path, is unknown: \
                 throw it first",
                left.as_mm()
            ),
            Self::TrackEnds { node, left } => {
                write!(f, "the track ends at `{node}`, {:.0} mm before the end of the path", left.as_mm())
            }
        }
    }
}

impl core::error::Error for PathError {}

impl Layout {
    /// The same point in the opposite direction of travel; `None` for a position of another layout.
    pub fn reversed(&self, position: Position) -> Option<Position> {
        let length = self.edge(position.edge)?.length;
        Some(Position { edge: position.edge.twin(), offset: (length - position.offset).max(Length::ZERO) })
    }

    /// The point `distance` ahead, or behind if it is negative, over turnouts in these positions.
    ///
    /// The result is in normal form: at the start of an edge rather than at the end of the previous one, unless the
    /// track ends there or a turnout is unknown. A distance of zero normalises.
    ///
    /// # Errors
    /// [`PathError`] if the path cannot be followed to its end.
    pub fn advance(
        &self,
        position: Position,
        distance: Length,
        turnouts: &TurnoutStates,
    ) -> Result<Position, PathError> {
        if !distance.is_finite() || !position.offset.is_finite() {
            return Err(PathError::NotFinite);
        }
        if distance < Length::ZERO {
            let behind = self.reversed(position).ok_or(PathError::NotOnLayout)?;
            let behind = self.advance(behind, -distance, turnouts)?;
            let position = self.reversed(behind).ok_or(PathError::NotOnLayout)?;
            // In the other direction it may be at the start of an edge, and so at the end of this one.
            return self.advance(position, Length::ZERO, turnouts);
        }
        let (mut id, mut left) = (position.edge, position.offset + distance);
        let mut passed = 0;
        loop {
            let edge = self.edge(id).ok_or(PathError::NotOnLayout)?;
            if left < edge.length {
                return Ok(Position { edge: id, offset: left });
            }
            match self.edge_ahead(edge.to, turnouts) {
                Ok(next) => {
                    id = next;
                    left -= edge.length;
                }
                Err(_) if left - edge.length <= ROUNDING => {
                    return Ok(Position { edge: id, offset: edge.length });
                }
                Err(stop) => return Err(stop.after(left - edge.length)),
            }
            passed += 1;
            if passed == self.edges().len() {
                // The path has passed as many edges as the layout has: it is a loop, and whole laps cancel.
                left = Length::from_m(libm::fmod(left.as_m(), self.lap(id, turnouts).as_m()));
            }
        }
    }

    /// The distance ahead from one position to another: the shortest over turnouts that are in position or unknown;
    /// `None` if no path leads there without reversing.
    pub fn distance_ahead(&self, from: Position, to: Position, turnouts: &TurnoutStates) -> Option<Length> {
        let (from_edge, to_edge) = (self.edge(from.edge)?, self.edge(to.edge)?);
        if from.edge == to.edge && from.offset <= to.offset {
            return Some(to.offset - from.offset);
        }
        // The end of one edge is the same point as the start of the next.
        let (from_nodes, to_nodes) = (nodes_at(from_edge, from.offset), nodes_at(to_edge, to.offset));
        if from_nodes.iter().flatten().any(|node| to_nodes.contains(&Some(*node))) {
            return Some(Length::ZERO);
        }
        let (_, between) = self.shortest(from_edge.to, to_edge.from, turnouts)?;
        Some(from_edge.length - from.offset + between + to.offset)
    }

    /// The edge that leaves a node with the turnouts in these positions.
    pub(crate) fn edge_ahead(&self, node: NodeId, turnouts: &TurnoutStates) -> Result<EdgeId, Stop<'_>> {
        let node = self.node(node).ok_or(Stop::NotOnLayout)?;
        match (node.outgoing, node.kind) {
            (OutgoingEdges::Ahead(edge), _) => Ok(edge),
            (OutgoingEdges::Legs { straight, curved }, NodeKind::Branch(turnout)) => {
                match turnouts.get(turnout) {
                    Some(Leg::Straight) => Ok(straight),
                    Some(Leg::Curved) => Ok(curved),
                    None => Err(Stop::TurnoutUnknown(turnout)),
                }
            }
            _ => Err(Stop::TrackEnds(&node.name)),
        }
    }

    /// The length of the loop of an edge, which is never zero.
    fn lap(&self, start: EdgeId, turnouts: &TurnoutStates) -> Length {
        let (mut id, mut lap) = (start, Length::ZERO);
        while let Some(edge) = self.edge(id) {
            lap += edge.length;
            match self.edge_ahead(edge.to, turnouts) {
                Ok(next) if next != start => id = next,
                _ => break,
            }
        }
        lap
    }
}

/// The nodes at a point: where its edge begins, where it ends, or both if the edge is 0 mm long.
fn nodes_at(edge: &Edge, offset: Length) -> [Option<NodeId>; 2] {
    let begins = (offset <= ROUNDING).then_some(edge.from);
    let ends = (edge.length - offset <= ROUNDING).then_some(edge.to);
    [begins, ends]
}

/// Why there is no edge ahead.
pub(crate) enum Stop<'l> {
    NotOnLayout,
    TurnoutUnknown(TurnoutId),
    TrackEnds(&'l str),
}

impl Stop<'_> {
    /// The error for a path with this remaining distance.
    pub(crate) fn after(self, left: Length) -> PathError {
        match self {
            Self::NotOnLayout => PathError::NotOnLayout,
            Self::TurnoutUnknown(turnout) => PathError::TurnoutUnknown { turnout, left },
            Self::TrackEnds(node) => PathError::TrackEnds { node: node.to_owned(), left },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::example::{oval, oval_plan};
    use std::format;
    use std::string::ToString;

    /// Turnout positions that close the loop over B.
    fn straight() -> TurnoutStates {
        [(TurnoutId(1), Leg::Straight), (TurnoutId(2), Leg::Straight)].into_iter().collect()
    }

    fn at(layout: &Layout, from: &str, to: &str, mm: f64) -> Position {
        let node = |name| layout.node_named(name).unwrap();
        Position { edge: layout.edge_between(node(from), node(to)).unwrap(), offset: Length::from_mm(mm) }
    }

    fn text(layout: &Layout, position: Position) -> String {
        let edge = layout.edge(position.edge).unwrap();
        let (from, to) = (layout.node_name(edge.from), layout.node_name(edge.to));
        format!("{:.3} from {from} to {to}", position.offset.as_mm())
    }

    #[test]
    fn a_position_moves_on_and_back_over_nodes() {
        let layout = oval();
        let start = at(&layout, "D1", "A1", 450.0);
        let moved = |mm| text(&layout, layout.advance(start, Length::from_mm(mm), &straight()).unwrap());
        assert_eq!(moved(20.0), "470.000 from D1 to A1");
        assert_eq!(moved(100.0), "50.000 from A1 to BR1");
        assert_eq!(moved(160.0), "10.000 from BR1 to B1");
        assert_eq!(moved(-450.0), "0.000 from D1 to A1");
        assert_eq!(moved(-460.0), "90.000 from MR2 to D1");
        assert_eq!(moved(-560.0), "190.000 from B1 to MR2");
    }

    #[test]
    fn whole_laps_make_no_difference_however_many() {
        let layout = oval();
        let start = at(&layout, "D1", "A1", 450.0);
        // 500 + 100 + 200 + 200 + 100.
        for laps in [1.0, 1e3, 1e6] {
            let moved = layout.advance(start, Length::from_mm(1_100.0 * laps), &straight()).unwrap();
            let distance = layout.distance_ahead(start, moved, &straight()).unwrap().as_mm();
            assert!(distance.min(1_100.0 - distance) < 1e-4, "{laps} laps: {distance}");
        }
        assert!(layout.advance(start, Length::from_m(f64::MAX), &straight()).is_ok());
        assert!(layout.advance(start, Length::from_m(-f64::MAX), &straight()).is_ok());
    }

    #[test]
    fn a_path_ends_at_the_end_of_the_track_and_at_an_unknown_turnout() {
        let layout = oval();
        let unknown = TurnoutStates::unknown();
        let start = at(&layout, "EN1", "E1", 10.0);
        let end = layout.advance(start, Length::from_mm(60.0), &unknown).unwrap();
        assert_eq!(text(&layout, end), "40.000 from E1 to EX2");
        let beyond = layout.advance(start, Length::from_mm(75.0), &unknown).unwrap_err();
        assert_eq!(beyond.to_string(), "the track ends at `EX2`, 15 mm before the end of the path");
        let start = at(&layout, "A1", "BR1", 0.0);
        let undecided = layout.advance(start, Length::from_mm(130.0), &unknown).unwrap_err();
        assert_eq!(
            undecided.to_string(),
            "the position of turnout 1, 30 mm before the end of the path, is unknown: throw it first"
        );
        assert!(layout.advance(start, Length::from_mm(100.0), &unknown).is_ok(), "up to it is known");
        assert_eq!(layout.advance(start, Length::from_m(f64::NAN), &unknown), Err(PathError::NotFinite));
        let elsewhere = Position { edge: EdgeId(999), offset: Length::ZERO };
        assert_eq!(layout.advance(elsewhere, Length::ZERO, &unknown), Err(PathError::NotOnLayout));
        assert_eq!(layout.reversed(elsewhere), None);
    }

    #[test]
    fn reversing_twice_changes_nothing() {
        let layout = oval();
        let here = at(&layout, "B1", "MR2", 60.0);
        let there = layout.reversed(here).unwrap();
        assert_eq!(text(&layout, there), "140.000 from BR2 to B2");
        assert_eq!(text(&layout, layout.reversed(there).unwrap()), text(&layout, here));
    }

    #[test]
    fn distances_are_ahead_and_by_the_shorter_leg() {
        let layout = oval();
        let ahead = |from, to, turnouts: &TurnoutStates| {
            layout.distance_ahead(from, to, turnouts).map(|length| (length.as_mm() * 1e6).round() / 1e6)
        };
        let (a, d) = (at(&layout, "A1", "BR1", 30.0), at(&layout, "D1", "A1", 5.0));
        assert_eq!(ahead(a, d, &straight()), Some(575.0));
        assert_eq!(ahead(a, d, &TurnoutStates::unknown()), Some(545.0));
        let further = at(&layout, "A1", "BR1", 40.0);
        assert_eq!(ahead(a, further, &straight()), Some(10.0));
        assert_eq!(ahead(further, a, &straight()), Some(1_090.0), "once around");
        assert_eq!(ahead(a, at(&layout, "EN1", "E1", 0.0), &straight()), None);
        // The end of an edge and the starts of the next ones are one point.
        let (end, start) = (at(&layout, "A1", "BR1", 100.0), at(&layout, "BR1", "C1", 0.0));
        assert_eq!((ahead(end, start, &straight()), ahead(start, end, &straight())), (Some(0.0), Some(0.0)));
    }

    #[test]
    fn edges_of_zero_length_are_passed() {
        let mut plan = oval_plan();
        plan.stretches[1].length = Length::ZERO.into();
        plan.stretches[3].length = Length::ZERO.into();
        let layout = Layout::build(&plan).unwrap();
        let start = at(&layout, "A1", "BR1", 100.0);
        let moved = layout.advance(start, Length::ZERO, &straight()).unwrap();
        assert_eq!(text(&layout, moved), "0.000 from MR2 to D1");
        let back = layout.advance(moved, Length::from_mm(-1.0), &straight()).unwrap();
        assert_eq!(text(&layout, back), "99.000 from A1 to BR1");
        assert_eq!(layout.distance_ahead(start, moved, &straight()), Some(Length::ZERO));
    }
}
