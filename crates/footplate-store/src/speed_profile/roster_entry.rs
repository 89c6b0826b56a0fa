//! Writes a motion model into a JMRI roster entry, and leaves every other byte as it is.
//!
//! Three places change: `<speeds>` inside `<speedprofile>`, which is replaced; our own `keyvaluepair`s inside `<attributepairs>`,
//! which are replaced or added; and an element that is missing is added where JMRI writes it. Edits are splices of byte ranges that
//! the parser reports, from the last to the first.

use std::fmt::Write;
use std::ops::Range;

use roxmltree::Node;

use super::error::{ProfileError, ProfileProblem};
use super::jmri::{FULL, OUR_STEP, OURS, RosterEntry, child, children};
use super::model_row::ModelRow;
use super::tables::text_of;

/// One level of indentation in JMRI's files.
const INDENT: &str = "  ";

/// The roster entry with the numbers of a model in place of its own. `file` is its name in messages.
///
/// # Errors
/// The bytes are not a roster entry of one locomotive.
pub fn write_roster_entry(file: &str, bytes: &[u8], rows: &[ModelRow]) -> Result<Vec<u8>, ProfileError> {
    let text = text_of(file, bytes)?;
    let entry = RosterEntry::parse(file, text)?;
    let locomotive = entry.locomotive()?;
    if text
        .get(locomotive.range())
        .is_some_and(|element| element.ends_with("/>") && !locomotive.has_children())
    {
        let problem = ProfileProblem::Missing { of: "locomotive", element: "speedprofile" };
        return Err(entry.wrong(locomotive.range().start, problem));
    }
    let end_of_line = if text.contains("\r\n") { "\r\n" } else { "\n" };
    let mut edits = Vec::new();
    let in_pairs = |depth: usize| pairs(rows, depth);
    match child(locomotive, "attributepairs") {
        Some(known) => {
            let ours = children(known, "keyvaluepair").filter(|pair| is_ours(*pair));
            edits.extend(ours.map(|pair| (with_space_before(text, pair.range()), String::new())));
            edits.push(last_inside(text, known, "attributepairs", &in_pairs(3)));
        }
        None => {
            let element = wrapped("attributepairs", 2, &in_pairs(3));
            let before = ["speedprofile", "values"].into_iter().find_map(|name| child(locomotive, name));
            edits.push(before_or_last(text, locomotive, before, &element));
        }
    }
    let speeds = wrapped("speeds", 3, &speeds(rows));
    match child(locomotive, "speedprofile") {
        Some(known) => match child(known, "speeds") {
            Some(old) => edits.push((old.range(), speeds.trim().to_owned())),
            None => edits.push(last_inside(text, known, "speedprofile", &speeds)),
        },
        None => {
            let overruns = ["Forward", "Reverse"]
                .map(|direction| line(3, &format!("<overRunTime{direction}>0.0</overRunTime{direction}>")))
                .concat();
            let element = wrapped("speedprofile", 2, &(overruns + &speeds));
            edits.push(before_or_last(text, locomotive, child(locomotive, "values"), &element));
        }
    }
    Ok(spliced(bytes, text, edits, end_of_line))
}

/// A part of the text, and what is to be there.
type Edit = (Range<usize>, String);

fn spliced(bytes: &[u8], text: &str, mut edits: Vec<Edit>, end_of_line: &str) -> Vec<u8> {
    // A stable order: where two edits insert at one place, the first comes first.
    edits.sort_by_key(|(range, _)| (range.start, range.end));
    let mut written = text.to_owned();
    for (range, new) in edits.into_iter().rev() {
        written.replace_range(range, &new.replace('\n', end_of_line));
    }
    // The byte order mark, which is not part of the text.
    let mark = bytes.get(..bytes.len() - text.len()).unwrap_or_default();
    [mark, written.as_bytes()].concat()
}

fn is_ours(pair: Node<'_, '_>) -> bool {
    child(pair, "key").and_then(|key| key.text()).is_some_and(|key| key.starts_with(OURS))
}

/// An element with the white space before it, so that no empty line stays where it was.
fn with_space_before(text: &str, range: Range<usize>) -> Range<usize> {
    let before = text.get(..range.start).unwrap_or_default();
    before.trim_end_matches([' ', '\t', '\r', '\n']).len()..range.end
}

/// Adds lines as the last content of an element, which may have none.
fn last_inside(text: &str, element: Node<'_, '_>, name: &str, lines: &str) -> Edit {
    let range = element.range();
    let whole = text.get(range.clone()).unwrap_or_default();
    if let Some(open) = whole.strip_suffix("/>") {
        // Its attributes stay.
        let begin = range.start + open.trim_end().len();
        return (begin..range.end, format!(">\n{lines}{}</{name}>", INDENT.repeat(2)));
    }
    let end = range.start + whole.rfind("</").unwrap_or(whole.len());
    let at = with_space_before(text, end..end).start;
    (at..at, format!("\n{}", lines.trim_end()))
}

/// Adds an element before another one, or as the last of the locomotive.
fn before_or_last(text: &str, locomotive: Node<'_, '_>, before: Option<Node<'_, '_>>, element: &str) -> Edit {
    match before {
        Some(next) => {
            let at = next.range().start;
            (at..at, format!("{}\n{}", element.trim(), INDENT.repeat(2)))
        }
        None => last_inside(text, locomotive, "locomotive", element),
    }
}

fn line(depth: usize, content: &str) -> String {
    format!("{}{content}\n", INDENT.repeat(depth))
}

fn wrapped(name: &str, depth: usize, lines: &str) -> String {
    line(depth, &format!("<{name}>")) + lines + &line(depth, &format!("</{name}>"))
}

/// JMRI's setting of a step: thousandths.
fn setting(row: &ModelRow) -> f64 {
    (FULL * row.throttle).round()
}

fn speeds(rows: &[ModelRow]) -> String {
    let mut text = String::new();
    for row in rows {
        let mut speed = line(5, &format!("<step>{}</step>", setting(row)));
        for direction in ["forward", "reverse"] {
            speed += &line(5, &format!("<{direction}>{:.2}</{direction}>", row.speed_mm_s));
        }
        text += &wrapped("speed", 4, &speed);
    }
    text
}

/// What a roster entry has no place for, by step.
fn pairs(rows: &[ModelRow], depth: usize) -> String {
    let mut text = String::new();
    for row in rows {
        let [passed, stops] = row.measurements;
        let mut value = String::new();
        // A string takes all that is written to it.
        let _ = write!(
            value,
            "speed_mm_s={:.2} uncertainty_mm_s={:.2} stop_mm={:.1} stop_uncertainty_mm={:.1} stop_scatter_mm={:.1} stop_s={:.2} \
             sensors_passed={passed} stops_measured={stops}",
            row.speed_mm_s,
            row.uncertainty_mm_s,
            row.stop_mm,
            row.stop_uncertainty_mm,
            row.stop_scatter_mm,
            row.stop_s,
        );
        let pair = line(depth + 1, &format!("<key>{OUR_STEP}{}</key>", setting(row)))
            + &line(depth + 1, &format!("<value>{value}</value>"));
        text += &wrapped("keyvaluepair", depth, &pair);
    }
    text
}
