//! An exponentially weighted mean in integers: α = 2⁻ᵏ is a shift.
//!
//! mean ← mean + (x − mean)·2⁻ᵏ. The sum carries `k` more binary digits than the values: no rounding error accumulates,
//! and the mean reaches a constant input exactly. A small α smooths, a large one adapts; the motion filter derives its
//! gain from stated noise instead, and the score shows both.

/// The mean of a stream of integers (such as µm/s or µs).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ShiftAverage {
    shift: u32,
    /// Mean · 2ᵏ, `None` before the first value.
    scaled_mean: Option<i64>,
}

impl ShiftAverage {
    /// The largest k: 2⁻¹⁶ averages over 65 000 values.
    const LARGEST_SHIFT: u32 = 16;
    /// Values are limited to ±2⁴⁶, so that 16 more digits fit into 63 bits.
    const LARGEST_VALUE: i64 = 1 << 46;

    /// A mean with α = 2⁻ˢʰⁱᶠᵗ; shifts are limited to [`LARGEST_SHIFT`](Self::LARGEST_SHIFT).
    pub(super) const fn new(shift: u32) -> Self {
        let shift = if shift > Self::LARGEST_SHIFT { Self::LARGEST_SHIFT } else { shift };
        Self { shift, scaled_mean: None }
    }

    /// Takes in one value.
    pub(super) const fn take(&mut self, value: i64) {
        let limited = if value > Self::LARGEST_VALUE {
            Self::LARGEST_VALUE
        } else if value < -Self::LARGEST_VALUE {
            -Self::LARGEST_VALUE
        } else {
            value
        };
        match self.scaled_mean {
            None => self.scaled_mean = Some(limited << self.shift),
            Some(mean) => {
                let off = (limited << self.shift) - mean;
                self.scaled_mean = Some(mean + (off >> self.shift));
            }
        }
    }

    /// The mean, rounded down to a whole unit; `None` before the first value.
    pub(super) const fn mean(&self) -> Option<i64> {
        match self.scaled_mean {
            None => None,
            Some(mean) => Some(mean >> self.shift),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_follows_a_step_like_the_formula_in_floating_point() {
        let (mut integer, mut plain) = (ShiftAverage::new(3), 1000.0_f64);
        integer.take(1000);
        for _ in 0..30 {
            integer.take(2000);
            plain += (2000.0 - plain) / 8.0;
            assert!((integer.mean().unwrap() as f64 - plain).abs() <= 8.0);
        }
        // Ten more time constants: the last unit is reached, which a shift without extra digits never does.
        (0..200).for_each(|_| integer.take(2000));
        assert!(integer.mean().unwrap() >= 1999);
    }

    #[test]
    fn no_value_overflows_it() {
        let mut average = ShiftAverage::new(99);
        for value in [i64::MAX, i64::MIN, 0, i64::MAX, i64::MIN] {
            average.take(value);
        }
        assert!(average.mean().is_some_and(|mean| mean.abs() <= ShiftAverage::LARGEST_VALUE));
    }
}
