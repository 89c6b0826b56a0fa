//! Some of the troubles that a seed draws: those that a story has.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

/// The word for no trouble at all.
const NONE: &str = "none";
/// A trouble is shortened to an eighth of its planned time at most: what is left then says enough.
const SHORTEST: f64 = 0.125;

/// Troubles by their numbers, counted from 1 over all lives of a story, each with the part of its planned time that it lasts.
///
/// The death at the end of a life is the last trouble of that life. Without it the life ends in order.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Selection(BTreeMap<usize, f64>);

impl Selection {
    /// All of a number of troubles, as planned.
    pub(crate) fn all(count: usize) -> Self {
        Self((1..=count).map(|number| (number, 1.0)).collect())
    }

    /// The part of its planned time that a trouble lasts; `None` if it is left out.
    pub(super) fn part(&self, number: usize) -> Option<f64> {
        self.0.get(&number).copied()
    }

    pub(crate) fn numbers(&self) -> impl Iterator<Item = usize> {
        self.0.keys().copied()
    }

    /// The smallest selection found by leaving out and shortening troubles one at a time, with which a story still `fails`.
    ///
    /// No trouble of it can be left out; another selection may be smaller (one-minimal; Zeller and Hildebrandt, 2002).
    ///
    /// # Errors
    /// That of `fails`.
    pub(crate) fn minimised<E>(
        count: usize,
        mut fails: impl FnMut(&Self) -> Result<bool, E>,
    ) -> Result<Self, E> {
        let mut kept = Self::all(count);
        loop {
            let before = kept.0.len();
            for number in kept.0.keys().copied().collect::<Vec<_>>() {
                let mut fewer = kept.clone();
                fewer.0.remove(&number);
                if fails(&fewer)? {
                    kept = fewer;
                }
            }
            if kept.0.len() == before {
                break;
            }
        }
        for number in kept.0.keys().copied().collect::<Vec<_>>() {
            while let Some(part) = kept.part(number).filter(|part| *part > SHORTEST) {
                let mut shorter = kept.clone();
                shorter.0.insert(number, 0.5 * part);
                if !fails(&shorter)? {
                    break;
                }
                kept = shorter;
            }
        }
        Ok(kept)
    }
}

impl fmt::Display for Selection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return f.write_str(NONE);
        }
        for (nth, (number, part)) in self.0.iter().enumerate() {
            let comma = if nth > 0 { "," } else { "" };
            write!(f, "{comma}{number}")?;
            if *part < 1.0 {
                write!(f, ":{part}")?;
            }
        }
        Ok(())
    }
}

impl FromStr for Selection {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.trim() == NONE {
            return Ok(Self(BTreeMap::new()));
        }
        let one = |word: &str| {
            let (number, part) = word.trim().split_once(':').unwrap_or((word.trim(), "1"));
            let number = number.parse::<usize>().ok().filter(|number| *number > 0);
            let part = part.parse::<f64>().ok().filter(|part| *part > 0.0 && *part <= 1.0);
            number.zip(part).ok_or_else(|| {
                format!("`{word}` is no trouble of a story; write its number, as 3, or 3:0.5 for half of its time, or none")
            })
        };
        text.split(',').map(one).collect::<Result<_, _>>().map(Self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_failure_does_not_need_is_left_out_and_the_rest_shortened() {
        // A story of eight troubles that fails while the third lasts a quarter of its time and the seventh is there.
        let fails = |selection: &Selection| {
            let is_long = selection.part(3).is_some_and(|part| part >= 0.25);
            Ok::<_, String>(is_long && selection.part(7).is_some())
        };
        let least = Selection::minimised(8, fails).unwrap();
        assert_eq!(least.to_string(), "3:0.25,7:0.125");
        assert_eq!("3:0.25,7:0.125".parse(), Ok(least));
    }

    #[test]
    fn a_story_that_fails_by_itself_needs_no_trouble() {
        let least = Selection::minimised(3, |_| Ok::<_, String>(true)).unwrap();
        assert_eq!(least.to_string(), "none");
        assert_eq!("none".parse(), Ok(least));
    }

    #[test]
    fn what_is_no_selection_is_refused_with_the_right_form() {
        for text in ["0", "x", "3:0", "3:2", "", "1,,2"] {
            let refusal = text.parse::<Selection>().unwrap_err();
            assert!(
                refusal.ends_with("write its number, as 3, or 3:0.5 for half of its time, or none"),
                "{refusal}"
            );
        }
    }
}
