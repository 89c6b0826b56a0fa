//! Gaps between reports as whole numbers of poll periods: `gap = offset + n · period`.

use core::f64::consts::TAU;

/// The straight line through gaps over their number of periods, in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PollRegression {
    /// From poll to poll.
    pub(super) period: f64,
    /// What the first period after a report is longer.
    pub(super) offset: f64,
    /// Standard deviation of a gap about the line.
    pub(super) jitter: f64,
    /// Standard error of the period.
    pub(super) uncertainty: f64,
}

impl PollRegression {
    /// Through these gaps, at least three, with a rough period that counts them right.
    pub(super) fn of(gaps: &[f64], rough: f64) -> Self {
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
            return Self { period: rough, offset, jitter: 0.0, uncertainty: rough };
        }
        let period = ng / nn;
        let offset = mean_g - period * mean_n;
        let squares: f64 = gaps.iter().map(|g| g - offset - period * periods(*g)).map(|e| e * e).sum();
        let jitter = libm::sqrt(squares / (count - 2.0));
        Self { period, offset, jitter, uncertainty: jitter / libm::sqrt(nn) }
    }
}

/// How well gaps line up at a period (1 for perfectly), and the mean phase in cycles.
pub(super) fn alignment(gaps: &[f64], period: f64) -> (f64, f64) {
    let (mut x, mut y) = (0.0, 0.0);
    for gap in gaps {
        let (sin, cos) = libm::sincos(TAU * (gap / period));
        x += cos;
        y += sin;
    }
    (libm::hypot(x, y) / gaps.len() as f64, libm::atan2(y, x) / TAU)
}
