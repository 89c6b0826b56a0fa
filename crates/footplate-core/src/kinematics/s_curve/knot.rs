//! A border between two phases of a profile.

/// The state there, in SI units and counted from the start of the profile.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Knot {
    pub(super) time: f64,
    pub(super) way: f64,
    pub(super) speed: f64,
    pub(super) half_acceleration: f64,
}
