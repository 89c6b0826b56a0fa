//! A train or a line, whichever a file describes.

use std::path::Path;

use crate::document::{DOCUMENT, DocumentError, DocumentProblem, Syntax, Table, parse};
use crate::line_file::{self, LineFile, parse_line};
use crate::train_file::{self, TrainFile, parse_train};

/// What a file describes.
#[derive(Debug, Clone, PartialEq)]
pub enum Described {
    /// A train.
    Train(TrainFile),
    /// A line.
    Line(LineFile),
}

/// Reads a train or a line of any form from the file at `path`; `which` names one of several.
///
/// # Errors
/// What is wrong with it, with file, line and column.
pub fn read_described(path: &Path, which: Option<&str>) -> Result<Described, DocumentError> {
    parse_described(&path.display().to_string(), &DOCUMENT.read(path)?, which)
}

/// Reads a train or a line from the bytes of a file. `file` is what messages call it; its end tells the syntax.
///
/// # Errors
/// As [`read_described`].
pub fn parse_described(file: &str, bytes: &[u8], which: Option<&str>) -> Result<Described, DocumentError> {
    let (syntax, node) = parse(file, bytes)?;
    let is_line = match syntax {
        // A line lists its speed limits; anything else gets the error of what a train lacks.
        Syntax::Toml => Table::of(&node, "").is_ok_and(|table| table.get("speed_limits_km_h").is_some()),
        Syntax::Yaml => line_file::form_of(syntax, &node).is_some(),
    };
    if is_line {
        return parse_line(file, bytes, which).map(Described::Line);
    }
    if train_file::form_of(syntax, &node).is_some() {
        return parse_train(file, bytes, which).map(Described::Train);
    }
    let problem = DocumentProblem::Form {
        found: node.described(),
        expected: "neither a train nor a line of TTOBench, railtoolkit or OSRD has keys like these",
    };
    Err(DocumentError::wrong(file, (node.place, problem)))
}
