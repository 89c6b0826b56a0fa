//! A layout with its description and drawing coordinates.

use std::collections::BTreeMap;

use footplate_core::NodeId;
use footplate_core::track::Layout;

/// The content of a layout file.
#[derive(Debug, Clone, PartialEq)]
pub struct LayoutFile {
    /// The layout.
    pub layout: Layout,
    /// Its description: where it is, its surveyor.
    pub about: String,
    /// Its drawing coordinates.
    pub drawing: Drawing,
}

/// Drawing coordinates of places, for those that have any.
///
/// The unit is the file's own, such as pixels of a plan; x grows to the right and y downwards.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drawing {
    /// By the first node of each place.
    points: BTreeMap<NodeId, [f64; 2]>,
}

impl Drawing {
    /// The point of a node's place.
    pub fn point(&self, node: NodeId) -> Option<[f64; 2]> {
        self.points.get(&place(node)).copied()
    }

    /// Sets the point of a node's place.
    pub fn set(&mut self, node: NodeId, point: [f64; 2]) {
        self.points.insert(place(node), point);
    }
}

/// The key of a node's place: the lower of its two nodes.
fn place(node: NodeId) -> NodeId {
    node.min(node.reverse())
}
