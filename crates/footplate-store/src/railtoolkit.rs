//! What trains and lines after the schemas of railtoolkit have in common: a version, and several in a file.

use crate::document::{DocumentProblem, Fault, Table};

/// The version of the schemas that is read.
pub(crate) const VERSION: &str = "2022.05";

/// Whether a document is after a schema in the version that is known.
pub(crate) fn after_schema(table: &Table<'_>, schema: &str) -> Result<(), Fault> {
    for (key, expected) in [("schema", schema), ("schema_version", VERSION)] {
        if table.text(key)? != expected {
            return Err(table.needs(key)?.not(&format!("`{key}`"), &format!("\"{expected}\"")));
        }
    }
    Ok(())
}

/// The one thing below a key, or the one of several that was named by its id.
pub(crate) fn chosen<'a>(table: &Table<'a>, key: &str, which: Option<&str>) -> Result<Table<'a>, Fault> {
    let all: Vec<Table<'a>> =
        table.list(key)?.iter().map(|node| Table::of(node, "an entry")).collect::<Result<_, _>>()?;
    let ids: Vec<&str> = all.iter().map(|entry| entry.text("id")).collect::<Result<_, _>>()?;
    let found = listed(&ids);
    let place = table.place_of(key);
    match (which, all.as_slice()) {
        (None, [one]) => Ok(*one),
        (None, _) => Err((place, DocumentProblem::Which(found))),
        (Some(wanted), _) => {
            let at = ids.iter().position(|id| *id == wanted);
            let entry = at.and_then(|at| all.get(at).copied());
            entry.ok_or((place, DocumentProblem::NotThere { wanted: wanted.to_owned(), found }))
        }
    }
}

/// Names as an error lists them: the first of many, on one line.
pub(crate) fn listed(names: &[&str]) -> String {
    /// A longer list does not help its reader.
    const MOST: usize = 10;
    let mut listed: Vec<String> =
        names.iter().take(MOST).map(|name| name.escape_debug().to_string()).collect();
    match names.len().saturating_sub(MOST) {
        0 if names.is_empty() => listed.push("nothing".to_owned()),
        0 => {}
        more => listed.push(format!("and {more} more")),
    }
    listed.join(", ")
}
