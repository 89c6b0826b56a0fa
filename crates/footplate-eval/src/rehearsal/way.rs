//! The longest way round with all turnouts straight, on which trains run, and places beside it.

use std::collections::BTreeSet;

use footplate_core::track::{Layout, Leg, TurnoutStates};
use footplate_core::{EdgeId, Length, NodeId};

/// A train that stands beside the way stands on an edge of at least this length, this far past its contact.
const BESIDE: [Length; 2] = [Length::from_mm(500.0), Length::from_mm(300.0)];
/// No way round has more contacts (chosen).
const MOST_CONTACTS: usize = 60;

/// A way round.
pub struct Way {
    /// Its contacts in the order of travel.
    pub nodes: Vec<NodeId>,
    /// Its edges in the order of travel.
    pub edges: Vec<EdgeId>,
    /// Contacts with places behind them that are not on it.
    pub beside: Vec<(NodeId, Length)>,
}

impl Way {
    /// The surveyed lengths (mm) of its first edges, summed.
    pub fn surveyed(&self, layout: &Layout, edges: usize) -> f64 {
        let edges = self.edges.iter().take(edges).filter_map(|edge| layout.edge(*edge));
        edges.map(|edge| edge.length.as_mm()).sum()
    }

    /// The longest that there is.
    pub fn round(layout: &Layout) -> Self {
        let turnouts: TurnoutStates =
            layout.turnouts().map(|(turnout, _)| (turnout, Leg::Straight)).collect();
        let from = |start: NodeId| {
            let (mut nodes, mut edges, mut node) = (Vec::new(), Vec::new(), start);
            for _ in 0..MOST_CONTACTS {
                let hop = layout.open_hops_from(node, &turnouts).next()?;
                hop.sensor?;
                nodes.push(node);
                edges.extend_from_slice(hop.edges);
                node = hop.to;
                if node == start {
                    return Some((nodes, edges));
                }
            }
            None
        };
        let rounds = layout.sensors().filter_map(|(_, node)| from(node));
        let (nodes, edges) = rounds.max_by_key(|(nodes, _)| nodes.len()).unwrap_or_default();
        let taken: BTreeSet<_> = edges.iter().map(|edge| edge.stretch()).collect();
        let beside = layout
            .sensors()
            .filter_map(|(_, node)| {
                let edge = *layout.open_hops_from(node, &turnouts).next()?.edges.first()?;
                let length = layout.edge(edge)?.length;
                (length >= BESIDE[0] && !taken.contains(&edge.stretch())).then_some((node, BESIDE[1]))
            })
            .collect();
        Self { nodes, edges, beside }
    }
}
