//! The distribution of values as a curve: the value below which each share of them lies.

/// Points of a curve (chosen: one per half per cent).
const SAMPLES: usize = 200;
/// The end of the curve, in per cent: outliers must not flatten the rest.
pub(in crate::commands) const SHOWN: f64 = 95.0;

/// Points (value, per cent of the values below it), from the least value on; empty without values.
pub(in crate::commands) fn shares(values: impl Iterator<Item = f64>) -> Vec<(f64, f64)> {
    let mut sorted: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return Vec::new() };
    let point = |sample: usize| {
        let share = SHOWN / 100.0 * sample as f64 / SAMPLES as f64;
        let value = sorted.get((share * last as f64).round() as usize)?;
        Some((*value, 100.0 * share))
    };
    (0..=SAMPLES).filter_map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_values_lie_below_the_middle_one_and_the_wildest_are_left_out() {
        let curve = shares((0..=100).rev().map(f64::from).chain([f64::NAN]));
        assert_eq!(curve.first(), Some(&(0.0, 0.0)));
        assert_eq!(curve.last(), Some(&(95.0, 95.0)));
        let (value, _) = curve.iter().find(|(_, share)| *share >= 50.0).unwrap();
        assert!((49.0..=51.0).contains(value), "{value}");
        assert!(shares([].into_iter()).is_empty());
    }
}
