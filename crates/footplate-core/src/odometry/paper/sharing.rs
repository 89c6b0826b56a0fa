//! The shares of information that the local filters get.
//!
//! Each has a speed v_i and a flag S_i, 1 if it is trusted; the virtual sensor is trusted where no
//! wheelset is, S₃ = (1 − S₁)(1 − S₂). The shares are
//!
//! ```text
//! β_i = S_i |v_i|^p / Σ S_j |v_j|^p
//! ```
//!
//! which keeps three rules at once: a wheelset that slips or slides gets nothing and the other all; if both do, the
//! virtual sensor gets all; and of two that roll the faster gets more, because a speed estimated too low is the
//! dangerous error for supervision of speed. With p = 1, the published form, that last preference is slight: 20.0
//! and 20.5 m/s get 0.494 and 0.506. Safety is the work of the bounds, not of a skewed mean.
//!
//! No share is zero, because covariances are divided by shares: a floor keeps every filter alive.

use crate::odometry::sound::sound;

/// Speeds below this (m/s) count as this, so that a train at rest has shares.
const SLOWEST: f64 = 0.1;

/// Speeds above this (m/s) count as this: beyond any train.
const FASTEST: f64 = 1e3;

/// The rule for shares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sharing {
    floor: f64,
    exponent: u32,
}

impl Sharing {
    /// A floor below this is lost beside 1.
    const LEAST_FLOOR: f64 = 1e-12;
    /// With this floor the three are equal.
    const MOST_FLOOR: f64 = 1.0 / 3.0;
    /// With this exponent a difference of a tenth already takes all.
    const MOST_EXPONENT: u32 = 64;

    /// The published form, exponent 1, with a floor of 0.001.
    pub const PAPER: Self = Self { floor: 1e-3, exponent: 1 };

    /// Shares with this floor, between 1e-12 and a third, and this exponent, up to 64: 0 shares evenly among those
    /// that are trusted, large ones give all to the fastest.
    #[must_use]
    pub fn new(floor: f64, exponent: u32) -> Self {
        Self {
            floor: sound(floor, Self::LEAST_FLOOR, Self::MOST_FLOOR),
            exponent: exponent.min(Self::MOST_EXPONENT),
        }
    }

    /// The shares of the two wheelsets and the virtual sensor, from the speeds (m/s) they claim and from whether
    /// each wheelset is trusted. They add up to 1, and none is much below the floor.
    #[must_use]
    pub fn shares(&self, speeds: [f64; 3], trusted: [bool; 2]) -> [f64; 3] {
        let [first, second] = trusted;
        let [v1, v2, v3] = speeds.map(|speed| self.weight(speed));
        let claims = [
            if first { v1 } else { 0.0 },
            if second { v2 } else { 0.0 },
            if first || second { 0.0 } else { v3 },
        ];
        normalised(normalised(claims).map(|share| share.max(self.floor)))
    }

    fn weight(&self, speed: f64) -> f64 {
        // No number counts as no speed.
        let speed = sound(speed.abs(), SLOWEST, FASTEST);
        if self.exponent == 1 { speed } else { power(speed, self.exponent) }
    }
}

fn normalised([first, second, third]: [f64; 3]) -> [f64; 3] {
    let scale = 1.0 / (first + second + third);
    [first * scale, second * scale, third * scale]
}

fn power(speed: f64, exponent: u32) -> f64 {
    (0..exponent).fold(1.0, |power, _| power * speed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PAPER: Sharing = Sharing::PAPER;

    #[test]
    fn a_wheelset_that_slides_gets_nothing_and_the_other_all() {
        let [first, second, third] = PAPER.shares([20.0, 14.0, 19.0], [true, false]);
        assert!(first > 0.997 && second < 1.001e-3 && third < 1.001e-3);
        let [first, second, _] = PAPER.shares([20.0, 26.0, 19.0], [false, true]);
        assert!(first < 1.001e-3 && second > 0.997);
    }

    #[test]
    fn if_both_slide_the_virtual_sensor_gets_all() {
        for speeds in [[14.0, 12.0, 19.0], [0.0, 0.0, 0.0], [14.0, 12.0, f64::NAN]] {
            let [first, second, third] = PAPER.shares(speeds, [false, false]);
            assert!(first < 1.001e-3 && second < 1.001e-3 && third > 0.997);
        }
    }

    #[test]
    fn of_two_that_roll_the_faster_gets_more_and_the_more_the_larger_the_exponent() {
        let faster = |exponent| {
            let [first, second, _] = Sharing::new(1e-3, exponent).shares([20.0, 20.5, 19.0], [true, true]);
            assert!(exponent == 0 || second > first);
            second
        };
        assert!((faster(0) - 0.4995).abs() < 1e-6);
        assert!((faster(1) - 0.506).abs() < 1e-3, "the published form");
        assert!(faster(1) < faster(4) && faster(4) < faster(64));
        assert!(faster(64) > 0.82);
    }

    #[test]
    fn a_train_at_rest_or_backwards_has_shares_too() {
        let [first, second, third] = PAPER.shares([0.0, 0.0, 0.0], [true, true]);
        assert!((first - second).abs() < 1e-15 && third < 1.001e-3);
        assert_eq!(
            PAPER.shares([-3.0, -3.3, 0.0], [true, true]),
            PAPER.shares([3.0, 3.3, 0.0], [true, true])
        );
    }

    proptest! {
        #[test]
        fn all_of_it_is_shared_out(
            speeds in proptest::array::uniform3(proptest::num::f64::ANY),
            trusted in proptest::array::uniform2(proptest::bool::ANY),
            floor in proptest::num::f64::ANY,
            exponent in 0..100_u32,
        ) {
            let sharing = Sharing::new(floor, exponent);
            let shares = sharing.shares(speeds, trusted);
            prop_assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-15 * 4.0);
            // The floors of the others come off.
            let least = sharing.floor / (1.0 + 2.0 * sharing.floor);
            prop_assert!(shares.iter().all(|share| *share >= least * (1.0 - 1e-12)), "{shares:?}");
        }
    }
}
