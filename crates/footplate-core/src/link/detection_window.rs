//! The interval of a detection, from one report.

use super::poll_timing::PollTiming;
use crate::time::{TimeSpan, Timestamp};

/// The interval of a detection: the sensor was free at `after` and occupied at `until`.
///
/// Both are stamps of the host. The time from the reading on the station to the stamp (φ in the literature)
/// is the same for every report of a link, so it cancels in every difference of reports and is not subtracted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DetectionWindow {
    /// Stamp of the last reading of the free sensor.
    pub after: Timestamp,
    /// Stamp of the first reading of the occupied sensor: the report.
    pub until: Timestamp,
}

impl DetectionWindow {
    /// The window of a report stamped `stamp`: the recorded interval if the host kept one; otherwise the interval
    /// after a reporting or an idle poll, by the time since the last report of any sensor.
    pub fn of_report(
        stamp: Timestamp,
        recorded_interval: Option<TimeSpan>,
        last_report: Option<Timestamp>,
        timing: PollTiming,
    ) -> Self {
        let interval = recorded_interval.unwrap_or_else(|| match last_report {
            Some(last) if stamp - last < timing.after_report_and_half() => timing.after_report,
            _ => timing.period,
        });
        Self { after: stamp - interval.abs(), until: stamp }
    }

    /// Its middle, the mean time of detection.
    #[inline]
    #[must_use]
    pub fn middle(self) -> Timestamp {
        self.after + TimeSpan::from_ns(self.width().as_ns() / 2)
    }

    /// Its length, the poll interval.
    #[inline]
    #[must_use]
    pub fn width(self) -> TimeSpan {
        self.until - self.after
    }

    /// The variance in s² of the time of detection, which is uniform in the window: width² / 12.
    #[inline]
    #[must_use]
    pub fn variance_s2(self) -> f64 {
        let width = self.width().as_s();
        width * width / 12.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMING: PollTiming = PollTiming {
        period: TimeSpan::from_us(61_400),
        after_report: TimeSpan::from_us(65_350),
        jitter: TimeSpan::from_us(50),
    };

    #[test]
    fn the_interval_after_a_reporting_poll_is_the_longer_one() {
        let stamp = Timestamp::from_s(10.0);
        let width = |last: f64| {
            DetectionWindow::of_report(stamp, None, Some(Timestamp::from_s(last)), TIMING).width()
        };
        assert_eq!(width(10.0 - 0.06535), TimeSpan::from_us(65_350));
        assert_eq!(width(9.0), TimeSpan::from_us(61_400));
        let recorded = DetectionWindow::of_report(stamp, Some(TimeSpan::from_ms(80)), None, TIMING);
        assert_eq!(recorded.width(), TimeSpan::from_ms(80));
        assert_eq!(recorded.middle(), Timestamp::from_s(9.96));
    }
}
