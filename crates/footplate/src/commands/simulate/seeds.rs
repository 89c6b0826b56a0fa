//! The seeds of runs, as a person gives them.

use std::ops::RangeInclusive;

use anyhow::{anyhow, bail};

/// More runs of a scenario say nothing new; a slip of the finger does.
const MOST_SEEDS: u64 = 100_000;

/// One seed, or all from one to another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Seeds(RangeInclusive<u64>);

impl Seeds {
    /// Reads `7`, or `1..100` with both ends.
    pub(super) fn parse(text: &str) -> anyhow::Result<Self> {
        let number = |text: &str| {
            text.trim().parse().map_err(|_| {
                anyhow!(
                    "`{text}` is no seed; it should be a whole number such as 7, or a range such as 1..100"
                )
            })
        };
        let seeds = match text.split_once("..") {
            Some((first, last)) => number(first)?..=number(last.trim_start_matches('='))?,
            None => {
                let seed = number(text)?;
                seed..=seed
            }
        };
        if seeds.is_empty() {
            bail!("the range ends before it begins; it should be {}..{}", seeds.end(), seeds.start());
        }
        if seeds.end() - seeds.start() >= MOST_SEEDS {
            bail!("the range should have at most {MOST_SEEDS} seeds");
        }
        Ok(Self(seeds))
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = u64> + Clone + use<> {
        self.0.clone()
    }

    /// As it is given on the command line.
    pub(super) fn written(&self) -> String {
        let (first, last) = (self.0.start(), self.0.end());
        if first == last { first.to_string() } else { format!("{first}..{last}") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_has_both_ends() {
        let seeds = |text| Seeds::parse(text).unwrap().iter().collect::<Vec<_>>();
        assert_eq!(seeds("7"), [7]);
        assert_eq!(seeds("1..3"), [1, 2, 3]);
        assert_eq!(seeds("1..=3"), [1, 2, 3]);
        assert_eq!(Seeds::parse("1..100").unwrap().written(), "1..100");
    }

    #[test]
    fn what_is_no_seed_is_said_with_what_would_be_right() {
        let refusal = |text| Seeds::parse(text).unwrap_err().to_string();
        assert!(refusal("x..3").starts_with("`x` is no seed"));
        assert_eq!(refusal("9..1"), "the range ends before it begins; it should be 1..9");
        assert!(refusal("0..18446744073709551615").contains("at most 100000 seeds"));
    }
}
