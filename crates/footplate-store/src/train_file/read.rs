//! Reads a train in any known format.

use std::path::Path;

use super::form::{TrainFile, TrainFileForm};
use super::{osrd, own, trainruns, ttobench};
use crate::document::{DOCUMENT, DocumentError, DocumentProblem, Node, Syntax, Table, parse};
use crate::railtoolkit::listed;

/// Reads the train in the file at `path`; `which` selects one of several.
///
/// # Errors
/// The file is invalid; the error names file, line and column.
pub fn read_train(path: &Path, which: Option<&str>) -> Result<TrainFile, DocumentError> {
    parse_train(&path.display().to_string(), &DOCUMENT.read(path)?, which)
}

/// Reads a train from the bytes of a file. `file` is its name in messages; its extension selects the syntax.
///
/// # Errors
/// As [`read_train`].
pub fn parse_train(file: &str, bytes: &[u8], which: Option<&str>) -> Result<TrainFile, DocumentError> {
    let (syntax, node) = parse(file, bytes)?;
    let read = match form_of(syntax, &node) {
        Some(TrainFileForm::Own) => own::read(&node),
        Some(TrainFileForm::TtoBench) => ttobench::read(&node),
        Some(TrainFileForm::TrainRuns) => trainruns::read(&node, which),
        Some(TrainFileForm::Osrd) => osrd::read(&node),
        None => Err((
            node.place,
            DocumentProblem::Form {
                found: node.described(),
                expected: "a train has `effort_curves` (OSRD), `max traction force` (TTOBench) or `vehicles` \
                           (railtoolkit), or is in Footplate's own form, in TOML",
            },
        )),
    };
    let read = read.and_then(|file| {
        // Formats with several trains have selected one by its id; the others have one train, selected by its name.
        let name = file.train.name.as_str();
        match which.filter(|which| file.form != TrainFileForm::TrainRuns && *which != name) {
            Some(wanted) => {
                let (wanted, found) = (wanted.to_owned(), listed(&[name]));
                Err((node.place, DocumentProblem::NotThere { wanted, found }))
            }
            None => Ok(file),
        }
    });
    read.map_err(|fault| DocumentError::wrong(file, fault))
}

/// The format of a document; `None` if it is not a train.
pub(crate) fn form_of(syntax: Syntax, node: &Node) -> Option<TrainFileForm> {
    let table = Table::of(node, "a train").ok()?;
    let forms = [
        ("effort_curves", TrainFileForm::Osrd),
        ("max traction force", TrainFileForm::TtoBench),
        ("vehicles", TrainFileForm::TrainRuns),
        ("trains", TrainFileForm::TrainRuns),
    ];
    match syntax {
        Syntax::Toml => table.get("speed_limits_km_h").is_none().then_some(TrainFileForm::Own),
        Syntax::Yaml => forms.into_iter().find(|(key, _)| table.get(key).is_some()).map(|(_, form)| form),
    }
}
