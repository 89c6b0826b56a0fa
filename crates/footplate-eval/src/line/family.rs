//! Figures over many runs: the median and the worst.

use footplate_store::odometry::{OdometryScore, RunScores};

use super::scored_run::{FalseFlags, Odometer, ScoredRun};

/// Runs that are judged together.
pub(crate) struct Family<'r> {
    pub(crate) name: String,
    runs: Vec<&'r ScoredRun>,
    /// The periods of all runs together.
    whole: Option<RunScores>,
    flags: FalseFlags,
}

/// A figure over runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spread {
    /// Half of the runs are better.
    pub(crate) median: f64,
    /// The largest.
    pub(crate) worst: f64,
}

/// Figures of an odometer on a family. Shares are over all periods of all runs, unless they name runs.
pub(crate) struct Figures {
    pub(crate) speed_rms_m_s: Option<Spread>,
    pub(crate) speed_max_m_s: Option<Spread>,
    /// Absolute error at the end of the run, in per cent of the distance.
    pub(crate) distance_end_pct: Option<Spread>,
    /// Of the guaranteed interval.
    pub(crate) guaranteed_speed_width_m_s: Option<Spread>,
    pub(crate) guaranteed_speed_inside_pct: Option<f64>,
    /// Number of runs whose distance never left its guaranteed interval; absent without one.
    pub(crate) guaranteed_distance_inside_runs: Option<usize>,
    /// Of the interval of the stated confidence.
    pub(crate) confidence_speed_width_m_s: Option<Spread>,
    pub(crate) confidence_speed_inside_pct: Option<f64>,
    pub(crate) confidence_distance_inside_pct: Option<f64>,
    pub(crate) etcs_speed_violation_pct: Option<f64>,
    /// The same in the worst run.
    pub(crate) etcs_speed_violation_worst_pct: Option<f64>,
    /// Of the runs in which something slips or slides and is flagged.
    pub(crate) detect_delay_s: Option<Spread>,
}

impl Spread {
    pub(crate) fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.collect();
        // NaN sorts last, as the worst.
        values.sort_unstable_by(f64::total_cmp);
        // Between two in the middle, their mean.
        let middle = |at: usize| values.get(at).copied();
        let median = 0.5 * (middle(values.len().checked_sub(1)? / 2)? + middle(values.len() / 2)?);
        Some(Self { median, worst: *values.last()? })
    }
}

impl<'r> Family<'r> {
    pub(crate) fn new(name: &str, runs: impl Iterator<Item = &'r ScoredRun>) -> Self {
        let mut family =
            Self { name: name.to_owned(), runs: Vec::new(), whole: None, flags: FalseFlags::default() };
        for run in runs {
            family.flags.merge(run.flags);
            match &mut family.whole {
                Some(whole) => whole.merge(&run.scores),
                None => family.whole = Some(run.scores.clone()),
            }
            family.runs.push(run);
        }
        family
    }

    pub(crate) fn runs(&self) -> usize {
        self.runs.len()
    }

    /// Share of periods in which the recommended preset flags a wheel that rolls (%).
    pub(crate) fn false_flags_pct(&self) -> Option<f64> {
        self.flags.pct()
    }

    pub(crate) fn figures(&self, odometer: Odometer) -> Figures {
        let scores: Vec<OdometryScore> = self.runs.iter().map(|run| odometer.score(&run.scores)).collect();
        let spread = |of: fn(&OdometryScore) -> Option<f64>| Spread::of(scores.iter().filter_map(of));
        let whole = self.whole.as_ref().map_or_else(OdometryScore::default, |whole| odometer.score(whole));
        let inside = scores.iter().filter_map(|score| score.distance_inside_pct);
        let held = inside.clone().filter(|pct| *pct >= 100.0).count();
        Figures {
            speed_rms_m_s: spread(|score| score.speed_rms_m_s),
            speed_max_m_s: spread(|score| score.speed_max_m_s),
            distance_end_pct: spread(|score| score.distance_end_pct.map(f64::abs)),
            guaranteed_speed_width_m_s: spread(|score| score.speed_width_mean_m_s),
            guaranteed_speed_inside_pct: whole.speed_inside_pct,
            guaranteed_distance_inside_runs: (inside.count() > 0).then_some(held),
            confidence_speed_width_m_s: spread(|score| score.confidence_speed_width_m_s),
            confidence_speed_inside_pct: whole.confidence_speed_inside_pct,
            confidence_distance_inside_pct: whole.confidence_distance_inside_pct,
            etcs_speed_violation_pct: whole.etcs_speed_violation_pct,
            etcs_speed_violation_worst_pct: spread(|score| score.etcs_speed_violation_pct)
                .map(|spread| spread.worst),
            detect_delay_s: spread(|score| score.detect_delay_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_runs_are_better_than_the_median_and_nothing_is_worse_than_not_a_number() {
        let of = |values: &[f64]| Spread::of(values.iter().copied());
        assert_eq!(of(&[]), None);
        assert_eq!(of(&[3.0, 1.0, 2.0]), Some(Spread { median: 2.0, worst: 3.0 }));
        assert_eq!(of(&[4.0, 1.0, 3.0, 2.0]), Some(Spread { median: 2.5, worst: 4.0 }));
        assert!(
            of(&[3.0, f64::NAN, 2.0]).is_some_and(|spread| spread.worst.is_nan() && spread.median == 3.0)
        );
    }
}
