//! Seeds, as given on the command line or as drawn by a commit.

use std::collections::BTreeSet;
use std::process::Command;

use crate::say;
use anyhow::{anyhow, bail};

/// The most seeds: more runs of a scenario add nothing, and a typing error should be rejected.
const MAX_SEEDS: u64 = 100_000;
/// The prefix of a number of seeds that a commit draws.
pub const FRESH: &str = "fresh:";

const OF_FRESH_SEEDS: &str =
    "The seeds are fresh: the commit behind the `@` drew them, so they were not chosen.";
/// Its link leads from one page of `docs/tables` to another.
const OF_REGRESSION_SEEDS: &str = "The seeds are regression seeds: they were looked at while the program was made. \
    [Rates on seeds that no one chose](fresh.md) states how many fresh seeds were run, and at which commit; \
    `./ci.sh fresh` draws others.";

/// Says on a page who chose its seeds.
pub const fn seeds_sentence(are_fresh: bool) -> &'static str {
    if are_fresh { OF_FRESH_SEEDS } else { OF_REGRESSION_SEEDS }
}

/// Digits of a commit's hash that determine its seeds.
const HASH_DIGITS: usize = 12;
/// The suffix of a hash if files differ from the commit.
const CHANGED: &str = "+changes";
/// The range of fresh seeds: above every seed that was ever chosen by hand, and short enough to type.
const FRESH_SEEDS: [f64; 2] = [1e6, 1e7];

/// One seed, a range of seeds, or fresh seeds that a commit draws.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seeds {
    all: Vec<u64>,
    written: String,
}

impl Seeds {
    /// Parses `7`, `1..100` with both ends, `fresh:64` for seeds that the current commit draws, or
    /// `fresh:64@5731edca1f20` for those of another commit.
    ///
    /// # Errors
    /// The text is none of these, or no commit is found.
    pub fn parse(text: &str) -> anyhow::Result<Self> {
        Self::parse_in_rows(text, 1)
    }

    /// As [`parse`](Self::parse), with fresh seeds in rows of successive ones, which a scorer prepares once. A row begins at a
    /// multiple of its length.
    ///
    /// # Errors
    /// As those of [`parse`](Self::parse).
    pub fn parse_in_rows(text: &str, row: u64) -> anyhow::Result<Self> {
        match text.trim().strip_prefix(FRESH) {
            Some(fresh) => Self::fresh(fresh, row),
            None => Self::chosen(text),
        }
    }

    fn chosen(text: &str) -> anyhow::Result<Self> {
        let number = |text: &str| {
            text.trim().parse::<u64>().map_err(|_| {
                anyhow!(
                    "`{text}` is no seed; it should be a whole number such as 7, a range such as 1..100, or fresh:64"
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
        if seeds.end() - seeds.start() >= MAX_SEEDS {
            bail!("the range should have at most {MAX_SEEDS} seeds");
        }
        let (first, last) = (seeds.start(), seeds.end());
        let written = if first == last { first.to_string() } else { format!("{first}..{last}") };
        Ok(Self { all: seeds.collect(), written })
    }

    fn fresh(text: &str, row: u64) -> anyhow::Result<Self> {
        let (count, commit) = match text.split_once('@') {
            Some((count, commit)) => (count, commit.to_owned()),
            None => (text, current_commit()?),
        };
        let Some(count) = count.parse::<u64>().ok().filter(|count| (1..=MAX_SEEDS).contains(count)) else {
            bail!("`{count}` is not a number of fresh seeds; write fresh:64, at most fresh:{MAX_SEEDS}");
        };
        let digits = commit.trim_end_matches(CHANGED);
        let Some(hash) = digits.get(..HASH_DIGITS).and_then(|hash| u64::from_str_radix(hash, 16).ok()) else {
            bail!("`{commit}` is no commit; write at least {HASH_DIGITS} digits of its hash");
        };
        let mut choice = Choice::new(hash);
        let mut drawn = BTreeSet::new();
        while (drawn.len() as u64) < count {
            let first = choice.between(FRESH_SEEDS[0], FRESH_SEEDS[1]) as u64 / row * row;
            drawn.extend((first..first + row).take((count - drawn.len() as u64) as usize));
        }
        let written = format!("{FRESH}{count}@{commit}");
        Ok(Self { all: drawn.into_iter().collect(), written })
    }

    /// The same seeds above another one, if they are fresh; seeds that a person wrote stay as they are.
    #[must_use]
    pub fn fresh_above(mut self, first: u64) -> Self {
        if self.written.starts_with(FRESH) {
            self.all.iter_mut().for_each(|seed| *seed += first);
        }
        self
    }

    /// All seeds, in order.
    pub fn iter(&self) -> impl Iterator<Item = u64> + Clone + use<> {
        self.all.clone().into_iter()
    }

    /// The text for the command line; fresh seeds with the commit that drew them.
    pub fn written(&self) -> &str {
        &self.written
    }
}

/// The hash of the current commit, marked if files differ from it.
fn current_commit() -> anyhow::Result<String> {
    let git = |arguments: &[&str]| {
        let said = Command::new("git").args(arguments).output().ok().filter(|said| said.status.success());
        said.and_then(|said| String::from_utf8(said.stdout).ok()).ok_or_else(|| {
            anyhow!(
                "fresh seeds are drawn from the commit, and git names none here: run inside the repository, or name \
                 the commit, as fresh:64@5731edca1f20"
            )
        })
    };
    let mut commit = git(&["rev-parse", "HEAD"])?;
    commit.truncate(HASH_DIGITS);
    if !git(&["status", "--porcelain", "--untracked-files=no"])?.trim().is_empty() {
        say!("the files differ from commit {commit}: these figures are not those of the commit");
        commit += CHANGED;
    }
    Ok(commit)
}

/// A random generator of its own, so that tasks do not depend on the draws of the world (SplitMix64; Steele, Lea and
/// Flood, 2014).
pub struct Choice(u64);

impl Choice {
    /// The tasks of a seed.
    pub const fn new(seed: u64) -> Self {
        Self(seed ^ 0x9e37_79b9_7f4a_7c15)
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number between two others.
    pub fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * ((self.bits() >> 11) as f64 / (1_u64 << 53) as f64)
    }

    /// A random element.
    pub fn of<'a, T>(&mut self, all: &'a [T]) -> Option<&'a T> {
        all.get((self.bits() % all.len().max(1) as u64) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seeds(text: &str) -> Vec<u64> {
        Seeds::parse(text).unwrap().iter().collect()
    }

    #[test]
    fn a_range_has_both_ends() {
        assert_eq!(seeds("7"), [7]);
        assert_eq!(seeds("1..3"), [1, 2, 3]);
        assert_eq!(seeds("1..=3"), [1, 2, 3]);
        assert_eq!(Seeds::parse("1..100").unwrap().written(), "1..100");
    }

    #[test]
    fn a_commit_draws_the_same_seeds_for_ever_and_another_commit_draws_others() {
        let of_commit = seeds("fresh:64@5731edca1f20");
        assert_eq!(of_commit.len(), 64);
        assert_eq!(of_commit, seeds("fresh:64@5731edca1f20+changes"));
        assert!(of_commit.iter().all(|seed| (1_000_000..10_000_000).contains(seed)), "{of_commit:?}");
        assert!(seeds("fresh:64@c6ca86b00000").iter().all(|seed| !of_commit.contains(seed)));
        assert_eq!(Seeds::parse("fresh:2@5731edca1f20").unwrap().written(), "fresh:2@5731edca1f20");
    }

    #[test]
    fn fresh_seeds_in_rows_are_successive_and_as_many_as_asked_for() {
        let all: Vec<u64> = Seeds::parse_in_rows("fresh:80@5731edca1f20", 32).unwrap().iter().collect();
        assert_eq!(all.len(), 80);
        let firsts: Vec<u64> = all.iter().copied().filter(|seed| seed % 32 == 0).collect();
        assert_eq!(firsts.len(), 3, "{all:?}");
        assert!(all.iter().all(|seed| firsts.iter().any(|first| (*first..first + 32).contains(seed))));
        // A row of one is what all other scorers draw.
        assert_eq!(
            Seeds::parse_in_rows("fresh:9@5731edca1f20", 1).unwrap(),
            Seeds::parse("fresh:9@5731edca1f20").unwrap()
        );
    }

    #[test]
    fn fresh_seeds_lie_above_another_one_if_wanted_and_chosen_ones_do_not() {
        let above = |text| Seeds::parse(text).unwrap().fresh_above(20_000_000).iter().collect::<Vec<_>>();
        let raised: Vec<u64> = seeds("fresh:9@5731edca1f20").iter().map(|seed| seed + 20_000_000).collect();
        assert_eq!(above("fresh:9@5731edca1f20"), raised);
        assert_eq!(above("7..9"), [7, 8, 9]);
    }

    #[test]
    fn invalid_seeds_are_rejected_with_the_correct_form() {
        let refusal = |text| Seeds::parse(text).unwrap_err().to_string();
        assert!(refusal("x..3").starts_with("`x` is no seed"));
        assert_eq!(refusal("9..1"), "the range ends before it begins; it should be 1..9");
        assert!(refusal("0..18446744073709551615").contains("at most 100000 seeds"));
        assert!(refusal("fresh:many@5731edca1f20").contains("write fresh:64"));
        assert!(refusal("fresh:64@main").contains("at least 12 digits"));
    }
}
