//! Times counted in bins that each are a fiftieth longer than the one before: quantiles to 2 %, in little room, for ever.

use serde::Serialize;

/// Each bin ends at this many times where it begins.
const WIDER: f64 = 1.02;
/// Where the first bin ends (ms): a microsecond. Nothing of interest is shorter.
const SHORTEST_MS: f64 = 1e-3;
/// Bins up to a minute.
const BINS: usize = 905;

/// How often times of each length were seen.
#[derive(Debug, Clone)]
pub(crate) struct Tally {
    counts: Vec<u32>,
    count: u64,
    longest: f64,
}

/// A tally for people.
#[derive(Debug, Serialize)]
pub(crate) struct TallyPicture {
    count: u64,
    median_ms: Option<f64>,
    p95_ms: Option<f64>,
    p99_ms: Option<f64>,
    longest_ms: Option<f64>,
    /// Bins in which there is anything: where they begin and end (ms), and how much.
    bins: Vec<(f64, f64, u32)>,
}

impl Default for Tally {
    fn default() -> Self {
        Self { counts: vec![0; BINS], count: 0, longest: 0.0 }
    }
}

impl Tally {
    /// One more, in milliseconds.
    pub(crate) fn add(&mut self, ms: f64) {
        let bin = if ms <= SHORTEST_MS { 0.0 } else { libm::log(ms / SHORTEST_MS) / libm::log(WIDER) };
        if let Some(count) = self.counts.get_mut((bin as usize).min(BINS - 1)) {
            *count = count.saturating_add(1);
        }
        self.count += 1;
        self.longest = self.longest.max(ms);
    }

    /// What a share of all is not longer than, in milliseconds; nothing if there is none.
    pub(crate) fn quantile(&self, share: f64) -> Option<f64> {
        let wanted = (share * self.count as f64).ceil().max(1.0) as u64;
        let mut seen = 0;
        let bin = self.counts.iter().position(|count| {
            seen += u64::from(*count);
            seen >= wanted
        })?;
        Some(begins(bin + 1).min(self.longest))
    }

    pub(crate) fn picture(&self) -> TallyPicture {
        let full = self.counts.iter().enumerate().filter(|(_, count)| **count > 0);
        TallyPicture {
            count: self.count,
            median_ms: self.quantile(0.5),
            p95_ms: self.quantile(0.95),
            p99_ms: self.quantile(0.99),
            longest_ms: (self.count > 0).then_some(self.longest),
            bins: full.map(|(bin, count)| (begins(bin), begins(bin + 1), *count)).collect(),
        }
    }
}

/// Where a bin begins (ms).
fn begins(bin: usize) -> f64 {
    if bin == 0 { 0.0 } else { SHORTEST_MS * libm::pow(WIDER, bin as f64) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_right_to_two_percent_and_the_longest_exactly() {
        let mut tally = Tally::default();
        assert_eq!(tally.quantile(0.5), None);
        // 1 to 1000 ms: the median is 500, the 99th percentile 990.
        (1..=1000).for_each(|ms| tally.add(f64::from(ms)));
        for (share, exact) in [(0.5, 500.0), (0.95, 950.0), (0.99, 990.0)] {
            let found = tally.quantile(share).expect("there are some");
            assert!((found / exact - 1.0).abs() <= 0.02, "{share}: {found}");
        }
        assert_eq!(tally.quantile(1.0), Some(1000.0));
        tally.add(1e9);
        tally.add(0.0);
        let picture = tally.picture();
        assert_eq!((picture.count, picture.longest_ms), (1002, Some(1e9)));
        let sum: u32 = picture.bins.iter().map(|(_, _, count)| count).sum();
        assert_eq!(sum, 1002);
    }
}
