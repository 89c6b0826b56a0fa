//! Measured times from requests to answers on a line, and their effect on the time model of a link.
//!
//! A station's [`TimeModel`] applies to a line as fast as the one that it was measured on. A slow network delays
//! commands and reports alike; a lossy one makes some commands wait until they are repeated.

use crate::link::TimeModel;
use crate::time::TimeSpan;

/// With fewer answers, the 1 % quantile is not estimated (chosen).
const FEWEST: usize = 50;
/// The share of answers within the longest usual time.
const WITHIN: f64 = 0.99;
/// The share of commands that may need more repeats than allowed for.
const BEYOND: f64 = 1e-3;

/// A line as a station's time model assumes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UsualLine {
    /// The longest time to an answer that is usual.
    pub answers_within: TimeSpan,
    /// When a request without an answer is repeated.
    pub repeated_after: TimeSpan,
}

/// The times from requests to answers on a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RoundTrips {
    /// Requests that were answered.
    pub answered: u32,
    /// Requests that were not.
    pub lost: u32,
    /// The shortest time to an answer.
    pub shortest: TimeSpan,
    /// The median.
    pub median: TimeSpan,
    /// The time within which 99 of 100 answers come.
    pub longest_usual: TimeSpan,
    /// The longest.
    pub longest: TimeSpan,
}

impl RoundTrips {
    /// The figures of times in ascending order; `None` if there are fewer than 50.
    pub fn of(sorted: &[TimeSpan], lost: u32) -> Option<Self> {
        let at = |share: f64| {
            let last = sorted.len().saturating_sub(1);
            sorted.get(libm::round(share * last as f64) as usize).copied()
        };
        let answered = u32::try_from(sorted.len()).ok().filter(|_| sorted.len() >= FEWEST)?;
        let [shortest, median, longest_usual, longest] = [at(0.0)?, at(0.5)?, at(WITHIN)?, at(1.0)?];
        Some(Self { answered, lost, shortest, median, longest_usual, longest })
    }

    /// The share of requests that were not answered.
    pub fn lost_share(&self) -> f64 {
        f64::from(self.lost) / f64::from((self.answered + self.lost).max(1))
    }

    /// How much later than on a usual line an answer may come: no command and no report is delayed by more, as either
    /// is a part of it.
    pub fn excess(&self, usual: UsualLine) -> TimeSpan {
        (self.longest_usual - usual.answers_within).max(TimeSpan::ZERO)
    }

    /// How often a command is repeated until all but one in a thousand are answered.
    pub fn repeats(&self) -> u32 {
        let lost = self.lost_share();
        if lost <= BEYOND {
            return 0;
        }
        let tries = libm::ceil(libm::log(BEYOND) / libm::log(lost.min(0.9)));
        (tries as u32).saturating_sub(1)
    }
}

impl TimeModel {
    /// The times of the link over a line that was measured.
    #[must_use]
    pub fn over(self, line: &RoundTrips, usual: UsualLine) -> Self {
        let excess = line.excess(usual);
        let repeated = TimeSpan::from_ns(usual.repeated_after.as_ns() * i64::from(line.repeats()));
        Self {
            soonest: self.soonest + excess + repeated,
            reaction: self.reaction + excess + excess + repeated,
            report_window: self.report_window + excess,
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const USUAL: UsualLine =
        UsualLine { answers_within: TimeSpan::from_ms(10), repeated_after: TimeSpan::from_ms(100) };

    fn line(longest_ms: i64, lost: u32) -> RoundTrips {
        let times: alloc::vec::Vec<TimeSpan> =
            (0..100).map(|nth| TimeSpan::from_us(2_000 + 10 * (longest_ms - 2) * nth)).collect();
        RoundTrips::of(&times, lost).unwrap()
    }

    #[test]
    fn a_usual_line_changes_nothing() {
        let model = TimeModel::default();
        assert_eq!(model.over(&line(8, 0), USUAL), model);
        assert_eq!(RoundTrips::of(&[TimeSpan::from_ms(1); 49], 0), None);
    }

    #[test]
    fn a_slow_and_lossy_line_delays_commands_and_reports() {
        let (model, slow) = (TimeModel::default(), line(82, 0));
        let excess = slow.excess(USUAL);
        assert!((excess - TimeSpan::from_ms(71)).abs() < TimeSpan::from_ms(2), "{excess:?}");
        assert_eq!(model.over(&slow, USUAL).report_window, model.report_window + excess);
        // One request in twenty is lost: two repeats leave one in eight thousand, none one in twenty.
        let lossy = line(8, 5);
        assert_eq!(lossy.repeats(), 2);
        assert_eq!(model.over(&lossy, USUAL).soonest, model.soonest + TimeSpan::from_ms(200));
        assert_eq!(model.over(&lossy, USUAL).command, model.command);
    }
}
