//! Splits a line into words with their columns, and formats mistakes.

use std::fmt;

use crate::comment::without_comment;

/// A word and the column at which it begins, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Word<'t> {
    pub(super) text: &'t str,
    pub(super) column: usize,
}

/// Splits a line at spaces and drops its comment.
pub(super) fn words(line: &str) -> Vec<Word<'_>> {
    without_comment(line)
        .split_whitespace()
        .map(|text| {
            // Both point into the same line: the difference is the word's byte offset.
            let byte = text.as_ptr() as usize - line.as_ptr() as usize;
            Word { text, column: line[..byte].chars().count() + 1 }
        })
        .collect()
}

/// A mistake in a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Mistake {
    /// The column of the wrong or missing word.
    pub(super) column: usize,
    /// What is wrong, and what would be right.
    pub(super) what: String,
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "column {}: {}", self.column, self.what)
    }
}

impl Word<'_> {
    /// A mistake in this word.
    pub(super) fn mistake(&self, what: impl fmt::Display) -> Mistake {
        Mistake { column: self.column, what: format!("`{}` {what}", self.text.escape_debug()) }
    }
}

/// The largest edit distance at which a word is still recognised.
const MAX_EDITS: usize = 2;

/// The known word nearest to a written one, if it is near enough.
pub(super) fn nearest<'k>(written: &str, known: impl Iterator<Item = &'k str>) -> Option<&'k str> {
    let distance = |known: &str| strsim::damerau_levenshtein(&known.to_lowercase(), &written.to_lowercase());
    known
        .map(|known| (distance(known), known))
        .filter(|(distance, _)| *distance <= MAX_EDITS.min(written.chars().count().div_ceil(2)))
        .min()
        .map(|(_, known)| known)
}

/// `: did you mean `x`?`, or `otherwise` if no known word is near.
pub(super) fn meant<'k>(written: &str, known: impl Iterator<Item = &'k str>, otherwise: &str) -> String {
    nearest(written, known).map_or_else(|| otherwise.to_owned(), |near| format!(": did you mean `{near}`?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_know_their_columns_even_after_letters_of_two_bytes() {
        let found: Vec<_> =
            words("  stop ä 24\t# at C13").iter().map(|word| (word.text, word.column)).collect();
        assert_eq!(found, [("stop", 3), ("ä", 8), ("24", 10)]);
        assert!(words("# a remark").is_empty() && words("").is_empty());
    }

    #[test]
    fn a_mistyped_word_is_recognised_and_a_strange_one_is_not() {
        let known = || ["speed", "stop", "turnout"].into_iter();
        assert_eq!(nearest("sped", known()), Some("speed"));
        assert_eq!(nearest("STOP", known()), Some("stop"));
        assert_eq!(nearest("xyz", known()), None);
        assert_eq!(nearest("", known()), None);
    }
}
