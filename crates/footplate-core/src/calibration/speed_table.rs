//! What is known of a train's steady speed at each throttle step, by the side from which it was reached.
//!
//! Kept as the logarithm of the speed: a dirty rail, a warm engine or a wrong length changes all speeds by
//! a factor, and the doubt of a speed is a part of it. Every run deviates by a few parts in a thousand as a
//! whole (repeats of one run: 0.3 to 0.8 % on seven published trains), so a run teaches the table no more
//! than its own deviation allows.

use alloc::vec;
use alloc::vec::Vec;

use crate::estimate::Estimate;
use crate::event::Approach;
use crate::ids::SpeedStep;
use crate::time::Timestamp;
use crate::units::Speed;

const APPROACHES: usize = 3;
const STEPS: usize = SpeedStep::HIGHEST as usize + 1;

/// Deviation of a run from the table before a train has shown its own: the upper end of repeats of one run.
const RUN_DEVIATION: f64 = 0.008;
/// How many runs that first figure is worth against those seen.
const RUN_DEVIATION_WEIGHT: f64 = 4.0;
/// The table itself wanders from run to run by this part (4 to 20 % between teams and years: good for a day).
const TABLE_WANDER: f64 = 0.001;
/// The same step from the other side: 13 to 31 mm/s apart at some 400 mm/s.
const OTHER_APPROACH: f64 = 0.06;
/// A step between known neighbours: what interpolation in the logarithm misses on published tables.
const INTERPOLATED: f64 = 0.08;
/// Each step beyond the last known one adds this doubt, less where the last two show the slope.
const EXTRAPOLATED: f64 = 0.15;
const EXTRAPOLATED_BY_SLOPE: f64 = 0.08;
/// Published tables rise from about this step on: 0 to 4 on seven trains.
const DEAD_STEPS: f64 = 2.0;
/// A neighbouring step is never taken as slower than this part of a speed.
const LEAST_RATIO: f64 = 0.6;
/// A model train of 14 steps does some 40 mm/s a step (published tables: 30 to 47 at step 14), give or take
/// a factor of 1.8 at any step.
const UNSEEN_SPEED_A_STEP: f64 = 0.040;
const UNSEEN: f64 = 0.6;

/// How well a step is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Familiarity {
    /// Nothing near it was ever measured.
    Unseen,
    /// Neighbouring steps or the other approach were measured.
    Inferred,
    /// It was measured.
    Measured,
}

/// What to expect of a step before a run has shown its own speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected {
    /// Logarithm of the speed in m/s.
    pub ln_speed: f64,
    /// Variance of that for the run ahead.
    pub variance: f64,
    /// How it is known.
    pub familiarity: Familiarity,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Entry {
    ln_speed: f64,
    variance: f64,
    runs: u32,
    date: Timestamp,
}

/// The steady speeds of one train.
#[derive(Debug, Clone)]
pub struct SpeedTable {
    entries: Vec<Option<Entry>>,
    /// Sum of squared deviations of runs, with their number, the first figure included.
    deviation_squares: f64,
    deviation_runs: f64,
}

impl Default for SpeedTable {
    fn default() -> Self {
        Self {
            entries: vec![None; STEPS * APPROACHES],
            deviation_squares: RUN_DEVIATION * RUN_DEVIATION * RUN_DEVIATION_WEIGHT,
            deviation_runs: RUN_DEVIATION_WEIGHT,
        }
    }
}

fn place(step: SpeedStep, approach: Approach) -> usize {
    usize::from(step.get()) * APPROACHES
        + match approach {
            Approach::Below => 0,
            Approach::Above => 1,
            Approach::Unknown => 2,
        }
}

impl SpeedTable {
    fn entry(&self, step: SpeedStep, approach: Approach) -> Option<Entry> {
        self.entries.get(place(step, approach)).copied().flatten()
    }

    /// The best known entry of a step from any side, preferring from below and unknown over the far side.
    fn any_entry(&self, step: SpeedStep, approach: Approach) -> Option<(Entry, f64)> {
        if let Some(entry) = self.entry(step, approach) {
            return Some((entry, 0.0));
        }
        [Approach::Unknown, Approach::Below, Approach::Above]
            .into_iter()
            .find_map(|other| self.entry(step, other))
            .map(|entry| (entry, OTHER_APPROACH * OTHER_APPROACH))
    }

    /// Variance of one run about the table, as ln speed.
    #[must_use]
    pub fn run_variance(&self) -> f64 {
        self.deviation_squares / self.deviation_runs
    }

    /// What to expect of a run at this step.
    #[must_use]
    pub fn expected(&self, step: SpeedStep, approach: Approach) -> Expected {
        if let Some((entry, doubt)) = self.any_entry(step, approach) {
            return Expected {
                ln_speed: entry.ln_speed,
                variance: entry.variance + doubt + self.run_variance(),
                familiarity: if doubt > 0.0 { Familiarity::Inferred } else { Familiarity::Measured },
            };
        }
        let at = |step: u8| {
            SpeedStep::new(step).and_then(|step| self.any_entry(step, approach)).map(|(entry, _)| entry)
        };
        let below = (1..step.get()).rev().find_map(|known| at(known).map(|entry| (known, entry)));
        let above = (step.get().saturating_add(1)..=SpeedStep::HIGHEST)
            .find_map(|known| at(known).map(|entry| (known, entry)));
        let own = f64::from(step.get());
        let (ln_speed, doubt) = match (below, above) {
            (Some((low, under)), Some((high, over))) => {
                let part = (own - f64::from(low)) / f64::from(high - low);
                let gap = f64::from(high - low) / 2.0;
                (under.ln_speed + part * (over.ln_speed - under.ln_speed), INTERPOLATED * gap)
            }
            // Beyond what was measured the table goes on as it came, or as published tables do.
            (Some((known, entry)), None) | (None, Some((known, entry))) => {
                let beside = if below.is_some() { known.checked_sub(1) } else { known.checked_add(1) };
                let slope = beside.and_then(at).map(|beside| {
                    let step = libm::exp(entry.ln_speed) - libm::exp(beside.ln_speed);
                    if below.is_some() { step } else { -step }
                });
                let away = own - f64::from(known);
                let value = libm::exp(entry.ln_speed);
                let floor = value * libm::pow(LEAST_RATIO, away.abs());
                let usual = value * (own - DEAD_STEPS).max(0.5) / (f64::from(known) - DEAD_STEPS).max(0.5);
                let speed =
                    slope.map_or(usual, |slope| value + away * slope).clamp(floor, value * value / floor);
                let doubt = if slope.is_some() { EXTRAPOLATED_BY_SLOPE } else { EXTRAPOLATED };
                (libm::log(speed), doubt * away.abs())
            }
            (None, None) => (libm::log(UNSEEN_SPEED_A_STEP * own.max(1.0)), UNSEEN),
        };
        Expected {
            ln_speed,
            variance: doubt * doubt + self.run_variance(),
            familiarity: if below.is_none() && above.is_none() {
                Familiarity::Unseen
            } else {
                Familiarity::Inferred
            },
        }
    }

    /// A run is over, or leaves the step. It was expected as `before` and ended knowing its own speed as
    /// `ln_speed` with `variance`, both with what was expected already in them; the table takes its share.
    pub fn learn(
        &mut self,
        step: SpeedStep,
        approach: Approach,
        before: Expected,
        ln_speed: f64,
        variance: f64,
        date: Timestamp,
    ) {
        if !(ln_speed.is_finite() && variance >= 0.0 && variance < before.variance) {
            return;
        }
        let run_variance = self.run_variance();
        let known = self.entry(step, approach);
        let entry = match known {
            None => Entry { ln_speed, variance: variance + run_variance, runs: 1, date },
            Some(entry) => {
                // What the run itself measured, its expectation taken out again.
                let own_variance = 1.0 / (1.0 / variance - 1.0 / before.variance);
                let own = ln_speed + (ln_speed - before.ln_speed) * own_variance / before.variance;
                let table_variance = entry.variance + TABLE_WANDER * TABLE_WANDER;
                let off = own - entry.ln_speed;
                // The deviation of this run, free of what the table and the run itself do not know.
                let explained = (off * off - table_variance - own_variance).max(0.0);
                self.deviation_squares += explained;
                self.deviation_runs += 1.0;
                let gain = table_variance / (table_variance + run_variance + own_variance);
                Entry {
                    ln_speed: entry.ln_speed + gain * off,
                    variance: table_variance * (1.0 - gain),
                    runs: entry.runs.saturating_add(1),
                    date,
                }
            }
        };
        if let Some(slot) = self.entries.get_mut(place(step, approach)) {
            *slot = Some(entry);
        }
    }

    /// The past no longer tells the future: the entry is doubted by this much more (as ln speed, one
    /// standard deviation).
    pub fn doubt(&mut self, step: SpeedStep, approach: Approach, deviation: f64) {
        if let Some(Some(entry)) = self.entries.get_mut(place(step, approach)) {
            entry.variance += deviation * deviation;
        }
    }

    /// Takes a speed from elsewhere, such as a calibration, as the entry of a step.
    pub fn set(&mut self, step: SpeedStep, approach: Approach, speed: Estimate<Speed>) {
        let value = speed.value.as_m_per_s();
        let part = speed.uncertainty.as_m_per_s() / value;
        if let (Some(slot), true) =
            (self.entries.get_mut(place(step, approach)), value > 0.0 && part.is_finite())
        {
            *slot = Some(Entry {
                ln_speed: libm::log(value),
                variance: part * part,
                runs: speed.count,
                date: speed.date,
            });
        }
    }

    /// Takes the deviation of a run from the table from elsewhere: one standard deviation as a part of the
    /// speed, and how many runs that figure is worth against those still to come.
    pub fn set_run_deviation(&mut self, deviation: f64, runs: f64) {
        if deviation.is_finite() && runs > 0.0 && runs.is_finite() {
            self.deviation_squares = deviation * deviation * runs;
            self.deviation_runs = runs;
        }
    }

    /// All measured speeds, by step and approach; the count is of runs.
    pub fn speeds(&self) -> impl Iterator<Item = (SpeedStep, Approach, Estimate<Speed>)> + '_ {
        (0..=SpeedStep::HIGHEST).filter_map(SpeedStep::new).flat_map(move |step| {
            [Approach::Below, Approach::Above, Approach::Unknown].into_iter().filter_map(move |approach| {
                let entry = self.entry(step, approach)?;
                let value = libm::exp(entry.ln_speed);
                Some((
                    step,
                    approach,
                    Estimate {
                        value: Speed::from_m_per_s(value),
                        uncertainty: Speed::from_m_per_s(value * libm::sqrt(entry.variance)),
                        count: entry.runs,
                        date: entry.date,
                    },
                ))
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(step: u8) -> SpeedStep {
        SpeedStep::new(step).unwrap()
    }

    /// A run that measured ln speed `own` with this variance by itself.
    fn run(table: &mut SpeedTable, at: u8, own: f64, own_variance: f64) {
        let before = table.expected(step(at), Approach::Below);
        let variance = 1.0 / (1.0 / before.variance + 1.0 / own_variance);
        let ln = variance * (before.ln_speed / before.variance + own / own_variance);
        table.learn(step(at), Approach::Below, before, ln, variance, Timestamp::ZERO);
    }

    #[test]
    fn many_equal_runs_end_at_their_mean_with_the_doubt_of_a_mean() {
        // Given 20 runs that each measure ln 0.4 ± 0.2 %,
        let mut table = SpeedTable::default();
        for _ in 0..20 {
            run(&mut table, 8, libm::log(0.4), 0.002 * 0.002);
        }
        // then the mean is found, and the doubt is that of 20 runs with a run's own deviation, not 0.2 %/√20.
        let (_, _, speed) = table.speeds().next().unwrap();
        assert!((speed.value.as_mm_per_s() - 400.0).abs() < 0.5, "{speed:?}");
        let part = speed.uncertainty / speed.value;
        assert!(part > 0.0008 && part < 0.004, "{part}");
        assert_eq!(speed.count, 20);
    }

    #[test]
    fn an_unmeasured_step_is_inferred_between_its_neighbours() {
        let mut table = SpeedTable::default();
        assert_eq!(table.expected(step(10), Approach::Below).familiarity, Familiarity::Unseen);
        run(&mut table, 8, libm::log(0.3), 1e-6);
        run(&mut table, 12, libm::log(0.48), 1e-6);
        let inferred = table.expected(step(10), Approach::Below);
        assert_eq!(inferred.familiarity, Familiarity::Inferred);
        // The geometric mean of 0.3 and 0.48.
        assert!((libm::exp(inferred.ln_speed) - 0.379_47).abs() < 2e-3);
        assert!(inferred.variance > 0.05 * 0.05);
    }
}
