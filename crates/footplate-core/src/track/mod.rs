//! Where trains can go: a layout as a directed graph, and the ways through it.
//!
//! Rails have no direction but trains do, so every place on the rails is a pair of nodes, one for each
//! direction of travel, and every stretch of rail is a pair of edges. A [`LayoutPlan`] says what a file or a
//! test says, by name; [`Layout::build`] checks it and answers from then on by small integers:
//! - [`Layout::hops_from`]: which sensors may come next, in nanoseconds, from a table made once;
//! - [`Layout::reaches`]: the same when up to [`MAX_MISSED`] sensors on the way stay silent;
//! - [`Layout::route`]: the shortest way between two nodes; [`Layout::circuit_from`]: a way that leads back;
//! - [`Layout::greatest_speed`]: how fast trains may be along a way;
//! - [`Position`] and [`Landmark`]: points on the rails, and the names people give them.

mod build;
mod circuit;
mod error;
#[cfg(test)]
pub(crate) mod example;
mod graph;
mod hop;
mod landmark;
mod plan;
mod position;
mod reach;
mod route;
mod sequence_test;
mod survey;
mod turnout;
mod zone;

pub use circuit::Circuit;
pub use error::{LayoutError, PlanEntry};
pub use graph::{Edge, Layout, Node, NodeKind, Ways};
pub use hop::{Hop, HopId};
pub use landmark::{Landmark, LandmarkError};
pub use plan::{LayoutPlan, MAX_EDGE_LENGTH, MAX_NAME_CHARACTERS, Place, PlannedZone, RailEnd, Stretch};
pub use position::{Position, WayError};
pub use reach::{MAX_MISSED, Reach, Reaches};
pub use route::{Route, RouteError};
pub use sequence_test::{SequenceTest, SequenceVerdict, StrayReport};
pub use survey::{StretchLength, Survey, SurveyedDistance};
pub use turnout::{Leg, TurnoutNeed, TurnoutStates};
pub use zone::{MAX_ZONE_LIMIT, MIN_ZONE_LIMIT, Zone};
