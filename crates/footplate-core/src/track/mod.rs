//! Track: a layout as a directed graph, and the paths through it.
//!
//! Rails have no direction but trains do, so every place on the rails is a pair of nodes, one for each
//! direction of travel, and every stretch of rail is a pair of edges. A [`LayoutPlan`] describes a layout by names, as
//! layout files do; [`Layout::build`] checks it. A [`Layout`] uses small integers:
//! - [`Layout::hops_from`]: the sensors that a train may reach next, in nanoseconds, from a table made once;
//! - [`Layout::reaches`]: the same if up to [`MAX_MISSED`] sensors on the path stay silent;
//! - [`Layout::circuit_from`]: a path that leads back;
//! - [`Layout::blocks`]: sections with an occupancy detector, and where trains enter them;
//! - [`Occupancy`]: from reports of their detectors to these entries;
//! - [`DirectionFinder`]: the direction in which a train passes sensors that do not report it;
//! - [`Layout::crossings`]: where two tracks cross without a connection;
//! - [`Layout::zone`]: the speed restriction of an edge;
//! - [`Position`] and [`Landmark`]: points on the rails, and their names.

mod block;
mod build;
mod circuit;
mod crossing;
mod error;
#[cfg(test)]
pub(crate) mod example;
mod graph;
mod hop;
mod landmark;
mod occupancy;
mod plan;
mod position;
mod reach;
mod route;
mod sequence_test;
mod survey;
mod turnout;
mod undirected_sensor;
mod zone;

pub use block::Block;
pub use circuit::Circuit;
pub use crossing::Crossing;
pub use error::{LayoutError, PlanEntry};
pub use graph::{Edge, Layout, Node, NodeKind, OutgoingEdges};
pub use hop::{Hop, HopId};
pub use landmark::{Landmark, LandmarkError};
pub use occupancy::{FLICKER_TIME, Occupancy};
pub use plan::{
    LayoutPlan, MAX_EDGE_LENGTH, MAX_NAME_CHARACTERS, Place, PlannedBlock, PlannedZone, RailEnd, Stretch,
};
pub use position::{PathError, Position};
pub use reach::{MAX_MISSED, Reach, Reaches};
pub use sequence_test::{SequenceTest, SequenceVerdict, StrayReport};
pub use survey::{StretchLength, Survey, SurveyedDistance};
pub use turnout::{Leg, TurnoutNeed, TurnoutStates};
pub use undirected_sensor::DirectionFinder;
pub use zone::{MAX_ZONE_LIMIT, MIN_ZONE_LIMIT, Zone};
