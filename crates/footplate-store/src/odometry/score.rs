//! How good an odometer was, measured against the truth.

use footplate_core::odometry::{distance_tolerance, speed_tolerance};
use footplate_core::{Length, Speed};

use crate::tachometer::Truth;

/// What an odometer says at the end of a period.
#[derive(Debug, Clone, Copy)]
pub(super) struct Claim {
    pub(super) speed: Speed,
    pub(super) distance: Length,
    /// That hold as long as what is claimed of the vehicle is true.
    pub(super) speed_bounds: Option<[Speed; 2]>,
    pub(super) distance_bounds: Option<[Length; 2]>,
    /// That hold with the probability stated.
    pub(super) likely_speed_bounds: Option<[Speed; 2]>,
    pub(super) likely_distance_bounds: Option<[Length; 2]>,
}

impl Claim {
    /// A speed and a distance without any bounds.
    pub(super) const fn plain(speed: Speed, distance: Length) -> Self {
        Self {
            speed,
            distance,
            speed_bounds: None,
            distance_bounds: None,
            likely_speed_bounds: None,
            likely_distance_bounds: None,
        }
    }
}

/// How good an odometer was. What there is no figure for is `None`: no truth, or no interval.
///
/// Of several runs together: root mean square, shares and mean width are over all periods of all runs, the rest is
/// that of the worst run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OdometryScore {
    /// Periods with a true speed or a true distance.
    pub scored: u64,
    /// Root mean square of the error of the speed.
    pub speed_rms_m_s: Option<f64>,
    /// Its largest amount.
    pub speed_max_m_s: Option<f64>,
    /// Distance less true distance at the end of the run.
    pub distance_end_m: Option<f64>,
    /// The same in per cent of the distance travelled.
    pub distance_end_pct: Option<f64>,
    /// Its largest amount within the run.
    pub distance_max_m: Option<f64>,
    /// Share of periods whose true speed lies within the guaranteed bounds.
    pub speed_inside_pct: Option<f64>,
    /// Share of periods whose true distance lies within the guaranteed bounds.
    pub distance_inside_pct: Option<f64>,
    /// Mean width of the guaranteed bounds of the speed.
    pub speed_width_mean_m_s: Option<f64>,
    /// Width of the guaranteed bounds of the distance at the end of the run.
    pub distance_width_end_m: Option<f64>,
    /// Share of periods whose true speed lies within the interval of the stated confidence.
    pub confidence_speed_inside_pct: Option<f64>,
    /// Share of periods whose true distance does.
    pub confidence_distance_inside_pct: Option<f64>,
    /// Mean width of that interval of the speed.
    pub confidence_speed_width_m_s: Option<f64>,
    /// Width of that of the distance at the end of the run.
    pub confidence_distance_width_m: Option<f64>,
    /// Share of periods whose speed is off by more than ETCS allows.
    pub etcs_speed_violation_pct: Option<f64>,
    /// Share of periods whose distance is off by more than ETCS allows.
    pub etcs_distance_violation_pct: Option<f64>,
    /// From the first period in which a wheelset really slips or slides to the first that says so of it.
    pub detect_delay_s: Option<f64>,
}

impl OdometryScore {
    /// Every figure and what it is called in files, in the order of docs/formats/odometry-result.md.
    #[must_use]
    pub fn figures(&self) -> [(&'static str, Option<f64>); 16] {
        [
            ("speed_rms_m_s", self.speed_rms_m_s),
            ("speed_max_m_s", self.speed_max_m_s),
            ("distance_end_m", self.distance_end_m),
            ("distance_end_pct", self.distance_end_pct),
            ("distance_max_m", self.distance_max_m),
            ("guaranteed_speed_inside_pct", self.speed_inside_pct),
            ("guaranteed_distance_inside_pct", self.distance_inside_pct),
            ("guaranteed_speed_width_m_s", self.speed_width_mean_m_s),
            ("guaranteed_distance_width_m", self.distance_width_end_m),
            ("confidence_speed_inside_pct", self.confidence_speed_inside_pct),
            ("confidence_distance_inside_pct", self.confidence_distance_inside_pct),
            ("confidence_speed_width_m_s", self.confidence_speed_width_m_s),
            ("confidence_distance_width_m", self.confidence_distance_width_m),
            ("etcs_speed_violation_pct", self.etcs_speed_violation_pct),
            ("etcs_distance_violation_pct", self.etcs_distance_violation_pct),
            ("detect_delay_s", self.detect_delay_s),
        ]
    }
}

/// How often something was so.
#[derive(Debug, Clone, Copy, Default)]
struct Share {
    of: u64,
    so: u64,
}

impl Share {
    fn count(&mut self, so: bool) {
        self.of += 1;
        self.so += u64::from(so);
    }

    fn merge(&mut self, other: Self) {
        self.of += other.of;
        self.so += other.so;
    }

    fn pct(self) -> Option<f64> {
        (self.of > 0).then(|| 100.0 * self.so as f64 / self.of as f64)
    }
}

/// Compares what an odometer says with the truth, period by period.
#[derive(Debug, Clone, Default)]
pub(super) struct Scorer {
    scored: u64,
    speeds: u64,
    squares: f64,
    speed_max: f64,
    distance_max: f64,
    speed_inside: Share,
    distance_inside: Share,
    width_sum: f64,
    likely_speed_inside: Share,
    likely_distance_inside: Share,
    likely_width_sum: f64,
    likely_distance_width_end: Option<f64>,
    speed_violation: Share,
    distance_violation: Share,
    /// The true distance at the first row, where that of the odometer is 0.
    origin: Option<f64>,
    true_distance: f64,
    travelled: f64,
    distance_end: Option<f64>,
    distance_end_pct: Option<f64>,
    distance_width_end: Option<f64>,
    detect_delay: Option<f64>,
}

impl Scorer {
    pub(super) fn see(&mut self, claim: &Claim, truth: &Truth) {
        self.scored += u64::from(truth.speed.is_some() || truth.distance.is_some());
        if let Some(true_speed) = truth.speed {
            self.see_speed(claim, true_speed);
        }
        if let Some(true_distance) = truth.distance {
            self.see_distance(claim, true_distance.as_m());
        }
    }

    fn see_speed(&mut self, claim: &Claim, true_speed: Speed) {
        let error = (claim.speed - true_speed).abs();
        self.speeds += 1;
        self.squares += error.as_m_per_s() * error.as_m_per_s();
        self.speed_max = self.speed_max.max(error.as_m_per_s());
        // NaN is within no tolerance.
        self.speed_violation.count(!matches!(
            error.partial_cmp(&speed_tolerance(true_speed)),
            Some(std::cmp::Ordering::Less | std::cmp::Ordering::Equal)
        ));
        if let Some([low, high]) = claim.speed_bounds {
            self.speed_inside.count(low <= true_speed && true_speed <= high);
            self.width_sum += (high - low).as_m_per_s();
        }
        if let Some([low, high]) = claim.likely_speed_bounds {
            self.likely_speed_inside.count(low <= true_speed && true_speed <= high);
            self.likely_width_sum += (high - low).as_m_per_s();
        }
    }

    fn see_distance(&mut self, claim: &Claim, true_distance: f64) {
        let origin = *self.origin.get_or_insert(true_distance);
        let gone = true_distance - origin;
        self.travelled += (gone - self.true_distance).abs();
        self.true_distance = gone;
        let error = claim.distance.as_m() - gone;
        self.distance_max = self.distance_max.max(error.abs());
        self.distance_end = Some(error);
        self.distance_end_pct = (self.travelled > 0.0).then(|| 100.0 * error / self.travelled);
        let tolerance = distance_tolerance(Length::from_m(self.travelled)).as_m();
        self.distance_violation.count(error.is_nan() || error.abs() > tolerance);
        if let Some([low, high]) = claim.distance_bounds {
            self.distance_inside.count(low.as_m() <= gone && gone <= high.as_m());
            self.distance_width_end = Some((high - low).as_m());
        }
        if let Some([low, high]) = claim.likely_distance_bounds {
            self.likely_distance_inside.count(low.as_m() <= gone && gone <= high.as_m());
            self.likely_distance_width_end = Some((high - low).as_m());
        }
    }

    /// Says how long a slip or slide went unnoticed.
    pub(super) fn set_detect_delay(&mut self, delay_s: Option<f64>) {
        self.detect_delay = delay_s;
    }

    /// Adds another run.
    pub(super) fn merge(&mut self, other: &Self) {
        self.scored += other.scored;
        self.speeds += other.speeds;
        self.squares += other.squares;
        self.speed_max = self.speed_max.max(other.speed_max);
        self.distance_max = self.distance_max.max(other.distance_max);
        self.speed_inside.merge(other.speed_inside);
        self.distance_inside.merge(other.distance_inside);
        self.width_sum += other.width_sum;
        self.likely_speed_inside.merge(other.likely_speed_inside);
        self.likely_distance_inside.merge(other.likely_distance_inside);
        self.likely_width_sum += other.likely_width_sum;
        self.likely_distance_width_end =
            farther(self.likely_distance_width_end, other.likely_distance_width_end);
        self.speed_violation.merge(other.speed_violation);
        self.distance_violation.merge(other.distance_violation);
        self.distance_end = farther(self.distance_end, other.distance_end);
        self.distance_end_pct = farther(self.distance_end_pct, other.distance_end_pct);
        self.distance_width_end = farther(self.distance_width_end, other.distance_width_end);
        self.detect_delay = farther(self.detect_delay, other.detect_delay);
    }

    pub(super) fn score(&self) -> OdometryScore {
        let speeds = (self.speeds > 0).then_some(self.speeds as f64);
        let bounds = (self.speed_inside.of > 0).then_some(self.speed_inside.of as f64);
        let likely = (self.likely_speed_inside.of > 0).then_some(self.likely_speed_inside.of as f64);
        OdometryScore {
            scored: self.scored,
            speed_rms_m_s: speeds.map(|count| (self.squares / count).sqrt()),
            speed_max_m_s: speeds.map(|_| self.speed_max),
            distance_end_m: self.distance_end,
            distance_end_pct: self.distance_end_pct,
            distance_max_m: self.distance_end.map(|_| self.distance_max),
            speed_inside_pct: self.speed_inside.pct(),
            distance_inside_pct: self.distance_inside.pct(),
            speed_width_mean_m_s: bounds.map(|count| self.width_sum / count),
            distance_width_end_m: self.distance_width_end,
            confidence_speed_inside_pct: self.likely_speed_inside.pct(),
            confidence_distance_inside_pct: self.likely_distance_inside.pct(),
            confidence_speed_width_m_s: likely.map(|count| self.likely_width_sum / count),
            confidence_distance_width_m: self.likely_distance_width_end,
            etcs_speed_violation_pct: self.speed_violation.pct(),
            etcs_distance_violation_pct: self.distance_violation.pct(),
            detect_delay_s: self.detect_delay,
        }
    }
}

/// The one that is farther from zero.
fn farther(one: Option<f64>, other: Option<f64>) -> Option<f64> {
    match (one, other) {
        (Some(one), Some(other)) => Some(if other.abs() > one.abs() { other } else { one }),
        (one, other) => one.or(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(speed: f64, distance: f64, width: f64) -> Claim {
        let half = width / 2.0;
        Claim {
            speed: Speed::from_m_per_s(speed),
            distance: Length::from_m(distance),
            speed_bounds: Some([speed - half, speed + half].map(Speed::from_m_per_s)),
            distance_bounds: Some([distance - half, distance + half].map(Length::from_m)),
            likely_speed_bounds: None,
            likely_distance_bounds: None,
        }
    }

    fn truth(speed: f64, distance: f64) -> Truth {
        let (speed, distance) = (Some(Speed::from_m_per_s(speed)), Some(Length::from_m(distance)));
        Truth { speed, distance, wheels: [None; 2] }
    }

    fn near(found: Option<f64>, expected: f64) -> bool {
        found.is_some_and(|found| (found - expected).abs() < 1e-9)
    }

    #[test]
    fn scores_match_a_hand_calculation() {
        let mut scorer = Scorer::default();
        // The odometer starts at 0 where the true distance is 1000 m; errors of the speed: 0, 3, -4 m/s.
        scorer.see(&claim(10.0, 0.0, 1.0), &truth(10.0, 1000.0));
        scorer.see(&claim(13.0, 60.0, 6.0), &truth(10.0, 1050.0));
        scorer.see(&claim(6.0, 98.0, 1.0), &truth(10.0, 1100.0));
        let score = scorer.score();
        assert_eq!(score.scored, 3);
        assert!(near(score.speed_rms_m_s, (25.0_f64 / 3.0).sqrt()));
        assert!(near(score.speed_max_m_s, 4.0));
        assert!(near(score.distance_end_m, -2.0) && near(score.distance_end_pct, -2.0));
        assert!(near(score.distance_max_m, 10.0));
        // The interval of 6 m/s around 13 m/s ends exactly at the truth; that of 1 m around 98 m does not reach it.
        assert!(near(score.speed_inside_pct, 200.0 / 3.0));
        assert!(near(score.distance_inside_pct, 100.0 / 3.0));
        assert!(near(score.speed_width_mean_m_s, 8.0 / 3.0));
        assert!(near(score.distance_width_end_m, 1.0));
        // At 10 m/s ETCS allows ±0.58 m/s; after 50 m ±7.5 m, after 100 m ±10 m.
        assert!(near(score.etcs_speed_violation_pct, 200.0 / 3.0));
        assert!(near(score.etcs_distance_violation_pct, 100.0 / 3.0));
        assert_eq!(score.detect_delay_s, None);
    }

    #[test]
    fn of_several_runs_the_worst_counts_or_all_periods_do() {
        let run = |errors: &[f64], delay| {
            let mut scorer = Scorer::default();
            for (at, error) in errors.iter().enumerate() {
                let distance = 10.0 * at as f64;
                scorer.see(&claim(10.0 + error, distance + error, 2.0), &truth(10.0, distance));
            }
            scorer.set_detect_delay(delay);
            scorer
        };
        let mut both = run(&[0.0, 1.0], Some(0.1));
        both.merge(&run(&[0.0, 0.0, -2.0, -3.0], Some(0.3)));
        let score = both.score();
        assert!(near(score.speed_rms_m_s, (14.0_f64 / 6.0).sqrt()));
        assert!(near(score.distance_end_m, -3.0) && near(score.distance_end_pct, 10.0), "{score:?}");
        assert!(near(score.speed_inside_pct, 400.0 / 6.0));
        assert_eq!((score.scored, score.detect_delay_s), (6, Some(0.3)));
    }

    #[test]
    fn nothing_true_gives_no_figure_and_nan_is_never_right() {
        let mut scorer = Scorer::default();
        scorer.see(&claim(1.0, 1.0, 1.0), &Truth::default());
        assert_eq!(scorer.score(), OdometryScore::default());
        scorer.see(&claim(f64::NAN, f64::NAN, 1.0), &truth(1.0, 0.0));
        let score = scorer.score();
        assert_eq!((score.speed_inside_pct, score.distance_inside_pct), (Some(0.0), Some(0.0)));
        assert_eq!(score.etcs_speed_violation_pct, Some(100.0));
        assert_eq!(score.etcs_distance_violation_pct, Some(100.0));
    }
}
