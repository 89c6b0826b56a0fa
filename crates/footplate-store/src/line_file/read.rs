//! Reads a line of any form.

use std::path::Path;

use super::form::{LineFile, LineFileForm};
use super::{own, trainruns, ttobench};
use crate::document::{DOCUMENT, DocumentError, DocumentProblem, Node, Syntax, Table, parse};
use crate::railtoolkit::listed;

/// Reads the line in the file at `path`; `which` names one of several.
///
/// # Errors
/// What is wrong with it, with file, line and column.
pub fn read_line(path: &Path, which: Option<&str>) -> Result<LineFile, DocumentError> {
    parse_line(&path.display().to_string(), &DOCUMENT.read(path)?, which)
}

/// Reads a line from the bytes of a file. `file` is what messages call it; its end tells the syntax.
///
/// # Errors
/// As [`read_line`].
pub fn parse_line(file: &str, bytes: &[u8], which: Option<&str>) -> Result<LineFile, DocumentError> {
    let (syntax, node) = parse(file, bytes)?;
    let read = match form_of(syntax, &node) {
        Some(LineFileForm::Own) => own::read(&node),
        Some(LineFileForm::TtoBench) => ttobench::read(&node),
        Some(LineFileForm::TrainRuns) => trainruns::read(&node, which),
        None => Err((
            node.place,
            DocumentProblem::Form {
                found: node.described(),
                expected: "a line has `speed limits` (TTOBench) or `paths` (railtoolkit), or is in Footplate's own \
                           form, in TOML",
            },
        )),
    };
    let read = read.and_then(|file| {
        // The forms with several in a file know them by their ids, and have chosen; the others have one, by its name.
        let name = file.line.name();
        match which.filter(|which| file.form != LineFileForm::TrainRuns && *which != name) {
            Some(wanted) => {
                let (wanted, found) = (wanted.to_owned(), listed(&[name]));
                Err((node.place, DocumentProblem::NotThere { wanted, found }))
            }
            None => Ok(file),
        }
    });
    read.map_err(|fault| DocumentError::wrong(file, fault))
}

/// The form of a line's document; `None` if it is no line.
pub(crate) fn form_of(syntax: Syntax, node: &Node) -> Option<LineFileForm> {
    let table = Table::of(node, "a line").ok()?;
    let forms = [("speed limits", LineFileForm::TtoBench), ("paths", LineFileForm::TrainRuns)];
    match syntax {
        Syntax::Toml => table.get("mass_kg").is_none().then_some(LineFileForm::Own),
        Syntax::Yaml => forms.into_iter().find(|(key, _)| table.get(key).is_some()).map(|(_, form)| form),
    }
}
