//! Asking a table of a document for its keys.

use super::error::{DocumentProblem, Fault};
use super::node::{Node, Place, Value};

/// A table and what errors call it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Table<'a> {
    pub(crate) place: Place,
    of: &'a str,
    entries: &'a [(String, Node)],
}

/// The least and the most that a number can be.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Range(pub(crate) f64, pub(crate) f64);

impl<'a> Table<'a> {
    /// The table that a node is; `of` is what errors call it.
    pub(crate) fn of(node: &'a Node, of: &'a str) -> Result<Self, Fault> {
        match &node.value {
            Value::Table(entries) => Ok(Self { place: node.place, of, entries }),
            _ => Err(node.not(of, "a table of keys and values")),
        }
    }

    /// The value of a key, if it has one.
    pub(crate) fn get(&self, key: &str) -> Option<&'a Node> {
        let found = self.entries.iter().find(|(name, _)| name == key);
        found.map(|(_, node)| node).filter(|node| node.value != Value::Nothing)
    }

    /// The value of a key.
    pub(crate) fn needs(&self, key: &str) -> Result<&'a Node, Fault> {
        let missing = || {
            (
                self.place,
                DocumentProblem::MissingKey { key: key.escape_debug().to_string(), of: self.of.to_owned() },
            )
        };
        self.get(key).ok_or_else(missing)
    }

    /// The number of a key.
    pub(crate) fn number(&self, key: &str) -> Result<f64, Fault> {
        self.needs(key)?.number(&format!("`{key}`"))
    }

    /// The number of a key, if it has one.
    pub(crate) fn optional_number(&self, key: &str) -> Result<Option<f64>, Fault> {
        self.get(key).map(|node| node.number(&format!("`{key}`"))).transpose()
    }

    /// The number of a key, within a range.
    pub(crate) fn number_within(&self, key: &str, range: Range) -> Result<f64, Fault> {
        let value = self.number(key)?;
        self.within(key, value, range)
    }

    /// The number of a key within a range, if it has one.
    pub(crate) fn optional_within(&self, key: &str, range: Range) -> Result<Option<f64>, Fault> {
        self.optional_number(key)?.map(|value| self.within(key, value, range)).transpose()
    }

    fn within(&self, key: &str, value: f64, Range(lowest, highest): Range) -> Result<f64, Fault> {
        if lowest <= value && value <= highest {
            return Ok(value);
        }
        let what = format!("`{key}`");
        Err((self.place_of(key), DocumentProblem::Range { what, value, lowest, highest }))
    }

    /// The text of a key.
    pub(crate) fn text(&self, key: &str) -> Result<&'a str, Fault> {
        self.needs(key)?.text(&format!("`{key}`"))
    }

    /// The text of a key, if it has one.
    pub(crate) fn optional_text(&self, key: &str) -> Result<Option<&'a str>, Fault> {
        self.get(key).map(|node| node.text(&format!("`{key}`"))).transpose()
    }

    /// The list of a key.
    pub(crate) fn list(&self, key: &str) -> Result<&'a [Node], Fault> {
        self.needs(key)?.list(&format!("`{key}`"))
    }

    /// Where the value of a key stands, or the table if it has none.
    pub(crate) fn place_of(&self, key: &str) -> Place {
        self.get(key).map_or(self.place, |node| node.place)
    }

    /// Where an entry of a key's list stands, or the list if it has no such entry.
    pub(crate) fn place_of_entry(&self, key: &str, index: usize) -> Place {
        let item = match self.get(key).map(|node| &node.value) {
            Some(Value::List(items)) => items.get(index),
            _ => None,
        };
        item.map_or(self.place_of(key), |item| item.place)
    }

    /// Refuses a version of our own form that is not this one.
    pub(crate) fn check_format(&self, known: i64) -> Result<(), Fault> {
        let format = self.number("format")?;
        if format == known as f64 {
            return Ok(());
        }
        let what = "`format`".to_owned();
        let expected = format!("{known}, the one that this version of Footplate knows");
        Err((self.place_of("format"), DocumentProblem::Kind { what, found: format.to_string(), expected }))
    }

    /// Refuses every key but these.
    pub(crate) fn only(&self, known: &[&str]) -> Result<(), Fault> {
        match self.entries.iter().find(|(key, _)| !known.contains(&key.as_str())) {
            None => Ok(()),
            Some((key, node)) => {
                let (key, of) = (key.escape_debug().to_string(), self.of.to_owned());
                Err((node.place, DocumentProblem::UnknownKey { key, of, known: known.join(", ") }))
            }
        }
    }
}

/// A list of pairs of numbers, named by what they are.
pub(crate) fn pairs(node: &Node, what: &str, items: [&str; 2]) -> Result<Vec<(f64, f64)>, Fault> {
    let rows = node.list(what)?.iter().map(|row| {
        let [first, second] = row.row(&format!("an entry of {what}"), items)?;
        Ok((first.number(items[0])?, second.number(items[1])?))
    });
    rows.collect()
}
