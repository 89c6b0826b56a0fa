//! Speed restrictions around a train, in its path lengths.

use alloc::vec::Vec;

use crate::ids::NodeId;
use crate::model::MotionModel;
use crate::track::{Hop, Zone};
use crate::tracking::TrackContext;

/// Hops examined in either direction: more than a lap of any layout in use.
const MAX_HOPS: usize = 200;
/// Edges closer together than this (m) are adjacent: sums of lengths are rounded.
const ADJACENT: f64 = 1e-6;

/// A part of the path with a speed restriction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RestrictedStretch<'g> {
    pub(super) zone: &'g Zone,
    /// Start and end (m past the node from which the train's position is measured, negative behind it).
    pub(super) from: f64,
    pub(super) to: f64,
}

impl<'g> RestrictedStretch<'g> {
    /// The restrictions behind and ahead of a node, up to these distances (m), in order along the path. Where the
    /// position of a turnout ahead is unknown, those of both legs.
    pub(super) fn about(
        context: TrackContext<'g>,
        model: &MotionModel,
        node: NodeId,
        behind: f64,
        ahead: f64,
    ) -> Vec<Self> {
        let mut found = Vec::new();
        let mut at = 0.0;
        for hop in context.hops_ahead(node.reverse()).take(MAX_HOPS) {
            if at > behind {
                break;
            }
            at += add(&mut found, context, model, &hop, at);
        }
        for way in &mut found {
            (way.from, way.to) = (-way.to, -way.from);
        }
        found.reverse();
        let (mut at, mut end) = (0.0, node);
        for hop in context.hops_ahead(node).take(MAX_HOPS) {
            if at > ahead {
                return found;
            }
            at += add(&mut found, context, model, &hop, at);
            end = hop.to;
        }
        for hop in context.layout.open_hops_from(end, context.turnouts) {
            add(&mut found, context, model, &hop, at);
        }
        found
    }
}

/// Adds the restricted edges of a hop that starts at a distance (m). Returns the train's path length of the hop.
fn add<'g>(
    found: &mut Vec<RestrictedStretch<'g>>,
    context: TrackContext<'g>,
    model: &MotionModel,
    hop: &Hop<'g>,
    begins: f64,
) -> f64 {
    let path_length = model.length(context.sections, hop)[0].as_m();
    let surveyed = hop.length.as_m();
    let scale = if surveyed > 0.0 { path_length / surveyed } else { 1.0 };
    let mut along = begins;
    for id in hop.edges {
        let Some(edge) = context.layout.edge(*id) else { continue };
        let (from, to) = (along, along + edge.length.as_m() * scale);
        along = to;
        let Some(zone) = context.layout.zone(*id) else { continue };
        match found.last_mut() {
            Some(last) if last.zone == zone && (from - last.to).abs() <= ADJACENT => last.to = to,
            _ => found.push(RestrictedStretch { zone, from, to }),
        }
    }
    path_length
}
