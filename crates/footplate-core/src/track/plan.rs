//! An unchecked layout by names, as in a layout file: each place and each stretch of rail once.
//!
//! Both directions of travel are implied, so a plan cannot contain an edge without its twin, a twin of another length
//! or a node without a reverse.

use alloc::string::String;
use alloc::vec::Vec;

use crate::ids::{SensorId, StretchId, TurnoutId};
use crate::track::{Leg, StretchLength, Survey, Zone};
use crate::units::Length;

/// Longest plausible stretch. The one published mistake of the unit (micrometres read as millimetres)
/// makes stretches of 185 m and 239 m; no stretch of a model railway without a sensor or turnout is near it.
pub const MAX_EDGE_LENGTH: Length = Length::from_m(100.0);

/// Longest name of a node.
pub const MAX_NAME_CHARACTERS: usize = 32;

/// The track as described by a layout file.
#[derive(Debug, Clone, PartialEq)]
pub struct LayoutPlan {
    /// The name of the layout.
    pub name: String,
    /// How well the lengths are known.
    pub survey: Survey,
    /// The places; the order decides the node numbers.
    pub places: Vec<Place>,
    /// The rails between them; the order decides the edge numbers.
    pub stretches: Vec<Stretch>,
    /// Pairs of turnouts in one place of which at most one may be set curved.
    pub never_both_curved: Vec<[TurnoutId; 2]>,
    /// Speed restrictions.
    pub zones: Vec<PlannedZone>,
    /// Blocks; the boundaries among the places say where they are.
    pub blocks: Vec<PlannedBlock>,
}

/// A section of track with an occupancy detector.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlannedBlock {
    /// Its name.
    pub name: String,
    /// The number under which the station reports it.
    pub detector: SensorId,
}

/// A speed restriction and its stretches.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedZone {
    /// The restriction.
    pub zone: Zone,
    /// The stretches, counted from 0 in the order of the plan.
    pub stretches: Vec<StretchId>,
}

/// A place on the rails: a node for each direction of travel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// A direction-sensitive sensor: it reports as one sensor or as the other.
    Sensor {
        /// The names of the two directions.
        names: [String; 2],
        /// The sensors of the two directions.
        sensors: [SensorId; 2],
    },
    /// A sensor that reports the same number whichever direction a train passes in.
    UndirectedSensor {
        /// The names of the two directions.
        names: [String; 2],
        /// The number that the station reports.
        sensor: SensorId,
    },
    /// The boundary of a block, where its insulated rail joint is.
    Boundary {
        /// The names of the two directions.
        names: [String; 2],
        /// The block that a train enters in each direction; `None` where no detector is.
        enters: [Option<String>; 2],
    },
    /// A turnout.
    Turnout {
        /// The name of the branch, approached at the toe, and of the merge, approached on a leg.
        names: [String; 2],
        /// The turnout.
        turnout: TurnoutId,
    },
    /// A place where the track ends, at a buffer or at the border of the model.
    End {
        /// The name of the entry, which leads onto the layout, and of the exit, which no edge leaves.
        names: [String; 2],
    },
}

impl Place {
    /// The names of its two nodes.
    pub const fn names(&self) -> &[String; 2] {
        match self {
            Self::Sensor { names, .. }
            | Self::UndirectedSensor { names, .. }
            | Self::Boundary { names, .. }
            | Self::Turnout { names, .. }
            | Self::End { names } => names,
        }
    }
}

/// A stretch of rail between two places, in either of its two directions.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// The node it leaves, with the leg at a branch.
    pub from: RailEnd,
    /// The node it reaches, with the leg at a merge.
    pub to: RailEnd,
    /// Its length, with its uncertainty.
    pub length: StretchLength,
}

/// One end of a stretch: a node, and the leg if the stretch joins a turnout on the side of its legs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RailEnd {
    /// The name of the node.
    pub node: String,
    /// The leg of the turnout; `None` at sensors, track ends and the toe.
    pub leg: Option<Leg>,
}
