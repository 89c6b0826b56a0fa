//! Process noise: by how much the numbers of a train change between sessions and within one.
//!
//! The same engine in another team's session runs at 1 % another speed in the median and 10 % at worst (18 pairs of published
//! tables); within an hour trains that get warm become some per cent faster. Predictions from an older model include this.

use alloc::vec::Vec;

use super::parameters::{
    DOWN, FRICTION, HYSTERESIS, NODES, START_DELAY, START_NODES, STOP_NODES, UP, hysteresis_at, knots,
    node_speed, speed_at,
};

/// Standard deviations of changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Variation {
    /// Of ln speed, at all steps alike, and at each by itself.
    common_speed: f64,
    own_speed: f64,
    /// Of hysteresis (m/s).
    hysteresis: f64,
    /// Of delays and lags (s), and of the delay of a start.
    delay: f64,
    start_delay: f64,
    /// Of `κ` (s² per m).
    kappa: f64,
    /// Of friction (m/s²).
    friction: f64,
    /// Of what the law of stops and starts leaves over, as part of the speed (m per m/s).
    residual: f64,
    /// Of the time that starts and other accelerations take, and of the time that stops and other decelerations take, each
    /// as a part of it.
    acceleration_time: f64,
    deceleration_time: f64,
    /// Of the time that all changes of speed take, as a part of it: a heavier load makes starts and stops slower by the same factor.
    /// No sum of a stop and the next start shows that where both take as long; sensors passed while braking do.
    load: f64,
}

impl Variation {
    /// From one session to the next: warmth, cleaning, voltage, wear.
    pub(super) const fn between_sessions() -> Self {
        Self {
            common_speed: 0.020,
            own_speed: 0.012,
            hysteresis: 0.002,
            delay: 0.010,
            start_delay: 0.040,
            kappa: 0.05,
            friction: 0.001,
            residual: 0.010,
            acceleration_time: 0.05,
            deceleration_time: 0.05,
            load: 0.12,
        }
    }

    /// Within an hour of one session: motors and grease get warm.
    pub(super) const fn per_hour() -> Self {
        Self {
            common_speed: 0.030,
            own_speed: 0.008,
            hysteresis: 0.002,
            delay: 0.008,
            start_delay: 0.030,
            kappa: 0.03,
            friction: 0.001,
            residual: 0.008,
            acceleration_time: 0.0,
            deceleration_time: 0.0,
            load: 0.0,
        }
    }

    /// After a multiple of its time, as a random walk.
    pub(super) fn over(self, times: f64) -> Self {
        let by = libm::sqrt(times.max(0.0));
        Self {
            common_speed: by * self.common_speed,
            own_speed: by * self.own_speed,
            hysteresis: by * self.hysteresis,
            delay: by * self.delay,
            start_delay: by * self.start_delay,
            kappa: by * self.kappa,
            friction: by * self.friction,
            residual: by * self.residual,
            acceleration_time: by * self.acceleration_time,
            deceleration_time: by * self.deceleration_time,
            load: by * self.load,
        }
    }

    /// Calls `add` with pairs of numbers that change and a covariance of their changes, each pair in one order only; the
    /// covariances of a pair add up. `values` are the numbers before the change.
    pub(super) fn each(&self, values: &[f64], highest: usize, mut add: impl FnMut(usize, usize, f64)) {
        let squared = |deviation: f64| deviation * deviation;
        let (up, down) = (time_slopes(values, UP, START_NODES), time_slopes(values, DOWN, STOP_NODES));
        let both = up.iter().chain(&down).copied().collect();
        for (slopes, deviation) in
            [(up, self.acceleration_time), (down, self.deceleration_time), (both, self.load)]
        {
            for (nth, (one, slope)) in slopes.iter().enumerate() {
                for (other, by) in slopes.iter().take(nth + 1) {
                    add(*one, *other, squared(deviation) * slope * by);
                }
            }
        }
        add(HYSTERESIS, HYSTERESIS, squared(self.hysteresis));
        for first in [UP, DOWN] {
            add(first, first, squared(self.delay));
            add(first + 1, first + 1, squared(self.delay));
            add(first + 2, first + 2, squared(self.kappa));
        }
        add(START_DELAY, START_DELAY, squared(self.start_delay));
        add(FRICTION, FRICTION, squared(self.friction));
        for node in 0..NODES {
            for first in [STOP_NODES, START_NODES] {
                add(first + node, first + node, squared(self.residual * node_speed(node)));
            }
        }
        for knot in 1..=knots(highest) {
            add(speed_at(knot), speed_at(knot), squared(self.own_speed) + squared(self.common_speed));
            for other in 1..knot {
                add(speed_at(knot), speed_at(other), squared(self.common_speed));
            }
            let own = hysteresis_at(knot, highest);
            add(own, own, 0.25 * squared(self.hysteresis));
        }
    }
}

/// How the numbers of a direction change with ln of the time that its speed changes take: lag, ramps and what the law leaves
/// over grow with it, friction falls. The delay of the command remains.
fn time_slopes(values: &[f64], first: usize, nodes: usize) -> Vec<(usize, f64)> {
    let value = |place: usize| values.get(place).copied().unwrap_or(0.0);
    let grows = (first + 1..first + 4).chain(nodes..nodes + NODES).map(|place| (place, value(place)));
    let falls = (first == DOWN).then(|| (FRICTION, -value(FRICTION)));
    grows.chain(falls).collect()
}

#[cfg(test)]
mod tests {
    use alloc::collections::BTreeMap;

    use super::super::parameters::count;
    use super::*;

    const HIGHEST: usize = 14;

    /// The covariances that one deviation alone makes.
    fn of(set: impl Fn(&mut Variation)) -> BTreeMap<(usize, usize), f64> {
        let mut variation = Variation::per_hour().over(0.0);
        set(&mut variation);
        let mut found = BTreeMap::new();
        let values = alloc::vec![0.0; count(HIGHEST)];
        variation.each(&values, HIGHEST, |one, other, by| *found.entry((one, other)).or_insert(0.0) += by);
        found.retain(|_, by| *by != 0.0);
        found
    }

    #[test]
    fn every_deviation_varies_its_own_numbers() {
        // The four numbers of acceleration begin at 1 and those of deceleration at 5: two delays, κ and one more each.
        let squares = |numbers: &[usize]| numbers.iter().map(|n| ((*n, *n), 0.25)).collect();
        assert_eq!(of(|v| v.delay = 0.5), squares(&[1, 2, 5, 6]));
        assert_eq!(of(|v| v.kappa = 0.5), squares(&[3, 7]));
        assert_eq!(of(|v| v.start_delay = 0.5), squares(&[9]));
        assert_eq!(of(|v| v.friction = 0.5), squares(&[10]));
    }

    #[test]
    fn speeds_vary_each_by_itself_and_all_together() {
        let speeds = of(|v| (v.own_speed, v.common_speed) = (0.3, 0.4));
        assert_eq!(speeds.len(), 14 * 15 / 2, "each pair once");
        for one in 1..=HIGHEST {
            for other in 1..=one {
                // 0.3² + 0.4² on the diagonal, 0.4² beside it.
                let wanted = if one == other { 0.25 } else { 0.16 };
                let found = speeds[&(speed_at(one), speed_at(other))];
                assert!((found - wanted).abs() < 1e-12, "{one} {other}: {found}");
            }
        }
    }

    #[test]
    fn what_laws_leave_over_varies_as_a_part_of_the_speed() {
        // Nodes lie 0.1 m/s apart: of 0.3 m/s 0.02 are 6 mm.
        let nodes = of(|v| v.residual = 0.02);
        assert_eq!(nodes.len(), 2 * NODES);
        for first in [STOP_NODES, START_NODES] {
            let third = nodes[&(first + 2, first + 2)];
            assert!((third - 0.006 * 0.006).abs() < 1e-15, "{third}");
        }
    }

    #[test]
    fn after_four_hours_a_random_walk_is_twice_as_far() {
        let all = |variation: Variation| {
            let Variation { common_speed, own_speed, hysteresis, delay, start_delay, .. } = variation;
            let Variation { kappa, friction, residual, acceleration_time, load, .. } = variation;
            [
                common_speed,
                own_speed,
                hysteresis,
                delay,
                start_delay,
                kappa,
                friction,
                residual,
                acceleration_time,
                load,
            ]
        };
        let four = all(Variation::between_sessions().over(4.0));
        for (one, four) in all(Variation::between_sessions()).into_iter().zip(four) {
            assert!((four - 2.0 * one).abs() < 1e-12, "{one} {four}");
        }
    }

    /// A heavier load by hand: one per cent more time makes lag, ramps and what the law leaves over one per cent greater, friction less.
    #[test]
    fn a_load_varies_all_that_takes_time_by_its_own_size() {
        let mut values = alloc::vec![0.0; count(HIGHEST)];
        (values[DOWN + 1], values[FRICTION], values[STOP_NODES + 1], values[UP + 3]) = (0.2, 0.05, 0.03, 0.4);
        // What takes no time, or is a delay of the command, does not change.
        (values[HYSTERESIS], values[UP], values[DOWN], values[START_DELAY]) = (0.01, 0.1, 0.3, 0.2);
        let mut load = Variation::per_hour().over(0.0);
        load.load = 0.1;
        let mut found = BTreeMap::new();
        load.each(&values, HIGHEST, |one, other, by| {
            *found.entry((one.min(other), one.max(other))).or_insert(0.0) += by;
        });
        found.retain(|_, by| *by != 0.0);
        let slopes = [(UP + 3, 0.4), (DOWN + 1, 0.2), (FRICTION, -0.05), (STOP_NODES + 1, 0.03)];
        assert_eq!(found.len(), 10, "{found:?}");
        for (nth, (one, slope)) in slopes.iter().enumerate() {
            for (other, by) in slopes.iter().skip(nth) {
                let covariance = found[&(*one, *other)];
                assert!((covariance - 0.01 * slope * by).abs() < 1e-15, "{one} {other}: {covariance}");
            }
        }
    }
}
