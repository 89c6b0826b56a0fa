//! What trains and lines of TTOBench have in common: where they say they come from.

use crate::document::{Fault, Table};

/// Where a file of the benchmark says it comes from.
pub(crate) fn about(metadata: &Table<'_>) -> Result<String, Fault> {
    let mut about = "From TTOBench".to_owned();
    for (says, key) in [("version", "library version"), ("by", "created by"), ("licence", "license")] {
        if let Some(text) = metadata.optional_text(key)? {
            about += &format!("; {says} {text}");
        }
    }
    Ok(about)
}
