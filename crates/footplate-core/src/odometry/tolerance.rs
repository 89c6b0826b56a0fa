//! How far on-board odometry may be off: the tolerances that ETCS demands for speed and distance.
//!
//! Source: UNISIG SUBSET-041, performance requirements for interoperability, 5.3.1.1 (distance) and 5.3.1.2 (speed).

use crate::units::{Length, Speed};

const KM_PER_H_PER_M_PER_S: f64 = 3.6;

/// Up to this speed (km/h) the tolerance stays as it is.
const LEVEL_UP_TO_KM_PER_H: f64 = 30.0;
/// The tolerance there (km/h).
const LEVEL_KM_PER_H: f64 = 2.0;
/// Up to this speed (km/h) it rises in a straight line.
const RISES_UP_TO_KM_PER_H: f64 = 500.0;
/// The tolerance there (km/h).
const HIGHEST_KM_PER_H: f64 = 12.0;

/// What a distance may be off at once (m), the error of detecting the balise group included.
const DISTANCE_FIXED_M: f64 = 5.0;
/// What it may be off for each metre travelled since that balise group.
const DISTANCE_PART: f64 = 0.05;

/// By how much a speed may be over or under the true speed: ±2 km/h up to 30 km/h, then rising in a straight line to
/// ±12 km/h at 500 km/h, and no further. The direction does not matter.
#[must_use]
pub fn speed_tolerance(true_speed: Speed) -> Speed {
    let km_per_h = true_speed.abs().as_m_per_s() * KM_PER_H_PER_M_PER_S;
    let beyond = km_per_h.clamp(LEVEL_UP_TO_KM_PER_H, RISES_UP_TO_KM_PER_H) - LEVEL_UP_TO_KM_PER_H;
    let rise = (HIGHEST_KM_PER_H - LEVEL_KM_PER_H) / (RISES_UP_TO_KM_PER_H - LEVEL_UP_TO_KM_PER_H);
    Speed::from_m_per_s((LEVEL_KM_PER_H + rise * beyond) / KM_PER_H_PER_M_PER_S)
}

/// By how much a distance may be over or under the distance travelled: ±(5 m + 5 %). The direction does not matter.
#[must_use]
pub fn distance_tolerance(travelled: Length) -> Length {
    Length::from_m(DISTANCE_FIXED_M) + travelled.abs() * DISTANCE_PART
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tolerance_km_per_h(km_per_h: f64) -> f64 {
        speed_tolerance(Speed::from_m_per_s(km_per_h / 3.6)).as_m_per_s() * 3.6
    }

    #[test]
    fn the_speed_tolerance_is_that_of_the_standard() {
        // At and around both corners, and values read off the line by hand: 2 + 10 (v − 30) / 470.
        for (speed, tolerance) in [
            (0.0, 2.0),
            (29.9, 2.0),
            (30.0, 2.0),
            (100.0, 3.489),
            (200.0, 5.617),
            (300.0, 7.745),
            (350.0, 8.809),
            (500.0, 12.0),
            (600.0, 12.0),
            (-200.0, 5.617),
        ] {
            assert!((tolerance_km_per_h(speed) - tolerance).abs() < 5e-4, "{speed} km/h");
        }
    }

    #[test]
    fn the_distance_tolerance_is_five_metres_and_five_per_cent() {
        for (travelled, tolerance) in [(0.0, 5.0), (100.0, 10.0), (5000.0, 255.0), (-100.0, 10.0)] {
            assert!((distance_tolerance(Length::from_m(travelled)).as_m() - tolerance).abs() < 1e-9);
        }
    }

    #[test]
    fn what_is_no_number_is_within_no_tolerance() {
        let error = Speed::from_m_per_s(0.0);
        assert!(!matches!(
            error.partial_cmp(&speed_tolerance(Speed::from_m_per_s(f64::NAN))),
            Some(core::cmp::Ordering::Less | core::cmp::Ordering::Equal)
        ));
        assert!(distance_tolerance(Length::from_m(f64::NAN)).as_m().is_nan());
    }
}
