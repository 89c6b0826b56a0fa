//! A layout with what a file says about it besides: a few words, and where to draw its places.

use std::collections::BTreeMap;

use footplate_core::NodeId;
use footplate_core::track::Layout;

/// What a layout file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct LayoutFile {
    /// The layout.
    pub layout: Layout,
    /// What people should know about it: where it stands, who measured it.
    pub about: String,
    /// Where to draw it.
    pub drawing: Drawing,
}

/// Where the places of a layout stand in a drawing, for those that have been given a point.
///
/// The unit is the file's own, such as pixels of a plan; x grows to the right and y downwards.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drawing {
    /// By the first node of each place.
    points: BTreeMap<NodeId, [f64; 2]>,
}

impl Drawing {
    /// The point of the place a node belongs to.
    #[must_use]
    pub fn point(&self, node: NodeId) -> Option<[f64; 2]> {
        self.points.get(&place(node)).copied()
    }

    /// Gives the place of a node a point.
    pub fn set(&mut self, node: NodeId, point: [f64; 2]) {
        self.points.insert(place(node), point);
    }

    /// Whether no place has a point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }
}

/// Both nodes of a place are drawn at one point, kept under the lower of them.
fn place(node: NodeId) -> NodeId {
    node.min(node.reverse())
}
