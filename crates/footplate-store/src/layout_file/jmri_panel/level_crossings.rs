//! The level crossings of a panel: two tracks run over each, A to C and B to D.
//!
//! A panel is no drawing to scale, so it does not say where on an edge a crossing is: crossings divide their edge into equal parts, and
//! each is listed to be measured.

use footplate_core::track::{Layout, Position};
use footplate_core::{EdgeId, Length};

use super::children;
use super::tracks::{Tracks, name_of};

/// The ends of both tracks.
const TRACKS: [[&str; 2]; 2] = [["A", "C"], ["B", "D"]];

impl Tracks<'_, '_> {
    /// Lets tracks run over level crossings.
    pub(super) fn read_level_crossings(&mut self) {
        for crossing in children(self.editor, "levelxing") {
            let ident = crossing.attribute("ident").unwrap_or_default();
            for letters in TRACKS {
                if let [Some(one), Some(other)] = letters.map(|letter| self.segment_at(crossing, letter)) {
                    self.join_over(ident, letters, [one, other]);
                }
            }
        }
    }

    /// The same layout with its level crossings.
    pub(super) fn cross(&mut self, mut layout: Layout) -> Layout {
        for crossing in children(self.editor, "levelxing") {
            let ident = crossing.attribute("ident").unwrap_or_default();
            let places =
                TRACKS.map(|letters| self.place_on(&layout, &(ident.to_owned() + &letters.concat())));
            let crossed = match places {
                [Some(one), Some(other)] => layout.clone().with_crossing([one, other]),
                _ => None,
            };
            let Some(crossed) = crossed else {
                self.left_out.push(format!("the level crossing {ident}: it does not have two tracks"));
                continue;
            };
            layout = crossed;
            self.left_out.push(format!(
                "where the tracks of level crossing {ident} cross: assumed; measure it and correct `mm` in `crossings`"
            ));
        }
        layout
    }

    /// Where a track of a crossing is: on the edge that runs over it, or at the boundary that was put there.
    fn place_on(&self, layout: &Layout, track: &str) -> Option<Position> {
        let boundary = || {
            let node = layout.node_named(&(name_of(track) + "a"))?;
            let edge = layout.outgoing(node).edges().next()?;
            Some(Position { edge, offset: Length::ZERO })
        };
        let over = self.passed.iter().find_map(|(stretch, passed)| {
            let crossed: Vec<&String> =
                passed.iter().filter(|joint| joint.ends_with("AC") || joint.ends_with("BD")).collect();
            let nth = crossed.iter().position(|joint| *joint == track)?;
            // A layout numbers its edges in the order of its plan, two for each stretch.
            let edge = EdgeId(2 * u16::try_from(*stretch).ok()?);
            let part = (nth + 1) as f64 / (crossed.len() + 1) as f64;
            Some(Position { edge, offset: layout.edge(edge)?.length * part })
        });
        over.or_else(boundary)
    }
}
