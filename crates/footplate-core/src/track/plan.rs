//! A layout as people write it down: by name, each place and each stretch of rail once, not yet checked.
//!
//! Both directions of travel are implied, so an edge without its twin, a twin of another length or a node
//! without a reverse cannot be written here at all.

use alloc::string::String;
use alloc::vec::Vec;

use crate::ids::{SensorId, StretchId, TurnoutId};
use crate::track::{Leg, StretchLength, Survey, Zone};
use crate::units::Length;

/// Longest stretch that is believed. The one published slip of the unit (micrometres read as millimetres)
/// makes stretches of 185 m and 239 m; no stretch of a model railway without a sensor or turnout is near it.
pub const MAX_EDGE_LENGTH: Length = Length::from_m(100.0);

/// Longest name of a node.
pub const MAX_NAME_CHARACTERS: usize = 32;

/// Everything a layout file says about the track.
#[derive(Debug, Clone, PartialEq)]
pub struct LayoutPlan {
    /// What people call the layout.
    pub name: String,
    /// How well the lengths are known.
    pub survey: Survey,
    /// The places; the order decides the node numbers.
    pub places: Vec<Place>,
    /// The rails between them; the order decides the edge numbers.
    pub stretches: Vec<Stretch>,
    /// Pairs of turnouts in one place of which at most one may lie for its curved leg.
    pub never_both_curved: Vec<[TurnoutId; 2]>,
    /// Speed restrictions.
    pub zones: Vec<PlannedZone>,
}

/// A speed restriction and where it is.
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
    /// A contact that shows the direction of travel: it reports as one sensor or as the other.
    Sensor {
        /// The names of the two directions.
        names: [String; 2],
        /// The sensors of the two directions.
        sensors: [SensorId; 2],
    },
    /// A turnout.
    Turnout {
        /// The name of the branch, met at the toe, and of the merge, met from a leg.
        names: [String; 2],
        /// The turnout.
        turnout: TurnoutId,
    },
    /// A place where the track ends, in a buffer or beyond what is modelled.
    End {
        /// The name of the entry, which leads onto the layout, and of the exit, from which nothing leads.
        names: [String; 2],
    },
}

impl Place {
    /// The names of its two nodes.
    #[must_use]
    pub const fn names(&self) -> &[String; 2] {
        match self {
            Self::Sensor { names, .. } | Self::Turnout { names, .. } | Self::End { names } => names,
        }
    }
}

/// A stretch of rail between two places, written in one of its two directions.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// The node it leaves; at a branch, by which leg.
    pub from: RailEnd,
    /// The node it reaches; at a merge, by which leg.
    pub to: RailEnd,
    /// What is known of its length.
    pub length: StretchLength,
}

/// One end of a stretch: a node, and the leg where the node is a turnout met or left on the side of its legs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RailEnd {
    /// The name of the node.
    pub node: String,
    /// The leg of the turnout; `None` at sensors, track ends and the toe.
    pub leg: Option<Leg>,
}
