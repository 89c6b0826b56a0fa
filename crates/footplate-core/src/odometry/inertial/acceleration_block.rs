//! Readings of an accelerometer, gathered into blocks of a tenth of a second.
//!
//! What watches an accelerometer then works the same at 20 readings a second and at 1000, in the same memory.

use crate::time::Timestamp;
use crate::units::Acceleration;

/// How long a block lasts (s). Chosen: short beside the jerk of a stop (half a second), long beside a reading.
pub(super) const BLOCK_S: f64 = 0.1;

/// The readings of a tenth of a second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AccelerationBlock {
    /// The time of its last reading.
    pub end: Timestamp,
    /// From the last reading of the block before (s).
    pub(super) lasted: f64,
    /// Mean acceleration along the track, as it is integrated (m/s²).
    pub(super) along: f64,
    /// Mean readings of the three axes (m/s²).
    pub(super) axes: [f64; 3],
    /// Variance of the readings around their means, summed over the axes ((m/s²)²).
    pub(super) variance: f64,
}

/// Gathers readings.
#[derive(Debug, Clone, Default)]
pub struct BlockAverage {
    start: Option<Timestamp>,
    readings: f64,
    along: f64,
    axes: [f64; 3],
    squares: f64,
}

impl BlockAverage {
    /// Takes in the readings of the three axes and the acceleration along the track that follows from them; gives the block
    /// that they complete. What is no number, and a time that does not go on, is left out.
    pub fn take(
        &mut self,
        time: Timestamp,
        axes: [Acceleration; 3],
        along: Acceleration,
    ) -> Option<AccelerationBlock> {
        if !along.is_finite() || !axes.iter().all(|axis| axis.is_finite()) {
            return None;
        }
        let Some(start) = self.start else {
            self.start = Some(time);
            return None;
        };
        if time <= start {
            return None;
        }
        self.readings += 1.0;
        self.along += along.as_m_per_s2();
        for (sum, axis) in self.axes.iter_mut().zip(axes) {
            let axis = axis.as_m_per_s2();
            *sum += axis;
            self.squares += axis * axis;
        }
        let lasted = (time - start).as_s();
        // A thousandth of a block earlier: readings do not come on the nanosecond.
        if lasted < BLOCK_S * 0.999 {
            return None;
        }
        let axes = self.axes.map(|sum| sum / self.readings);
        let means: f64 = axes.iter().map(|axis| axis * axis).sum();
        let block = AccelerationBlock {
            end: time,
            lasted,
            along: self.along / self.readings,
            axes,
            variance: (self.squares / self.readings - means).max(0.0),
        };
        *self = Self { start: Some(time), ..Self::default() };
        Some(block)
    }
}
