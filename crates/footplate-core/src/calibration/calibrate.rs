//! Recordings in, a calibration out: the batch fit in its order.
//!
//! Speeds need to know when a change of speed is over, laws of change need the speeds: the two are fitted in
//! turn until neither moves, which takes three rounds.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use super::joint_fit::{FittedPassage, JointFit, SpeedKey};
use super::law_fit::{LawComparison, LawKind, compare_laws};
use super::length_table::SectionIndex;
use super::passage::Drive;
use super::run::RunPassages;
use super::stop_fit::{StopTable, stop_tables};
use super::transient::{Direction, Transient, transients};
use crate::estimate::Estimate;
use crate::event::Approach;
use crate::ids::{SpeedStep, TrainId};
use crate::kinematics::StepTable;
use crate::time::TimeSpan;
use crate::track::Layout;
use crate::units::{Length, Speed};

/// Before a law is known: a slow start (80 mm/s², the slowest of the published trains) and a long delay.
const SLOW_ACCELERATION: f64 = 0.08;
const LONG_DELAY_S: f64 = 0.6;
/// A speed of which nothing is known is taken as this a step (m/s).
const SPEED_A_STEP: f64 = 0.040;
/// A change is taken as over this much after its law says so.
const MARGIN: f64 = 1.15;
const ROUNDS: usize = 3;

/// Everything that some runs tell of their trains.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// Speeds, lengths, deviations, and every contact beside its fit.
    pub fit: JointFit,
    /// Laws of speed change, by train and direction, where enough changes were seen.
    pub laws: BTreeMap<(TrainId, Direction), LawComparison>,
    /// The changes they rest on.
    pub transients: Vec<Transient>,
    /// Stops measured by hand.
    pub stops: BTreeMap<TrainId, StopTable>,
}

/// How a step differs by the side from which it was reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hysteresis {
    /// Speed from above less speed from below.
    pub difference: Estimate<Speed>,
    /// Whether the data tell the two apart: beyond two standard deviations.
    pub told_apart: bool,
}

impl Calibration {
    /// Calibrates all trains in the runs together. `None` when no run passes two contacts at a settled speed.
    #[must_use]
    pub fn of(layout: &Layout, sections: &SectionIndex, runs: &[RunPassages]) -> Option<Self> {
        let slow = |_: TrainId, drive: Drive| {
            let change = SPEED_A_STEP * f64::from(drive.step.get().abs_diff(drive.from.get()));
            TimeSpan::from_s(LONG_DELAY_S + change / SLOW_ACCELERATION)
        };
        let mut fit = JointFit::of(sections, runs, &slow)?;
        let mut laws = BTreeMap::new();
        let mut seen = Vec::new();
        for _ in 0..ROUNDS {
            let settle = |train: TrainId, drive: Drive| {
                settle_time(&fit, &laws, train, drive).unwrap_or_else(|| slow(train, drive))
            };
            let found = transients(sections, runs, &fit, &settle);
            let compared = compare_all(&fit, &found);
            let settle = |train: TrainId, drive: Drive| {
                settle_time(&fit, &compared, train, drive).unwrap_or_else(|| slow(train, drive))
            };
            let Some(refitted) = JointFit::of(sections, runs, &settle) else { break };
            (fit, laws, seen) = (refitted, compared, found);
        }
        let stops = stop_tables(layout, sections, runs, &fit);
        Some(Self { fit, laws, transients: seen, stops })
    }

    /// The difference between a step reached from above and from below, where both were seen.
    #[must_use]
    pub fn hysteresis(&self, train: TrainId, step: SpeedStep) -> Option<Hysteresis> {
        let speed = |approach| self.fit.speeds.get(&SpeedKey { train, step, approach }).copied();
        let (below, above) = (speed(Approach::Below)?, speed(Approach::Above)?);
        // Lengths make most of the uncertainty of a speed and are the same for both, so what is left of the
        // difference is the deviation of runs.
        let deviation = self.fit.run_deviation.get(&train).copied().unwrap_or(0.0);
        let runs = |approach| {
            let key = SpeedKey { train, step, approach };
            f64::from(self.fit.stretches.get(&key).copied().unwrap_or(1).max(1))
        };
        let part = deviation * libm::sqrt(1.0 / runs(Approach::Below) + 1.0 / runs(Approach::Above));
        let difference = Estimate {
            value: above.value - below.value,
            uncertainty: below.value * part,
            count: below.count.min(above.count),
            date: below.date.max(above.date),
        };
        let told_apart = difference.value.abs() > difference.uncertainty * 2.0;
        Some(Hysteresis { difference, told_apart })
    }

    /// The contacts behind a speed, in the order of the runs.
    pub fn behind(&self, key: SpeedKey) -> impl Iterator<Item = &FittedPassage> {
        self.fit.passages.iter().filter(move |passage| passage.key == key)
    }

    /// Contacts taken out of the fit because they are too improbable.
    pub fn suspicious(&self) -> impl Iterator<Item = &FittedPassage> {
        self.fit.passages.iter().filter(|passage| passage.suspicious)
    }

    /// The trains seen, in order.
    #[must_use]
    pub fn trains(&self) -> Vec<TrainId> {
        let mut trains: Vec<TrainId> = self.fit.speeds.keys().map(|key| key.train).collect();
        trains.dedup();
        trains
    }

    /// How long after a command the speed is settled, where the law of the train is known.
    #[must_use]
    pub fn settle_time(&self, train: TrainId, drive: Drive) -> Option<TimeSpan> {
        settle_time(&self.fit, &self.laws, train, drive)
    }

    /// Scatter of a train's contacts.
    #[must_use]
    pub fn contact_scatter(&self, train: TrainId) -> Option<Length> {
        self.fit.contact_scatter.get(&train).copied()
    }
}

fn settle_time(
    fit: &JointFit,
    laws: &BTreeMap<(TrainId, Direction), LawComparison>,
    train: TrainId,
    drive: Drive,
) -> Option<TimeSpan> {
    let comparison = laws.get(&(train, Direction::of(drive)))?;
    let law = comparison.laws.get(comparison.best)?;
    let speed = |step: SpeedStep| {
        if step == SpeedStep::STAND {
            return Some(Speed::ZERO);
        }
        fit.speed(train, step, drive.approach()).map(|speed| speed.value)
    };
    let (from, to) = (speed(drive.from)?, speed(drive.step)?);
    let [pace, _] = law.pace;
    let takes = match law.kind {
        LawKind::Family(family) => {
            use crate::kinematics::Motion;
            family.change(pace, from, to).duration().as_s()
        }
        LawKind::StepRamp => pace * f64::from(drive.step.get().abs_diff(drive.from.get())),
        LawKind::Table => law.curve.as_ref()?.duration([from, to]),
    };
    let [delay, _] = law.delay;
    Some(TimeSpan::from_s(delay + MARGIN * takes))
}

fn compare_all(fit: &JointFit, seen: &[Transient]) -> BTreeMap<(TrainId, Direction), LawComparison> {
    let mut grouped: BTreeMap<(TrainId, Direction), Vec<Transient>> = BTreeMap::new();
    for change in seen {
        grouped.entry((change.train, change.direction())).or_default().push(change.clone());
    }
    grouped
        .into_iter()
        .filter_map(|((train, direction), changes)| {
            let table = step_table(fit, train);
            Some(((train, direction), compare_laws(&changes, table.as_ref())?))
        })
        .collect()
}

/// The speeds of all steps of a train for a ramp through them, gaps on straight lines; `None` below three.
pub(super) fn step_table(fit: &JointFit, train: TrainId) -> Option<StepTable> {
    let known: Vec<(u8, f64)> = core::iter::once((0, 0.0))
        .chain((1..=SpeedStep::HIGHEST).filter_map(|number| {
            let step = SpeedStep::new(number)?;
            Some((number, fit.speed(train, step, Approach::Below)?.value.as_m_per_s()))
        }))
        .collect();
    if known.len() < 4 {
        return None;
    }
    let (last, _) = *known.last()?;
    let speeds: Vec<Speed> = (0..=last)
        .filter_map(|number| {
            let above = known.partition_point(|(step, _)| *step < number);
            let (high, upper) = *known.get(above)?;
            let (low, lower) =
                if high == number { (high, upper) } else { *known.get(above.checked_sub(1)?)? };
            let part = if high == low { 0.0 } else { f64::from(number - low) / f64::from(high - low) };
            Some(Speed::from_m_per_s(lower + part * (upper - lower)))
        })
        .collect();
    StepTable::new(&speeds).ok()
}
