//! Statistics over many runs with one kind of disturbance.

use serde_json::{Value, json};

use super::disturbed_run::Outcomes;
use super::kind::Kind;
use crate::figures::median_and_high;

/// The statistics of one kind.
pub(super) struct Figures {
    pub(super) kind: Kind,
    pub(super) runs: usize,
    /// Seconds until detection, and the distance run until then (mm).
    pub(super) noticed: Vec<[f64; 2]>,
    /// Runs in which nothing was noticed that a person sees.
    pub(super) unnoticed: usize,
    /// Seconds until the train was back in service.
    pub(super) recovered: Vec<f64>,
    /// The outcomes of recoveries: as before, rescaled, learnt anew.
    pub(super) outcomes: [usize; 3],
    pub(super) needed_operator: usize,
    /// Absolute errors of stops (mm).
    pub(super) before: Vec<f64>,
    pub(super) after: Vec<f64>,
    pub(super) incidents: usize,
    pub(super) powered_off: usize,
}

impl Figures {
    pub(super) fn of(kind: Kind, runs: &[&Outcomes]) -> Self {
        let all = |of: fn(&Outcomes) -> &Vec<f64>| {
            runs.iter().flat_map(|run| of(run)).map(|error| error.abs()).collect::<Vec<f64>>()
        };
        let counted = |name: &str| {
            runs.iter().filter(|run| run.recovered.is_some_and(|(_, what)| what == name)).count()
        };
        Self {
            kind,
            runs: runs.len(),
            noticed: runs.iter().filter_map(|run| run.noticed).collect(),
            unnoticed: runs.iter().filter(|run| run.is_unnoticed()).count(),
            recovered: runs.iter().filter_map(|run| run.recovered).map(|(seconds, _)| seconds).collect(),
            outcomes: ["as before", "rescaled", "learnt anew"].map(counted),
            needed_operator: runs.iter().filter(|run| run.needed_operator).count(),
            before: all(|run| &run.before),
            after: all(|run| &run.after),
            incidents: runs.iter().map(|run| run.incidents.len()).sum(),
            powered_off: runs.iter().filter(|run| run.powered_off).count(),
        }
    }

    pub(super) fn json(&self) -> Value {
        let [as_before, rescaled, anew] = self.outcomes;
        json!({
            "kind": self.kind.key(), "runs": self.runs, "noticed": self.noticed.len(), "unnoticed": self.unnoticed,
            "noticed_s": median_and_high(self.noticed.iter().map(|[seconds, _]| *seconds)),
            "run_until_then_mm": median_and_high(self.noticed.iter().map(|[_, mm]| *mm)),
            "recovered": self.recovered.len(), "recovered_s": median_and_high(self.recovered.iter().copied()),
            "as_before": as_before, "rescaled": rescaled, "learnt_anew": anew,
            "needed_person": self.needed_operator, "powered_off": self.powered_off, "incidents": self.incidents,
            "stops_before": self.before.len(), "before_mm": median_and_high(self.before.iter().copied()),
            "stops_after": self.after.len(), "after_mm": median_and_high(self.after.iter().copied()),
        })
    }
}
