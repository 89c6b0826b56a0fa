//! Bounds of the speed from an accelerometer alone.
//!
//! The reading is the acceleration plus a bias between bounds plus gravity on a gradient between bounds. While the wheels
//! bound the speed, the change of speed and the sum of the readings over a stretch bound the bias; stretches are
//! intersected, so that the bias is known ever better, and widened with time, because it wanders. Gradients are not learnt: the
//! next one may be the steepest of the line in a second.

use crate::time::TimeSpan;
use crate::units::{Acceleration, Speed};

/// Readings of a shorter stretch are not held against the wheels (s): the bounds of the wheels, some 0.3 m/s at both ends, say
/// nothing beside a gradient of 10 mm/m.
const SHORTEST_STRETCH_S: f64 = 5.0;
/// After so long a new stretch begins (s). Chosen: what the bias may have wandered since is then half a gradient.
const LONGEST_STRETCH_S: f64 = 120.0;
const MINUTE_S: f64 = 60.0;

/// What is assumed of an accelerometer and of the line. Bounds, not standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InertialLimits {
    /// The magnitude of the bias is never larger, gravity on a sensor that is not level included.
    pub bias: Acceleration,
    /// The bias changes by no more than this in a minute, and by its part in less.
    pub bias_in_a_minute: Acceleration,
    /// Gravity on the steepest gradient of the line: ±0.1 m/s² for each 10 mm/m.
    pub gradient: Acceleration,
    /// Largest integral of vibration and noise over any stretch, positive or negative.
    pub vibration: Speed,
}

impl Default for InertialLimits {
    /// A bias of 0.5 m/s² (three degrees of misalignment alone) that changes by 0.03 m/s² a minute; gradients of 12 mm/m as on a
    /// high-speed line; and 0.9 m/s for vibration: five times what white noise of 0.1 m/s² at 20 readings a second adds up
    /// to in a minute.
    fn default() -> Self {
        Self {
            bias: Acceleration::from_m_per_s2(0.5),
            bias_in_a_minute: Acceleration::from_m_per_s2(0.03),
            gradient: Acceleration::from_m_per_s2(0.12),
            vibration: Speed::from_m_per_s(0.9),
        }
    }
}

/// Bounds of the speed, and of the bias behind them.
#[derive(Debug, Clone, PartialEq)]
pub struct InertialBounds {
    limits: InertialLimits,
    bias: [f64; 2],
    speed: Option<[f64; 2]>,
    stretch: Option<Stretch>,
}

/// Readings since the wheels bounded the speed at its start.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stretch {
    start: [f64; 2],
    read: f64,
    lasted: f64,
}

impl InertialBounds {
    /// Nothing is known of the speed, and of the bias what the limits say.
    #[must_use]
    pub fn new(limits: InertialLimits) -> Self {
        let bias = limits.bias.as_m_per_s2();
        Self { limits, bias: [-bias, bias], speed: None, stretch: None }
    }

    /// Carries the bounds over a span in which this was read in the mean. Without a reading nothing is known of the speed
    /// until wheels bound it again.
    pub fn predict(&mut self, span: TimeSpan, reading: Option<Acceleration>) {
        let t = span.as_s();
        if t <= 0.0 {
            return;
        }
        let widest = self.limits.bias.as_m_per_s2();
        let wandered = self.limits.bias_in_a_minute.as_m_per_s2() * t / MINUTE_S;
        let [low, high] = self.bias;
        self.bias = [(low - wandered).max(-widest), (high + wandered).min(widest)];
        let Some(z) = reading.map(Acceleration::as_m_per_s2).filter(|z| z.is_finite()) else {
            self.speed = None;
            self.stretch = None;
            return;
        };
        let gradient = self.limits.gradient.as_m_per_s2();
        let [low, high] = self.bias;
        if let Some([slowest, fastest]) = self.speed {
            self.speed = Some([slowest + (z - high - gradient) * t, fastest + (z - low + gradient) * t]);
        }
        if let Some(stretch) = &mut self.stretch {
            stretch.read += z * t;
            stretch.lasted += t;
        }
    }

    /// Takes in bounds of the speed that hold for certain, by wheels that roll or because the train stands; one of them may
    /// be infinite, as a sliding wheel bounds the speed from below only. `false` when they contradict these: then one of the
    /// assumptions is wrong, and the wheels count.
    pub fn hold(&mut self, low: Speed, high: Speed) -> bool {
        let [low, high] = [low, high].map(Speed::as_m_per_s);
        if !(low <= high && low < f64::INFINITY && high > f64::NEG_INFINITY) {
            return true;
        }
        let agrees = self.learn([low, high]);
        let both =
            self.spread().map_or([low, high], |[slowest, fastest]| [slowest.max(low), fastest.min(high)]);
        let [slowest, fastest] = both;
        if slowest <= fastest && agrees {
            self.speed = Some(both);
            return true;
        }
        *self = Self { speed: Some([low, high]), ..Self::new(self.limits) };
        false
    }

    /// Between which bounds the speed lies; `None` when nothing bounds it.
    #[must_use]
    pub fn speed(&self) -> Option<[Speed; 2]> {
        self.spread().map(|speed| speed.map(Speed::from_m_per_s))
    }

    /// Between which bounds the bias lies.
    #[must_use]
    pub fn bias(&self) -> [Acceleration; 2] {
        self.bias.map(Acceleration::from_m_per_s2)
    }

    /// The sum of the readings since the wheels last bounded the speed, with what vibration may have added.
    fn spread(&self) -> Option<[f64; 2]> {
        let vibration = self.limits.vibration.as_m_per_s();
        self.speed.map(|[slowest, fastest]| [slowest - vibration, fastest + vibration])
    }

    /// Learns the bias from the stretch so far. `false` when no bias explains it.
    fn learn(&mut self, [low, high]: [f64; 2]) -> bool {
        let stretch = self.stretch;
        if stretch.is_none_or(|stretch| stretch.lasted > LONGEST_STRETCH_S) && (high - low).is_finite() {
            self.stretch = Some(Stretch { start: [low, high], read: 0.0, lasted: 0.0 });
        }
        let Some(Stretch { start: [start_low, start_high], read, lasted }) = stretch else { return true };
        if lasted < SHORTEST_STRETCH_S {
            return true;
        }
        let vibration = self.limits.vibration.as_m_per_s();
        // The mean of the bias over the stretch; it may have wandered since.
        let beside = self.limits.gradient.as_m_per_s2()
            + self.limits.bias_in_a_minute.as_m_per_s2() * lasted / MINUTE_S;
        let least = (read - vibration - (high - start_low)) / lasted - beside;
        let most = (read + vibration - (low - start_high)) / lasted + beside;
        let [bias_low, bias_high] = self.bias;
        let both = [bias_low.max(least), bias_high.min(most)];
        let [bias_low, bias_high] = both;
        if bias_low <= bias_high {
            self.bias = both;
        }
        bias_low <= bias_high
    }
}
