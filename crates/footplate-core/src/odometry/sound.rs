//! Limits numbers from sensors and files to finite ranges.

/// The longest period (s). An odometer begins again after a much shorter gap; this keeps everything finite until then.
const LONGEST_PERIOD_S: f64 = 60.0;

/// Returns the value clamped to both bounds, and the lower one for NaN, which [`f64::clamp`] would return. One instruction
/// for each bound.
pub(super) fn sound(value: f64, least: f64, most: f64) -> f64 {
    let at_least = if value > least { value } else { least };
    if at_least < most { at_least } else { most }
}

/// Returns a period (s) between 0 and [`LONGEST_PERIOD_S`], and 0 for NaN.
pub(super) fn sound_period(period: f64) -> f64 {
    sound(period, 0.0, LONGEST_PERIOD_S)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_becomes_the_lower_bound() {
        assert_eq!(
            [f64::NAN, -3.0, 0.25, f64::INFINITY].map(|value| sound(value, 0.0, 1.0)),
            [0.0, 0.0, 0.25, 1.0]
        );
        assert_eq!([f64::NAN, -3.0, 0.05, 1e9].map(sound_period), [0.0, 0.0, 0.05, 60.0]);
    }
}
