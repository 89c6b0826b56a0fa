//! Why a description of a train or a line could not be read: where, what stands there and what would be right.

use footplate_sim::line::{LineError, TrainError};

use super::node::Place;
use crate::text_file::{TextFileError, TextPlace};

/// A value and what is wrong with it, before the file has its name.
pub(crate) type Fault = (Place, DocumentProblem);

/// A description of a train or a line that could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DocumentError {
    /// It is no such text.
    #[error(transparent)]
    Text(#[from] TextFileError),
    /// A name that does not tell how to read the file.
    #[error("{0}: its name should end in .toml (Footplate's own form), .json or .yaml")]
    Syntax(String),
    /// Something in the text is wrong.
    #[error("{place}: {problem}")]
    Wrong {
        /// Where.
        place: TextPlace,
        /// What.
        problem: DocumentProblem,
    },
}

impl DocumentError {
    /// The error of a fault in a file.
    pub(crate) fn wrong(file: &str, (place, problem): Fault) -> Self {
        let Place { line, column } = place;
        Self::Wrong { place: TextPlace { file: file.to_owned(), line, column }, problem }
    }
}

/// What is wrong with the text of a description.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DocumentProblem {
    /// It is no TOML, JSON or YAML.
    #[error("{0}")]
    Syntax(String),
    /// A part of YAML that no description needs.
    #[error("{0} are not read; write the value itself")]
    NotRead(&'static str),
    /// Deeper than any description.
    #[error("more than {0} levels of nesting; a train or a line has a handful")]
    TooDeep(usize),
    /// A key said twice.
    #[error("`{0}` is given twice; remove one")]
    KeyTwice(String),
    /// A key that means nothing here.
    #[error("`{key}` is not a key of {of}; its keys are {known}")]
    UnknownKey {
        /// The key.
        key: String,
        /// What it is a part of.
        of: String,
        /// What would be right.
        known: String,
    },
    /// A key that cannot be done without.
    #[error("{of} lacks `{key}`")]
    MissingKey {
        /// The key.
        key: String,
        /// What lacks it.
        of: String,
    },
    /// A value of another kind.
    #[error("{what} is {found}; it should be {expected}")]
    Kind {
        /// What it is the value of.
        what: String,
        /// What stands there.
        found: String,
        /// What would be right.
        expected: String,
    },
    /// A number that no railway has.
    #[error("{what} is {value}; it should lie between {lowest} and {highest}")]
    Range {
        /// What it is the value of.
        what: String,
        /// The value.
        value: f64,
        /// The least it can be.
        lowest: f64,
        /// The most it can be.
        highest: f64,
    },
    /// Neither a train nor a line of any form that is read.
    #[error("this is {found}; {expected}")]
    Form {
        /// What was found.
        found: String,
        /// What would be right.
        expected: &'static str,
    },
    /// A file with several trains or lines, of which none was named.
    #[error("the file describes {0}; say which one")]
    Which(String),
    /// A file without the train or line that was named.
    #[error("there is no `{wanted}` in the file, which describes {found}")]
    NotThere {
        /// What was asked for.
        wanted: String,
        /// What there is.
        found: String,
    },
    /// It is no train.
    #[error(transparent)]
    Train(#[from] TrainError),
    /// It is no line.
    #[error(transparent)]
    Line(#[from] LineError),
}
