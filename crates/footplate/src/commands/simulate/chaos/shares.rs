//! Shares over many stories, and the bounds that they must not break.

use std::fmt;

use footplate_eval::figures::binomial_interval;

/// Fewer cases say little: a single story sets some twenty routes and makes as many promises.
const JUDGED_FROM: usize = 500;

/// How often something happened, of how many times that it could.
#[derive(Debug, Clone, Copy)]
pub(super) struct Share {
    pub(super) what: &'static str,
    pub(super) times: usize,
    pub(super) of: usize,
    pub(super) bound: Bound,
}

/// What a share must not be.
#[derive(Debug, Clone, Copy)]
pub(super) enum Bound {
    /// Below this.
    AtLeast(f64),
    /// Above this.
    AtMost(f64),
}

impl Share {
    /// Whether it breaks its bound by more than chance: the whole 95 % interval lies beyond it.
    pub(super) fn is_broken(&self) -> bool {
        let [low, high] = binomial_interval(self.times, self.of);
        self.of >= JUDGED_FROM
            && match self.bound {
                Bound::AtLeast(least) => high < least,
                Bound::AtMost(most) => low > most,
            }
    }
}

impl fmt::Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, times, of, bound } = self;
        let [low, high] = binomial_interval(*times, *of).map(|part| 100.0 * part);
        let (word, bound) = match bound {
            Bound::AtLeast(least) => ("at least", 100.0 * least),
            Bound::AtMost(most) => ("at most", 100.0 * most),
        };
        write!(f, "{what}: {times} of {of} ({low:.2} to {high:.2} %; {word} {bound:.1} % are expected)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_breaks_its_bound_only_by_more_than_chance() {
        let kept = |times, of| Share { what: "kept", times, of, bound: Bound::AtLeast(0.88) };
        assert!(!kept(880, 1_000).is_broken());
        // 86.5 % of a thousand may be 88 (84.2 to 88.5), 85 % may not (82.7 to 87.1).
        assert!(!kept(865, 1_000).is_broken());
        assert!(kept(850, 1_000).is_broken());
        // A single story may keep none of its few.
        assert!(!kept(0, 20).is_broken());
        let entered = |times| Share { what: "entered", times, of: 10_000, bound: Bound::AtMost(0.005) };
        assert!(!entered(60).is_broken());
        assert!(entered(80).is_broken());
        assert_eq!(
            entered(30).to_string(),
            "entered: 30 of 10000 (0.21 to 0.43 %; at most 0.5 % are expected)"
        );
    }
}
