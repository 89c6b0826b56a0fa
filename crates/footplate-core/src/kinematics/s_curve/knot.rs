//! A boundary between two phases of a profile.

/// The state at a boundary, in SI units, counted from the start of the profile.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Knot {
    pub(super) time: f64,
    pub(super) distance: f64,
    pub(super) speed: f64,
    pub(super) half_acceleration: f64,
}
