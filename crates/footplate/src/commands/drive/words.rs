//! A line cut into words that know their columns, and mistakes that name them.

use std::fmt;

/// A word and the column it begins at, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Word<'t> {
    pub(super) text: &'t str,
    pub(super) column: usize,
}

/// Cuts a line at spaces, and leaves out what follows a `#`.
pub(super) fn words(line: &str) -> Vec<Word<'_>> {
    let said = line.split('#').next().unwrap_or_default();
    said.split_whitespace()
        .map(|text| {
            // Both are parts of one line, so that the difference is where the word begins in it.
            let byte = text.as_ptr() as usize - line.as_ptr() as usize;
            Word { text, column: line[..byte].chars().count() + 1 }
        })
        .collect()
}

/// What is wrong with a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Mistake {
    /// Where the word begins that is wrong, or where one is missing.
    pub(super) column: usize,
    /// What is wrong and what would be right.
    pub(super) what: String,
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "column {}: {}", self.column, self.what)
    }
}

impl Word<'_> {
    /// This word is wrong.
    pub(super) fn mistake(&self, what: impl fmt::Display) -> Mistake {
        Mistake { column: self.column, what: format!("`{}` {what}", self.text.escape_debug()) }
    }
}

/// Most letters that may be wrong in a word that is still recognised.
const MOST_MISTAKES: usize = 2;

/// The known word that is nearest to one that was written, if it is near.
pub(super) fn nearest<'k>(written: &str, known: impl Iterator<Item = &'k str>) -> Option<&'k str> {
    let distance = |known: &str| strsim::damerau_levenshtein(&known.to_lowercase(), &written.to_lowercase());
    known
        .map(|known| (distance(known), known))
        .filter(|(distance, _)| *distance <= MOST_MISTAKES.min(written.chars().count().div_ceil(2)))
        .min()
        .map(|(_, known)| known)
}

/// `: did you mean `x`?`, or what else to say.
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
