//! Imports a panel of JMRI's Layout Editor as a layout.
//!
//! ```text
//! layout-config
//!     sensors / sensor, turnouts / turnout          systemName "LS17", userName
//!     blocks / block                                userName, occupancysensor; length in mm, 0 if it was not measured
//!     layoutblocks / layoutblock                    userName; occupancysensor
//!     LayoutEditor
//!         positionablepoint                         ANCHOR, END_BUMPER or EDGE_CONNECTOR, and the segments at it
//!         tracksegment                              blockname; what is at its ends: a point, or A, B or C of a turnout
//!         layoutturnout                             turnoutname, blockname; A is the toe, B the leg that goes on at `continuing`
//!         levelxing                                 the tracks A to C and B to D
//!         layoutSlip                                turnout, turnoutB, and their states for each route through it
//!         layoutturntable                           not imported
//! ```
//!
//! Files before JMRI 4.21 write numbers for the types. An anchor between two detectors becomes a boundary, every other anchor
//! disappears. JMRI draws tracks and does not measure them: only where a block is one track between two places does its length, if it
//! has one, become that of an edge. DTDs are refused, so that no entity can grow, and the number of nodes is limited.

mod level_crossings;
mod slips;
mod tracks;

use footplate_core::track::{Layout, LayoutError};
use roxmltree::{Document, Node, ParsingOptions};

use self::tracks::Tracks;

use super::drawing::{Drawing, LayoutFile};
use super::import::ImportContext;
use crate::text_file::TextPlace;

/// More nodes than any panel has.
const MOST_NODES: u32 = 500_000;
/// Which program wrote it.
const ABOUT: &str = "Imported from a panel of JMRI's Layout Editor.";

/// A panel as a layout.
#[derive(Debug)]
pub struct ImportedPanel {
    /// The layout.
    pub file: LayoutFile,
    /// What the layout does not have of the panel, or could not know: a line each.
    pub left_out: Vec<String>,
}

/// A panel that could not be imported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PanelError {
    /// The file is not sound XML.
    #[error("{place}: not sound XML ({problem}); save the panel in JMRI again")]
    Xml {
        /// Where.
        place: TextPlace,
        /// What the reader says.
        problem: String,
    },
    /// There is no panel of the Layout Editor in the file.
    #[error(
        "{0}: no track of a Layout Editor panel; give a file that JMRI's Layout Editor saved (File, Store)"
    )]
    NoTrack(String),
    /// A turnout has no number.
    #[error(
        "{place}: turnout {ident} has no number, because its `turnoutname` is `{name}`; give it a turnout in JMRI whose system name \
         ends with its address, such as LT5"
    )]
    NoNumber {
        /// Where.
        place: TextPlace,
        /// Its name in the panel.
        ident: String,
        /// The name of the turnout that it throws.
        name: String,
    },
    /// The tracks are no layout.
    #[error("{file}: {problem}")]
    Layout {
        /// The file.
        file: String,
        /// Why.
        problem: LayoutError,
    },
}

/// Imports a panel. `file` is its name in messages; `context` has what the panel does not say.
///
/// # Errors
/// What is wrong with the file or its tracks, and what to do.
pub fn import_panel(file: &str, text: &str, context: &ImportContext) -> Result<ImportedPanel, PanelError> {
    let options = ParsingOptions { allow_dtd: false, nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        let place = TextPlace::of_xml(file, text, &error);
        PanelError::Xml { place, problem: error.to_string().chars().take(200).collect() }
    })?;
    let root = document.root_element();
    let mut editors =
        children(root, "LayoutEditor").filter(|one| children(*one, "tracksegment").next().is_some());
    let editor = editors.next().ok_or_else(|| PanelError::NoTrack(file.to_owned()))?;
    let mut tracks = Tracks::new(root, editor);
    for other in editors {
        tracks.left_out.push(format!(
            "the panel `{}`: only the first is imported",
            other.attribute("name").unwrap_or("")
        ));
    }
    tracks.read_turnouts(|node, ident, name| PanelError::NoNumber {
        place: TextPlace::of_byte(file, text, node.range().start),
        ident: ident.to_owned(),
        name: name.to_owned(),
    })?;
    tracks.read_slips();
    tracks.read_level_crossings();
    tracks.read_points();
    tracks.join();
    let plan = tracks.plan(context);
    let layout =
        Layout::build(&plan).map_err(|problem| PanelError::Layout { file: file.to_owned(), problem })?;
    let layout = tracks.cross(layout);
    let mut drawing = Drawing::default();
    for (name, point) in &tracks.drawn {
        if let Some(node) = layout.node_named(name) {
            drawing.set(node, *point);
        }
    }
    let file = LayoutFile {
        layout,
        about: if context.about.is_empty() { ABOUT } else { &context.about }.to_owned(),
        drawing,
    };
    Ok(ImportedPanel { file, left_out: tracks.left_out })
}

/// Elements of one kind in tables of another.
fn descendants<'a, 'i>(root: Node<'a, 'i>, table: &str, element: &str) -> impl Iterator<Item = Node<'a, 'i>> {
    children(root, table).flat_map(move |table| children(table, element))
}

/// The child elements of a name.
fn children<'a, 'i>(node: Node<'a, 'i>, name: &str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |child| child.has_tag_name(name))
}

/// The text of a child element; `None` without any.
fn text_of<'a>(node: Node<'a, '_>, element: &str) -> Option<&'a str> {
    children(node, element).next()?.text().map(str::trim).filter(|text| !text.is_empty())
}
