//! Trains and lines come in TOML, JSON and YAML; here all three become one tree whose every value knows its place.
//!
//! So a reader of a form asks for keys and numbers and needs not know which syntax it reads, and every error names
//! file, line and column. JSON is read as YAML, of which it is a part.

mod error;
mod node;
mod table;
mod text;
mod toml_tree;
mod yaml_tree;

pub use error::{DocumentError, DocumentProblem};
pub use text::LARGEST_DOCUMENT;

pub(crate) use error::Fault;
pub(crate) use node::{Node, Place};
pub(crate) use table::{Range, Table, pairs};
pub(crate) use text::{DOCUMENT, Syntax, parse};
