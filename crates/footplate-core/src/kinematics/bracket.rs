//! Root of a continuous function between two points of opposite signs.

/// Most steps; bisection alone needs fewer to exhaust all digits.
const MOST_STEPS: u32 = 100;

/// The argument between `low` and `high` at which `f` crosses zero, to a few units in the last place.
///
/// `f(low)` and `f(high)` should have opposite signs; otherwise the result is the end whose value is nearer to zero.
///
/// Chandrupatla's method (Advances in Engineering Software 28, 1997): a parabola through three points where it
/// is reliable, else bisection. It never leaves the bracket, and takes about eight steps on smooth functions.
pub(super) fn crossing(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut newest, mut across) = ((low, f(low)), (high, f(high)));
    if (newest.1 < 0.0) == (across.1 < 0.0) {
        return if newest.1.abs() <= across.1.abs() { low } else { high };
    }
    let mut share = 0.5;
    for _ in 0..MOST_STEPS {
        let x = newest.0 + share * (across.0 - newest.0);
        let y = f(x);
        let third = if (y < 0.0) == (newest.1 < 0.0) {
            newest
        } else {
            let third = across;
            across = newest;
            third
        };
        newest = (x, y);
        let best = if newest.1.abs() < across.1.abs() { newest } else { across };
        let resolution = 2.0 * f64::EPSILON * best.0.abs() / (across.0 - newest.0).abs();
        if best.1 == 0.0 || resolution > 0.5 {
            return best.0;
        }
        let along = (newest.0 - across.0) / (third.0 - across.0);
        let up = (newest.1 - across.1) / (third.1 - across.1);
        // The parabola is monotonic between the points if both shares lie on the same side of these curves.
        let trusted = up * up < along && (1.0 - up) * (1.0 - up) < 1.0 - along;
        share = if trusted {
            let (a, b, c) = (newest, across, third);
            a.1 / (b.1 - a.1) * c.1 / (b.1 - c.1)
                + (c.0 - a.0) / (b.0 - a.0) * a.1 / (c.1 - a.1) * b.1 / (c.1 - b.1)
        } else {
            0.5
        };
        share = share.max(resolution).min(1.0 - resolution);
    }
    newest.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crossing_is_found_to_the_last_digits() {
        assert!((crossing(0.0, 2.0, |x| x * x - 2.0) - core::f64::consts::SQRT_2).abs() < 1e-15);
        assert!((crossing(3.0, 0.0, |x| 1.0 - x * x * x) - 1.0).abs() < 1e-15);
        // A curve that is all but flat at its root.
        assert!((crossing(0.0, 3.0, |x| (x - 1.0) * (x - 1.0) * (x - 1.0)) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn without_a_crossing_the_nearer_end_is_given() {
        assert_eq!(crossing(1.0, 2.0, |x| x), 1.0);
        assert_eq!(crossing(-2.0, -1.0, |x| x), -1.0);
    }
}
