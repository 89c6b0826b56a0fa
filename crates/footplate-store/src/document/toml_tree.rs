//! A TOML text as a tree of nodes.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{DocumentProblem, Fault};
use super::node::{DEEPEST, Node, Place, Value};
use crate::text_file::TextPlace;

/// The tree of a TOML text.
pub(super) fn tree(text: &str) -> Result<Node, Fault> {
    let document = DeTable::parse(text).map_err(|error| {
        let message = error.message().trim_end().replace('\n', "; ");
        let byte = error.span().map_or(0, |span| span.start);
        (place(text, byte), DocumentProblem::Syntax(message))
    })?;
    table(text, Place::START, document.get_ref(), DEEPEST)
}

fn place(text: &str, byte: usize) -> Place {
    let TextPlace { line, column, .. } = TextPlace::of_byte("", text, byte);
    Place { line, column }
}

fn table(text: &str, place: Place, entries: &DeTable<'_>, levels: usize) -> Result<Node, Fault> {
    let entries =
        entries.iter().map(|(key, value)| Ok((key.get_ref().to_string(), node(text, value, levels)?)));
    Ok(Node { place, value: Value::Table(entries.collect::<Result<_, Fault>>()?) })
}

fn node(text: &str, value: &Spanned<DeValue<'_>>, levels: usize) -> Result<Node, Fault> {
    let place = place(text, value.span().start);
    let Some(levels) = levels.checked_sub(1) else {
        return Err((place, DocumentProblem::TooDeep(DEEPEST)));
    };
    let value = match value.get_ref() {
        DeValue::String(text) => Value::Text(text.to_string()),
        DeValue::Boolean(truth) => Value::Truth(*truth),
        // Decimal digits are read as a decimal number; 0x and its like have a radix of their own.
        DeValue::Integer(whole) => match i64::from_str_radix(whole.as_str(), whole.radix()) {
            Ok(whole) => Value::Number(whole as f64),
            Err(_) => Value::Text(whole.as_str().to_owned()),
        },
        DeValue::Float(number) => match number.as_str().parse() {
            Ok(number) => Value::Number(number),
            Err(_) => Value::Text(number.as_str().to_owned()),
        },
        DeValue::Datetime(date) => Value::Text(date.to_string()),
        DeValue::Array(items) => {
            Value::List(items.iter().map(|item| node(text, item, levels)).collect::<Result<_, _>>()?)
        }
        DeValue::Table(entries) => return table(text, place, entries, levels),
    };
    Ok(Node { place, value })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_knows_its_line_and_column() {
        let read = tree("format = 1\n[brake]\n  full_n = 12.5\n").unwrap();
        let Value::Table(entries) = &read.value else { panic!("{read:?}") };
        let brake = entries.iter().find(|(key, _)| key == "brake").unwrap();
        let Value::Table(brake) = &brake.1.value else { panic!("{brake:?}") };
        assert_eq!(brake[0].1, Node { place: Place { line: 3, column: 12 }, value: Value::Number(12.5) });
    }

    #[test]
    fn what_is_no_toml_is_said_with_its_place() {
        let (place, problem) = tree("name = \"train\"\nmass = = 5\n").unwrap_err();
        assert_eq!((place.line, place.column), (2, 8), "{problem}");
    }
}
