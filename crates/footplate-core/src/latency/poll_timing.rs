//! The polling period of a link and its jitter, found in the reports themselves.
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

use core::f64::consts::TAU;

use super::poll_rhythm::PollRhythm;
use crate::estimate::Estimate;
use crate::time::{TimeSpan, Timestamp};

/// What is known of the rhythm of a polled link.
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
    /// What is assumed of a link of which nothing is known: five modules polled at 2400 baud, as
    /// published courses measured it (65 to 100 ms, most near 70 ms).
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

/// Gaps kept; a fit over more does not move the period by a microsecond.
const KEPT: usize = 96;
/// Fewest gaps from which a period is stated.
const FEWEST: usize = 8;
/// Gaps longer than this many seconds would need a finer search for nothing.
const LONGEST_GAP_S: f64 = 2.0;
/// Trial periods reach from one module polled alone (13.8 ms on the wire) to a slow host with 31 modules.
const SHORTEST_PERIOD_S: f64 = 0.012;
const LONGEST_PERIOD_S: f64 = 0.3;
/// Trial periods advance by this part of a cycle at the longest gap.
const PHASE_STEP: f64 = 0.15;
/// Gaps line up when `c` reaches this; random ones of `FEWEST` reach 0.95 once in 1400 trials.
const LINED_UP: f64 = 0.95;
/// A longer period is preferred when it lines up this nearly as well as the best.
const NEARLY: f64 = 0.985;

/// Polls are told apart while their doubt is below this part of the period.
const TOLD_APART: i64 = 5;

/// Learns the rhythm of a link from the stamps of its reports.
#[derive(Debug, Clone)]
pub struct PollTimingEstimator {
    gaps_s: [f64; KEPT],
    /// Gaps seen in all; the newest `KEPT` are kept.
    seen: usize,
    last_stamp: Option<Timestamp>,
    fitted: Option<Estimate<TimeSpan>>,
    timing: PollTiming,
    /// The count of gaps at which the rhythm is next fitted anew: it doubles, so the cost stays bounded.
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
    /// The clock starts anew: the gap to the next report means nothing.
    pub fn restart(&mut self) {
        self.last_stamp = None;
    }

    /// A command went before the polls and pushed them back: the gap to the next report is no whole number of
    /// periods.
    pub fn command_sent(&mut self) {
        self.last_stamp = None;
    }

    /// Takes in the stamp of a report of any contact.
    #[inline]
    pub fn report(&mut self, stamp: Timestamp) {
        if let Some(last) = self.last_stamp.replace(stamp) {
            let gap = (stamp - last).as_s();
            // Repeats of one contact come one interval after another and dominate; they say nothing of the
            // idle period, so only every gap with an idle poll in it counts, and one repeat.
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

    /// The rhythm as known so far; [`PollTiming::ASSUMED`] until the reports have shown one.
    #[inline]
    #[must_use]
    pub fn timing(&self) -> PollTiming {
        self.timing
    }

    /// The period with its uncertainty, `None` while no rhythm was found.
    #[must_use]
    pub fn period(&self) -> Option<Estimate<TimeSpan>> {
        self.fitted
    }

    /// The polls to come, as long as a rhythm was found and no command has pushed them since the last report.
    #[inline]
    #[must_use]
    pub fn rhythm(&self) -> Option<PollRhythm> {
        let period = self.fitted?;
        let doubt = period.uncertainty.as_ns().max(1);
        let tolerated = period.value.as_ns() / TOLD_APART - self.timing.jitter.as_ns();
        let next = self.last_stamp? + self.timing.after_report;
        Some(PollRhythm { next, period: period.value, reaches: tolerated / doubt })
    }

    /// Fits the rhythm to the gaps kept, now instead of at the next doubling.
    pub fn fit(&mut self, date: Timestamp) {
        let gaps = &self.gaps_s[..self.seen.min(KEPT)];
        if gaps.len() < FEWEST {
            return;
        }
        let Some(rough) = longest_aligned_period(gaps) else { return };
        let (period, offset, jitter, uncertainty) = refined(gaps, rough);
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

/// `c(p)` of the legend, and the mean phase in cycles.
fn alignment(gaps: &[f64], period: f64) -> (f64, f64) {
    let (mut x, mut y) = (0.0, 0.0);
    for gap in gaps {
        let (sin, cos) = libm::sincos(TAU * (gap / period));
        x += cos;
        y += sin;
    }
    (libm::hypot(x, y) / gaps.len() as f64, libm::atan2(y, x) / TAU)
}

fn longest_aligned_period(gaps: &[f64]) -> Option<f64> {
    let longest_gap = gaps.iter().fold(0.0_f64, |longest, gap| longest.max(*gap));
    let trials = || {
        core::iter::successors(Some(LONGEST_PERIOD_S), move |p| {
            Some(p - PHASE_STEP * p * p / longest_gap).filter(|p| *p >= SHORTEST_PERIOD_S)
        })
    };
    let best = trials().map(|p| alignment(gaps, p).0).fold(0.0, f64::max);
    if best < LINED_UP * 0.9 {
        return None;
    }
    // Climb to the top of the first (longest) hill that is nearly as high as the highest.
    for trial in trials() {
        if alignment(gaps, trial).0 < best * 0.8 {
            continue;
        }
        let mut step = PHASE_STEP * trial * trial / longest_gap;
        let (mut top, mut height) = (trial, alignment(gaps, trial).0);
        while step > 1e-9 {
            let tries = [top - step, top + step].map(|p| (p, alignment(gaps, p).0));
            match tries.into_iter().find(|(_, c)| *c > height) {
                Some((p, c)) => (top, height) = (p, c),
                None => step *= 0.5,
            }
        }
        if height >= LINED_UP && height >= best * NEARLY {
            return Some(top);
        }
    }
    None
}

/// Regression of the gaps on their number of periods: period, offset, residual deviation and the standard
/// error of the period, all in seconds.
fn refined(gaps: &[f64], rough: f64) -> (f64, f64, f64, f64) {
    let count = gaps.len() as f64;
    let offset = alignment(gaps, rough).1 * rough;
    let periods = |gap: f64| libm::round((gap - offset) / rough);
    let mean_n = gaps.iter().map(|g| periods(*g)).sum::<f64>() / count;
    let mean_g = gaps.iter().sum::<f64>() / count;
    let (mut nn, mut ng) = (0.0, 0.0);
    for gap in gaps {
        let n = periods(*gap) - mean_n;
        nn += n * n;
        ng += n * (gap - mean_g);
    }
    if nn <= 0.0 {
        return (rough, offset, 0.0, rough);
    }
    let period = ng / nn;
    let offset = mean_g - period * mean_n;
    let squares: f64 = gaps.iter().map(|g| g - offset - period * periods(*g)).map(|e| e * e).sum();
    let deviation = libm::sqrt(squares / (count - 2.0));
    (period, offset, deviation, deviation / libm::sqrt(nn))
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
}
