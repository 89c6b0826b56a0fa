//! The polls of a link: their period and jitter, estimated from the reports, and the next ones.
//!
//! Polls that report nothing leave no trace, but every report is stamped by a poll, so the gaps between
//! reports are whole numbers of periods: `gap = offset + n · period`. The poll that follows a reporting one
//! may come later (the host handles the report first), which is the offset. The period is the longest that
//! makes all gaps line up (a shorter one, its half or third, lines them up as well).
//!
//! Letters: `g` gap, `p` trial period, `c(p) = |mean e^(2πi g/p)|` how well gaps line up (Rayleigh's
//! statistic, 1 for perfectly), `n` periods in a gap.
#![expect(
    clippy::indexing_slicing,
    reason = "indices stay below the named capacities and lengths beside them"
)]

use super::period_search::{
    LINED_UP, LONGEST_GAP_S, MOST_GAPS, PollRegression, SHORTEST_PERIOD_S, alignment, longest_aligned_period,
};
use crate::estimate::Estimate;
use crate::time::{TimeSpan, Timestamp};

/// The timing of a polled link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PollTiming {
    /// From one reading to the next when nothing was reported.
    pub period: TimeSpan,
    /// From a reading that reported something to the next.
    pub after_report: TimeSpan,
    /// One standard deviation of a poll about its place in the rhythm.
    pub jitter: TimeSpan,
}

impl PollTiming {
    /// The default for an unknown link: five modules polled at 2400 baud, as published courses measured it
    /// (65 to 100 ms, most near 70 ms).
    pub const ASSUMED: Self = Self {
        period: TimeSpan::from_ms(70),
        after_report: TimeSpan::from_ms(70),
        jitter: TimeSpan::from_ms(1),
    };

    /// Beyond this time since a report, at least one poll in between saw nothing.
    #[must_use]
    pub fn after_report_and_half(self) -> TimeSpan {
        self.after_report + TimeSpan::from_ns(self.period.as_ns() / 2)
    }
}

/// The predicted polls after the last report.
///
/// A sensor is reported by the first poll after it was occupied. A report can therefore be predicted better than the
/// detection: it is stamped by a poll, and polls follow one another regularly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PollRhythm {
    /// The first poll after the last report.
    next: Timestamp,
    /// From poll to poll while nothing is reported.
    period: TimeSpan,
    /// Beyond this many polls the uncertainty of the period has grown to a fifth of it, and neighbouring polls can no
    /// longer be distinguished.
    reaches: i64,
}

impl PollRhythm {
    /// The first poll not before a time; `None` if it can no longer be predicted.
    #[inline]
    #[must_use]
    pub fn poll_after(self, time: Timestamp) -> Option<Timestamp> {
        let ahead = (time - self.next).as_ns();
        let period = self.period.as_ns();
        if period <= 0 {
            return None;
        }
        // Rounded up: a detection between two polls waits for the later one.
        let polls = ahead.max(0).saturating_add(period - 1) / period;
        (polls <= self.reaches).then(|| self.next + TimeSpan::from_ns(polls * period))
    }
}

/// Gaps kept; a fit over more does not move the period by a microsecond.
const KEPT: usize = MOST_GAPS;
/// Fewest gaps from which a period is stated.
const FEWEST: usize = 8;
/// A period found in this many gaps is only refined as long as gaps line up at it; the search for another one
/// costs a hundred times more.
const CONFIRMED: u32 = 16;
/// Polls are distinguished while their uncertainty is below this part of the period.
const DISTINGUISHED: i64 = 5;

/// Learns the rhythm of a link from the stamps of its reports.
#[derive(Debug, Clone)]
pub struct PollTimingEstimator {
    gaps_s: [f64; KEPT],
    /// Gaps seen in all; the newest `KEPT` are kept.
    seen: usize,
    last_stamp: Option<Timestamp>,
    fitted: Option<Estimate<TimeSpan>>,
    timing: PollTiming,
    /// The number of gaps at which the rhythm is fitted again: it doubles, so that the cost stays bounded.
    next_fit: usize,
}

impl Default for PollTimingEstimator {
    fn default() -> Self {
        Self {
            gaps_s: [0.0; KEPT],
            seen: 0,
            last_stamp: None,
            fitted: None,
            timing: PollTiming::ASSUMED,
            next_fit: FEWEST,
        }
    }
}

impl PollTimingEstimator {
    /// The clock was restarted: the gap to the next report is meaningless.
    pub fn restart(&mut self) {
        self.last_stamp = None;
    }

    /// A command delayed the polls: the gap to the next report is no whole number of
    /// periods.
    pub fn command_sent(&mut self) {
        self.last_stamp = None;
    }

    /// Adds the stamp of a report of any sensor.
    #[inline]
    pub fn report(&mut self, stamp: Timestamp) {
        if let Some(last) = self.last_stamp.replace(stamp) {
            let gap = (stamp - last).as_s();
            // Repeats of one sensor come one interval after another and dominate, but contain no information about
            // the idle period: only every gap with an idle poll in it counts, and one repeat.
            if gap > SHORTEST_PERIOD_S && gap < LONGEST_GAP_S && gap > 1.5 * self.timing.after_report.as_s() {
                self.gaps_s[self.seen % KEPT] = gap;
                self.seen += 1;
                if self.seen >= self.next_fit {
                    self.next_fit = self.seen * 2;
                    self.fit(stamp);
                }
            }
        }
    }

    /// The rhythm known so far; [`PollTiming::ASSUMED`] until the reports have shown one.
    #[inline]
    pub fn timing(&self) -> PollTiming {
        self.timing
    }

    /// The period with its uncertainty, `None` while no rhythm was found.
    pub fn period(&self) -> Option<Estimate<TimeSpan>> {
        self.fitted
    }

    /// The next polls, if a rhythm was found and no command has delayed them since the last report.
    #[inline]
    pub fn rhythm(&self) -> Option<PollRhythm> {
        let period = self.fitted?;
        let uncertainty = period.uncertainty.as_ns().max(1);
        let tolerated = period.value.as_ns() / DISTINGUISHED - self.timing.jitter.as_ns();
        let next = self.last_stamp? + self.timing.after_report;
        Some(PollRhythm { next, period: period.value, reaches: tolerated / uncertainty })
    }

    /// Fits the rhythm to the gaps kept, now instead of at the next doubling.
    pub fn fit(&mut self, date: Timestamp) {
        let gaps = &self.gaps_s[..self.seen.min(KEPT)];
        if gaps.len() < FEWEST {
            return;
        }
        let lines_up = |period: &f64| alignment(gaps, *period).0 >= LINED_UP;
        let confirmed = self.fitted.filter(|fitted| fitted.count >= CONFIRMED);
        let known = confirmed.map(|fitted| fitted.value.as_s()).filter(lines_up);
        let Some(rough) = known.or_else(|| longest_aligned_period(gaps)) else { return };
        let PollRegression { period, offset, jitter, uncertainty } = PollRegression::of(gaps, rough);
        self.timing = PollTiming {
            period: TimeSpan::from_s(period),
            after_report: TimeSpan::from_s(period + offset),
            jitter: TimeSpan::from_s(jitter),
        };
        self.fitted = Some(Estimate {
            value: TimeSpan::from_s(period),
            uncertainty: TimeSpan::from_s(uncertainty),
            count: gaps.len() as u32,
            date,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    /// A deterministic spread of poll counts, far from regular.
    fn counts() -> impl Iterator<Item = i64> {
        (1..40_i64).map(|i| 3 + (i * i * 7 + i) % 23)
    }

    #[test]
    fn the_idle_period_is_found_behind_a_longer_interval_after_reports() {
        // Given polls every 61.4 ms that come 3.95 ms later after a report,
        let mut estimator = PollTimingEstimator::default();
        let mut stamp = Timestamp::ZERO;
        for n in counts() {
            stamp += TimeSpan::from_us(3_950 + 61_400 * n);
            estimator.report(stamp);
        }
        // then both are found from the reports alone.
        estimator.fit(stamp);
        assert!((estimator.timing().period - TimeSpan::from_us(61_400)).abs() < TimeSpan::from_us(2));
        assert!((estimator.timing().after_report - TimeSpan::from_us(65_350)).abs() < TimeSpan::from_us(20));
    }

    #[test]
    fn pushed_reports_have_no_period() {
        let mut estimator = PollTimingEstimator::default();
        let mut stamp = Timestamp::ZERO;
        let mut state = 1_u64;
        for _ in 0..60 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            stamp += TimeSpan::from_ns(200_000_000 + (state >> 34) as i64);
            estimator.report(stamp);
        }
        estimator.fit(stamp);
        assert_eq!(estimator.period(), None);
        assert_eq!(estimator.timing(), PollTiming::ASSUMED);
    }

    #[test]
    fn no_stamps_upset_it() {
        let mut estimator = PollTimingEstimator::default();
        let stamps: Vec<i64> =
            alloc::vec![0, 0, -5, i64::MAX, i64::MIN, 100_000_000, 200_000_000, 300_000_000];
        for ns in stamps.iter().cycle().take(200) {
            estimator.report(Timestamp::from_ns(*ns));
        }
        estimator.fit(Timestamp::ZERO);
        assert!(estimator.timing().period > TimeSpan::ZERO);
    }

    #[test]
    fn a_detection_waits_for_the_next_poll() {
        let rhythm = PollRhythm { next: Timestamp::from_s(1.0), period: TimeSpan::from_ms(60), reaches: 100 };
        assert_eq!(rhythm.poll_after(Timestamp::ZERO), Some(Timestamp::from_s(1.0)));
        assert_eq!(rhythm.poll_after(Timestamp::from_s(1.0)), Some(Timestamp::from_s(1.0)));
        assert_eq!(rhythm.poll_after(Timestamp::from_s(1.001)), Some(Timestamp::from_s(1.06)));
        assert_eq!(rhythm.poll_after(Timestamp::from_s(100.0)), None);
    }
}
