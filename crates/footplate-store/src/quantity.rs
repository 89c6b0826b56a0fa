//! A number as it travels in files.

use core::fmt;

use footplate_core::{Estimate, Length, Speed, TimeSpan};
use serde::{Deserialize, Serialize};

/// A measured number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Quantity {
    /// The best value.
    pub value: f64,
    /// One standard deviation.
    pub uncertainty: f64,
    /// The unit of both.
    pub unit: String,
    /// Measurements behind it.
    pub measurements: u32,
    /// When the newest of them was made, in seconds since the Unix epoch, where the recording tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured_at_s: Option<f64>,
}

/// As `179 ± 12 mm/s²`: two digits of the uncertainty, at most three behind the point.
impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = [10.0, 1.0, 0.1].iter().take_while(|place| self.uncertainty < **place).count();
        write!(f, "{:.digits$} ± {:.digits$} {}", self.value, self.uncertainty, self.unit)
    }
}

impl Quantity {
    /// A number of which no date is known.
    pub fn new(unit: &str, value: f64, uncertainty: f64, measurements: u32) -> Self {
        Self { value, uncertainty, unit: unit.to_owned(), measurements, measured_at_s: None }
    }

    pub(crate) fn speed(speed: Estimate<Speed>) -> Self {
        Self::new("mm/s", speed.value.as_mm_per_s(), speed.uncertainty.as_mm_per_s(), speed.count)
    }

    pub(crate) fn length(value: Length, uncertainty: Length, measurements: u32) -> Self {
        Self::new("mm", value.as_mm(), uncertainty.as_mm(), measurements)
    }

    pub(crate) fn milliseconds(time: Estimate<TimeSpan>) -> Self {
        Self::new("ms", time.value.as_ms(), time.uncertainty.as_ms(), time.count)
    }

    /// The same, whose newest measurement was made then.
    #[must_use]
    pub(crate) fn dated(self, measured_at_s: Option<f64>) -> Self {
        Self { measured_at_s, ..self }
    }
}
