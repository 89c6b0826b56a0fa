//! Statistics over many trains: medians, high percentiles, and shares with their intervals.

use footplate_sim::LawFamily;
use serde_json::{Value, json};

use super::trial::{NOT_BEYOND_PERCENT, Results};
use crate::figures::{binomial_interval, median_and_high, quantile};

/// One train with the results of all drivers.
pub struct ScoredTrain {
    /// Its law of speed change.
    pub law: LawFamily,
    /// The seed.
    pub seed: u64,
    /// Simulated time of the calibration, in s.
    pub(super) calibration_s: f64,
    /// How the calibration ended.
    pub(super) ending: String,
    /// By how much the learnt length of the train is wrong, and one standard deviation, in mm; `None` without blocks.
    pub(super) length_error_mm: Option<[f64; 2]>,
    /// The results in the order of [`Driven::ALL`].
    pub(super) by: Vec<Results>,
}

impl ScoredTrain {
    /// What happened in the simulated world while Footplate drove, in words.
    pub fn incidents(&self) -> &[String] {
        self.by.first().map_or(&[], |ours| &ours.incidents)
    }
}

/// The driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Driven {
    /// Footplate, with the calibrated model.
    Calibrated,
    /// Footplate, with the true properties of the train.
    Oracle,
    /// The method of course projects.
    CourseProject,
}

impl Driven {
    pub(super) const ALL: [Self; 3] = [Self::Calibrated, Self::Oracle, Self::CourseProject];

    pub(super) const fn key(self) -> &'static str {
        match self {
            Self::Calibrated => "footplate",
            Self::Oracle => "oracle",
            Self::CourseProject => "course project",
        }
    }
}

/// Stops that should not end beyond their target.
#[derive(Debug, Clone, Copy)]
pub(super) struct Overruns {
    /// Those that did.
    pub(super) over: usize,
    /// All.
    pub(super) stops: usize,
}

/// The statistics of one driver over several trains.
pub(super) struct Figures {
    /// Median and 95th percentile of the absolute errors of stops, in mm.
    pub(super) mid: Option<[f64; 2]>,
    pub(super) top: Option<[f64; 2]>,
    /// The same of short moves.
    pub(super) moves: Option<[f64; 2]>,
    /// Moves within 8 mm or 5 %, and all.
    pub(super) good_moves: [usize; 2],
    /// By allowed probability.
    pub(super) beyond: [Overruns; 2],
    /// The median place of rest of such stops relative to the target, in mm; negative short of it.
    pub(super) median_rest: [Option<f64>; 2],
    /// Position checks, and those inside the interval.
    pub(super) position_checks: [u64; 2],
    pub(super) stops: [usize; 2],
    pub(super) failed: u32,
    pub(super) incidents: usize,
}

/// The tolerance of a short move: this, or this share of it.
const GOOD_MOVE_MM: f64 = 8.0;
const GOOD_MOVE_SHARE: f64 = 0.05;

impl Figures {
    pub(super) fn of(results: &[&Results]) -> Self {
        let results = results.iter().copied();
        let all = |each: fn(&Results) -> &Vec<f64>| -> Vec<f64> {
            results.clone().flat_map(|results| each(results).iter().map(|error| error.abs())).collect()
        };
        let moves: Vec<[f64; 2]> =
            results.clone().flat_map(|results| results.moves.iter().copied()).collect();
        let is_good = |[ordered, moved]: &&[f64; 2]| {
            (moved - ordered).abs() <= GOOD_MOVE_MM.max(GOOD_MOVE_SHARE * ordered)
        };
        let beyond = |nth: usize| {
            let ends = results.clone().flat_map(move |results| results.not_beyond[nth].iter().copied());
            ends.collect::<Vec<f64>>()
        };
        let (mid, top) = (all(|results| &results.mid), all(|results| &results.top));
        let overruns = |ends: &[f64]| Overruns {
            over: ends.iter().filter(|end| **end > 0.0).count(),
            stops: ends.len(),
        };
        let sum = |each: fn(&Results) -> u64| results.clone().map(each).sum::<u64>();
        Self {
            stops: [mid.len(), top.len()],
            mid: median_and_high(mid.iter().copied()),
            top: median_and_high(top.iter().copied()),
            moves: median_and_high(moves.iter().map(|[ordered, moved]| (moved - ordered).abs())),
            good_moves: [moves.iter().filter(is_good).count(), moves.len()],
            beyond: [overruns(&beyond(0)), overruns(&beyond(1))],
            median_rest: [quantile(beyond(0).into_iter(), 0.5), quantile(beyond(1).into_iter(), 0.5)],
            position_checks: [
                sum(|results| u64::from(results.position_checks[0])),
                sum(|results| u64::from(results.position_checks[1])),
            ],
            failed: results.clone().map(|results| results.failed).sum(),
            incidents: results.clone().map(|results| results.incidents.len()).sum(),
        }
    }

    /// The share of position checks inside the interval, in percent.
    pub(super) fn covered_pct(&self) -> Option<f64> {
        (self.position_checks[0] > 0)
            .then(|| 100.0 * self.position_checks[1] as f64 / self.position_checks[0] as f64)
    }

    pub(super) fn json(&self) -> Value {
        let beyond: Vec<Value> = NOT_BEYOND_PERCENT
            .iter()
            .zip(self.beyond)
            .map(|(allowed, Overruns { over, stops })| {
                let [low, high] = binomial_interval(over, stops);
                json!({
                    "allowed_pct": allowed, "overruns": over, "stops": stops, "low_pct": 100.0 * low,
                    "high_pct": 100.0 * high,
                })
            })
            .collect();
        json!({
            "mid_stop_mm": self.mid, "mid_stops": self.stops[0], "top_stop_mm": self.top,
            "top_stops": self.stops[1], "move_mm": self.moves, "moves": self.good_moves[1],
            "moves_within_8_mm_or_5_pct": self.good_moves[0], "not_beyond": beyond,
            "position_inside_pct": self.covered_pct(), "failed": self.failed, "incidents": self.incidents,
        })
    }
}
