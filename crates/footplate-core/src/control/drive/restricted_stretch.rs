//! Speed restrictions on the way of a train, in lengths as the train feels them.

use alloc::vec::Vec;

use crate::ids::NodeId;
use crate::model::MotionModel;
use crate::track::{Hop, Zone};
use crate::tracking::TrackContext;

/// Hops looked at in either direction: more than a circuit_length of any layout in use.
const MAX_HOPS: usize = 200;
/// Edges that are this near to each other (m) follow one another: sums of lengths are rounded.
const ADJACENT: f64 = 1e-6;

/// A part of the way on which the speed is restricted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RestrictedStretch<'g> {
    pub(super) zone: &'g Zone,
    /// Where it begins and where it ends (m past the node from which the train is counted, negative behind it).
    pub(super) from: f64,
    pub(super) to: f64,
}

impl<'g> RestrictedStretch<'g> {
    /// What is restricted behind a node and ahead of it, so far each (m), as the turnouts lie; the ways behind first. Where
    /// nobody knows how a turnout ahead lies, what is restricted on either leg.
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

/// Adds the restricted edges of a hop that begins so far ahead (m); returns how long the train feels the hop.
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
