//! The bytes of a document, and the syntax its name tells.

use std::path::Path;

use super::error::DocumentError;
use super::node::Node;
use super::{toml_tree, yaml_tree};
use crate::text_file::TextFile;

/// The largest description that is read, in bytes: a hundred times the longest line at hand.
pub const LARGEST_DOCUMENT: usize = 1024 * 1024;

/// How a document is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Syntax {
    Toml,
    /// YAML, and JSON as a part of it.
    Yaml,
}

impl Syntax {
    /// The syntax that the end of a file's name tells.
    fn of(file: &str) -> Option<Self> {
        let extension = Path::new(file).extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "toml" => Some(Self::Toml),
            "json" | "yaml" | "yml" => Some(Self::Yaml),
            _ => None,
        }
    }
}

/// What a document is.
pub(crate) const DOCUMENT: TextFile = TextFile { kind: "a train or a line", largest: LARGEST_DOCUMENT };

/// The tree of a document, and its syntax, which the end of the file's name tells.
pub(crate) fn parse(file: &str, bytes: &[u8]) -> Result<(Syntax, Node), DocumentError> {
    let syntax = Syntax::of(file).ok_or_else(|| DocumentError::Syntax(file.to_owned()))?;
    let text = DOCUMENT.text(file, bytes)?;
    let tree = match syntax {
        Syntax::Toml => toml_tree::tree(text),
        Syntax::Yaml => yaml_tree::tree(text),
    };
    tree.map(|node| (syntax, node)).map_err(|fault| DocumentError::wrong(file, fault))
}
