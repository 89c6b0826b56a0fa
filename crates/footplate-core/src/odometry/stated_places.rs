//! Estimates distance and wheel scale from places of stated accuracy, some of which are wrong.
//!
//! A place within a bound narrows the guaranteed interval (`balise_link.rs`). A place with a standard deviation does not: a stop, a
//! satellite fix or a kilometre post may be wrong by far more, and nothing marks it. All of the latest places are therefore
//! estimated together as a mixture: a place is right, with its standard deviation, or it is wrong and anywhere.
//!
//! Letters: `x` distance by the odometer, `y` place, `c` error of the odometer's distance, `k` logarithm of its scale, both
//! estimated; `p` their covariance, `r` variance of a place, `w` probability that it is right. Between two places `c` grows by
//! `k Δx` and by a random walk. A Kalman filter and its smoother (Rauch, Tung and Striebel, 1965) estimate them for given
//! `w`; `w` follows from the residuals (expectation and maximisation, Dempster, Laird and Rubin, 1977). The first
//! rounds enlarge the standard deviations, so that a wrong place among the first ones does not decide.

use libm::{exp, sqrt};

use crate::units::Length;

/// Number of places that are estimated together. When there are more, every second one of the older half is dropped.
pub const MOST_PLACES: usize = 64;
/// Prior share of wrong places. Chosen: stops of trams are wrong in a few per cent.
const WRONG: f64 = 0.1;
/// A wrong place is anywhere within this distance (m). Chosen: the next platform end; what is farther is no likelier to be
/// right.
const WRONG_WITHIN_M: f64 = 30.0;
/// Creepage that changes from hop to hop: 0.08 % of 500 m, as a random walk (m² a metre); chosen on 100 simulated rides so that 95 of
/// 100 scales lie in their interval.
const WALK_M2_PER_M: f64 = 3.0e-4;
/// Standard deviation of the phase within a pulse at the first row (m).
const START_DEVIATION_M: f64 = 0.05;
/// Standard deviation of the zero of the odometer against that of the places (m).
const UNKNOWN_START_M: f64 = 1e6;
/// Standard deviation of the scale that creepage and cones leave, however many places there are. As for balises.
const NEVER_BETTER_THAN: f64 = 1e-4;
/// Factors of the standard deviations, round by round.
const ROUNDS: [f64; 12] = [8.0, 4.0, 4.0, 2.0, 2.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0];
/// A place with a smaller probability to be right counts as wrong.
const PROBABLE: f64 = 0.5;
/// Least weight of a place, so that no variance is infinite.
const LEAST_WEIGHT: f64 = 1e-9;
/// Limits of a stated standard deviation (m).
const BEST_DEVIATION_M: f64 = 0.01;
const WORST_DEVIATION_M: f64 = 1e5;
/// No place on a line is farther (m).
const FARTHEST_M: f64 = 1e8;

/// A value and its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedValue {
    /// The best estimate.
    pub value: f64,
    /// One standard deviation.
    pub deviation: f64,
}

/// A place that was passed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Mark {
    /// Distance by the odometer (m).
    x: f64,
    /// Stated place (m).
    y: f64,
    /// Its variance (m²).
    r: f64,
    /// Variance gained since the mark before (m²).
    walked: f64,
    /// The probability that it is right.
    w: f64,
}

const NO_MARK: Mark = Mark { x: 0.0, y: 0.0, r: 1.0, walked: 0.0, w: 1.0 };

/// State and covariance after a mark.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Known {
    c: f64,
    k: f64,
    p: [f64; 3],
}

impl Known {
    /// Predicts over a distance.
    fn moved(self, dx: f64, walked: f64) -> Self {
        let Self { c, k, p: [cc, ck, kk] } = self;
        Self { c: c + k * dx, k, p: [cc + 2.0 * dx * ck + dx * dx * kk + walked, ck + dx * kk, kk] }
    }

    /// Takes in a measurement `z` of the error, with a variance.
    fn measured(self, z: f64, r: f64) -> Self {
        let Self { c, k, p: [cc, ck, kk] } = self;
        let s = cc + r;
        let (gain_c, gain_k) = (cc / s, ck / s);
        let left = z - c;
        Self { c: c + gain_c * left, k: k + gain_k * left, p: [cc * (r / s), ck * (r / s), kk - gain_k * ck] }
    }
}

/// The places of one run. Fixed memory.
#[derive(Debug, Clone)]
pub struct StatedPlaces {
    marks: [Mark; MOST_PLACES],
    count: usize,
    /// Variance of the logarithm of the scale before any place.
    prior: f64,
    /// Variance gained while wheels slid, since the latest mark (m²).
    slid: f64,
    latest: Known,
    at: f64,
    passed: usize,
}

impl StatedPlaces {
    /// Without a place; the scale of the distance lies within `tolerance` of 1.
    #[must_use]
    pub fn new(tolerance: f64) -> Self {
        // Uniform within the tolerance.
        let prior = (tolerance * tolerance / 3.0).max(NEVER_BETTER_THAN * NEVER_BETTER_THAN);
        let start = Mark { r: START_DEVIATION_M * START_DEVIATION_M, ..NO_MARK };
        let mut marks = [NO_MARK; MOST_PLACES];
        if let Some(first) = marks.first_mut() {
            *first = start;
        }
        let latest = Known { c: 0.0, k: 0.0, p: [START_DEVIATION_M * START_DEVIATION_M, 0.0, prior] };
        Self { marks, count: 1, prior, slid: 0.0, latest, at: 0.0, passed: 0 }
    }

    /// A slide made the distance uncertain by this.
    pub fn slid(&mut self, deviation: Length) {
        let deviation = deviation.as_m();
        if deviation.abs() <= WORST_DEVIATION_M {
            self.slid += deviation * deviation;
        }
    }

    /// Takes in a place at a distance. NaN is ignored.
    pub fn pass(&mut self, reckoned: Length, place: Length, deviation: Length) {
        let (x, y, sd) = (reckoned.as_m(), place.as_m(), deviation.as_m());
        let known = x.abs() <= FARTHEST_M && y.abs() <= FARTHEST_M && sd > 0.0 && sd <= WORST_DEVIATION_M;
        if !known {
            return;
        }
        let sd = sd.max(BEST_DEVIATION_M);
        self.make_room();
        let walked = WALK_M2_PER_M * (x - self.newest().x).abs() + self.slid;
        self.slid = 0.0;
        if let Some(free) = self.marks.get_mut(self.count) {
            *free = Mark { x, y, r: sd * sd, walked, w: 1.0 };
            self.count += 1;
            self.passed += 1;
        }
        self.explain();
    }

    /// Number of places passed, and of wrong ones among those kept.
    #[must_use]
    pub fn passed_and_wrong(&self) -> [usize; 2] {
        let wrong = self.remembered().iter().skip(1).filter(|mark| mark.w < PROBABLE).count();
        [self.passed, wrong]
    }

    /// Estimate of the true distance where the odometer has this one, ahead of the latest place.
    #[must_use]
    pub fn distance(&self, reckoned: Length) -> PlacedValue {
        let dx = reckoned.as_m() - self.at;
        let now = self.latest.moved(dx, WALK_M2_PER_M * dx.abs() + self.slid);
        let [variance, ..] = now.p;
        PlacedValue { value: reckoned.as_m() + now.c, deviation: sqrt(variance.max(0.0)) }
    }

    /// True distance over that of the odometer.
    #[must_use]
    pub fn scale(&self) -> PlacedValue {
        let [.., variance] = self.latest.p;
        let value = exp(self.latest.k);
        let deviation = value * sqrt(variance.max(0.0) + NEVER_BETTER_THAN * NEVER_BETTER_THAN);
        PlacedValue { value, deviation }
    }

    fn remembered(&self) -> &[Mark] {
        self.marks.get(..self.count).unwrap_or(&self.marks)
    }

    fn newest(&self) -> Mark {
        self.remembered().last().copied().unwrap_or(NO_MARK)
    }

    /// Drops every second mark of the older half except the start; its variance goes to the next mark.
    fn make_room(&mut self) {
        if self.count < MOST_PLACES {
            return;
        }
        let mut kept = [NO_MARK; MOST_PLACES];
        let (mut count, mut walked) = (0, 0.0);
        for (at, mark) in self.marks.iter().enumerate() {
            walked += mark.walked;
            if at < MOST_PLACES / 2 && at % 2 == 1 {
                continue;
            }
            if let Some(free) = kept.get_mut(count) {
                *free = Mark { walked, ..*mark };
                (count, walked) = (count + 1, 0.0);
            }
        }
        (self.marks, self.count) = (kept, count);
    }

    /// Estimates which places are right, and the state. Places count from the start of the run, unless more of them are right if they
    /// count from elsewhere.
    fn explain(&mut self) {
        let from_start = self.explained(true);
        let from_elsewhere = self.explained(false);
        let right = |marks: &[Mark; MOST_PLACES]| -> f64 {
            marks.iter().take(self.count).skip(1).map(|mark| mark.w).sum()
        };
        // The start counts for one.
        let elsewhere = right(&from_elsewhere.0) > right(&from_start.0) + 1.0;
        let (marks, latest) = if elsewhere { from_elsewhere } else { from_start };
        (self.marks, self.latest, self.at) = (marks, latest, self.newest().x);
    }

    /// The marks with their probabilities, and the state at the last of them; with or without the start.
    fn explained(&self, from_start: bool) -> ([Mark; MOST_PLACES], Known) {
        let count = self.count;
        let mut marks = self.marks;
        for (at, mark) in marks.iter_mut().enumerate() {
            mark.w = if at == 0 && !from_start { 0.0 } else { 1.0 };
        }
        let unknown = Known { c: 0.0, k: 0.0, p: [UNKNOWN_START_M * UNKNOWN_START_M, 0.0, self.prior] };
        let mut known = unknown;
        for enlarged in ROUNDS {
            let enlarged = enlarged * enlarged;
            let mut before = [unknown; MOST_PLACES];
            let mut after = [unknown; MOST_PLACES];
            known = unknown;
            let mut x = 0.0;
            for ((mark, before), after) in marks.iter().take(count).zip(&mut before).zip(&mut after) {
                *before = known.moved(mark.x - x, mark.walked);
                *after = if mark.w > LEAST_WEIGHT {
                    before.measured(mark.y - mark.x, enlarged * mark.r / mark.w)
                } else {
                    *before
                };
                (known, x) = (*after, mark.x);
            }
            // Backwards: the smoother.
            let mut next: Option<(Known, Known, f64)> = None;
            let steps = marks.iter_mut().zip(&before).zip(&after).take(count).enumerate();
            for (at, ((mark, before), after)) in steps.rev() {
                let smooth = next.map_or(*after, |(smooth, predicted, x)| {
                    smoothed(after, &predicted, &smooth, x - mark.x)
                });
                let left = mark.y - mark.x - smooth.c;
                let [variance, ..] = smooth.p;
                if at > 0 {
                    mark.w = right(left * left + variance.max(0.0), enlarged * mark.r);
                }
                next = Some((smooth, *before, mark.x));
            }
        }
        (marks, known)
    }
}

/// One step of the smoother: the state after a mark, given the smoothed state after the next one.
fn smoothed(after: &Known, predicted: &Known, next: &Known, dx: f64) -> Known {
    let [cc, ck, kk] = after.p;
    let [pcc, pck, pkk] = predicted.p;
    let determinant = pcc * pkk - pck * pck;
    if determinant <= 0.0 {
        return *after;
    }
    // g = P Fᵀ P₁⁻¹ with F = [1 dx; 0 1].
    let (a, b) = (cc + dx * ck, ck);
    let (d, e) = (ck + dx * kk, kk);
    let g = [
        [(a * pkk - b * pck) / determinant, (b * pcc - a * pck) / determinant],
        [(d * pkk - e * pck) / determinant, (e * pcc - d * pck) / determinant],
    ];
    let [[g00, g01], [g10, g11]] = g;
    let (dc, dk) = (next.c - predicted.c, next.k - predicted.k);
    let [ncc, nck, nkk] = next.p;
    let [ecc, eck, ekk] = [ncc - pcc, nck - pck, nkk - pkk];
    let (h00, h01) = (g00 * ecc + g01 * eck, g00 * eck + g01 * ekk);
    let (h10, h11) = (g10 * ecc + g11 * eck, g10 * eck + g11 * ekk);
    Known {
        c: after.c + g00 * dc + g01 * dk,
        k: after.k + g10 * dc + g11 * dk,
        p: [cc + h00 * g00 + h01 * g01, ck + h00 * g10 + h01 * g11, kk + h10 * g10 + h11 * g11],
    }
}

/// The probability that a place is right, from its squared residual and the variance of that.
fn right(squared: f64, variance: f64) -> f64 {
    let density = exp(-0.5 * squared / variance) / sqrt(2.0 * core::f64::consts::PI * variance);
    let wrong = WRONG / (2.0 * WRONG_WITHIN_M);
    let right = (1.0 - WRONG) * density;
    right / (right + wrong)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pass(places: &mut StatedPlaces, x: f64, y: f64, sd: f64) {
        places.pass(Length::from_m(x), Length::from_m(y), Length::from_m(sd));
    }

    #[test]
    fn right_places_give_scale_and_distance() {
        let mut places = StatedPlaces::new(0.02);
        for n in 1..=20 {
            let x = 250.0 * f64::from(n);
            pass(&mut places, x, x * 1.007, 1.0);
        }
        let scale = places.scale();
        assert!((scale.value - 1.007).abs() < 2e-4 && scale.deviation < 4e-4, "{scale:?}");
        let distance = places.distance(Length::from_m(5100.0));
        assert!((distance.value - 5135.7).abs() < 0.3 && distance.deviation < 1.2, "{distance:?}");
        assert_eq!(places.passed_and_wrong(), [20, 0]);
    }

    #[test]
    fn wrong_places_change_nothing_and_are_called_wrong() {
        let mut places = StatedPlaces::new(0.02);
        for n in 1..=20 {
            let x = 250.0 * f64::from(n);
            let wrong = if n % 8 == 1 { 17.0 } else { 0.0 };
            pass(&mut places, x, x * 0.994 + wrong, 1.0);
        }
        let scale = places.scale();
        assert!((scale.value - 0.994).abs() < 4e-4, "{scale:?}");
        assert_eq!(places.passed_and_wrong(), [20, 3]);
        assert!((places.distance(Length::from_m(5000.0)).value - 4970.0).abs() < 1.0);
    }

    #[test]
    fn places_that_count_from_elsewhere_still_give_the_scale() {
        let mut places = StatedPlaces::new(0.02);
        for n in 1..=20 {
            let x = 250.0 * f64::from(n);
            pass(&mut places, x, 12_345.0 + x * 1.004, 0.5);
        }
        assert!((places.scale().value - 1.004).abs() < 3e-4, "{:?}", places.scale());
        assert!((places.distance(Length::from_m(5000.0)).value - 17_365.0).abs() < 1.5);
    }

    #[test]
    fn a_slide_that_the_reckoning_missed_is_no_wrong_scale() {
        let mut places = StatedPlaces::new(0.02);
        for n in 1..=24 {
            let x = 250.0 * f64::from(n);
            if n == 12 {
                places.slid(Length::from_m(15.0));
            }
            let slid = if n >= 12 { 12.0 } else { 0.0 };
            pass(&mut places, x, x * 1.002 + slid, 0.5);
        }
        assert!((places.scale().value - 1.002).abs() < 5e-4, "{:?}", places.scale());
    }

    proptest! {
        /// With any places, all numbers stay finite and standard deviations positive.
        #[test]
        fn any_places_leave_numbers(
            marks in prop::collection::vec((any::<f64>(), any::<f64>(), any::<f64>()), 0..20),
            some in prop::collection::vec((-1e4..1e5_f64, -1e4..1e5_f64, 0.0..1e3_f64), 0..150),
        ) {
            let mut places = StatedPlaces::new(0.012);
            let far = |value: f64| if value.abs() < 1e8 { value } else { f64::NAN };
            for (x, y, sd) in some.into_iter().chain(marks.into_iter().map(|(x, y, sd)| (far(x), far(y), sd))) {
                pass(&mut places, x, y, sd);
                let (scale, distance) = (places.scale(), places.distance(Length::from_m(1000.0)));
                prop_assert!(scale.value.is_finite() && scale.deviation > 0.0);
                prop_assert!(distance.value.is_finite() && distance.deviation.is_finite());
            }
        }
    }

    /// The inverse of a positive definite matrix (Gauss and Jordan), and its product with a vector.
    fn solved<const N: usize>(mut m: [[f64; N]; N], y: [f64; N]) -> ([[f64; N]; N], [f64; N]) {
        let mut inverse: [[f64; N]; N] =
            core::array::from_fn(|row| core::array::from_fn(|column| f64::from(u8::from(row == column))));
        for pivot in 0..N {
            let by = m[pivot][pivot];
            (m[pivot], inverse[pivot]) = (m[pivot].map(|x| x / by), inverse[pivot].map(|x| x / by));
            for row in (0..N).filter(|row| *row != pivot) {
                let times = m[row][pivot];
                for column in 0..N {
                    m[row][column] -= times * m[pivot][column];
                    inverse[row][column] -= times * inverse[pivot][column];
                }
            }
        }
        let x = inverse.map(|row| row.iter().zip(y).map(|(a, b)| a * b).sum());
        (inverse, x)
    }

    /// Each probability is the one that follows from least squares over all places at once, weighted by the probabilities; so are the
    /// estimates at the latest place.
    #[test]
    fn probabilities_and_estimates_are_those_of_least_squares_over_all_places() {
        let mut places = StatedPlaces::new(0.02);
        for (x, off) in [(300.0, 0.4), (650.0, -0.7), (900.0, 4.5), (1500.0, 0.9)] {
            pass(&mut places, x, 1.01 * x + off, 1.0);
        }
        // Unknown: the error at the start and at each place, and the logarithm `k` of the scale.
        let (mut information, mut weighted) = ([[0.0; 6]; 6], [0.0; 6]);
        information[5][5] = 3.0 / (0.02 * 0.02);
        let mut from = 0.0;
        for (at, mark) in places.remembered().iter().enumerate() {
            information[at][at] += mark.w / mark.r;
            weighted[at] += mark.w / mark.r * (mark.y - mark.x);
            if at > 0 {
                // The error grows by `k Δx`, but for 3e-4 m² a metre.
                let row = [(at - 1, -1.0), (at, 1.0), (5, -(mark.x - from))];
                for ((one, a), (other, b)) in row.into_iter().flat_map(|a| row.map(|b| (a, b))) {
                    information[one][other] += a * b / (3e-4 * (mark.x - from));
                }
            }
            from = mark.x;
        }
        let (covariance, x) = solved(information, weighted);
        for (at, mark) in places.remembered().iter().enumerate().skip(1) {
            let left = mark.y - mark.x - x[at];
            let expected = right(left * left + covariance[at][at], 1.0);
            assert!((mark.w - expected).abs() < 2e-4, "{at}: {} {expected}", mark.w);
        }
        assert_eq!(places.passed_and_wrong(), [4, 1]);
        assert!((places.latest.c - x[4]).abs() < 2e-3 && (places.latest.k - x[5]).abs() < 1e-6);
    }

    proptest! {
        /// The filter and its smoother give what least squares over both places at once gives: for the error `c` at the first and
        /// at the second and for the logarithm `k` of the scale.
        #[test]
        fn the_smoother_is_least_squares_over_all_places(
            (z0, z1) in (-5.0..5.0_f64, -5.0..5.0_f64),
            (r0, r1) in (0.1..4.0_f64, 0.1..4.0_f64),
            (dx, walked) in (1.0..9.0_f64, 0.01..2.0_f64),
            (vc, vk) in (0.5..9.0_f64, 0.01..1.0_f64),
        ) {
            let prior = Known { c: 0.0, k: 0.0, p: [vc, 0.0, vk] };
            let first = prior.measured(z0, r0);
            let predicted = first.moved(dx, walked);
            let second = predicted.measured(z1, r1);
            let smooth = smoothed(&first, &predicted, &second, dx);
            // Unknowns c₀, c₁, k. Rows: c₀ ~ 0, k ~ 0, c₀ ~ z₀, c₁ ~ z₁, c₁ − c₀ − k Δx ~ 0.
            let w = 1.0 / walked;
            let information = [
                [1.0 / vc + 1.0 / r0 + w, -w, w * dx],
                [-w, 1.0 / r1 + w, -w * dx],
                [w * dx, -w * dx, 1.0 / vk + w * dx * dx],
            ];
            let (covariance, x) = solved(information, [z0 / r0, z1 / r1, 0.0]);
            let near = |one: f64, other: f64| (one - other).abs() < 1e-9 * (1.0 + other.abs());
            prop_assert!(near(second.c, x[1]) && near(second.k, x[2]), "{second:?} {x:?}");
            prop_assert!(near(smooth.c, x[0]) && near(smooth.k, x[2]), "{smooth:?} {x:?}");
            for (found, [one, other]) in smooth.p.into_iter().zip([[0, 0], [0, 2], [2, 2]]) {
                prop_assert!(near(found, covariance[one][other]), "{smooth:?} {covariance:?}");
            }
            for (found, [one, other]) in second.p.into_iter().zip([[1, 1], [1, 2], [2, 2]]) {
                prop_assert!(near(found, covariance[one][other]), "{second:?} {covariance:?}");
            }
        }
    }

    #[test]
    fn before_any_place_the_distance_is_as_uncertain_as_pulses_creepage_scale_and_slides_make_it() {
        let off = |places: &StatedPlaces| places.distance(Length::from_m(1000.0)).deviation;
        // 0.05 m at the start, 0.3 m² of creepage over a kilometre, and a scale known to 1e-4 at best: 0.1 m.
        let mut exact = StatedPlaces::new(0.0);
        assert!((off(&exact) - (0.0025 + 0.3 + 0.01_f64).sqrt()).abs() < 1e-9, "{}", off(&exact));
        exact.slid(Length::from_m(-2.0));
        assert!((off(&exact) - (0.0025 + 0.3 + 0.01 + 4.0_f64).sqrt()).abs() < 1e-9, "{}", off(&exact));
        // A scale anywhere within 1.2 %: its deviation is that over the root of three, 6.93 m in a kilometre.
        let scaled = StatedPlaces::new(0.012);
        assert!((off(&scaled) - (0.0025 + 0.3 + 144.0 / 3.0_f64).sqrt()).abs() < 1e-9, "{}", off(&scaled));
        assert!((scaled.scale().deviation - (4.8e-5 + 1e-8_f64).sqrt()).abs() < 1e-12);
        // A place known to 1 m leaves the product of both variances over their sum, the place's enlarged because it may be wrong:
        // with a residual of 0.9 m it is right with 0.9 · 0.398942 e^−0.408 / (0.9 · 0.398942 e^−0.408 + 0.1 / 60) = 0.993066.
        pass(&mut exact, 1000.0, 1000.0, 1.0);
        let stated = 1.0 / 0.993_066;
        let left = 4.3125 * stated / (4.3125 + stated);
        assert!((off(&exact) - f64::sqrt(left)).abs() < 1e-5, "{}", off(&exact));
        let before = exact.distance(Length::from_m(900.0)).deviation;
        assert!(
            before > off(&exact) && before < exact.distance(Length::from_m(1200.0)).deviation,
            "{before}"
        );
    }

    #[test]
    fn a_place_is_right_as_often_as_bayes_says() {
        // Nine of ten are right, the others anywhere within 30 m on either side. At its own place a place with a variance of 1 m²
        // has a density of 1/√(2π) = 0.398942: 0.9 · 0.398942 / (0.9 · 0.398942 + 0.1 / 60) = 0.995380.
        assert!((right(0.0, 1.0) - 0.995_380).abs() < 1e-6, "{}", right(0.0, 1.0));
        // Three deviations off, e^−4.5 = 0.011109 of it: 0.705293.
        assert!((right(9.0, 1.0) - 0.705_293).abs() < 1e-6, "{}", right(9.0, 1.0));
    }
}
