//! Statistics of many values.

use footplate_store::score::Coverage;

/// The quantile `part`: the nearest value.
pub fn quantile(values: impl Iterator<Item = f64>, part: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    values.get((last as f64 * part).round() as usize).copied()
}

/// The median and the 95th percentile.
pub(crate) fn median_and_high(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let values: Vec<f64> = values.collect();
    let at = |part| quantile(values.iter().copied(), part);
    Some([at(0.5)?, at(0.95)?])
}

/// The share of absolute values within a bound, in percent.
pub(crate) fn within_pct(values: impl Iterator<Item = f64>, bound: f64) -> Option<f64> {
    let [mut within, mut all] = [0_usize; 2];
    for value in values {
        within += usize::from(value.abs() <= bound);
        all += 1;
    }
    (all > 0).then(|| 100.0 * within as f64 / all as f64)
}

/// The root mean square.
pub(crate) fn root_mean_square(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.fold((0_usize, 0.0), |(count, sum), value| (count + 1, sum + value * value));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

/// A figure as the tables show it.
pub fn shown(figure: Option<f64>, digits: usize) -> String {
    figure.map_or_else(|| "–".to_owned(), |figure| format!("{figure:.digits$}"))
}

/// A median and a high percentile as the tables show them.
pub(crate) fn shown_pair(pair: Option<[f64; 2]>) -> String {
    pair.map_or_else(|| shown(None, 0), |[median, high]| format!("{median:.1} / {high:.1}"))
}

/// The 95 % interval of a probability after `of` successes in `all` trials (Wilson, 1927).
pub fn binomial_interval(of: usize, all: usize) -> [f64; 2] {
    if all == 0 {
        return [0.0, 1.0];
    }
    let (low, high) = Coverage { level: 0.95, inside: of, of: all }.plausible();
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_match_textbook_values() {
        let values = || [3.0, -4.0, 0.0, 5.0].into_iter();
        assert_eq!(quantile(values(), 0.0), Some(-4.0));
        assert_eq!(quantile(values(), 1.0), Some(5.0));
        assert_eq!(within_pct(values(), 4.0), Some(75.0));
        // 9 + 16 + 0 + 25 = 50, a fourth of it is 12.5.
        assert_eq!(root_mean_square(values()), Some(12.5_f64.sqrt()));
        assert_eq!(quantile(core::iter::empty(), 0.5), None);
        assert_eq!(median_and_high((0..=100).rev().map(f64::from)), Some([50.0, 95.0]));
        assert_eq!(median_and_high(core::iter::empty()), None);
    }

    #[test]
    fn a_share_has_the_interval_of_the_tables() {
        // Wilson's interval for 10 of 100, as in any table: 5.5 to 17.4 %.
        let [low, high] = binomial_interval(10, 100);
        assert!((low - 0.0552).abs() < 1e-3 && (high - 0.1744).abs() < 1e-3, "{low} {high}");
        assert_eq!(binomial_interval(0, 0), [0.0, 1.0]);
    }
}
