//! The smallest and largest of the last few values: what was seen lately, not ever.
//!
//! Extremes of all time do not follow a train that slows down as it gets dirty.

/// The last `N` values of a stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecentExtremes<const N: usize> {
    values: [f64; N],
    seen: usize,
}

impl<const N: usize> Default for RecentExtremes<N> {
    fn default() -> Self {
        Self { values: [0.0; N], seen: 0 }
    }
}

impl<const N: usize> RecentExtremes<N> {
    /// Takes in one value; NaN is no value.
    pub fn take(&mut self, value: f64) {
        if value.is_nan() {
            return;
        }
        if let Some(place) = self.values.get_mut(self.seen % N.max(1)) {
            *place = value;
            self.seen += 1;
        }
    }

    /// Smallest and largest of the last `N` values; `None` before the first.
    #[must_use]
    pub fn range(&self) -> Option<(f64, f64)> {
        let (first, rest) = self.values.get(..self.seen.min(N))?.split_first()?;
        Some(rest.iter().fold((*first, *first), |(low, high), value| (low.min(*value), high.max(*value))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_extremes_are_forgotten() {
        let mut recent = RecentExtremes::<4>::default();
        assert_eq!(recent.range(), None);
        for value in [900.0, 10.0, 5.0, 6.0, f64::NAN, 7.0, 8.0] {
            recent.take(value);
        }
        assert_eq!(recent.range(), Some((5.0, 8.0)));
    }
}
