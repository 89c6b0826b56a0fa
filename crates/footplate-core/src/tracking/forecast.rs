//! When and where the next report is due, as a distribution.

use crate::ids::SensorId;
use crate::link::UniformNormal;
use crate::time::{TimeSpan, Timestamp};
use crate::units::{Length, Speed};

/// What the train is doing before the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum ForecastPhase {
    /// Runs at a settled speed over a hop that it has passed before.
    Steady,
    /// Runs at a settled speed over a hop that it passes for the first time, or at a step it has not run at.
    FirstLap,
    /// Starts from rest or changes speed before it.
    Change,
}

/// The forecast of one report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forecast {
    /// The sensor.
    pub sensor: SensorId,
    /// Mean time of the report, wherever polls may be: the mean time of the detection and half a poll interval.
    /// Intervals lie about it.
    pub time: Timestamp,
    /// The poll that will report it if it closes when it is due, where the rhythm of polls is known; otherwise
    /// the mean time again. The best single estimate of the stamp: a report comes at a poll, not between two.
    pub report: Timestamp,
    /// How the report scatters about the mean time, in seconds: the uncertainty of the motion and the uniform poll.
    pub spread: UniformNormal,
    /// The speed at which the train will pass it.
    pub speed: Speed,
    /// What the train does before it.
    pub phase: ForecastPhase,
}

impl Forecast {
    /// The central interval that holds the report with probability `level`.
    pub fn interval(&self, level: f64) -> (Timestamp, Timestamp) {
        let half = TimeSpan::from_s(self.spread.half_width(level));
        (self.time - half, self.time + half)
    }

    /// How much later than the poll that was expected to report it a report came.
    #[inline]
    pub fn error(&self, report: Timestamp) -> TimeSpan {
        report - self.report
    }

    /// How much later than the mean time a report came: the error of the motion, with that of the poll in it.
    #[inline]
    pub fn detection_error(&self, report: Timestamp) -> TimeSpan {
        report - self.time
    }

    /// The same in millimetres: how far beyond the forecast place the train was, negative when it
    /// was short of it.
    #[inline]
    pub fn place_error(&self, report: Timestamp) -> Length {
        self.speed * self.error(report)
    }

    /// The probability that was given to a report no later than this one. Over many forecasts it is uniform
    /// between 0 and 1 when the stated intervals are true.
    #[inline]
    pub fn probability_by(&self, report: Timestamp) -> f64 {
        self.spread.cdf(self.detection_error(report).as_s())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_holds_what_it_says() {
        let forecast = Forecast {
            sensor: SensorId(3),
            time: Timestamp::from_s(10.0),
            report: Timestamp::from_s(10.0),
            spread: UniformNormal { deviation: 0.01, width: 0.07 },
            speed: Speed::from_mm_per_s(400.0),
            phase: ForecastPhase::Steady,
        };
        let (low, high) = forecast.interval(0.9);
        let held = forecast.probability_by(high) - forecast.probability_by(low);
        assert!((held - 0.9).abs() < 1e-6);
        let late = Timestamp::from_s(10.05);
        assert_eq!(forecast.error(late), TimeSpan::from_ms(50));
        assert!((forecast.place_error(late).as_mm() - 20.0).abs() < 1e-9);
    }
}
