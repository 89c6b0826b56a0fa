//! One start or one stop from a series of positions: video, a tape, light gates.
//!
//! The law is that of the motion model ([`Segment`]): a ramp of the set speed, a lag behind it and, at the end of a stop,
//! friction. A series knows no command, so that the time is found at which the change takes effect, not its delay.
//! Letters: `x` unknowns, `s(t)` position by the law, `r` residual, `ρ` correlation of neighbouring residuals.
//!
//! ```text
//! x = position and time at which the change takes effect, speed, ln lag, ln ramp, ln friction
//! cost = Σ r²/(σ² (1 + ρ)/(1 − ρ)) + Σ (x − prior)²/spread²
//! ```
//!
//! Residuals of a tracker are alike from picture to picture. Counted as independent, a hundred of them would promise far
//! too much; the factor is that of the mean of a series whose correlation falls geometrically (Bartlett, 1946).
#![expect(clippy::indexing_slicing, reason = "every index is below the number of unknowns or of points")]

use alloc::vec::Vec;

use crate::estimate::Estimate;
use crate::kinematics::RampedLag;
use crate::linalg::{CurveFit, FittedCurve, Unknown};
use crate::model::segment::Segment;
use crate::time::{TimeSpan, Timestamp};
use crate::units::{Acceleration, Length, Speed};

use super::series_error::SeriesError;

const POSITION: usize = 0;
const EFFECT: usize = 1;
const SPEED: usize = 2;
const LAG: usize = 3;
const RAMP: usize = 4;
const FRICTION: usize = 5;
const N: usize = 6;

/// Steps of the numerical derivatives, as fine as the law is smooth: m, s, m/s, 1, 1, 1.
const STEP: [f64; N] = [1e-4, 1e-4, 1e-4, 1e-3, 1e-3, 1e-3];
/// Spreads (m, s, m/s) far beyond any layout: they only keep the equations from being singular.
const WIDE: [f64; 3] = [1e3, 1e4, 1e2];
/// Before anything is known: a lag of 0.3 s and friction of 15 mm/s² as in `parameters.rs`, each within a factor of 4.5.
const LN_LAG: (f64, f64) = (-1.2, 1.5);
const LN_FRICTION: (f64, f64) = (-4.2, 1.5);
/// A ramp is anything from a jump to half a second: 0.04 s within a factor of 12. Longer or less wide, a jump would be taken for a
/// short ramp.
const LN_RAMP: (f64, f64) = (-3.2, 2.5);
/// Wider than any ramp: for an even change, of which nothing is known beforehand.
const ANY_LN_RAMP: f64 = 10.0;
/// A lag that answers at once, in 1 ms: an even change of speed.
const EVEN_LN_LAG: f64 = -7.0;
/// An even change needs no friction to end (m/s²).
const NO_FRICTION: f64 = 1e-4;

/// How far the law's shape is off within a change, as part of its distance: for most trains (docs/theory/motion_model.md). No number
/// of positions narrows it, so that it is added to where a stop begins and how long it is.
const SHAPE: f64 = 0.04;

/// Positions below which six unknowns and the noise are not found.
pub(super) const FEWEST_POINTS: usize = 10;
/// The part of the series at either end from which the two speeds are read.
const END_PART: f64 = 0.1;
/// A train counts as standing at an end below this part of the speed at the other.
const STANDING: f64 = 0.1;
/// A train that moves less than this in all stands (m).
const NO_MOTION: f64 = 0.01;
/// No position is known better than this (m); keeps a series without noise from being divided by nothing.
const LEAST_NOISE: f64 = 1e-5;
/// Correlation above which positions say next to nothing new.
const MOST_CORRELATED: f64 = 0.98;

/// Where the train was at a time, on any clock and from any origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionPoint {
    /// Time on the clock of the series.
    pub time: TimeSpan,
    /// Place along the track.
    pub position: Length,
}

/// Which change of speed a series shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeriesChange {
    /// From standstill to a speed.
    Start,
    /// From a speed to standstill.
    Stop,
}

/// What a series of positions says of a start or a stop. All uncertainties are standard deviations.
#[derive(Debug, Clone, PartialEq)]
pub struct SeriesFit {
    /// Which change it is.
    pub change: SeriesChange,
    /// Steady speed before a stop, or after a start; never negative.
    pub speed: Estimate<Speed>,
    /// When the change takes effect, on the clock of the series.
    pub effect: Estimate<TimeSpan>,
    /// Time constant of the lag.
    pub lag: Estimate<TimeSpan>,
    /// Duration of the ramp of the set speed before the lag; short against its uncertainty if the set speed jumps.
    pub ramp: Estimate<TimeSpan>,
    /// Deceleration by friction at the end of a stop.
    pub friction: Option<Estimate<Acceleration>>,
    /// From where a stop takes effect to rest.
    pub stopping_distance: Option<Estimate<Length>>,
    /// From when a stop takes effect to rest.
    pub stopping_time: Option<Estimate<TimeSpan>>,
    /// Root mean square of the residuals.
    pub residual: Length,
    /// The same if speed changed evenly, without lag and friction (`τv + v²/2a`).
    pub even_residual: Length,
    /// Correlation of neighbouring residuals.
    pub correlation: f64,
}

impl SeriesFit {
    /// Fits the law to positions of one start or one stop, in either direction along the track.
    ///
    /// # Errors
    ///
    /// If there are too few positions, their times do not increase, or they show no change from or to standstill.
    pub fn of(points: &[PositionPoint]) -> Result<Self, SeriesError> {
        let series = Series::of(points)?;
        let even = series
            .fitted(&[POSITION, EFFECT, SPEED, RAMP], &series.first(true))
            .ok_or(SeriesError::NotDetermined)?;
        // A long ramp and a long lag are two minima: the search begins at both.
        let firsts = [series.first(false), Series::nearly_even(&even.curve.x)];
        let fits = firsts.iter().filter_map(|first| series.fitted(series.unknowns(), first));
        let fit =
            fits.min_by(|one, other| one.rms.total_cmp(&other.rms)).ok_or(SeriesError::NotDetermined)?;
        Ok(series.report(&fit, &even))
    }
}

/// Positions in m and s, turned so that the train runs towards larger ones.
struct Series {
    /// When it begins, on its own clock; all times count from there.
    begins: TimeSpan,
    times: Vec<f64>,
    positions: Vec<f64>,
    change: SeriesChange,
    speed: f64,
}

/// A fitted law and what it leaves over.
struct Fitted {
    curve: FittedCurve,
    unknowns: [Unknown; N],
    rms: f64,
    correlation: f64,
}

impl Series {
    fn of(points: &[PositionPoint]) -> Result<Self, SeriesError> {
        let (Some(first), Some(last)) = (points.first(), points.last()) else {
            return Err(SeriesError::TooFew { found: 0 });
        };
        if points.len() < FEWEST_POINTS {
            return Err(SeriesError::TooFew { found: points.len() });
        }
        let pairs = points.iter().zip(points.iter().skip(1));
        if let Some(before) = pairs.clone().position(|(one, next)| next.time <= one.time) {
            return Err(SeriesError::NotLater { point: before + 1 });
        }
        let moved = last.position - first.position;
        let most = points.iter().map(|point| (point.position - first.position).as_m().abs());
        let most = most.fold(0.0, f64::max);
        if moved.as_m().is_nan() || moved.as_m().abs() < NO_MOTION {
            return Err(SeriesError::Standing { moved: Length::from_m(most) });
        }
        let sense = moved.as_m().signum();
        let times: Vec<f64> = points.iter().map(|point| (point.time - first.time).as_s()).collect();
        let positions: Vec<f64> =
            points.iter().map(|point| sense * (point.position - first.position).as_m()).collect();
        let part = ((END_PART * times.len() as f64) as usize).max(3);
        let speed_in = |from: usize| {
            let (times, positions) = (&times[from..from + part], &positions[from..from + part]);
            slope(times, positions)
        };
        let (begin, end) = (speed_in(0), speed_in(times.len() - part));
        let (change, speed) = if end.abs() < STANDING * begin {
            (SeriesChange::Stop, begin)
        } else if begin.abs() < STANDING * end {
            (SeriesChange::Start, end)
        } else {
            return Err(SeriesError::NotOneChange {
                first: Speed::from_m_per_s(sense * begin),
                last: Speed::from_m_per_s(sense * end),
            });
        };
        Ok(Self { begins: first.time, times, positions, change, speed })
    }

    fn unknowns(&self) -> &'static [usize] {
        match self.change {
            SeriesChange::Stop => &[POSITION, EFFECT, SPEED, LAG, RAMP, FRICTION],
            SeriesChange::Start => &[POSITION, EFFECT, SPEED, LAG, RAMP],
        }
    }

    fn law(&self, x: &[f64]) -> Segment {
        let shape = RampedLag::new(libm::exp(x[RAMP]), libm::exp(x[LAG]));
        match self.change {
            SeriesChange::Stop => {
                Segment::by_law(x[EFFECT], [x[SPEED], 0.0], shape, Some(libm::exp(x[FRICTION])))
            }
            SeriesChange::Start => Segment::by_law(x[EFFECT], [0.0, x[SPEED]], shape, None),
        }
    }

    fn residuals(&self, x: &[f64]) -> Vec<f64> {
        let law = self.law(x);
        let pairs = self.times.iter().zip(&self.positions);
        pairs.map(|(time, position)| position - x[POSITION] - law.distance(*time)).collect()
    }

    /// Where the search begins: the delay and ramp that a stop or start of this length has at an even rate.
    fn first(&self, is_even: bool) -> [f64; N] {
        let (duration, distance) =
            (self.times.last().copied().unwrap_or(0.0), self.positions.last().copied().unwrap_or(0.0));
        // A change at once at the time `at` would get as far; a real one begins before it, and takes about a second.
        let running = distance / self.speed;
        let at = if self.change == SeriesChange::Stop { running } else { duration - running };
        let effect = (at - 0.5).max(0.0);
        let position = if self.change == SeriesChange::Stop { self.speed * effect } else { 0.0 };
        let (lag, ramp, friction) = if is_even {
            (EVEN_LN_LAG, 0.0, libm::log(NO_FRICTION))
        } else {
            (-0.7, LN_RAMP.0, LN_FRICTION.0)
        };
        [position, effect, self.speed, lag, ramp, friction]
    }

    /// Where the search begins if the change is nearly even: its ramp, with a short lag.
    fn nearly_even(even: &[f64]) -> [f64; N] {
        let short_lag = LN_LAG.0 - LN_LAG.1;
        [even[POSITION], even[EFFECT], even[SPEED], short_lag, even[RAMP], LN_FRICTION.0]
    }

    fn fitted(&self, free: &[usize], first: &[f64; N]) -> Option<Fitted> {
        let is_even = !free.contains(&LAG);
        let unknowns = self.priors(free, is_even);
        let curve = CurveFit {
            unknowns: &unknowns,
            residuals: |x: &[f64]| self.residuals(x),
            variance: |residuals: &[f64]| noise(residuals),
        };
        let curve = curve.fitted(first)?;
        let (rms, correlation) = spread(&self.residuals(&curve.x));
        rms.is_finite().then_some(Fitted { curve, unknowns, rms, correlation })
    }

    /// What is known of the unknowns beforehand.
    fn priors(&self, free: &[usize], is_even: bool) -> [Unknown; N] {
        let ramp = if is_even { ANY_LN_RAMP } else { LN_RAMP.1 };
        let of = [
            (0.0, WIDE[POSITION]),
            (0.0, WIDE[EFFECT]),
            (self.speed, WIDE[SPEED]),
            LN_LAG,
            (LN_RAMP.0, ramp),
            LN_FRICTION,
        ];
        core::array::from_fn(|unknown| Unknown {
            prior: of[unknown].0,
            spread: of[unknown].1,
            step: STEP[unknown],
            is_free: free.contains(&unknown),
        })
    }

    fn report(&self, fit: &Fitted, even: &Fitted) -> SeriesFit {
        let count = u32::try_from(self.times.len()).unwrap_or(u32::MAX);
        let (x, deviation) = (&fit.curve.x, |unknown| fit.curve.deviation(unknown));
        let derived = |of: fn(&Segment) -> f64| fit.curve.derived(&fit.unknowns, |x| of(&self.law(x)));
        let span = |(value, deviation): (f64, f64)| Estimate {
            value: TimeSpan::from_s(value),
            uncertainty: TimeSpan::from_s(deviation),
            count,
            date: Timestamp::ZERO,
        };
        let (lag, is_stop) = (libm::exp(x[LAG]), self.change == SeriesChange::Stop);
        let (ramp, friction) = (libm::exp(x[RAMP]), libm::exp(x[FRICTION]));
        let (distance, distance_deviation) = derived(Segment::distance_to_rest);
        let (time, time_deviation) = derived(|law| law.settled() - law.begins);
        let shape = SHAPE * self.law(x).delay() * x[SPEED];
        let shape_time = SHAPE * self.law(x).delay();
        SeriesFit {
            change: self.change,
            speed: Estimate {
                value: Speed::from_m_per_s(x[SPEED]),
                uncertainty: Speed::from_m_per_s(deviation(SPEED)),
                count,
                date: Timestamp::ZERO,
            },
            effect: span((self.begins.as_s() + x[EFFECT], libm::hypot(deviation(EFFECT), shape_time))),
            lag: span((lag, lag * deviation(LAG))),
            ramp: span((ramp, ramp * deviation(RAMP))),
            friction: is_stop.then(|| Estimate {
                value: Acceleration::from_m_per_s2(friction),
                uncertainty: Acceleration::from_m_per_s2(friction * deviation(FRICTION)),
                count,
                date: Timestamp::ZERO,
            }),
            stopping_distance: is_stop.then(|| Estimate {
                value: Length::from_m(distance),
                uncertainty: Length::from_m(libm::hypot(distance_deviation, shape)),
                count,
                date: Timestamp::ZERO,
            }),
            stopping_time: is_stop.then(|| span((time, libm::hypot(time_deviation, shape_time)))),
            residual: Length::from_m(fit.rms),
            even_residual: Length::from_m(even.rms),
            correlation: fit.correlation,
        }
    }
}

/// Slope of the straight line through points, least squares.
fn slope(times: &[f64], positions: &[f64]) -> f64 {
    let count = times.len() as f64;
    let mean = times.iter().sum::<f64>() / count;
    let products: f64 = times.iter().zip(positions).map(|(time, position)| (time - mean) * position).sum();
    let squares: f64 = times.iter().map(|time| (time - mean) * (time - mean)).sum();
    products / squares
}

/// Variance that one position counts with: what is left over, times how much alike neighbours are.
fn noise(residuals: &[f64]) -> f64 {
    let (rms, correlation) = spread(residuals);
    let freedom = residuals.len() as f64 / (residuals.len().saturating_sub(N).max(1)) as f64;
    (rms * rms * freedom).max(LEAST_NOISE * LEAST_NOISE) * (1.0 + correlation) / (1.0 - correlation)
}

/// Root mean square of residuals, and the correlation of neighbours, at least zero.
fn spread(residuals: &[f64]) -> (f64, f64) {
    let squares: f64 = residuals.iter().map(|r| r * r).sum();
    let products: f64 = residuals.iter().zip(residuals.iter().skip(1)).map(|(one, next)| one * next).sum();
    let correlation = if squares > 0.0 { (products / squares).clamp(0.0, MOST_CORRELATED) } else { 0.0 };
    (libm::sqrt(squares / residuals.len().max(1) as f64), correlation)
}

#[cfg(test)]
mod tests {
    use alloc::string::ToString as _;

    use super::*;

    fn points(count: u32, every_s: f64, position: impl Fn(f64) -> f64) -> Vec<PositionPoint> {
        let point =
            |time| PositionPoint { time: TimeSpan::from_s(time), position: Length::from_m(position(time)) };
        (0..count).map(|n| point(every_s * f64::from(n))).collect()
    }

    /// From rest at `t = 1` to 0.25 m/s with a lag of 0.4 s: the integral of `v (1 − e^−t/θ)`.
    fn lagging(time: f64) -> f64 {
        let since = (time - 1.0).max(0.0);
        0.25 * (since - 0.4 * (1.0 - libm::exp(-since / 0.4)))
    }

    /// From 0.3 m/s at `t = 1.2` towards rest with a lag of 0.5 s: 0.15 m.
    fn stopping(time: f64) -> f64 {
        let since = (time - 1.2).max(0.0);
        0.3 * time.min(1.2) + 0.15 * (1.0 - libm::exp(-since / 0.5))
    }

    fn assert_near(found: f64, expected: f64, tolerance: f64) {
        assert!((found - expected).abs() < tolerance, "{found}, not {expected} ± {tolerance}");
    }

    #[test]
    fn a_start_with_a_lag_gives_its_numbers_on_any_clock_and_in_either_direction() {
        for (clock, origin, sense) in [(0.0, 0.0, 1.0), (100.0, -7.0, -1.0)] {
            let mut series = points(150, 0.04, |time| origin + sense * lagging(time));
            series.iter_mut().for_each(|point| point.time += TimeSpan::from_s(clock));
            let fit = SeriesFit::of(&series).expect("a start");
            assert_eq!(fit.change, SeriesChange::Start);
            assert_near(fit.speed.value.as_m_per_s(), 0.25, 1e-3);
            assert_near(fit.lag.value.as_s(), 0.4, 0.02);
            assert_near(fit.effect.value.as_s(), clock + 1.0, 0.02);
            assert!(fit.ramp.value.as_s() < 0.1, "{:?}", fit.ramp);
            assert!(fit.residual < Length::from_mm(0.1), "{:?}", fit.residual);
            // An even change of 0.25 m/s is off by millimetres.
            assert!(fit.even_residual > Length::from_mm(1.0), "{:?}", fit.even_residual);
            assert_eq!((fit.friction, fit.stopping_distance, fit.stopping_time), (None, None, None));
            assert_eq!(fit.speed.count, 150);
        }
    }

    #[test]
    fn an_even_stop_is_as_long_as_it_was() {
        // 0.3 m/s, from 1 s on 0.15 m/s² less each second: 2 s and 0.3 m to rest.
        let even = |time: f64| {
            let braking = (time - 1.0).clamp(0.0, 2.0);
            0.3 * (time.min(1.0) + braking) - 0.5 * 0.15 * braking * braking
        };
        let fit = SeriesFit::of(&points(250, 0.02, even)).unwrap();
        assert_near(fit.speed.value.as_m_per_s(), 0.3, 0.001);
        // Every train lags and rubs a little beforehand, so that it is taken for 5 % longer: within twice what it says of itself.
        let distance = fit.stopping_distance.unwrap();
        assert_near(distance.value.as_m(), 0.3, 0.016);
        assert!((0.008..0.02).contains(&distance.uncertainty.as_m()), "{distance:?}");
        assert_near(fit.stopping_time.unwrap().value.as_s(), 2.0, 0.25);
    }

    #[test]
    fn a_stop_is_as_long_as_it_was() {
        let fit = SeriesFit::of(&points(200, 0.04, stopping)).expect("a stop");
        assert_eq!(fit.change, SeriesChange::Stop);
        assert_near(fit.speed.value.as_m_per_s(), 0.3, 1e-3);
        assert_near(fit.lag.value.as_s(), 0.5, 0.02);
        assert_near(fit.effect.value.as_s(), 1.2, 0.03);
        assert!(fit.residual < Length::from_mm(0.2) && fit.even_residual > fit.residual, "{fit:?}");
        // The law's shape is off by 4 % of its delay of half a second: at least 6 mm, and 20 ms.
        let distance = fit.stopping_distance.expect("a stop");
        assert_near(distance.value.as_mm(), 150.0, 8.0);
        assert!(
            distance.uncertainty > Length::from_mm(6.0) && distance.uncertainty < Length::from_mm(20.0),
            "{fit:?}"
        );
        assert!(
            fit.effect.uncertainty > TimeSpan::from_ms(20) && fit.effect.uncertainty < TimeSpan::from_ms(80),
            "{fit:?}"
        );
        assert!(fit.stopping_time.is_some_and(|time| time.value > TimeSpan::from_s(2.0)), "{fit:?}");
        assert!(
            fit.friction.is_some_and(|friction| friction.value < Acceleration::from_mm_per_s2(5.0)),
            "{fit:?}"
        );
    }

    #[test]
    fn what_is_no_change_of_speed_is_refused_with_its_numbers() {
        let refused = |points: &[PositionPoint]| SeriesFit::of(points).expect_err("nothing").to_string();
        let start = points(150, 0.04, lagging);
        assert!(refused(&start[..9]).starts_with("9 positions are too few"));
        assert!(refused(&[]).starts_with("0 positions"));
        let mut twice = start.clone();
        twice[5].time = twice[4].time;
        assert!(refused(&twice).starts_with("the time of position 6 is not after"), "{}", refused(&twice));
        // To and fro: 3 mm at most.
        let shaken = points(40, 0.1, |time| 0.003 * libm::sin(time));
        assert!(refused(&shaken).starts_with("the train moved only 3.0 mm"), "{}", refused(&shaken));
        let even = points(40, 0.1, |time| -0.2 * time);
        assert!(refused(&even).contains("runs at -200 mm/s at the beginning and -200 mm/s at the end"));
    }

    #[test]
    fn residuals_that_are_alike_say_less() {
        assert_near(slope(&[0.0, 1.0, 2.0], &[0.0, 2.0, 4.5]), 2.25, 1e-12);
        // Σ r² = 9 and Σ r r′ = 6.
        let (rms, correlation) = spread(&[1.0, 2.0, 2.0]);
        assert_near(rms, libm::sqrt(3.0), 1e-12);
        assert_near(correlation, 2.0 / 3.0, 1e-12);
        // Twelve residuals of 2 mm with six unknowns: 8 mm² where each has the other sign than the one before, 23 times that
        // where all are alike: ρ = 11/12.
        let alternating: Vec<f64> = (0..12).map(|n| if n % 2 == 0 { 0.002 } else { -0.002 }).collect();
        assert_near(noise(&alternating), 8e-6, 1e-12);
        assert_near(noise(&[0.002; 12]), 23.0 * 8e-6, 1e-10);
        assert_near(noise(&[0.0; 12]), LEAST_NOISE * LEAST_NOISE, 1e-20);
    }
}
