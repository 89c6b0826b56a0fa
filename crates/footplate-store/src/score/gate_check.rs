//! Compares the estimator with light gates, which it never sees.
//!
//! Two gates are [`GATE_DISTANCE`] apart somewhere on the loop. Their clock is not synchronised, so each pair of passes
//! gives one speed, and the pairs of a run belong to its laps in order. Their place on the loop is not recorded; each
//! speed is therefore compared with the estimated speed of the run at the end of the same lap. The difference includes
//! the resolution of the gates and the deviation of the local speed from the lap's mean.

use std::collections::BTreeMap;

use footplate_core::{Estimate, Length, NodeId, RunId, Speed, SpeedStep, TimeSpan, TrainId};

use crate::recording::{GatePass, Run};

/// The distance between the gates, as stated by the team that installed them.
pub const GATE_DISTANCE: Length = Length::from_mm(20.0);
/// The resolution of the gates' clock.
pub const GATE_TICK: TimeSpan = TimeSpan::from_ms(1);
/// Two passes further apart are not of one crossing: that would be 10 mm/s, slower than any train ran. Chosen.
const LONGEST_CROSSING: TimeSpan = TimeSpan::from_ms(2_000);

/// A pair of gate passes beside the estimate of its lap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GateCheck {
    /// The run.
    pub run: RunId,
    /// The line of the file with the second pass.
    pub line: u64,
    /// The train.
    pub train: TrainId,
    /// Its step.
    pub step: SpeedStep,
    /// The lap, counted from 1.
    pub lap: usize,
    /// Speed between the gates.
    pub spot: Speed,
    /// The standard deviation of `spot` from the resolution of the gates' clock alone.
    pub resolution: Speed,
    /// The estimated speed of the train at the end of the lap.
    pub estimated: Estimate<Speed>,
}

impl GateCheck {
    /// The estimated speed minus the speed between the gates.
    pub fn excess(&self) -> Speed {
        self.estimated.value - self.spot
    }
}

/// The statistics of many checks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GateAgreement {
    /// Pairs.
    pub count: usize,
    /// Mean excess of the estimates over the gates, in mm/s.
    pub bias_mm_per_s: f64,
    /// The same, as a part of the speed.
    pub bias: f64,
    /// Standard deviation of the excess about its mean, in mm/s; 0 for one pair.
    pub spread_mm_per_s: f64,
    /// The same, as a part of the speed.
    pub spread: f64,
    /// The same about the mean of each train and step, in mm/s; `None` if none has two pairs.
    pub spread_within_mm_per_s: Option<f64>,
    /// The same, as a part of the speed.
    pub spread_within: Option<f64>,
    /// The part of the spread that the resolution of the gates' clock explains, in mm/s (root mean square).
    pub resolution_mm_per_s: f64,
    /// The same, as a part of the speed.
    pub resolution: f64,
}

impl GateAgreement {
    /// The statistics of all checks; `None` without a check.
    pub fn of<'a>(checks: impl Iterator<Item = &'a GateCheck>) -> Option<Self> {
        let checks: Vec<&GateCheck> = checks.collect();
        let column =
            |value: fn(&GateCheck) -> f64| checks.iter().map(|check| value(check)).collect::<Vec<_>>();
        let (bias_mm_per_s, spread_mm_per_s) = mean_and_deviation(&column(|c| c.excess().as_mm_per_s()))?;
        let (bias, spread) = mean_and_deviation(&column(|c| c.excess() / c.spot))?;
        Some(Self {
            count: checks.len(),
            bias_mm_per_s,
            bias,
            spread_mm_per_s,
            spread,
            spread_within_mm_per_s: deviation_within(&checks, |check| check.excess().as_mm_per_s()),
            spread_within: deviation_within(&checks, |check| check.excess() / check.spot),
            resolution_mm_per_s: root_mean_square(&column(|c| c.resolution.as_mm_per_s())),
            resolution: root_mean_square(&column(|c| c.resolution / c.spot)),
        })
    }
}

impl GateAgreement {
    /// The statistics of each train.
    pub fn by_train<'a>(checks: impl Iterator<Item = &'a GateCheck>) -> BTreeMap<TrainId, Self> {
        let mut trains: BTreeMap<TrainId, Vec<&GateCheck>> = BTreeMap::new();
        for check in checks {
            trains.entry(check.train).or_default().push(check);
        }
        let of_train =
            |(train, checks): (TrainId, Vec<&GateCheck>)| Some((train, Self::of(checks.into_iter())?));
        trains.into_iter().filter_map(of_train).collect()
    }
}

fn mean_and_deviation(values: &[f64]) -> Option<(f64, f64)> {
    let degrees = values.len().checked_sub(1)?;
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    Some((mean, (squares / degrees.max(1) as f64).sqrt()))
}

/// Standard deviation about the mean of each train and step, pooled.
fn deviation_within(checks: &[&GateCheck], value: fn(&GateCheck) -> f64) -> Option<f64> {
    let mut groups: BTreeMap<(TrainId, SpeedStep), Vec<f64>> = BTreeMap::new();
    for check in checks {
        groups.entry((check.train, check.step)).or_default().push(value(check));
    }
    let (mut squares, mut degrees) = (0.0, 0);
    for values in groups.values() {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        squares += values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>();
        degrees += values.len() - 1;
    }
    (degrees > 0).then(|| (squares / degrees as f64).sqrt())
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// The estimated speed at the end of each lap of a run.
#[derive(Debug, Default)]
pub(super) struct LapSpeeds {
    first: Option<NodeId>,
    laps: Vec<Estimate<Speed>>,
    latest: Option<Estimate<Speed>>,
}

impl LapSpeeds {
    /// Takes in a passage and the estimate after it.
    pub(super) fn take(&mut self, node: NodeId, speed: Option<Estimate<Speed>>) {
        self.latest = speed.or(self.latest);
        match self.first {
            None => self.first = Some(node),
            Some(first) if first == node => self.laps.extend(self.latest),
            Some(_) => {}
        }
    }

    /// The gate checks of the run; an incomplete last lap ends with the run.
    pub(super) fn checks(&self, run: &Run, train: TrainId, step: SpeedStep) -> Vec<GateCheck> {
        let mut checks = Vec::new();
        for (place, crossing) in crossings(&run.gates).enumerate() {
            let Some((second, took)) = crossing else { continue };
            let Some(estimated) = self.laps.get(place).copied().or(self.latest) else { continue };
            let spot = GATE_DISTANCE / took;
            // Each time stamp has a uniform error of ± half a tick: tick/√12, and √2 times that for a difference.
            let resolution = spot * (GATE_TICK.as_s() / took.as_s() / 6.0_f64.sqrt());
            let (run, line, lap) = (run.id, second.line, place + 1);
            checks.push(GateCheck { run, line, train, step, lap, spot, resolution, estimated });
        }
        checks
    }
}

/// The times at which the train crossed the gates: the pass of the second one and the time between both, or `None` if only
/// one of them saw the train. Two passes belong together if the gates differ and the train cannot have run a lap between them.
fn crossings(gates: &[GatePass]) -> impl Iterator<Item = Option<(GatePass, TimeSpan)>> {
    let mut rest = gates;
    std::iter::from_fn(move || {
        let (first, others) = rest.split_first()?;
        rest = others;
        let (second, later) = others.split_first()?;
        let took = second.time - first.time;
        if first.gate == second.gate || took <= TimeSpan::ZERO || took > LONGEST_CROSSING {
            return Some(None);
        }
        rest = later;
        Some(Some((*second, took)))
    })
}

#[cfg(test)]
mod tests {
    use footplate_core::Timestamp;

    use super::*;

    #[test]
    fn a_missed_pass_costs_the_pair_of_its_lap_only() {
        let pass = |(gate, s)| GatePass { line: 0, gate, time: Timestamp::from_s(s) };
        // Three laps of 20 s, 0.5 s between the gates; gate 2 misses the train on the second lap.
        let gates = [(1, 0.0), (2, 0.5), (1, 20.0), (1, 40.0), (2, 40.5)].map(pass);
        let found: Vec<Option<f64>> =
            crossings(&gates).map(|crossing| crossing.map(|(_, took)| took.as_s())).collect();
        assert_eq!(found, [Some(0.5), None, Some(0.5)]);
    }
}
