//! Layouts on disk: a TOML format written by hand, an importer for tables, and the built-in layouts.
//!
//! [`layout_named`] resolves every `--layout`: a built-in name or the path of a file. `docs/formats/layout.md`
//! describes the format.

mod built_in;
mod draw;
mod drawing;
mod error;
mod import;
mod import_error;
mod jmri_panel;
mod read;
mod tables;
mod write;

pub use built_in::{BUILT_IN, built_in, layout_named};
pub use draw::{NothingToDraw, draw_layout};
pub use drawing::{Drawing, LayoutFile};
pub use error::{LayoutFileError, LayoutProblem};
pub use import::{ImportContext, import_layout};
pub use import_error::{ImportError, RowProblem};
pub use jmri_panel::{ImportedPanel, PanelError, import_panel};
pub use read::{LARGEST_LAYOUT, parse_layout, read_layout};
pub use tables::LayoutTables;
pub use write::write_layout;
