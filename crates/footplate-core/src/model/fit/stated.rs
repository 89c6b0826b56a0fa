//! Speeds that another program states for a train, as measurements before the first run.
//!
//! A table of speeds by throttle setting was measured on another layout, at another time, by a procedure that we do not know. All
//! of it may be too fast or too slow by one factor, each entry has an error of its own, and some entries are gross errors.
//! Letters, for entry `i` at a fractional step `x` between the steps `a` and `b`: `z = ln v` stated, `f = ln(x/a)/ln(b/a)`,
//!
//! ```text
//! z = (1 − f) ln v(a) + f ln v(b) + c + e,   c ~ N(0, SCALE²),   e ~ N(0, STEP² + (FLOOR/v)²)
//! ```
//!
//! `c` is common to the table and is eliminated afterwards. Entries are weighted by how far they are from what prior and
//! other entries predict (leave-one-out residuals of a weighted least-squares fit), so that gross errors count little. A table
//! whose entries contradict each other counts less as a whole.

use alloc::vec;
use alloc::vec::Vec;

use super::motion_fit::MotionFit;
use super::robust::RobustWeight;
use crate::linalg::{NormalEquations, Solution};
use crate::model::motion_model::MotionModel;
use crate::model::parameters::{DOWN, START_NODES, STOP_NODES, UP, bend_deviation, count, knots, speed_at};
use crate::model::priors::independent_nodes;
use crate::model::spread::Spread;
use crate::model::survey::{PER_MEDIAN, median};
use crate::time::TimeSpan;
use crate::units::Speed;

/// Relative error that all speeds of a table have in common (tables of different teams for one train: standard deviation 5.7 %,
/// `velocity.csv` of 31 teams; 37 pairs of tables).
const SCALE: f64 = 0.057;
/// Relative error of each entry (the same pairs after their common factor, from 200 mm/s on: 1.0 to 2.7 %, median 2.4 %).
const STEP: f64 = 0.024;
/// The least error of an entry (m/s): below 150 mm/s the same pairs differ by 5 to 18 mm/s, since approach and load matter more.
const FLOOR: f64 = 0.010;
/// An entry that another program also gave an uncertainty is on another layout now; this relative error remains (published
/// section means: 1 to 3 %).
const LEAST: f64 = 0.01;
/// Relative error of a momentum time: decoders count 0.25 to 0.9 s for each unit of CV 3 and 4, around 0.5 s.
const MOMENTUM: f64 = 0.6;
/// The weight of what counts for nothing.
const LEAST_WEIGHT: f64 = 1e-12;
/// Iterations of the weights; they settle within ten.
const ITERATIONS: usize = 20;
/// Beyond so many standard deviations an entry contradicts the others: one in 300 by chance.
const CONTRADICTS: f64 = 3.0;
/// Beyond so many it is a gross error and counts for nothing: a report of another train, a length that was mistyped.
const GROSS: f64 = 5.0;
/// Place of `ρ` among the numbers of a direction.
const RHO: usize = 3;

/// A speed that another program states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatedSpeed {
    /// The throttle setting, from 0 (stop) to 1 (highest step).
    pub throttle: f64,
    /// The speed.
    pub speed: Speed,
    /// One standard deviation, if the program states it too.
    pub uncertainty: Option<Speed>,
}

/// All that another program states about the motion of a train.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StatedMotion {
    /// Speeds, in any order; several may have one setting.
    pub speeds: Vec<StatedSpeed>,
    /// The time of the decoder's ramp from rest to its highest step.
    pub speeding_up: Option<TimeSpan>,
    /// The time of the decoder's ramp from its highest step to rest.
    pub slowing_down: Option<TimeSpan>,
}

/// How a stated speed fits the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatedFit {
    /// What prior and other entries predict for this setting.
    pub predicted: Speed,
    /// One standard deviation of ln of the stated speed about it.
    pub deviation: f64,
    /// How far the stated speed is from it, in standard deviations.
    pub sigmas: f64,
    /// Its weight, from 0 (ignored) to 1.
    pub weight: f64,
}

impl StatedFit {
    /// Whether the entry contradicts the others.
    pub fn contradicts(&self) -> bool {
        self.sigmas.abs() > CONTRADICTS
    }

    /// Whether it is a gross error, which counts for nothing.
    pub fn is_gross(&self) -> bool {
        self.sigmas.abs() > GROSS
    }
}

/// One entry as a measurement of the train's numbers.
struct Row {
    terms: Vec<(usize, f64)>,
    measured: f64,
    variance: f64,
}

impl Row {
    /// `None` where no step is at or below the setting, or the numbers make no speed.
    fn of(stated: &StatedSpeed, highest: usize, scale_column: usize) -> Option<Self> {
        let speed = stated.speed.as_m_per_s();
        let measured = libm::log(speed);
        let (terms, variance) = terms_at(stated.throttle, knots(highest))?;
        if !measured.is_finite() {
            return None;
        }
        let own = match stated.uncertainty {
            Some(uncertainty) => libm::hypot(LEAST, uncertainty.as_m_per_s() / speed),
            None => libm::hypot(STEP, FLOOR / speed),
        };
        let mut terms = terms;
        terms.push((scale_column, 1.0));
        let variance = variance + own * own;
        variance.is_finite().then_some(Self { terms, measured, variance })
    }
}

/// ln speed at a throttle setting as a sum of the numbers of two steps, and the variance of the interpolation.
fn terms_at(throttle: f64, highest: usize) -> Option<(Vec<(usize, f64)>, f64)> {
    // The nearest step of a throttle that is written in thousandths.
    const ROUNDED: f64 = 1e-3;
    let place = throttle * highest as f64;
    let low = libm::floor(place + ROUNDED * highest as f64);
    if !(low >= 1.0 && place <= highest as f64 * (1.0 + ROUNDED)) {
        return None;
    }
    let step = (low as usize).min(highest);
    let part = libm::log(place / step as f64) / libm::log1p(1.0 / step as f64);
    if step == highest || part <= 0.0 {
        return Some((vec![(speed_at(step), 1.0)], 0.0));
    }
    // A parabola between two steps is farthest from its chord in the middle, by an eighth of its second difference.
    let bend = bend_deviation(step) * 0.5 * part * (1.0 - part);
    Some((vec![(speed_at(step), 1.0 - part), (speed_at(step + 1), part)], bend * bend))
}

/// The rows of a table, and the position of each in it.
struct Table {
    rows: Vec<(usize, Row)>,
    fits: Vec<Option<StatedFit>>,
    /// Factor on the variance of all rows.
    inflation: f64,
}

impl MotionFit {
    /// Takes what another program states about this train. Only for a fit without data. Returns how each speed fits the others;
    /// `None` for those below the first step, or that are no speeds.
    ///
    /// Steps count as untried after this: only a run shows that a step moves the train.
    pub fn take_stated(&mut self, stated: &StatedMotion) -> Vec<Option<StatedFit>> {
        let highest = usize::from(self.model.highest().get());
        let (equations, mut table) = self.weighed(stated);
        let Some(mut all) = table.with_rows(&equations) else { return table.fits };
        if all.eliminate_last().is_none() {
            return table.fits;
        }
        if let Some(solution) = closed(&all).and_then(|closed| closed.solve()) {
            self.prior.equations = all;
            self.model.values = solution.values.get(..count(highest)).unwrap_or_default().to_vec();
            (self.model.spread, self.model.scale) = Spread::of(&solution, highest, &[]);
        }
        core::mem::take(&mut table.fits)
    }

    /// Compares other entries of the same table with what `known` predicts for them, and takes nothing.
    pub fn compare_stated(&self, known: &StatedMotion, others: &[StatedSpeed]) -> Vec<Option<StatedFit>> {
        let (equations, known) = self.weighed(known);
        let mut compared = Table::of(others, &self.model, equations.unknowns());
        compared.inflation = known.inflation;
        if let Some(solution) = known.solved(&equations, true) {
            compared.refit(&solution, false);
        }
        compared.fits
    }

    /// The prior with the decoder's momentum, and the table with its weights.
    fn weighed(&self, stated: &StatedMotion) -> (NormalEquations, Table) {
        let highest = usize::from(self.model.highest().get());
        let mut equations = self.prior.equations.clone();
        for (first, time) in [(UP, stated.speeding_up), (DOWN, stated.slowing_down)] {
            let by_step = time.map_or(0.0, |time| time.as_s() / knots(highest).max(1) as f64);
            if by_step > 0.0 && by_step.is_finite() {
                let deviation = MOMENTUM * by_step;
                equations.add(&[(first + RHO, 1.0)], by_step, deviation * deviation);
            }
        }
        let mut table = Table::of(&stated.speeds, &self.model, equations.unknowns());
        table.weigh(&equations);
        (equations, table)
    }
}

/// The equations with all their priors: the place of the next trip is unknown, and laws leave over what is usual.
fn closed(equations: &NormalEquations) -> Option<NormalEquations> {
    let mut closed = equations.clone();
    closed.eliminate_last()?;
    for first in [STOP_NODES, START_NODES] {
        independent_nodes(first).for_each(|(sum, usual)| closed.add(&sum, usual, 1.0));
    }
    Some(closed)
}

impl Table {
    fn of(speeds: &[StatedSpeed], model: &MotionModel, scale_column: usize) -> Self {
        let highest = usize::from(model.highest().get());
        let row = |(at, one)| Row::of(one, highest, scale_column).map(|row| (at, row));
        Self {
            rows: speeds.iter().enumerate().filter_map(row).collect(),
            fits: vec![None; speeds.len()],
            inflation: 1.0,
        }
    }

    /// The equations with one more unknown, the common factor, and all rows by their weights.
    fn with_rows(&self, equations: &NormalEquations) -> Option<NormalEquations> {
        let mut all = equations.clone();
        let scale_column = all.unknowns();
        all.append(1);
        all.add(&[(scale_column, 1.0)], 0.0, SCALE * SCALE);
        for (at, row) in &self.rows {
            let weight = self.fits.get(*at)?.map_or(1.0, |fit| fit.weight);
            all.add(&row.terms, row.measured, self.inflation * row.variance / weight.max(LEAST_WEIGHT));
        }
        Some(all)
    }

    fn weigh(&mut self, equations: &NormalEquations) {
        let Some(only_prior) = self.solved(equations, false) else { return };
        self.refit(&only_prior, false);
        for _ in 0..ITERATIONS {
            let Some(solution) = self.solved(equations, true) else { return };
            self.refit(&solution, true);
        }
        let sizes = || self.fits.iter().flatten().map(|fit| fit.sigmas.abs());
        // Few entries say little about how well a table was measured.
        let count = sizes().count() as f64;
        let share = count / (count + 4.0);
        let factor = 1.0 + share * (PER_MEDIAN * median(sizes()).unwrap_or(0.0) - 1.0).max(0.0);
        self.inflation = factor * factor;
        if factor > 1.0
            && let Some(solution) = self.solved(equations, true)
        {
            self.refit(&solution, true);
        }
    }

    /// The solution with or without the rows. The common factor comes in the place of the first trip's begin, which is free.
    fn solved(&self, equations: &NormalEquations, with_rows: bool) -> Option<Solution> {
        let bare = Self { rows: Vec::new(), fits: Vec::new(), inflation: 1.0 };
        let mut all = if with_rows { self } else { &bare }.with_rows(equations)?;
        all.swap_last_two();
        closed(&all)?.solve()
    }

    /// Compares each row with what prior and other rows predict.
    fn refit(&mut self, solution: &Solution, with_rows: bool) {
        let (inflation, fits) = (self.inflation, &mut self.fits);
        for (at, row) in &self.rows {
            let Some(slot) = fits.get_mut(*at) else { continue };
            // The common factor has moved one place down.
            let mut terms = row.terms.clone();
            if let Some(last) = terms.last_mut() {
                last.0 -= 1;
            }
            let value: f64 =
                terms.iter().filter_map(|(place, by)| Some(by * solution.values.get(*place)?)).sum();
            let (mut residual, mut variance) = (row.measured - value, solution.variance_of(&terms));
            if with_rows {
                // Without the row itself, in closed form: its share in its own prediction is taken back.
                let weight = slot.map_or(1.0, |fit| fit.weight).max(LEAST_WEIGHT);
                let free = (1.0 - variance * weight / (inflation * row.variance)).max(1e-9);
                residual /= free;
                variance /= free;
            }
            let deviation = libm::sqrt(variance + inflation * row.variance);
            let sigmas = residual / deviation;
            *slot = Some(StatedFit {
                predicted: Speed::from_m_per_s(libm::exp(row.measured - residual)),
                deviation,
                sigmas,
                weight: if sigmas.abs() > GROSS { 0.0 } else { RobustWeight::STOPS.weight(sigmas.abs()) },
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::Approach;
    use crate::ids::{SpeedStep, TrainId};

    fn fit(highest: u8) -> MotionFit {
        MotionFit::new(TrainId(24), SpeedStep::new(highest).unwrap())
    }

    fn stated(entries: &[(f64, f64)]) -> StatedMotion {
        let speed = |(throttle, mm_per_s): &(f64, f64)| StatedSpeed {
            throttle: *throttle,
            speed: Speed::from_mm_per_s(*mm_per_s),
            uncertainty: None,
        };
        StatedMotion { speeds: entries.iter().map(speed).collect(), ..StatedMotion::default() }
    }

    /// Train 58 of the course, by the tables of several teams: throttle and speed (mm/s).
    const TRAIN_58: [(f64, f64); 4] =
        [(5.0 / 14.0, 66.0), (8.0 / 14.0, 190.0), (11.0 / 14.0, 371.0), (1.0, 579.0)];

    fn speed(fit: &MotionFit, step: u8) -> (f64, f64) {
        let speed = fit.model().speed(SpeedStep::new(step).unwrap(), Approach::Below);
        (speed.value.as_mm_per_s(), speed.uncertainty.as_mm_per_s())
    }

    #[test]
    fn a_stated_speed_is_known_to_some_percent_and_its_neighbours_less_well() {
        let mut fit = fit(14);
        let before = speed(&fit, 8);
        let stop = fit.model().stop(SpeedStep::new(8).unwrap(), Approach::Below);
        let fits = fit.take_stated(&stated(&TRAIN_58));
        assert!(fits.iter().all(|fit| fit.is_some_and(|fit| !fit.contradicts())), "{fits:?}");
        let (value, uncertainty) = speed(&fit, 8);
        assert!((value - 190.0).abs() < 10.0, "{value} after {before:?}");
        // The common factor alone is 5.7 %.
        assert!((0.05..0.1).contains(&(uncertainty / value)), "{uncertainty}");
        let (between, wider) = speed(&fit, 9);
        assert!((190.0..371.0).contains(&between) && wider / between > uncertainty / value);
        // Nothing was stated about stops: in proportion to its distance a stop is as uncertain as before.
        let after = fit.model().stop(SpeedStep::new(8).unwrap(), Approach::Below);
        assert!(after.doubt.as_m() / after.distance.as_m() > 0.5 * stop.doubt.as_m() / stop.distance.as_m());
        assert_eq!(after.count, 0);
    }

    #[test]
    fn a_throttle_between_two_steps_is_a_share_of_both_as_uncertain_as_a_parabola() {
        let at = |throttle: f64| terms_at(throttle, 14);
        // Step 7, and 8 rounded to thousandths.
        assert_eq!(at(0.5), Some((vec![(speed_at(7), 1.0)], 0.0)));
        assert_eq!(at(0.571), Some((vec![(speed_at(8), 1.0)], 0.0)));
        assert_eq!([at(0.07), at(1.002)], [None, None]);
        assert_eq!([at(0.0714), at(1.000_5)], [1, 14].map(|step| Some((vec![(speed_at(step), 1.0)], 0.0))));
        // Halfway from 7 to 8: ln (7.5/7) / ln (8/7) = 0.516679, and half of that times the rest is 0.124861.
        let (terms, variance) = at(7.5 / 14.0).unwrap();
        let [(low, one), (high, other)] = terms[..] else { panic!("two steps, not {terms:?}") };
        assert_eq!((low, high), (speed_at(7), speed_at(8)));
        assert!((one - 0.483_321).abs() < 1e-6 && (other - 0.516_679).abs() < 1e-6, "{one} {other}");
        assert!((libm::sqrt(variance) / bend_deviation(7) - 0.124_861).abs() < 1e-6, "{variance}");
    }

    #[test]
    fn one_gross_error_among_good_entries_is_ignored() {
        let mut with_error = TRAIN_58.to_vec();
        with_error.push((9.5 / 14.0, 3_662.0));
        let (mut good, mut bad) = (fit(14), fit(14));
        good.take_stated(&stated(&TRAIN_58));
        let fits = bad.take_stated(&stated(&with_error));
        assert!(fits[4].unwrap().contradicts() && fits[4].unwrap().weight < 0.05, "{fits:?}");
        assert!(fits[..4].iter().all(|fit| !fit.unwrap().contradicts()), "{fits:?}");
        let (one, other) = (speed(&good, 8), speed(&bad, 8));
        assert!((one.0 - other.0).abs() < 0.5 * one.1, "{one:?} {other:?}");
    }

    #[test]
    fn entries_are_compared_with_what_others_state() {
        let fit = fit(14);
        let others = stated(&[(8.0 / 14.0, 195.0), (9.5 / 14.0, 3_662.0), (0.0, 100.0)]);
        let compared = fit.compare_stated(&stated(&TRAIN_58), &others.speeds);
        let [Some(near), Some(far), None] = compared[..] else { panic!("{compared:?}") };
        assert!(
            !near.contradicts() && !near.is_gross() && far.contradicts() && far.is_gross(),
            "{compared:?}"
        );
    }

    #[test]
    fn a_table_that_contradicts_itself_leaves_more_uncertainty() {
        let smooth: Vec<(f64, f64)> =
            (1..=14).map(|step| (f64::from(step) / 14.0, 40.0 * f64::from(step))).collect();
        let rough: Vec<(f64, f64)> = smooth
            .iter()
            .enumerate()
            .map(|(at, (throttle, speed))| (*throttle, if at % 2 == 0 { speed * 1.5 } else { speed / 1.5 }))
            .collect();
        let (mut one, mut other) = (fit(14), fit(14));
        one.take_stated(&stated(&smooth));
        other.take_stated(&stated(&rough));
        let relative = |fit: &MotionFit| speed(fit, 9).1 / speed(fit, 9).0;
        assert!(relative(&other) > 1.3 * relative(&one), "{} {}", relative(&other), relative(&one));
    }

    #[test]
    fn numbers_that_make_no_speed_change_nothing() {
        for entry in
            [(0.5, f64::NAN), (0.5, 0.0), (0.5, -7.0), (0.0, 100.0), (0.01, 5.0), (f64::NAN, 5.0), (2.0, 9.0)]
        {
            let mut fit = fit(14);
            let before = fit.model().clone();
            assert_eq!(fit.take_stated(&stated(&[entry])), [None], "{entry:?}");
            let (value, _) = speed(&fit, 9);
            let step = SpeedStep::new(9).unwrap();
            assert!((value - before.speed(step, Approach::Below).value.as_mm_per_s()).abs() < 30.0);
        }
    }
}
