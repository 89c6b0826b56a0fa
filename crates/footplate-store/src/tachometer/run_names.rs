//! The names of the runs of a recording, in the order in which they first appear.

use std::collections::HashMap;

/// Most runs of one file. Each has an odometer of its own, of 46 kB with a score, and the process that walks an uploaded
/// recording may have 256 MB; a column that names a run a row is no `run_id`.
pub(super) const MOST_RUNS: usize = 3_000;

/// Numbers the runs as they come, contiguous or interleaved.
#[derive(Debug, Default)]
pub(super) struct RunNames {
    names: Vec<String>,
    numbers: HashMap<String, u32>,
    /// The run that came after this one the last time: interleaved runs mostly take turns.
    after: Vec<u32>,
    last: u32,
}

impl RunNames {
    /// The number of a run that was named before.
    #[inline]
    pub(super) fn known(&mut self, name: &[u8]) -> Option<u32> {
        let is = |names: &[String], run: u32| names.get(run as usize).is_some_and(|n| n.as_bytes() == name);
        if is(&self.names, self.last) {
            return Some(self.last);
        }
        let next = self.after.get(self.last as usize).copied().unwrap_or_default();
        let run =
            if is(&self.names, next) { next } else { *self.numbers.get(std::str::from_utf8(name).ok()?)? };
        self.turn_to(run);
        Some(run)
    }

    /// Numbers a run that was not named before; `None` if there are too many.
    pub(super) fn add(&mut self, name: &str) -> Option<u32> {
        let run = u32::try_from(self.names.len()).ok().filter(|run| (*run as usize) < MOST_RUNS)?;
        self.names.push(name.to_owned());
        self.numbers.insert(name.to_owned(), run);
        self.after.push(0);
        self.turn_to(run);
        Some(run)
    }

    fn turn_to(&mut self, run: u32) {
        if let Some(after) = self.after.get_mut(self.last as usize) {
            *after = run;
        }
        self.last = run;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_keep_their_number_however_they_come() {
        let mut runs = RunNames::default();
        assert_eq!(runs.known(b"a"), None);
        assert_eq!([runs.add("a"), runs.add("b"), runs.add("c")], [Some(0), Some(1), Some(2)]);
        for turn in [b"a", b"b", b"a", b"b", b"c", b"c", b"a", b"c"] {
            let expected = u32::from(turn[0] - b'a');
            assert_eq!(runs.known(turn), Some(expected));
        }
        assert_eq!(runs.known(b"\xff"), None);
    }

    #[test]
    fn a_name_a_row_is_refused_in_the_end() {
        let mut runs = RunNames::default();
        let added = (0..=MOST_RUNS).filter_map(|run| runs.add(&run.to_string())).count();
        assert_eq!(added, MOST_RUNS);
    }
}
