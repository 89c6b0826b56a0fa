//! What the stops of many worlds come to.

use serde_json::{Value, json};

use super::sessions::{ScoredStop, ScoredWorld};
use footplate_eval::figures::{binomial_interval, quantile};

/// A session of fewer stops has no share.
const LEAST_STOPS: usize = 10;
/// No session may keep less than this share of its promises.
const LEAST_SHARE: f64 = 0.85;

/// Figures of one world over all its seeds.
pub(super) struct Figures {
    pub(super) stops: usize,
    pub(super) kept: usize,
    /// Sessions that have a share, those below the least, and the worst: its share, seed and number.
    pub(super) sessions: usize,
    pub(super) below: usize,
    pub(super) worst: Option<(f64, u64, u8)>,
    /// Absolute errors in mm: median and 95th percentile.
    pub(super) errors: [Option<f64>; 2],
    /// The median of the errors with their sign: stops end so far beyond what was aimed at.
    pub(super) bias: Option<f64>,
    /// The median width of a promise, in mm, of those kept and of those broken.
    pub(super) widths: [Option<f64>; 2],
    pub(super) failed: usize,
    pub(super) incidents: usize,
}

impl Figures {
    pub(super) fn of(worlds: &[&ScoredWorld]) -> Self {
        let stops = || worlds.iter().flat_map(|world| &world.stops);
        let widths =
            |kept: bool| quantile(stops().filter(|stop| stop.is_kept() == kept).map(ScoredStop::width), 0.5);
        let shares: Vec<(f64, u64, u8)> = worlds.iter().flat_map(|world| shares(world)).collect();
        Self {
            stops: stops().count(),
            kept: stops().filter(|stop| stop.is_kept()).count(),
            sessions: shares.len(),
            below: shares.iter().filter(|(share, ..)| *share < LEAST_SHARE).count(),
            worst: shares.into_iter().min_by(|one, other| one.0.total_cmp(&other.0)),
            errors: [0.5, 0.95].map(|part| quantile(stops().map(|stop| stop.error.abs()), part)),
            bias: quantile(stops().map(|stop| stop.error), 0.5),
            widths: [widths(true), widths(false)],
            failed: worlds.iter().map(|world| world.failures.len()).sum(),
            incidents: worlds.iter().map(|world| world.incidents.len()).sum(),
        }
    }

    /// The share of promises kept and its 95 % interval.
    pub(super) fn share(&self) -> Option<[f64; 3]> {
        let [low, high] = binomial_interval(self.kept, self.stops);
        (self.stops > 0).then(|| [self.kept as f64 / self.stops as f64, low, high])
    }

    pub(super) fn json(&self) -> Value {
        let worst = self.worst.map(
            |(share, seed, session)| json!({ "kept_pct": 100.0 * share, "seed": seed, "session": session }),
        );
        json!({
            "stops": self.stops, "kept": self.kept,
            "kept_pct": self.share().map(|shares| shares.map(|share| 100.0 * share)),
            "sessions": self.sessions, "sessions_below_85_pct": self.below, "worst_session": worst,
            "error_median_mm": self.errors[0], "error_p95_mm": self.errors[1], "bias_mm": self.bias,
            "width_kept_mm": self.widths[0], "width_broken_mm": self.widths[1],
            "failed": self.failed, "incidents": self.incidents,
        })
    }
}

/// The share of promises kept in each session that has enough stops, with seed and number.
fn shares(world: &ScoredWorld) -> Vec<(f64, u64, u8)> {
    let last = world.stops.last().map_or(0, |stop| stop.session);
    let of_session = |session: u8| world.stops.iter().filter(move |stop| stop.session == session);
    (1..=last)
        .filter(|session| of_session(*session).count() >= LEAST_STOPS)
        .map(|session| {
            let kept = of_session(session).filter(|stop| stop.is_kept()).count();
            (kept as f64 / of_session(session).count() as f64, world.seed, session)
        })
        .collect()
}
