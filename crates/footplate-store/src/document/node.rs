//! A value of a document, and where it stands.

use super::error::{DocumentProblem, Fault};

/// Levels of nesting that are read; a train has five.
pub(super) const DEEPEST: usize = 32;

/// A place in a text; both are counted from 1, columns in characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Place {
    pub(crate) line: usize,
    pub(crate) column: usize,
}

impl Place {
    /// Where a text begins.
    pub(crate) const START: Self = Self { line: 1, column: 1 };
}

/// A value and its place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Node {
    pub(crate) place: Place,
    pub(crate) value: Value,
}

/// What can stand in a document.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Value {
    Nothing,
    Truth(bool),
    Number(f64),
    Text(String),
    List(Vec<Node>),
    Table(Vec<(String, Node)>),
}

impl Node {
    /// What stands here, in the words of an error.
    pub(crate) fn described(&self) -> String {
        /// Longer texts are cut off in an error.
        const LONGEST: usize = 40;
        match &self.value {
            Value::Nothing => "nothing".to_owned(),
            Value::Truth(truth) => truth.to_string(),
            Value::Number(number) => number.to_string(),
            Value::Text(text) if text.chars().count() > LONGEST => {
                format!("\"{}…\"", text.chars().take(LONGEST).collect::<String>().escape_debug())
            }
            Value::Text(text) => format!("\"{}\"", text.escape_debug()),
            Value::List(items) => format!("a list of {}", items.len()),
            Value::Table(_) => "a table".to_owned(),
        }
    }

    /// The fault of a value of another kind.
    pub(crate) fn not(&self, what: &str, expected: &str) -> Fault {
        let (what, expected) = (what.to_owned(), expected.to_owned());
        (self.place, DocumentProblem::Kind { what, found: self.described(), expected })
    }

    /// The number here; `what` is what an error calls it. Infinities and NaN are none.
    pub(crate) fn number(&self, what: &str) -> Result<f64, Fault> {
        match self.value {
            Value::Number(number) if number.is_finite() => Ok(number),
            _ => Err(self.not(what, "a number")),
        }
    }

    /// The text here.
    pub(crate) fn text(&self, what: &str) -> Result<&str, Fault> {
        match &self.value {
            Value::Text(text) => Ok(text),
            _ => Err(self.not(what, "text")),
        }
    }

    /// The items of the list here.
    pub(crate) fn list(&self, what: &str) -> Result<&[Node], Fault> {
        match &self.value {
            Value::List(items) => Ok(items),
            _ => Err(self.not(what, "a list")),
        }
    }

    /// Exactly so many items, named by what they are.
    pub(crate) fn row<const N: usize>(&self, what: &str, items: [&str; N]) -> Result<&[Node; N], Fault> {
        let expected = || format!("a list of {N}: {}", items.join(", "));
        let found = match &self.value {
            Value::List(found) => found.as_slice().try_into().ok(),
            _ => None,
        };
        found.ok_or_else(|| self.not(what, &expected()))
    }
}
