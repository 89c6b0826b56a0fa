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
#![expect(clippy::indexing_slicing, reason = "every index is below the number of unknowns")]

use alloc::vec::Vec;

use super::segment::Segment;
use crate::estimate::Estimate;
use crate::kinematics::RampedLag;
use crate::linalg::{NormalEquations, Solution};
use crate::time::{TimeSpan, Timestamp};
use crate::units::{Acceleration, Length, Speed};

const POSITION: usize = 0;
const EFFECT: usize = 1;
const SPEED: usize = 2;
const LAG: usize = 3;
const RAMP: usize = 4;
const FRICTION: usize = 5;
const N: usize = 6;

/// Steps of the numerical derivatives, as fine as the law is smooth: m, s, m/s, 1, 1, 1.
const STEP: [f64; N] = [1e-4, 1e-4, 1e-4, 1e-3, 1e-3, 1e-3];
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

/// How far the law's shape is off within a change, as part of its way: for most trains (docs/theory/motion_model.md). No number
/// of positions narrows it, so that it is added to where a stop begins and how long it is.
const SHAPE: f64 = 0.04;

const MOST_ITERATIONS: usize = 80;
/// A step that lowers the cost by less than this share is the last.
const CONVERGED: f64 = 1e-9;
/// Positions below which six unknowns and the noise are not found.
const FEWEST_POINTS: usize = 10;
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

/// Why a series says nothing of a change of speed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SeriesError {
    /// There are too few positions.
    TooFew {
        /// How many there are.
        found: usize,
    },
    /// A time is not later than the one before.
    NotLater {
        /// Number of the point, from 0.
        point: usize,
    },
    /// The train stands all the time.
    Standing {
        /// How far it moved in all.
        moved: Length,
    },
    /// The train moves at both ends, or at neither.
    NotOneChange {
        /// Speed in the first tenth.
        first: Speed,
        /// Speed in the last tenth.
        last: Speed,
    },
    /// The positions leave the law's numbers open.
    NotDetermined,
}

impl core::fmt::Display for SeriesError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooFew { found } => {
                write!(f, "{found} positions are too few for a law: measure {FEWEST_POINTS} or more")
            }
            Self::NotLater { point } => {
                write!(
                    f,
                    "the time of position {} is not after the one before: sort the rows by time",
                    point + 1
                )
            }
            Self::Standing { moved } => write!(
                f,
                "the train moved only {:.1} mm, so that it stood all the time: measure a start or a stop",
                moved.as_mm()
            ),
            Self::NotOneChange { first, last } => write!(
                f,
                "the train runs at {:.0} mm/s at the beginning and {:.0} mm/s at the end: one of them should be standstill, \
                 so cut the series to one start or one stop",
                first.as_mm_per_s(),
                last.as_mm_per_s()
            ),
            Self::NotDetermined => {
                write!(f, "the positions leave the law open: measure more of them while the speed changes")
            }
        }
    }
}

impl core::error::Error for SeriesError {}

impl SeriesFit {
    /// Fits the law to positions of one start or one stop, in either direction along the track.
    ///
    /// # Errors
    ///
    /// If there are too few positions, their times do not increase, or they show no change from or to standstill.
    pub fn of(points: &[PositionPoint]) -> Result<Self, SeriesError> {
        let series = Series::of(points)?;
        let even = series.fitted(&[POSITION, EFFECT, SPEED, RAMP]).ok_or(SeriesError::NotDetermined)?;
        let fit = series.fitted(series.unknowns()).ok_or(SeriesError::NotDetermined)?;
        Ok(series.report(&fit, &even))
    }
}

/// Positions in m and s, turned so that the train runs towards larger ones.
struct Series {
    times: Vec<f64>,
    positions: Vec<f64>,
    change: SeriesChange,
    speed: f64,
}

/// Values of all unknowns, and how those that were free are known.
struct Fitted {
    x: [f64; N],
    free: Vec<usize>,
    solution: Solution,
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
        Ok(Self { times, positions, change, speed })
    }

    fn unknowns(&self) -> &'static [usize] {
        match self.change {
            SeriesChange::Stop => &[POSITION, EFFECT, SPEED, LAG, RAMP, FRICTION],
            SeriesChange::Start => &[POSITION, EFFECT, SPEED, LAG, RAMP],
        }
    }

    fn law(&self, x: &[f64; N]) -> Segment {
        let shape = RampedLag::new(libm::exp(x[RAMP]), libm::exp(x[LAG]));
        match self.change {
            SeriesChange::Stop => {
                Segment::by_law(x[EFFECT], [x[SPEED], 0.0], shape, Some(libm::exp(x[FRICTION])))
            }
            SeriesChange::Start => Segment::by_law(x[EFFECT], [0.0, x[SPEED]], shape, None),
        }
    }

    fn residuals(&self, x: &[f64; N]) -> Vec<f64> {
        let law = self.law(x);
        let pairs = self.times.iter().zip(&self.positions);
        pairs.map(|(time, position)| position - x[POSITION] - law.way(*time)).collect()
    }

    /// Where the search begins: the delay and ramp that a stop or start of this length has at an even rate.
    fn first(&self, is_even: bool) -> [f64; N] {
        let (duration, way) =
            (self.times.last().copied().unwrap_or(0.0), self.positions.last().copied().unwrap_or(0.0));
        // A change at once at the time `at` would get as far; a real one begins before it, and takes about a second.
        let running = way / self.speed;
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

    /// Gauss's and Newton's iteration with steps damped until they lower the cost (Levenberg, 1944).
    fn fitted(&self, free: &[usize]) -> Option<Fitted> {
        let is_even = !free.contains(&LAG);
        let mut x = self.first(is_even);
        let mut noise = self.noise(&x);
        let (mut damping, mut cost) = (1e-3, self.cost(&x, noise, is_even));
        for _ in 0..MOST_ITERATIONS {
            let step = self.equations(&x, noise, free, is_even, damping).values()?;
            let mut next = x;
            for (unknown, by) in free.iter().zip(&step) {
                next[*unknown] += by;
            }
            let next_cost = self.cost(&next, noise, is_even);
            if next_cost < cost {
                let gained = cost - next_cost;
                x = next;
                damping = (0.2 * damping).max(1e-9);
                let settled = gained < CONVERGED * cost;
                noise = self.noise(&x);
                cost = self.cost(&x, noise, is_even);
                if settled {
                    break;
                }
            } else {
                damping *= 8.0;
                if damping > 1e9 {
                    break;
                }
            }
        }
        let residuals = self.residuals(&x);
        let (rms, correlation) = spread(&residuals);
        let solution = self.equations(&x, noise, free, is_even, 0.0).solve()?;
        let is_finite = x.iter().all(|value| value.is_finite()) && rms.is_finite();
        is_finite.then(|| Fitted { x, free: free.to_vec(), solution, rms, correlation })
    }

    /// Variance that one position counts with: what is left over, times how much alike neighbours are.
    fn noise(&self, x: &[f64; N]) -> f64 {
        let residuals = self.residuals(x);
        let (rms, correlation) = spread(&residuals);
        let freedom = residuals.len() as f64 / (residuals.len().saturating_sub(N).max(1)) as f64;
        (rms * rms * freedom).max(LEAST_NOISE * LEAST_NOISE) * (1.0 + correlation) / (1.0 - correlation)
    }

    /// Priors of the unknowns: which, value, standard deviation. The rest is bounded by its unit only.
    fn priors(&self, is_even: bool) -> [(usize, f64, f64); N] {
        // Metres, seconds and m/s, far beyond any layout: they only keep the equations from being singular.
        let wide = [(POSITION, 0.0, 1e3), (EFFECT, 0.0, 1e4), (SPEED, self.speed, 1e2)];
        let ramp = if is_even { ANY_LN_RAMP } else { LN_RAMP.1 };
        [
            wide[0],
            wide[1],
            wide[2],
            (LAG, LN_LAG.0, LN_LAG.1),
            (RAMP, LN_RAMP.0, ramp),
            (FRICTION, LN_FRICTION.0, LN_FRICTION.1),
        ]
    }

    fn cost(&self, x: &[f64; N], noise: f64, is_even: bool) -> f64 {
        let squares: f64 = self.residuals(x).iter().map(|r| r * r).sum();
        let priors = self.priors(is_even);
        let offs = priors.iter().map(|(unknown, value, by)| (x[*unknown] - value) / by);
        let prior: f64 = offs.map(|off| off * off).sum();
        let cost = squares / noise + prior;
        if cost.is_finite() { cost } else { f64::INFINITY }
    }

    /// For the step from `x`, so that a prior counts with how far `x` is from it.
    fn equations(
        &self,
        x: &[f64; N],
        noise: f64,
        free: &[usize],
        is_even: bool,
        damping: f64,
    ) -> NormalEquations {
        let residuals = self.residuals(x);
        let slopes: Vec<Vec<f64>> = free.iter().map(|unknown| self.slopes(x, *unknown)).collect();
        let mut equations = NormalEquations::new(free.len());
        for (row, residual) in residuals.iter().enumerate() {
            let terms: Vec<(usize, f64)> =
                slopes.iter().enumerate().map(|(unknown, slope)| (unknown, slope[row])).collect();
            equations.add(&terms, *residual, noise);
        }
        let priors = self.priors(is_even);
        for (place, unknown) in free.iter().enumerate() {
            let (_, value, by) = priors[*unknown];
            equations.add(&[(place, 1.0)], value - x[*unknown], by * by);
            if damping > 0.0 {
                let information: f64 = slopes[place].iter().map(|slope| slope * slope).sum::<f64>() / noise;
                equations.add(&[(place, 1.0)], 0.0, 1.0 / (damping * information.max(1e-12)));
            }
        }
        equations
    }

    /// Derivative of each position by one unknown.
    fn slopes(&self, x: &[f64; N], unknown: usize) -> Vec<f64> {
        let (mut up, mut down) = (*x, *x);
        up[unknown] += STEP[unknown];
        down[unknown] -= STEP[unknown];
        let width = up[unknown] - down[unknown];
        let pairs = self.residuals(&down).into_iter().zip(self.residuals(&up));
        pairs.map(|(below, above)| (below - above) / width).collect()
    }

    /// A figure that follows from the unknowns, with its standard deviation to first order.
    fn derived(&self, fit: &Fitted, of: impl Fn(&Segment) -> f64) -> (f64, f64) {
        let terms: Vec<(usize, f64)> = fit
            .free
            .iter()
            .enumerate()
            .map(|(place, unknown)| {
                let mut up = fit.x;
                up[*unknown] += STEP[*unknown];
                (place, (of(&self.law(&up)) - of(&self.law(&fit.x))) / STEP[*unknown])
            })
            .collect();
        (of(&self.law(&fit.x)), libm::sqrt(fit.solution.variance_of(&terms)))
    }

    fn report(&self, fit: &Fitted, even: &Fitted) -> SeriesFit {
        let count = u32::try_from(self.times.len()).unwrap_or(u32::MAX);
        let deviation = |unknown: usize| {
            let place = fit.free.iter().position(|free| *free == unknown);
            place.map_or(0.0, |place| libm::sqrt(fit.solution.variance(place)))
        };
        let span = |(value, deviation): (f64, f64)| Estimate {
            value: TimeSpan::from_s(value),
            uncertainty: TimeSpan::from_s(deviation),
            count,
            date: Timestamp::ZERO,
        };
        let (lag, is_stop) = (libm::exp(fit.x[LAG]), self.change == SeriesChange::Stop);
        let (ramp, friction) = (libm::exp(fit.x[RAMP]), libm::exp(fit.x[FRICTION]));
        let (way, way_deviation) = self.derived(fit, Segment::way_to_rest);
        let (time, time_deviation) = self.derived(fit, |law| law.settled() - law.begins);
        let shape = SHAPE * self.law(&fit.x).delay() * fit.x[SPEED];
        let shape_time = SHAPE * self.law(&fit.x).delay();
        SeriesFit {
            change: self.change,
            speed: Estimate {
                value: Speed::from_m_per_s(fit.x[SPEED]),
                uncertainty: Speed::from_m_per_s(deviation(SPEED)),
                count,
                date: Timestamp::ZERO,
            },
            effect: span((fit.x[EFFECT], libm::hypot(deviation(EFFECT), shape_time))),
            lag: span((lag, lag * deviation(LAG))),
            ramp: span((ramp, ramp * deviation(RAMP))),
            friction: is_stop.then(|| Estimate {
                value: Acceleration::from_m_per_s2(friction),
                uncertainty: Acceleration::from_m_per_s2(friction * deviation(FRICTION)),
                count,
                date: Timestamp::ZERO,
            }),
            stopping_distance: is_stop.then(|| Estimate {
                value: Length::from_m(way),
                uncertainty: Length::from_m(libm::hypot(way_deviation, shape)),
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

/// Root mean square of residuals, and the correlation of neighbours, at least zero.
fn spread(residuals: &[f64]) -> (f64, f64) {
    let squares: f64 = residuals.iter().map(|r| r * r).sum();
    let products: f64 = residuals.iter().zip(residuals.iter().skip(1)).map(|(one, next)| one * next).sum();
    let correlation = if squares > 0.0 { (products / squares).clamp(0.0, MOST_CORRELATED) } else { 0.0 };
    (libm::sqrt(squares / residuals.len().max(1) as f64), correlation)
}
