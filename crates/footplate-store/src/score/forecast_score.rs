//! The error statistics of one forecaster over a selection of detections.

use footplate_core::{HALF_95, TimeSpan};

use super::reference_forecaster::ReferenceForecaster;
use super::scored_hit::ScoredHit;

/// The levels of the intervals whose coverage is counted.
pub const LEVELS: [f64; 3] = [0.5, 0.9, 0.99];

/// Error statistics of forecasts. `None` if nothing was scored.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ForecastScore {
    /// Detections in the selection.
    pub hits: usize,
    /// Detections with a forecast; the first of a run and those at new steps have none.
    pub scored: usize,
    /// Median absolute error, in mm.
    pub median_abs_mm: Option<f64>,
    /// 90 % quantile of the absolute error, in mm.
    pub p90_abs_mm: Option<f64>,
    /// Median absolute error, in ms.
    pub median_abs_ms: Option<f64>,
    /// Mean absolute error, in mm. Reports are quantised by polls: the median may be near zero while every third
    /// forecast is wrong by a whole poll. The mean includes those.
    pub mean_abs_mm: Option<f64>,
    /// Mean error, in mm: positive if trains are later than forecast.
    pub bias_mm: Option<f64>,
    /// Coverage of the stated intervals, in the order of [`LEVELS`]; `None` for forecasts without intervals.
    pub coverage: Option<[Coverage; LEVELS.len()]>,
}

impl ForecastScore {
    /// The score of our estimator.
    pub fn of<'a>(hits: impl Iterator<Item = &'a ScoredHit> + Clone) -> Self {
        let levels: Vec<f64> = hits.clone().filter_map(ScoredHit::level).collect();
        let coverage = |level: f64| Coverage {
            level,
            inside: levels.iter().filter(|found| **found <= level).count(),
            of: levels.len(),
        };
        Self {
            coverage: (!levels.is_empty()).then(|| LEVELS.map(coverage)),
            ..Self::of_errors(hits, ScoredHit::late)
        }
    }

    /// The score of a reference, over the detections that both forecast.
    pub fn of_reference<'a>(
        hits: impl Iterator<Item = &'a ScoredHit> + Clone,
        reference: ReferenceForecaster,
    ) -> Self {
        Self::of_errors(hits, |hit| hit.late_by(reference))
    }

    /// The score of our estimator over the detections that a reference forecast, too.
    pub fn of_ours_beside<'a>(
        hits: impl Iterator<Item = &'a ScoredHit> + Clone,
        reference: ReferenceForecaster,
    ) -> Self {
        Self::of(hits.filter(move |hit| hit.late_by(reference).is_some()))
    }

    fn of_errors<'a>(
        hits: impl Iterator<Item = &'a ScoredHit>,
        late: impl Fn(&ScoredHit) -> Option<TimeSpan>,
    ) -> Self {
        let mut count = 0;
        let (mut distances, mut times, mut sum) = (Vec::new(), Vec::new(), 0.0);
        for hit in hits {
            count += 1;
            let Some((late, mm)) = late(hit).and_then(|late| Some((late, hit.distance_mm(late)?))) else {
                continue;
            };
            sum += mm;
            distances.push(mm.abs());
            times.push(late.abs().as_ms());
        }
        let mean = |sum: f64| (!distances.is_empty()).then(|| sum / distances.len() as f64);
        let (bias_mm, mean_abs_mm) = (mean(sum), mean(distances.iter().sum()));
        distances.sort_by(f64::total_cmp);
        times.sort_by(f64::total_cmp);
        Self {
            hits: count,
            scored: distances.len(),
            median_abs_mm: quantile(&distances, 0.5),
            p90_abs_mm: quantile(&distances, 0.9),
            median_abs_ms: quantile(&times, 0.5),
            mean_abs_mm,
            bias_mm,
            coverage: None,
        }
    }
}

/// The quantile `part` of sorted values, interpolated between neighbours (Hyndman and Fan, 1996, definition 7).
fn quantile(sorted: &[f64], part: f64) -> Option<f64> {
    let place = part * sorted.len().checked_sub(1)? as f64;
    let (low, high) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    Some(low + (high - low) * place.fract())
}

/// A count of reports inside intervals of one level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coverage {
    /// The stated probability of the intervals, 0 to 1.
    pub level: f64,
    /// Reports inside.
    pub inside: usize,
    /// All reports, at least one.
    pub of: usize,
}

impl Coverage {
    /// The share inside.
    #[must_use]
    pub fn fraction(self) -> f64 {
        self.inside as f64 / self.of as f64
    }

    /// The 95 % interval of the true probability: the score interval (Wilson, 1927), which remains valid for small
    /// counts and near 0 and 1, unlike the normal approximation.
    #[must_use]
    pub fn plausible(self) -> (f64, f64) {
        let (n, p, z) = (self.of as f64, self.fraction(), HALF_95);
        let middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        ((middle - half).max(0.0), (middle + half).min(1.0))
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::link::{DetectionWindow, UniformNormal};
    use footplate_core::model::{Drive, Passage};
    use footplate_core::tracking::{Forecast, ForecastPhase, Hit, Verdict};
    use footplate_core::{NodeId, RunId, SensorId, Speed, SpeedStep, TimeSpan, Timestamp, TrainId};

    use super::*;

    /// A detection at 10 s that we forecast `late_ms` earlier at 400 mm/s, uniformly within ±50 ms, and that the last
    /// lap forecast at 9.9 s.
    fn hit(late_ms: Option<i64>) -> ScoredHit {
        let sensor = SensorId(0);
        let until = Timestamp::from_s(10.0);
        let forecast = |late_ms| Forecast {
            sensor,
            time: until - TimeSpan::from_ms(late_ms),
            report: until - TimeSpan::from_ms(late_ms),
            spread: UniformNormal { deviation: 0.0, width: 0.1 },
            speed: Speed::from_mm_per_s(400.0),
            phase: ForecastPhase::Steady,
        };
        let passage = Passage {
            sensor,
            node: NodeId(0),
            window: DetectionWindow { after: until - TimeSpan::from_ms(70), until },
            path: None,
            drive: Drive { step: SpeedStep::STAND, from: SpeedStep::STAND, commanded: None },
            entry: 0,
        };
        let mut references = [None; ReferenceForecaster::ALL.len()];
        references[ReferenceForecaster::LastLap as usize] = Some(until - TimeSpan::from_ms(100));
        let forecast = late_ms.map(forecast);
        let hit = Hit { passage, forecast, named: None, verdict: Verdict::Learnt, drift: None };
        ScoredHit { run: RunId(1), line: 1, train: TrainId(1), hit, references }
    }

    #[test]
    fn scores_match_a_hand_calculation() {
        // Given reports 5 ms early and 10, 20, 30, 60 ms late, and one without a forecast,
        let hits = [Some(-5), Some(10), Some(20), Some(30), Some(60), None].map(hit);
        let score = ForecastScore::of(hits.iter());
        // then at 400 mm/s the errors are 2, 4, 8, 12 and 24 mm.
        assert_eq!((score.hits, score.scored), (6, 5));
        let close = |found: Option<f64>, right: f64| (found.unwrap() - right).abs() < 1e-9;
        assert!(close(score.median_abs_mm, 8.0) && close(score.median_abs_ms, 20.0));
        // Place 0.9 · 4 = 3.6: 12 + 0.6 · 12.
        assert!(close(score.p90_abs_mm, 19.2));
        assert!(close(score.bias_mm, (-2.0 + 4.0 + 8.0 + 12.0 + 24.0) / 5.0));
        assert!(close(score.mean_abs_mm, 10.0));
        // ±25 ms, ±45 ms and ±49.5 ms are the central 50, 90 and 99 %.
        assert_eq!(score.coverage.unwrap().map(|coverage| coverage.inside), [3, 4, 4]);
    }

    #[test]
    fn a_reference_is_scored_on_common_detections() {
        let hits = [Some(10), None].map(hit);
        let reference = ForecastScore::of_reference(hits.iter(), ReferenceForecaster::LastLap);
        assert_eq!((reference.hits, reference.scored, reference.coverage), (2, 1, None));
        assert!((reference.median_abs_mm.unwrap() - 40.0).abs() < 1e-9);
        assert_eq!(ForecastScore::of_ours_beside(hits.iter(), ReferenceForecaster::Oracle).scored, 0);
        assert_eq!(ForecastScore::of_ours_beside(hits.iter(), ReferenceForecaster::LastLap).scored, 1);
    }

    #[test]
    fn nothing_scored_has_no_figures() {
        let nothing = ForecastScore::of([hit(None)].iter());
        assert_eq!(nothing, ForecastScore { hits: 1, ..ForecastScore::default() });
    }

    #[test]
    fn quantiles_lie_between_neighbours() {
        assert_eq!(quantile(&[], 0.5), None);
        assert_eq!(quantile(&[3.0], 0.9), Some(3.0));
        assert_eq!(quantile(&[1.0, 2.0, 10.0], 0.5), Some(2.0));
        assert_eq!(quantile(&[1.0, 2.0, 3.0, 10.0], 0.5), Some(2.5));
        // 0.9 · 10 = place 9 of eleven.
        let eleven: Vec<f64> = (0..11).map(f64::from).collect();
        assert_eq!(quantile(&eleven, 0.9), Some(9.0));
    }

    #[test]
    fn the_interval_is_wilsons() {
        // Newcombe (1998), table I: 81 of 263 gives 0.2553 to 0.3662, 15 of 148 gives 0.0624 to 0.1605,
        // 0 of 20 gives 0 to 0.1611.
        for (inside, of, low, high) in
            [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611)]
        {
            let (found_low, found_high) = Coverage { level: 0.5, inside, of }.plausible();
            assert!((found_low - low).abs() < 5e-5 && (found_high - high).abs() < 5e-5, "{inside} of {of}");
        }
    }
}
