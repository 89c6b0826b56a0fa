//! The built-in layouts, and the lookup that every `--layout` uses.

use std::path::Path;

use super::drawing::LayoutFile;
use super::error::LayoutFileError;
use super::read::{parse_layout, read_layout};

/// The built-in layouts by name: the two tracks of the course on real-time trains, an earlier survey of the first, and an
/// oval of blocks.
pub const BUILT_IN: [&str; 4] = ["track-a", "track-a-v1", "track-b", "oval-blocks"];

const TEXTS: [&str; 4] = [
    include_str!("../../layouts/track-a.toml"),
    include_str!("../../layouts/track-a-v1.toml"),
    include_str!("../../layouts/track-b.toml"),
    include_str!("../../layouts/oval-blocks.toml"),
];

/// A built-in layout.
///
/// # Errors
/// [`LayoutFileError::Unknown`] if there is none of that name.
pub fn built_in(name: &str) -> Result<LayoutFile, LayoutFileError> {
    let found = BUILT_IN.iter().zip(TEXTS).find(|(known, _)| **known == name);
    let Some((name, text)) = found else {
        return Err(LayoutFileError::Unknown { name: name.to_owned(), built_in: BUILT_IN.join(" or ") });
    };
    parse_layout(name, text.as_bytes())
}

/// The built-in layout of that name, otherwise the layout file at that path.
///
/// # Errors
/// The file is invalid, or there is neither.
pub fn layout_named(name: &str) -> Result<LayoutFile, LayoutFileError> {
    let path = Path::new(name);
    match built_in(name) {
        Err(LayoutFileError::Unknown { .. }) if path.exists() => read_layout(path),
        result => result,
    }
}
