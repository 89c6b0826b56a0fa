//! Numbers that can be reckoned with, whatever a sensor or a file made of them.

/// After a longer time (s) an odometer begins again; until then, what follows stays finite.
const LONGEST_PERIOD_S: f64 = 60.0;

/// The value if it lies within, the nearer bound if not, and the lower one for what is no number: unlike
/// [`f64::clamp`], which hands that on. One instruction a bound.
pub(super) fn sound(value: f64, least: f64, most: f64) -> f64 {
    let at_least = if value > least { value } else { least };
    if at_least < most { at_least } else { most }
}

/// A period (s): not negative, not absurd; what is no number is no time.
pub(super) fn sound_period(period: f64) -> f64 {
    sound(period, 0.0, LONGEST_PERIOD_S)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_the_least() {
        assert_eq!(
            [f64::NAN, -3.0, 0.25, f64::INFINITY].map(|value| sound(value, 0.0, 1.0)),
            [0.0, 0.0, 0.25, 1.0]
        );
        assert_eq!([f64::NAN, -3.0, 0.05, 1e9].map(sound_period), [0.0, 0.0, 0.05, 60.0]);
    }
}
