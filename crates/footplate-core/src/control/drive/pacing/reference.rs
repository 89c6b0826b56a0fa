//! Where a train should be at a few moments ahead.

/// From one moment to the next (s): a tenth of a hop between contacts, and short against every change of speed.
pub(super) const GRID: f64 = 0.2;
/// Moments ahead: a little longer than a change by a step takes to be felt and answered with the next.
pub(super) const LOOKS: usize = 12;

/// The ideal, from now on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::control::drive) struct Reference {
    /// Surveyed m past the contact that the train passed last, after 1, 2 … [`LOOKS`] times [`GRID`].
    pub(super) places: [f64; LOOKS],
    /// How fast it should be now and at the last of them (surveyed m/s).
    pub(super) speeds: [f64; 2],
}

impl Reference {
    /// From now to the last moment (s).
    pub(super) const SPAN: f64 = GRID * LOOKS as f64;

    /// From places at times from now (s).
    pub(super) fn of(place_at: impl Fn(f64) -> f64, speeds: [f64; 2]) -> Self {
        Self { places: core::array::from_fn(|look| place_at(GRID * (look + 1) as f64)), speeds }
    }

    /// Where it should be now, by where it should be soon.
    pub(super) fn now(&self) -> f64 {
        let [first, second, ..] = self.places;
        first + first - second
    }

    pub(super) fn last(&self) -> f64 {
        self.places.last().copied().unwrap_or_default()
    }
}
