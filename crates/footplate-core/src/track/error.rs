//! Errors of a layout plan, each with the entry at fault.

use alloc::string::String;
use core::fmt;

use crate::ids::{SensorId, TurnoutId};
use crate::track::{Leg, MAX_EDGE_LENGTH, MAX_NAME_CHARACTERS, MAX_ZONE_LIMIT, MIN_ZONE_LIMIT};
use crate::units::{Length, Speed};

/// Why a plan is invalid. Places, stretches, pairs and zones are counted from 0 in the order of the plan.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum LayoutError {
    /// More places or stretches than node and edge numbers can name.
    TooMany {
        /// `places` or `stretches`.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there may be.
        limit: usize,
    },
    /// The uncertainty of the lengths is not a length.
    IllegalUncertainty {
        /// What was given.
        found: Length,
    },
    /// A name that could be confused with a landmark or with other text.
    IllegalName {
        /// The place.
        place: usize,
        /// Its name.
        name: String,
    },
    /// Two nodes of one name.
    DuplicateName {
        /// The later place.
        place: usize,
        /// The name.
        name: String,
    },
    /// One sensor at two nodes.
    SensorPlacedTwice {
        /// The later place.
        place: usize,
        /// The sensor.
        sensor: SensorId,
        /// The node that has it.
        first: String,
        /// The other node.
        second: String,
    },
    /// One turnout at two places.
    TurnoutPlacedTwice {
        /// The later place.
        place: usize,
        /// The turnout.
        turnout: TurnoutId,
        /// The branch that has it.
        first: String,
        /// The other branch.
        second: String,
    },
    /// A stretch ends at a node that no place has.
    UnknownNode {
        /// The stretch.
        stretch: usize,
        /// The unknown name.
        node: String,
    },
    /// A stretch joins a turnout without naming the leg.
    LegMissing {
        /// The stretch.
        stretch: usize,
        /// The branch or merge.
        node: String,
    },
    /// A leg at a node that has none.
    LegWithoutTurnout {
        /// The stretch.
        stretch: usize,
        /// The node.
        node: String,
        /// The leg given.
        leg: Leg,
    },
    /// A stretch leaves an exit or reaches an entry.
    BeyondTrackEnd {
        /// The stretch.
        stretch: usize,
        /// The entry or exit.
        node: String,
    },
    /// A negative, infinite, undefined or absurd length.
    IllegalLength {
        /// The stretch.
        stretch: usize,
        /// What was given.
        found: Length,
    },
    /// The uncertainty of a length of its own is not a length.
    IllegalLengthUncertainty {
        /// The stretch.
        stretch: usize,
        /// What was given.
        found: Length,
    },
    /// The relative uncertainty of the common scale of all lengths is out of range.
    IllegalScale {
        /// What was given, as a fraction.
        found: f64,
    },
    /// A surveyed distance that is not from a sensor to the next one over a single path.
    NoDistance {
        /// The distance.
        distance: usize,
        /// The node it begins at.
        from: String,
        /// The node it ends at.
        to: String,
    },
    /// A surveyed distance that is not the sum of its edges.
    UnequalDistance {
        /// The distance.
        distance: usize,
        /// What was given.
        found: Length,
        /// The sum of the edges.
        edges: Length,
    },
    /// The uncertainty of a surveyed distance is not a length.
    IllegalDistanceUncertainty {
        /// The distance.
        distance: usize,
        /// What was given.
        found: Length,
    },
    /// Two stretches, or both ends of one, at one rail end.
    RailEndTaken {
        /// The later stretch.
        stretch: usize,
        /// The stretch that was there before.
        first: usize,
        /// The node that both would leave.
        node: String,
        /// The leg, at a branch.
        leg: Option<Leg>,
    },
    /// No edge leaves a node that is not an exit.
    RailEndOpen {
        /// The place.
        place: usize,
        /// The node.
        node: String,
        /// The leg, at a branch.
        leg: Option<Leg>,
    },
    /// A pair of turnouts names a turnout that the layout does not have, or that is in a pair already.
    IllegalPair {
        /// The pair.
        pair: usize,
        /// The turnout.
        turnout: TurnoutId,
    },
    /// A loop of edges of 0 mm.
    LoopWithoutLength {
        /// A place on the loop.
        place: usize,
        /// Its node.
        node: String,
    },
    /// Too many paths from a node to the next sensors for the table of hops.
    TooManyHops {
        /// The place.
        place: usize,
        /// The node.
        node: String,
    },
    /// A zone's name that does not fit on one line.
    IllegalZoneName {
        /// The zone.
        zone: usize,
        /// Its name.
        name: String,
    },
    /// Two zones of one name.
    DuplicateZone {
        /// The later zone.
        zone: usize,
        /// The name.
        name: String,
    },
    /// A limit out of range: it would restrict nothing, or no train could observe it.
    IllegalZoneLimit {
        /// The zone.
        zone: usize,
        /// What was given.
        found: Speed,
    },
    /// One stretch in two zones.
    RestrictedTwice {
        /// The later zone.
        zone: usize,
        /// The name of the zone that has it.
        first: String,
        /// The name of the other zone.
        second: String,
    },
    /// A zone without edges.
    ZoneWithoutEdges {
        /// The zone.
        zone: usize,
        /// Its name.
        name: String,
    },
    /// A block's name that does not fit on one line.
    IllegalBlockName {
        /// The block.
        block: usize,
        /// Its name.
        name: String,
    },
    /// Two blocks of one name.
    DuplicateBlock {
        /// The later block.
        block: usize,
        /// The name.
        name: String,
    },
    /// A detector whose number another block or a sensor has.
    DetectorTaken {
        /// The later block.
        block: usize,
        /// The number.
        detector: SensorId,
        /// The name of the block or sensor that has it.
        first: String,
    },
    /// A block that no boundary leads into.
    BlockWithoutBoundary {
        /// The block.
        block: usize,
        /// Its name.
        name: String,
    },
    /// A boundary of a block that the plan does not have.
    UnknownBlock {
        /// The place.
        place: usize,
        /// The name of the block.
        name: String,
    },
    /// The rails of a block end at a boundary that leads into another block, or into none.
    BoundaryMissing {
        /// The place of the boundary.
        place: usize,
        /// Its node that faces the block.
        node: String,
        /// The block of the rails.
        block: String,
        /// The block that the boundary names.
        entered: Option<String>,
    },
    /// One stretch in two blocks.
    BlocksOverlap {
        /// The stretch.
        stretch: usize,
        /// The name of the block that has it.
        first: String,
        /// The name of the other block.
        second: String,
    },
}

/// The entry of a plan that an error is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlanEntry {
    /// The plan as a whole.
    Plan,
    /// The uncertainty of its lengths.
    Survey,
    /// A place.
    Place(usize),
    /// A stretch.
    Stretch(usize),
    /// A surveyed distance.
    Distance(usize),
    /// A pair of turnouts that are never both curved.
    Pair(usize),
    /// A speed restriction.
    Zone(usize),
    /// A block.
    Block(usize),
}

impl LayoutError {
    /// The entry to look at.
    pub const fn entry(&self) -> PlanEntry {
        match *self {
            Self::TooMany { .. } => PlanEntry::Plan,
            Self::IllegalUncertainty { .. } | Self::IllegalScale { .. } => PlanEntry::Survey,
            Self::NoDistance { distance, .. }
            | Self::UnequalDistance { distance, .. }
            | Self::IllegalDistanceUncertainty { distance, .. } => PlanEntry::Distance(distance),
            Self::IllegalName { place, .. }
            | Self::DuplicateName { place, .. }
            | Self::SensorPlacedTwice { place, .. }
            | Self::TurnoutPlacedTwice { place, .. }
            | Self::RailEndOpen { place, .. }
            | Self::UnknownBlock { place, .. }
            | Self::BoundaryMissing { place, .. }
            | Self::LoopWithoutLength { place, .. }
            | Self::TooManyHops { place, .. } => PlanEntry::Place(place),
            Self::UnknownNode { stretch, .. }
            | Self::LegMissing { stretch, .. }
            | Self::LegWithoutTurnout { stretch, .. }
            | Self::BeyondTrackEnd { stretch, .. }
            | Self::IllegalLength { stretch, .. }
            | Self::IllegalLengthUncertainty { stretch, .. }
            | Self::RailEndTaken { stretch, .. }
            | Self::BlocksOverlap { stretch, .. } => PlanEntry::Stretch(stretch),
            Self::IllegalPair { pair, .. } => PlanEntry::Pair(pair),
            Self::IllegalZoneName { zone, .. }
            | Self::DuplicateZone { zone, .. }
            | Self::IllegalZoneLimit { zone, .. }
            | Self::RestrictedTwice { zone, .. }
            | Self::ZoneWithoutEdges { zone, .. } => PlanEntry::Zone(zone),
            Self::IllegalBlockName { block, .. }
            | Self::DuplicateBlock { block, .. }
            | Self::DetectorTaken { block, .. }
            | Self::BlockWithoutBoundary { block, .. } => PlanEntry::Block(block),
        }
    }
}

/// `` `BR6` `` or `` `BR6 curved` ``.
struct Named<'a>(&'a str, Option<Leg>);

impl fmt::Display for Named<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.1 {
            Some(leg) => write!(f, "`{} {leg}`", self.0),
            None => write!(f, "`{}`", self.0),
        }
    }
}

impl fmt::Display for LayoutError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooMany { what, found, limit } => {
                write!(f, "{found} {what} are more than the {limit} that a layout can number")
            }
            Self::IllegalUncertainty { found }
            | Self::IllegalLengthUncertainty { found, .. }
            | Self::IllegalDistanceUncertainty { found, .. } => write!(
                f,
                "an uncertainty of {} mm is not between 0 and {} mm",
                found.as_mm(),
                MAX_EDGE_LENGTH.as_mm()
            ),
            Self::IllegalScale { found } => {
                write!(f, "an uncertainty of the scale of {} % is not between 0 and 100 %", 100.0 * found)
            }
            Self::NoDistance { from, to, .. } => write!(
                f,
                "there is no single path from sensor `{from}` to `{to}` without another sensor between: \
                 give a distance between neighbouring sensors"
            ),
            Self::UnequalDistance { found, edges, .. } => write!(
                f,
                "a distance of {:.0} mm is not the sum of the edges between, {:.0} mm: correct one or the other",
                found.as_mm(),
                edges.as_mm()
            ),
            Self::IllegalName { name, .. } => write!(
                f,
                "the name `{}` is not 1 to {MAX_NAME_CHARACTERS} letters, digits, `_` or `.`",
                name.escape_debug()
            ),
            Self::DuplicateName { name, .. } => {
                write!(f, "the name `{name}` is taken; every node needs its own")
            }
            Self::SensorPlacedTwice { sensor, first, second, .. } => {
                write!(f, "sensor {sensor} is placed at `{first}` and again at `{second}`")
            }
            Self::TurnoutPlacedTwice { turnout, first, second, .. } => {
                write!(f, "turnout {turnout} is placed at `{first}` and again at `{second}`")
            }
            Self::UnknownNode { node, .. } => {
                write!(f, "no sensor, turnout or end is called `{}`", node.escape_debug())
            }
            Self::LegMissing { node, .. } => {
                write!(f, "`{node}` has two legs: write `{node} straight` or `{node} curved`")
            }
            Self::LegWithoutTurnout { node, leg, .. } => {
                write!(f, "`{node} {leg}` names a leg, but this node has only one exit: write `{node}`")
            }
            Self::BeyondTrackEnd { node, .. } => {
                write!(f, "the track ends at `{node}`: edges leave an entry and reach an exit")
            }
            Self::IllegalLength { found, .. } => write!(
                f,
                "a length of {} mm is not between 0 and {} mm (is it in millimetres?)",
                found.as_mm(),
                MAX_EDGE_LENGTH.as_mm()
            ),
            Self::RailEndTaken { stretch, first, node, leg } if stretch == first => {
                write!(f, "an edge that leaves {} comes back to the same rail end", Named(node, *leg))
            }
            Self::RailEndTaken { node, leg, .. } => write!(
                f,
                "there is an edge from {} already; each stretch is written once, in either direction",
                Named(node, *leg)
            ),
            Self::RailEndOpen { node, leg, .. } => write!(
                f,
                "no edge leads on from {}: join it to another node, or to an end if the track ends there",
                Named(node, *leg)
            ),
            Self::IllegalPair { turnout, .. } => write!(
                f,
                "turnout {turnout} makes no pair: it takes two different turnouts of this layout, each in one pair"
            ),
            Self::LoopWithoutLength { node, .. } => {
                write!(f, "the edges from `{node}` come back to it after 0 mm: at least one must be longer")
            }
            Self::TooManyHops { node, .. } => write!(
                f,
                "there are too many paths from `{node}` to the next sensors: put sensors between the \
                 turnouts"
            ),
            Self::IllegalZoneName { name, .. } => write!(
                f,
                "the zone's name `{}` is not 1 to {MAX_NAME_CHARACTERS} characters on one line",
                name.escape_debug()
            ),
            Self::DuplicateZone { name, .. } => {
                write!(f, "there is a zone `{name}` already; every zone needs its own name")
            }
            Self::IllegalZoneLimit { found, .. } => write!(
                f,
                "a limit of {} mm/s is not between {} and {} mm/s (is it in millimetres a second?)",
                found.as_mm_per_s(),
                MIN_ZONE_LIMIT.as_mm_per_s(),
                MAX_ZONE_LIMIT.as_mm_per_s()
            ),
            Self::RestrictedTwice { first, second, .. } => {
                write!(f, "an edge is in zone `{first}` and in zone `{second}`; each edge is in one at most")
            }
            Self::ZoneWithoutEdges { name, .. } => {
                write!(f, "no edge is in zone `{name}`: write `zone = \"{name}\"` on the edges it restricts")
            }
            Self::IllegalBlockName { name, .. } => write!(
                f,
                "the block's name `{}` is not 1 to {MAX_NAME_CHARACTERS} characters on one line",
                name.escape_debug()
            ),
            Self::DuplicateBlock { name, .. } => {
                write!(f, "there is a block `{name}` already; every block needs its own name")
            }
            Self::DetectorTaken { detector, first, .. } => write!(
                f,
                "detector {detector} belongs to `{first}` already; give the number that this block reports"
            ),
            Self::BlockWithoutBoundary { name, .. } => {
                write!(f, "no boundary leads into block `{name}`: name it in `enters` of its boundaries")
            }
            Self::UnknownBlock { name, .. } => {
                let name = name.escape_debug();
                write!(
                    f,
                    "no block is called `{name}`: add `{{ name = \"{name}\", number = .. }}` to `blocks`"
                )
            }
            Self::BoundaryMissing { node, block, entered, .. } => {
                write!(f, "the rails at `{node}` belong to block `{block}`, but trains enter ")?;
                match entered {
                    Some(entered) => write!(f, "`{entered}` there")?,
                    None => write!(f, "no block there")?,
                }
                write!(f, ": write `{block}` in `enters`, or put a boundary between")
            }
            Self::BlocksOverlap { first, second, .. } => {
                write!(f, "an edge is in block `{first}` and in block `{second}`: put a boundary between")
            }
        }
    }
}

impl core::error::Error for LayoutError {}
