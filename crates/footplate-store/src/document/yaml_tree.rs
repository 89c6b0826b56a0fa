//! A YAML or JSON text as a tree of nodes.

use std::borrow::Cow;

use saphyr_parser::{Event, Parser, ScalarStyle, Span};

use super::error::{DocumentProblem, Fault};
use super::node::{DEEPEST, Node, Place, Value};

/// The tree of the one document in a YAML or JSON text.
pub(super) fn tree(text: &str) -> Result<Node, Fault> {
    let mut tree = Tree { open: Vec::new(), whole: None };
    for event in Parser::new_from_str(text) {
        let (event, span) = event.map_err(|error| {
            let marker = error.marker();
            let place = Place { line: marker.line(), column: marker.col() + 1 };
            (place, DocumentProblem::Syntax(error.info().to_owned()))
        })?;
        tree.take(event, place(span))?;
    }
    Ok(tree.whole.unwrap_or(Node { place: Place::START, value: Value::Nothing }))
}

fn place(span: Span) -> Place {
    Place { line: span.start.line(), column: span.start.col() + 1 }
}

/// A tree that grows event by event.
struct Tree {
    open: Vec<Open>,
    whole: Option<Node>,
}

/// A list or table that has begun and not ended.
enum Open {
    List(Place, Vec<Node>),
    /// With the key that waits for its value.
    Table(Place, Vec<(String, Node)>, Option<String>),
}

impl Tree {
    fn take(&mut self, event: Event<'_>, place: Place) -> Result<(), Fault> {
        let not_read = |what| Err((place, DocumentProblem::NotRead(what)));
        match event {
            Event::Alias(_) => not_read("aliases"),
            Event::Scalar(_, _, 1.., _) | Event::SequenceStart(1.., _) | Event::MappingStart(1.., _) => {
                not_read("anchors")
            }
            Event::Scalar(_, _, _, Some(_))
            | Event::SequenceStart(_, Some(_))
            | Event::MappingStart(_, Some(_)) => not_read("tags"),
            Event::DocumentStart(_) if self.whole.is_some() => not_read("further documents in one file"),
            Event::Scalar(text, style, ..) => self.put(Node { place, value: scalar(text, style) }),
            Event::SequenceStart(..) => self.open(place, Open::List(place, Vec::new())),
            Event::MappingStart(..) => self.open(place, Open::Table(place, Vec::new(), None)),
            Event::SequenceEnd | Event::MappingEnd => match self.open.pop() {
                Some(Open::List(place, items)) => self.put(Node { place, value: Value::List(items) }),
                Some(Open::Table(place, entries, _)) => {
                    self.put(Node { place, value: Value::Table(entries) })
                }
                None => Ok(()),
            },
            Event::Nothing
            | Event::StreamStart
            | Event::StreamEnd
            | Event::DocumentStart(_)
            | Event::DocumentEnd => Ok(()),
        }
    }

    fn open(&mut self, place: Place, what: Open) -> Result<(), Fault> {
        if self.open.len() >= DEEPEST {
            return Err((place, DocumentProblem::TooDeep(DEEPEST)));
        }
        self.open.push(what);
        Ok(())
    }

    fn put(&mut self, node: Node) -> Result<(), Fault> {
        match self.open.last_mut() {
            None => self.whole = Some(node),
            Some(Open::List(_, items)) => items.push(node),
            Some(Open::Table(_, entries, waiting)) => match waiting.take() {
                Some(key) => entries.push((key, node)),
                None => {
                    let key = match node.value {
                        Value::Text(text) => text,
                        Value::Number(number) => number.to_string(),
                        _ => return Err(node.not("a key", "text")),
                    };
                    if entries.iter().any(|(before, _)| *before == key) {
                        let key = key.escape_debug().to_string();
                        return Err((node.place, DocumentProblem::KeyTwice(key)));
                    }
                    *waiting = Some(key);
                }
            },
        }
        Ok(())
    }
}

/// What a scalar means by the core schema of YAML 1.2, of which JSON's values are a part.
fn scalar(text: Cow<'_, str>, style: ScalarStyle) -> Value {
    if style != ScalarStyle::Plain {
        return Value::Text(text.into_owned());
    }
    match text.as_ref() {
        "" | "~" | "null" | "Null" | "NULL" => Value::Nothing,
        "true" | "True" | "TRUE" => Value::Truth(true),
        "false" | "False" | "FALSE" => Value::Truth(false),
        // Rust reads `inf`, `infinity` and `nan` as numbers, which YAML does not.
        digits if digits.bytes().all(|byte| b"+-.eE0123456789".contains(&byte)) => match digits.parse() {
            Ok(number) => Value::Number(number),
            Err(_) => Value::Text(text.into_owned()),
        },
        _ => Value::Text(text.into_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Value {
        tree(text).unwrap().value
    }

    fn problem(text: &str) -> (usize, usize, String) {
        let (place, problem) = tree(text).unwrap_err();
        (place.line, place.column, problem.to_string())
    }

    #[test]
    fn json_is_yaml_with_or_without_blanks_and_tabs() {
        let spaced = tree(
            "{\n    \"mass\": {\"unit\": \"kg\", \"value\":167},\n    \"a/b\": [1, -2.5e3, null, true]\n}",
        );
        let tabbed =
            value("{\n\t\"mass\":{\"unit\":\"kg\",\"value\":167},\n\t\"a\\/b\":[1,-2.5e3,null,true]\n}\n");
        let Value::Table(entries) = spaced.unwrap().value else { panic!("a table") };
        let Value::List(list) = &entries[1].1.value else { panic!("a list") };
        let values: Vec<_> = list.iter().map(|node| node.value.clone()).collect();
        assert_eq!(values, [Value::Number(1.0), Value::Number(-2500.0), Value::Nothing, Value::Truth(true)]);
        let Value::Table(tabs) = tabbed else { panic!("a table") };
        assert_eq!(tabs[1].0, "a/b");
    }

    #[test]
    fn a_quoted_number_is_text_and_a_word_is_no_number() {
        let Value::List(list) = value("- \"5\"\n- 5\n- nan\n- inf\n- 2022.05\n- 1e5\n- -\n") else {
            panic!()
        };
        let texts = list.iter().filter(|node| matches!(node.value, Value::Text(_))).count();
        let numbers = list.iter().filter(|node| matches!(node.value, Value::Number(_))).count();
        assert_eq!((texts, numbers), (3, 3), "{list:?}");
    }

    #[test]
    fn what_is_not_read_is_said_with_its_place() {
        assert_eq!(problem("a: &x 5\nb: *x\n").2, "anchors are not read; write the value itself");
        assert_eq!(problem("a: 1\na: 2\n"), (2, 1, "`a` is given twice; remove one".to_owned()));
        assert_eq!(problem("a: 1\n---\nb: 1\n").0, 2);
        assert_eq!(problem(&"[".repeat(40)).1, 33);
        assert_eq!(problem("a: [1, 2\nb: 3\n").0, 2);
        assert!(problem("? [1]\n: 2\n").2.starts_with("a key is a list of 1"));
    }
}
