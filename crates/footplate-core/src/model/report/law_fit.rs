//! Which law a train follows when it changes speed: all of them fitted, compared, the best named.
//!
//! Two unknowns a law: `a` = ln of its pace and `q`, the delay from command to effect (s). For a change with
//! detections at times `t` and distances `s` the law predicts the distance `X(t)`; the position at the command is
//! unknown, so `x0` is fitted to each change: r = s − x0 − X(t), weighted by 1/w, w = v(t)²·var(t) + σ². Levenberg and
//! Marquardt's iteration on a and q with x0 eliminated; derivatives are numerical.
//!
//! Laws are compared by Akaike's criterion with unknown variance (n ln(χ²/n) + 2k, corrected for small n;
//! Hurvich and Tsai, 1989) and by the error on changes held out of the fit, one at a time. They have to agree:
//! a law that describes but does not forecast is not reported as best.
//!
//! How well that works on simulated trains (40 seeds, 12 to 14 changes up and as many down, `changes` on track A): a lag is named as
//! one 80 times in 80, a constant rate as a law of a constant rate 74 times in 80. The shape within a change is distinguished
//! less well: of the laws that end within some tenths of a second of each other, an even rate is named for most of the
//! rounded and eased ones (138 in 160).
#![expect(clippy::indexing_slicing, reason = "two unknowns, indexed below two")]

use alloc::vec::Vec;

use super::law_family::{Constant, LawFamily};
use super::transient::Transient;
use crate::kinematics::{Motion, StepRamp, StepTable};
use crate::time::TimeSpan;

/// Prior of the delay: see `LawMemory`.
const EXPECTED_DELAY_S: f64 = 0.4;
const DELAY_SPREAD_S: f64 = 0.6;
/// Prior of ln pace is that of the family, this much wider, so that the data decide.
const PRIOR_WIDENED: f64 = 2.0;
const MOST_ITERATIONS: usize = 60;
/// Residuals beyond this many standard deviations count linearly (Huber, 1964): the first detection of a start
/// may be of the train's rear end when it stood astride it.
const HUBER: f64 = 2.5;
/// Steps of the numerical derivatives.
const STEP: [f64; 2] = [1e-3, 1e-3];
/// A law whose residuals are this many times what poll and scatter explain does not fit.
const FITS: f64 = 3.0;
/// Fewest changes from which laws are distinguished: one to fit and two to hold out.
const FEWEST_CHANGES: usize = 3;

/// What may describe a change of speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum LawKind {
    /// A law between two speeds.
    Family(LawFamily),
    /// So many seconds a step through the train's own speed table (momentum, CV 3 and CV 4).
    StepRamp,
}

/// One law as fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedLaw {
    /// Which.
    pub kind: LawKind,
    /// Its pace (m/s² or s, see [`Constant`]; s a step for a ramp) and one standard deviation.
    pub pace: [f64; 2],
    /// Delay from command to effect and one standard deviation (s).
    pub delay: [f64; 2],
    /// Sum of squared residuals over their variances; wild ones count linearly.
    pub chi_square: f64,
    /// Detections less unknowns.
    pub freedom: usize,
    /// Akaike's criterion; smaller is better.
    pub criterion: f64,
    /// Root mean square error in distance on changes held out of the fit (mm).
    pub held_out_mm: f64,
}

/// What the comparison came to.
#[derive(Debug, Clone, PartialEq)]
pub struct LawComparison {
    /// Every law, the best by criterion first.
    pub laws: Vec<FittedLaw>,
    /// Whether the best explains the data within three times what poll and scatter allow.
    pub fits: bool,
    /// Whether held-out error and criterion name the same law, or one within a tenth of its error.
    pub agreed: bool,
    /// The changes behind it.
    pub changes: usize,
}

/// Fits and compares all laws. `table` serves the step ramp. `None` with too few changes.
pub fn compare_laws(changes: &[Transient], table: Option<&StepTable>) -> Option<LawComparison> {
    if changes.len() < FEWEST_CHANGES {
        return None;
    }
    let kinds = LawFamily::all().map(LawKind::Family).chain(table.map(|_| LawKind::StepRamp));
    let mut laws: Vec<FittedLaw> = kinds.filter_map(|kind| fitted(kind, changes, table)).collect();
    laws.sort_by(|one, other| one.criterion.total_cmp(&other.criterion));
    let first = laws.first()?;
    let fits = first.chi_square < FITS * first.freedom.max(1) as f64;
    let least = laws.iter().map(|law| law.held_out_mm).fold(f64::INFINITY, f64::min);
    let agreed = first.held_out_mm <= 1.1 * least;
    Some(LawComparison { fits, agreed, changes: changes.len(), laws })
}

/// The motion of a change under a law, since its effect began.
pub(super) fn motion<'t>(
    kind: LawKind,
    pace: f64,
    change: &Transient,
    table: Option<&'t StepTable>,
) -> Option<crate::kinematics::SpeedChange<'t>> {
    let [from, to] = change.speeds;
    match kind {
        LawKind::Family(family) => Some(family.change(pace, from, to)),
        LawKind::StepRamp => {
            let [from, to] = change.steps;
            Some(crate::kinematics::SpeedChange::StepRamp(StepRamp::new(
                table?,
                from,
                to,
                TimeSpan::from_s(pace),
            )))
        }
    }
}

/// Distance and speed at a time since the command.
pub(super) fn at(motion: &impl Motion, from: f64, since_effect: f64) -> (f64, f64) {
    if since_effect <= 0.0 {
        return (from * since_effect, from);
    }
    let state = motion.state_at(TimeSpan::from_s(since_effect));
    (state.distance.as_m(), state.speed.as_m_per_s())
}

/// Cost of a residual and the weight it leaves it with.
fn huber(residual: f64) -> (f64, f64) {
    let size = residual.abs();
    if size <= HUBER {
        (residual * residual, 1.0)
    } else {
        (2.0 * HUBER * size - HUBER * HUBER, HUBER / size)
    }
}

fn total_cost(all: &[(f64, f64)]) -> f64 {
    all.iter().map(|(r, _)| huber(*r).0).sum()
}

/// Residuals of one change over their standard deviations, and in m, `x0` eliminated.
pub(super) fn residuals(distances: &[(f64, f64)], change: &Transient) -> Vec<(f64, f64)> {
    let weights: Vec<f64> = change
        .points
        .iter()
        .zip(distances)
        .map(|(point, (_, speed))| {
            1.0 / (speed * speed * point.variance + change.distance_deviation * change.distance_deviation)
        })
        .collect();
    let off =
        |(point, (distance, _)): (&super::transient::TransientPoint, &(f64, f64))| point.distance - distance;
    let sum: f64 =
        change.points.iter().zip(distances).map(off).zip(&weights).map(|(off, weight)| off * weight).sum();
    let x0 = sum / weights.iter().sum::<f64>();
    change
        .points
        .iter()
        .zip(distances)
        .map(off)
        .zip(&weights)
        .map(|(off, weight)| ((off - x0) * libm::sqrt(*weight), off - x0))
        .collect()
}

fn all_residuals(
    kind: LawKind,
    x: [f64; 2],
    changes: &[Transient],
    table: Option<&StepTable>,
) -> Option<Vec<(f64, f64)>> {
    let mut all = Vec::new();
    for change in changes {
        let motion = motion(kind, libm::exp(x[0]), change, table)?;
        let [from, _] = change.speeds;
        let distances: Vec<(f64, f64)> = change
            .points
            .iter()
            .map(|point| at(&motion, from.as_m_per_s(), point.since_command - x[1].max(0.0)))
            .collect();
        all.extend(residuals(&distances, change));
    }
    Some(all)
}

struct Found {
    x: [f64; 2],
    covariance: [[f64; 2]; 2],
    chi_square: f64,
}

fn minimise(kind: LawKind, changes: &[Transient], table: Option<&StepTable>) -> Option<Found> {
    let (start, spread) = match kind {
        LawKind::Family(family) => family.expected_ln_pace(),
        // 14 steps in three seconds, as long as a whole change takes.
        LawKind::StepRamp => (libm::log(3.0 / 14.0), 0.4 * 0.4),
    };
    let prior = [
        (start, spread * PRIOR_WIDENED * PRIOR_WIDENED),
        (EXPECTED_DELAY_S, DELAY_SPREAD_S * DELAY_SPREAD_S),
    ];
    let cost = |x: [f64; 2]| -> Option<(f64, Vec<(f64, f64)>)> {
        let all = all_residuals(kind, x, changes, table)?;
        let sum = total_cost(&all);
        let pull: f64 = (0..2).map(|i| (x[i] - prior[i].0) * (x[i] - prior[i].0) / prior[i].1).sum();
        let total = sum + pull;
        total.is_finite().then_some((total, all))
    };
    let mut x = [prior[0].0, prior[1].0];
    let (mut best, mut all) = cost(x)?;
    let mut damping = 1e-3;
    let mut information = [[0.0; 2]; 2];
    for _ in 0..MOST_ITERATIONS {
        let mut columns = Vec::with_capacity(2);
        for i in 0..2 {
            let mut moved = x;
            moved[i] += STEP[i];
            columns.push(all_residuals(kind, moved, changes, table)?);
        }
        let j = |i: usize, row: usize| (columns[i][row].0 - all[row].0) / STEP[i];
        information = [[0.0; 2]; 2];
        let mut gradient = [0.0; 2];
        for (row, (residual, _)) in all.iter().enumerate() {
            let slopes = [j(0, row), j(1, row)];
            let (_, weight) = huber(*residual);
            for (i, slope) in slopes.iter().enumerate() {
                gradient[i] += weight * slope * residual;
                for (k, other) in slopes.iter().enumerate() {
                    information[i][k] += weight * slope * other;
                }
            }
        }
        for i in 0..2 {
            information[i][i] += 1.0 / prior[i].1;
            gradient[i] += (x[i] - prior[i].0) / prior[i].1;
        }
        let mut improved = false;
        for _ in 0..8 {
            let damped = [
                [information[0][0] * (1.0 + damping), information[0][1]],
                [information[1][0], information[1][1] * (1.0 + damping)],
            ];
            let inverse = inverse(damped)?;
            let step: [f64; 2] =
                core::array::from_fn(|i| -(inverse[i][0] * gradient[0] + inverse[i][1] * gradient[1]));
            let tried = [x[0] + step[0].clamp(-1.0, 1.0), x[1] + step[1].clamp(-1.0, 1.0)];
            if let Some((value, residuals)) = cost(tried).filter(|(value, _)| *value < best) {
                improved = best - value > 1e-9 * best;
                (best, all, x) = (value, residuals, tried);
                damping *= 0.3;
                break;
            }
            damping *= 4.0;
        }
        if !improved {
            break;
        }
    }
    let covariance = inverse(information)?;
    Some(Found { x, covariance, chi_square: total_cost(&all) })
}

fn inverse(a: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    (determinant > 0.0 && determinant.is_finite()).then(|| {
        [[a[1][1] / determinant, -a[0][1] / determinant], [-a[1][0] / determinant, a[0][0] / determinant]]
    })
}

/// Akaike's corrected criterion for `n` residuals, `k` unknowns.
fn criterion(chi_square: f64, n: usize, k: usize) -> f64 {
    let (n, k) = (n as f64, k as f64);
    let small = if n > k + 1.0 { 2.0 * k * (k + 1.0) / (n - k - 1.0) } else { f64::INFINITY };
    n * libm::log((chi_square / n).max(1e-12)) + 2.0 * k + small
}

fn points(changes: &[Transient]) -> usize {
    changes.iter().map(|change| change.points.len()).sum()
}

fn fitted(kind: LawKind, changes: &[Transient], table: Option<&StepTable>) -> Option<FittedLaw> {
    let found = minimise(kind, changes, table)?;
    let n = points(changes);
    // The unknowns of the law and the place of each change.
    let unknowns = 2 + changes.len();
    let freedom = n.saturating_sub(unknowns);
    // If the law is not exact, the residuals show by how much the uncertainty has to grow.
    let grown = (found.chi_square / freedom.max(1) as f64).max(1.0);
    let covariance = found.covariance.map(|line| line.map(|value| value * grown));
    let pace = libm::exp(found.x[0]);
    let held_out = held_out(changes, |others, change| {
        let x = minimise(kind, others, table)?.x;
        all_residuals(kind, x, core::slice::from_ref(change), table)
    });
    Some(FittedLaw {
        kind,
        pace: [pace, pace * libm::sqrt(covariance[0][0])],
        delay: [found.x[1].max(0.0), libm::sqrt(covariance[1][1])],
        chi_square: found.chi_square,
        freedom,
        criterion: criterion(found.chi_square, n, unknowns),
        held_out_mm: held_out?,
    })
}

/// Root mean square error (mm) over changes each forecast by a fit to all the others.
fn held_out(
    changes: &[Transient],
    forecast: impl Fn(&[Transient], &Transient) -> Option<Vec<(f64, f64)>>,
) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for (place, change) in changes.iter().enumerate() {
        let others: Vec<Transient> = changes
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != place)
            .map(|(_, other)| other.clone())
            .collect();
        for (_, off) in forecast(&others, change)? {
            sum += off * off;
            count += 1.0;
        }
    }
    (count > 0.0).then(|| 1e3 * libm::sqrt(sum / count))
}

impl LawKind {
    /// What stays the same between changes, for the unit of the pace.
    #[must_use]
    pub const fn constant(self) -> Constant {
        match self {
            Self::Family(family) => family.constant,
            Self::StepRamp => Constant::Time,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::transient::TransientPoint;
    use super::*;
    use crate::ids::{SpeedStep, TrainId};
    use crate::kinematics::SpeedLaw;
    use crate::units::Speed;

    fn assert_near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-9 * expected.abs().max(1.0), "{found} {expected}");
    }

    /// A change between two speeds (m/s) with points at these times (s) and distances (m).
    fn change(speeds: [f64; 2], points: &[(f64, f64)], variance: f64, distance_deviation: f64) -> Transient {
        let points = points.iter().map(|(since_command, distance)| TransientPoint {
            since_command: *since_command,
            variance,
            distance: *distance,
            entry: 0,
        });
        Transient {
            train: TrainId(24),
            run: 0,
            steps: [SpeedStep::STAND, SpeedStep::new(8).expect("a step")],
            speeds: speeds.map(Speed::from_m_per_s),
            points: points.collect(),
            distance_deviation,
        }
    }

    #[test]
    fn a_wild_residual_counts_linearly_and_joins_smoothly() {
        for (residual, cost, weight) in [
            (0.0, 0.0, 1.0),
            (-2.0, 4.0, 1.0),
            (2.5, 6.25, 1.0),
            // 2 · 2.5 · 4 − 2.5², and 2.5 / 4.
            (4.0, 13.75, 0.625),
            (-4.0, 13.75, 0.625),
        ] {
            assert_eq!(huber(residual), (cost, weight));
        }
        assert_eq!(total_cost(&[(2.0, 9.0), (-4.0, 9.0)]), 17.75);
    }

    #[test]
    fn residuals_are_about_the_place_that_fits_best() {
        // 0.1 and 0.3 m beyond; at 0.5 and 1 m/s with 0.01 s² and 5 cm they weigh 200 and 80.
        let change = change([0.0, 1.0], &[(1.0, 1.1), (2.0, 2.3)], 0.01, 0.05);
        let found = residuals(&[(1.0, 0.5), (2.0, 1.0)], &change);
        let x0 = (200.0 * 0.1 + 80.0 * 0.3) / 280.0;
        for ((scaled, off), (expected, weight)) in found.into_iter().zip([(0.1, 200.0_f64), (0.3, 80.0)]) {
            assert_near(off, expected - x0);
            assert_near(scaled, (expected - x0) * weight.sqrt());
        }
    }

    #[test]
    fn before_its_effect_a_train_runs_as_before() {
        let law = LawFamily { law: SpeedLaw::ConstantAcceleration, constant: Constant::Acceleration };
        let change = change([0.2, 0.6], &[], 0.0, 0.0);
        let motion = motion(LawKind::Family(law), 0.1, &change, None).expect("a motion");
        for (since, distance, speed) in [(-0.5, -0.1, 0.2), (0.0, 0.0, 0.2), (2.0, 0.6, 0.4), (4.0, 1.6, 0.6)]
        {
            let (found, at_speed) = at(&motion, 0.2, since);
            assert_near(found, distance);
            assert_near(at_speed, speed);
        }
        assert!(super::motion(LawKind::StepRamp, 0.1, &change, None).is_none());
    }

    #[test]
    fn the_inverse_and_the_criterion_are_those_of_the_books() {
        // The determinant is 2 · 3 − 1 · 1 = 5.
        assert_eq!(inverse([[2.0, 1.0], [1.0, 3.0]]), Some([[0.6, -0.2], [-0.2, 0.4]]));
        assert_eq!(inverse([[1.0, 1.0], [1.0, 1.0]]), None);
        assert_eq!(inverse([[1.0, 2.0], [1.0, 1.0]]), None);
        // n ln(χ²/n) + 2 k + 2 k (k + 1) / (n − k − 1).
        assert_near(criterion(20.0, 10, 3), 10.0 * core::f64::consts::LN_2 + 6.0 + 24.0 / 6.0);
        assert_near(criterion(5.0, 5, 3), 6.0 + 24.0);
        assert_eq!(criterion(5.0, 4, 3), f64::INFINITY);
        assert_near(criterion(0.0, 10, 3), 10.0 * 1e-12_f64.ln() + 10.0);
    }

    #[test]
    fn an_error_held_out_is_of_the_change_that_was_left_out() {
        let changes = [0.1, 0.2, 0.3].map(|from| change([from, 1.0], &[], 0.0, 0.0));
        // Each forecast is off by 3 and 4 mm for each change that it was fitted to.
        let forecast = |others: &[Transient], left_out: &Transient| {
            assert!(others.iter().all(|other| other.speeds != left_out.speeds));
            let count = others.len() as f64;
            Some(alloc::vec![(9.0, 0.003 * count), (9.0, -0.004 * count)])
        };
        assert_near(held_out(&changes, forecast).expect("three of them"), 2.0 * 12.5_f64.sqrt());
        assert_eq!(held_out(&[], forecast), None);
    }

    #[test]
    fn a_law_that_made_the_changes_is_found_with_its_pace_and_delay() {
        // Given changes by 0.2 m/s² that begin 0.3 s after their commands, from speeds that differ,
        let law = LawFamily { law: SpeedLaw::ConstantAcceleration, constant: Constant::Acceleration };
        let made = |from: f64, to: f64| {
            let family = law.change(0.2, Speed::from_m_per_s(from), Speed::from_m_per_s(to));
            let times = (1..=10).map(|nth| 0.4 * f64::from(nth));
            let points: Vec<(f64, f64)> =
                times.map(|time| (time, 7.0 + at(&family, from, time - 0.3).0)).collect();
            change([from, to], &points, 1e-6, 1e-3)
        };
        let changes = [made(0.1, 0.5), made(0.3, 0.5), made(0.6, 0.2), made(0.5, 0.1), made(0.2, 0.6)];
        assert!(compare_laws(&changes[..2], None).is_none());
        let found = compare_laws(&changes, None).expect("five are enough");
        // then that law fits best, and describes as it forecasts,
        let best = &found.laws[0];
        assert_eq!(best.kind, LawKind::Family(law));
        assert!(found.fits && found.agreed && found.changes == 5);
        // with its pace and delay, fifty detections less seven unknowns, and hardly any error.
        assert!((best.pace[0] - 0.2).abs() < 1e-3 && (best.delay[0] - 0.3).abs() < 3e-3, "{best:?}");
        assert_eq!(best.freedom, 50 - 7);
        assert!(best.chi_square < 0.2 && best.held_out_mm < 5.0, "{best:?}");
        assert_near(best.criterion, criterion(best.chi_square, 50, 7));
        assert!(found.laws.iter().all(|law| law.criterion >= best.criterion));
        // A thousand times the variance makes its uncertainty larger by the root of a thousand.
        let mut vague = changes.clone();
        for change in &mut vague {
            change.distance_deviation *= 10.0;
            change.points.iter_mut().for_each(|point| point.variance *= 100.0);
        }
        let vague = fitted(LawKind::Family(law), &vague, None).expect("a fit");
        assert!((vague.pace[1] / best.pace[1] - 10.0).abs() < 0.1, "{vague:?} {best:?}");
        assert!((vague.delay[1] / best.delay[1] - 10.0).abs() < 0.1, "{vague:?} {best:?}");
    }
}
