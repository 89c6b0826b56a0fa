//! The entries of one TOML table, taken out one by one, so that what is left over is unknown.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use super::error::VehicleProblem;

/// The byte at fault and what is wrong with it.
pub(super) type Fault = (usize, VehicleProblem);

/// How many letters may be wrong, missing, too many or exchanged in a key that is taken for another.
const MOST_MISTAKES: usize = 3;

/// A number and the byte at which it stands.
#[derive(Debug, Clone, Copy)]
pub(super) struct Number {
    pub(super) value: f64,
    pub(super) byte: usize,
}

/// The entries of one table.
pub(super) struct Entries<'t, 'i> {
    table: &'t DeTable<'i>,
    /// What people call the table.
    called: &'static str,
    /// Where the table begins.
    begin: usize,
    known: Vec<&'static str>,
}

impl<'t, 'i> Entries<'t, 'i> {
    pub(super) fn new(table: &'t DeTable<'i>, span: Range<usize>, called: &'static str) -> Self {
        Self { table, called, begin: span.start, known: Vec::new() }
    }

    pub(super) fn take(&mut self, key: &'static str) -> Option<&'t Spanned<DeValue<'i>>> {
        self.known.push(key);
        self.table.iter().find(|(name, _)| name.get_ref() == key).map(|(_, value)| value)
    }

    pub(super) fn needs(&mut self, key: &'static str) -> Result<&'t Spanned<DeValue<'i>>, Fault> {
        if let Some(value) = self.take(key) {
            return Ok(value);
        }
        // A person who misspelt it thinks it is there.
        match self.table.keys().find(|written| is_near(key, written.get_ref())) {
            Some(written) => Err(self.unknown(written, Some(key))),
            None => Err((self.begin, VehicleProblem::MissingKey { key, table: self.called })),
        }
    }

    pub(super) fn number(&mut self, key: &'static str) -> Result<Number, Fault> {
        let value = self.needs(key)?;
        number(key, value)
    }

    pub(super) fn optional_number(&mut self, key: &'static str) -> Result<Option<Number>, Fault> {
        self.take(key).map(|value| number(key, value)).transpose()
    }

    pub(super) fn optional_text(&mut self, key: &'static str) -> Result<Option<&'t str>, Fault> {
        self.take(key).map(|value| text(key, value, "a text in quotes")).transpose()
    }

    pub(super) fn optional_truth(&mut self, key: &'static str) -> Result<Option<bool>, Fault> {
        self.take(key).map(|value| truth(key, value)).transpose()
    }

    /// Fails on the first key that was not asked for.
    pub(super) fn end(self) -> Result<(), Fault> {
        let unknown = self.table.keys().find(|key| !self.known.contains(&key.get_ref().as_ref()));
        let Some(unknown) = unknown else { return Ok(()) };
        let near = self.known.iter().find(|known| is_near(known, unknown.get_ref())).copied();
        Err(self.unknown(unknown, near))
    }

    fn unknown(&self, key: &Spanned<DeString<'_>>, near: Option<&'static str>) -> Fault {
        let problem = VehicleProblem::UnknownKey {
            key: key.get_ref().escape_debug().to_string(),
            table: self.called,
            near,
            known: self.known.join(", "),
        };
        (key.span().start, problem)
    }
}

/// Whether a key is so nearly another that it must be meant.
fn is_near(known: &str, written: &str) -> bool {
    strsim::damerau_levenshtein(known, written) <= MOST_MISTAKES.min(written.len() / 2)
}

/// The table that a value is.
pub(super) fn table<'t, 'i>(
    key: &'static str,
    value: &'t Spanned<DeValue<'i>>,
    expected: &'static str,
) -> Result<&'t DeTable<'i>, Fault> {
    match value.get_ref() {
        DeValue::Table(table) => Ok(table),
        other => Err(kind(key, other, value.span().start, expected)),
    }
}

/// The text that a value is.
pub(super) fn text<'t>(
    key: &'static str,
    value: &'t Spanned<DeValue<'_>>,
    expected: &'static str,
) -> Result<&'t str, Fault> {
    match value.get_ref() {
        DeValue::String(text) => Ok(text),
        other => Err(kind(key, other, value.span().start, expected)),
    }
}

/// Whether a value says yes.
fn truth(key: &'static str, value: &Spanned<DeValue<'_>>) -> Result<bool, Fault> {
    match value.get_ref() {
        DeValue::Boolean(truth) => Ok(*truth),
        other => Err(kind(key, other, value.span().start, "true or false")),
    }
}

fn number(key: &'static str, value: &Spanned<DeValue<'_>>) -> Result<Number, Fault> {
    let byte = value.span().start;
    let read = match value.get_ref() {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(whole) => {
            i64::from_str_radix(whole.as_str(), whole.radix()).ok().map(|whole| whole as f64)
        }
        _ => None,
    };
    match read {
        Some(value) => Ok(Number { value, byte }),
        None => Err(kind(key, value.get_ref(), byte, "a number")),
    }
}

/// The fault of a value of another kind.
pub(super) fn kind(key: &'static str, value: &DeValue<'_>, byte: usize, expected: &'static str) -> Fault {
    let found = match value {
        DeValue::String(text) => format!("the text `{}`", text.escape_debug()),
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.to_string(),
        DeValue::Boolean(value) => value.to_string(),
        DeValue::Datetime(date) => format!("the date {date}"),
        DeValue::Array(_) => "a list".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
    };
    (byte, VehicleProblem::Kind { key, found, expected })
}
