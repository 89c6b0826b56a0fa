//! Names of recordings: two of one name are two recordings, and the second gets a number.

use std::collections::HashSet;

/// The names in order, each once: of equal ones the second becomes `name (2)`.
///
/// Logs of several folders are often called alike, and `simulate layout` calls every log `train-1.csv`. What is found per
/// recording, such as the rhythm of its link, must not be shared by two of them.
pub(crate) fn distinct_names<'n>(names: impl Iterator<Item = &'n str>) -> Vec<String> {
    let mut taken: HashSet<String> = HashSet::new();
    let mut distinct = Vec::new();
    for name in names {
        let mut own = name.to_owned();
        let mut number = 2_usize;
        while !taken.insert(own.clone()) {
            own = format!("{name} ({number})");
            number += 1;
        }
        distinct.push(own);
    }
    distinct
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_equal_names_the_later_ones_are_numbered() {
        let names = ["a", "b", "a", "a (2)", "a"];
        assert_eq!(distinct_names(names.into_iter()), ["a", "b", "a (2)", "a (2) (2)", "a (3)"]);
    }
}
