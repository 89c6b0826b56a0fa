//! The optional keys of a vehicle file, and where each of them stands in the vehicle.

use footplate_core::odometry::wheels::{BrakeCommand, SlideProtection, Thresholds};
use footplate_core::{Acceleration, Speed, TimeSpan};

/// One key of a table of numbers.
pub(super) struct Key<T> {
    pub(super) name: &'static str,
    pub(super) get: fn(&T) -> f64,
    pub(super) set: fn(&mut T, f64),
}

const fn key<T>(name: &'static str, get: fn(&T) -> f64, set: fn(&mut T, f64)) -> Key<T> {
    Key { name, get, set }
}

/// The keys of `[thresholds]`.
pub(super) const THRESHOLDS: [Key<Thresholds>; 14] = [
    key(
        "slip_acceleration_m_s2",
        |t| t.slip_acceleration.as_m_per_s2(),
        |t, value| t.slip_acceleration = Acceleration::from_m_per_s2(value),
    ),
    key(
        "slide_deceleration_m_s2",
        |t| t.slide_deceleration.as_m_per_s2(),
        |t, value| t.slide_deceleration = Acceleration::from_m_per_s2(value),
    ),
    key("creepage", |t| t.creepage, |t, value| t.creepage = value),
    key("rolling_creepage", |t| t.rolling_creepage, |t, value| t.rolling_creepage = value),
    key(
        "creepage_floor_m_s",
        |t| t.creepage_floor.as_m_per_s(),
        |t, value| t.creepage_floor = Speed::from_m_per_s(value),
    ),
    key(
        "difference_m_s",
        |t| t.difference.as_m_per_s(),
        |t, value| t.difference = Speed::from_m_per_s(value),
    ),
    key("difference_ratio", |t| t.difference_ratio, |t, value| t.difference_ratio = value),
    key(
        "slowest_ratio_m_s",
        |t| t.slowest_ratio.as_m_per_s(),
        |t, value| t.slowest_ratio = Speed::from_m_per_s(value),
    ),
    key("raise_after_s", |t| t.raise_after.as_s(), |t, value| t.raise_after = TimeSpan::from_s(value)),
    key("clear_after_s", |t| t.clear_after.as_s(), |t, value| t.clear_after = TimeSpan::from_s(value)),
    key(
        "correction_m_s2",
        |t| t.correction.as_m_per_s2(),
        |t, value| t.correction = Acceleration::from_m_per_s2(value),
    ),
    key(
        "lock_correction_m_s2",
        |t| t.lock_correction.as_m_per_s2(),
        |t, value| t.lock_correction = Acceleration::from_m_per_s2(value),
    ),
    key(
        "longest_correction_s",
        |t| t.longest_correction.as_s(),
        |t, value| t.longest_correction = TimeSpan::from_s(value),
    ),
    key(
        "least_sliding_deceleration_m_s2",
        |t| t.least_sliding_deceleration.as_m_per_s2(),
        |t, value| t.least_sliding_deceleration = Acceleration::from_m_per_s2(value),
    ),
];

/// The keys of `[brake_command]`.
pub(super) const BRAKE_COMMAND: [Key<BrakeCommand>; 6] = [
    key("full_brake_m_s2", |b| b.full.as_m_per_s2(), |b, value| b.full = Acceleration::from_m_per_s2(value)),
    key("full_brake_tolerance", |b| b.tolerance, |b, value| b.tolerance = value),
    key(
        "gradient_m_s2",
        |b| b.gradient.as_m_per_s2(),
        |b, value| b.gradient = Acceleration::from_m_per_s2(value),
    ),
    key(
        "resistance_m_s2",
        |b| b.resistance.as_m_per_s2(),
        |b, value| b.resistance = Acceleration::from_m_per_s2(value),
    ),
    key("build_up_s", |b| b.build_up.as_s(), |b, value| b.build_up = TimeSpan::from_s(value)),
    key("release_s", |b| b.release.as_s(), |b, value| b.release = TimeSpan::from_s(value)),
];

/// The keys of `[slide_protection]`, all of which it needs.
pub(super) const SLIDE_PROTECTION: [Key<SlideProtection>; 2] = [
    key("creepage", |s| s.creepage, |s, value| s.creepage = value),
    key("longest_s", |s| s.longest.as_s(), |s, value| s.longest = TimeSpan::from_s(value)),
];
