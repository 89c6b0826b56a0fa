//! Uncertainty of single changes of speed by the model.
//!
//! The distance that a change adds is linear in the train's numbers, so its slopes are explicit and nothing is allocated:
//! a change of speed `Δ = v − v′` over `n` steps displaces by `Δ (q + θ + κ|Δ| + ρ|n|/2)`, and starts and stops by what
//! their nodes add.

use super::motion_model::MotionModel;
use super::parameters::{
    Answers, DOWN, FRICTION, HYSTERESIS, START_DELAY, START_NODES, STOP_NODES, UP, between_knots,
    hysteresis_at, knots, knots_about, nodes_about, speed_at, stride,
};
use super::priors::end_of_stop;

/// Factor on the shape error of a single change in forecasts, for shapes of decoders that the law lacks (chosen on simulated
/// decoders of six laws, so that 90 % intervals hold nine times in ten).
pub(crate) const OTHER_SHAPES: f64 = 2.0;

impl MotionModel {
    /// Variance of ln of the steady speed at a step.
    pub(crate) fn ln_speed_variance(&self, step: u8, above: bool) -> f64 {
        let place = usize::from(step);
        let speed = self.answers().speed(place, above);
        if speed <= 0.0 || place == 0 || place > self.steps() {
            return 0.0;
        }
        let below = self.answers().speed(place, false);
        let between = between_knots(place, self.steps());
        let [low, high] = knots_about(place, self.steps());
        let of_speed = |(knot, weight): (usize, f64), part: f64| (speed_at(knot), weight * part);
        if !above {
            return self.spread.variance_along(&[low, high].map(|knot| of_speed(knot, 1.0)))
                + between * between;
        }
        let part = Answers::hysteresis_part(below) / speed;
        let own = |(knot, weight): (usize, f64)| (hysteresis_at(knot, self.steps()), weight * part);
        let slopes = [
            of_speed(low, below / speed),
            of_speed(high, below / speed),
            (HYSTERESIS, part),
            own(low),
            own(high),
        ];
        self.spread.variance_along(&slopes) + between * between
    }

    /// Variance of the time of a start (s²): of what is known of its delay, and of single starts.
    pub(crate) fn start_variance(&self) -> f64 {
        let scatter = self.start_scatter();
        scatter * scatter + self.spread.variance(START_DELAY)
    }

    /// One standard deviation (m) of the stopping distance from a speed (m/s), by the uncertainty of the law.
    pub(crate) fn stop_deviation(&self, speed: f64) -> f64 {
        let [(low, left), (high, right)] = nodes_about(speed);
        let [delay, (lag, by_lag), kappa, rho] = self.law_slopes(DOWN, speed, 0.0);
        let (friction_by_lag, by_friction) = self.friction_slopes(speed);
        let (lag, friction) = ((lag, by_lag - friction_by_lag), (FRICTION, -by_friction));
        let nodes = [(STOP_NODES + low, left), (STOP_NODES + high, right)];
        let slopes = [delay, lag, kappa, rho, friction, nodes[0], nodes[1]];
        libm::hypot(libm::sqrt(self.spread.variance_along(&slopes)), end_of_stop(speed))
    }

    /// The same for the place of a train that has started to a speed, without the delay of the start.
    pub(crate) fn start_deviation(&self, speed: f64) -> f64 {
        let [(low, left), (high, right)] = nodes_about(speed);
        let [_, lag, kappa, rho] = self.law_slopes(UP, 0.0, speed);
        let slopes = [lag, kappa, rho, (START_NODES + low, left), (START_NODES + high, right)];
        libm::sqrt(self.spread.variance_along(&slopes))
    }

    /// The same for a change from one speed to another.
    pub(crate) fn change_deviation(&self, from: f64, to: f64) -> f64 {
        let slopes = self.law_slopes(if to > from { UP } else { DOWN }, from, to);
        libm::sqrt(self.spread.variance_along(&slopes))
    }

    /// Slopes of a displacement in delay, lag, `κ` and `ρ` of a direction.
    fn law_slopes(&self, first: usize, from: f64, to: f64) -> [(usize, f64); 4] {
        let change = from - to;
        let steps = f64::from(self.step_near(from)) - f64::from(self.step_near(to));
        [
            (first, change),
            (first + 1, change),
            (first + 2, change * change.abs()),
            (first + 3, 0.5 * change * (steps.abs() / stride(self.steps()) as f64)),
        ]
    }

    /// Slopes in lag and friction of the distance by which friction shortens a stop, `f θ² ln(1 + u)` with `u = A/(f θ)`; as if
    /// nothing drove from the beginning, where it is largest.
    fn friction_slopes(&self, speed: f64) -> (f64, f64) {
        let answers = self.answers();
        let (lag, _) = answers.lag_and_ramp(false, speed, 0.0);
        let (lag, friction) = (lag.max(1e-3), answers.friction());
        let u = speed / (friction * lag);
        let (log, part) = (libm::log1p(u), u / (1.0 + u));
        (friction * lag * (2.0 * log - part), lag * lag * (log - part))
    }

    /// The step with the nearest speed; 0 for standstill.
    pub(crate) fn step_near(&self, speed: f64) -> u8 {
        let answers = self.answers();
        let (knots, stride) = (knots(self.steps()), stride(self.steps()));
        let steps = if stride == 1 {
            1..=self.highest().get()
        } else {
            let fast_enough = |knot: &usize| answers.speed(knot * stride, false) >= speed;
            let above = stride * (1..=knots).find(fast_enough).unwrap_or(knots);
            (above - stride).max(1) as u8..=above as u8
        };
        // The nearest is the fastest of the slower ones, the slowest of the faster ones, or standstill: logarithms tell which.
        let ln = if speed > 0.0 { libm::log(speed) } else { f64::NEG_INFINITY };
        let (mut slower, mut faster) = ((0, f64::NEG_INFINITY), (0, f64::INFINITY));
        for step in steps {
            let at = answers.bounded_ln_speed(usize::from(step));
            if at <= ln && at > slower.1 {
                slower = (step, at);
            } else if at > ln && at < faster.1 {
                faster = (step, at);
            }
        }
        let off = |step: &u8| (answers.speed(usize::from(*step), false) - speed).abs();
        let near = [0, slower.0, faster.0].map(|step| (off(&step), step));
        near.into_iter()
            .min_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)))
            .map_or(0, |(_, step)| step)
    }
}
