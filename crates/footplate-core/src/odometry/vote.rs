//! The loosest of the bounds that several wheels set on one side.

/// The loosest bound of all wheels that have one, so that one faulty sensor cannot break it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vote {
    bound: Option<f64>,
    /// At least one of the wheels may set the bound.
    counts: bool,
}

impl Vote {
    pub(super) const NONE: Self = Self { bound: None, counts: false };

    pub(super) fn also(self, bound: f64, disputed: bool, looser: fn(f64, f64) -> f64) -> Self {
        if bound.is_infinite() {
            return self;
        }
        let bound = self.bound.map_or(bound, |so_far| looser(so_far, bound));
        Self { bound: Some(bound), counts: self.counts || !disputed }
    }

    pub(super) fn outcome(self) -> Option<f64> {
        self.bound.filter(|_| self.counts)
    }
}
