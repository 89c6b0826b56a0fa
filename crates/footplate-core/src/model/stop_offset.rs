//! By how much stops are longer or shorter because of the track that they run over, mostly through gradients.
//!
//! Gravity lengthens a stop downhill and shortens it uphill; layouts come without surveyed gradients. Each edge therefore has a
//! stop offset, learnt from the stops that ran over it. A stop of some decimetres runs over several edges, and what each adds
//! depends on the speed there: see [`StopEffect`]. The standard deviation of the offsets is learnt with them: on a level
//! layout they stay near zero.

use alloc::collections::BTreeMap;

use crate::linalg::Gaussian;

/// Speed (m/s) up to which a stop grows as friction lets it: friction of 15 mm/s² over a lag of 2 s.
const FRICTION_SPEED: f64 = 0.03;
/// Offsets are those of stops from this speed (m/s), a middle one.
const REFERENCE_SPEED: f64 = 0.3;
/// Least prior standard deviation of an offset (m), so that offsets can still grow on a layout that seemed level.
const LEAST_DEVIATION: f64 = 0.0005;
/// On a layout of which nothing is known (m): the effect of a gradient of 0.2 % on a train that rolls to rest (chosen: tables of
/// clubs are level to a few millimetres a metre), ...
const USUAL_DEVIATION: f64 = 0.005;
/// ... which weighs as much as this many edges that are well known. With four, a layout of steep gradients is taken for a level one for
/// whole sessions: while the deviation is small, no edge counts as well known.
const WORTH: f64 = 1.0;
/// Halvings of the speed at which a part of a stop is left: to a thousandth.
const HALVINGS: usize = 10;

/// How the effect of gradients is spread over a stop.
///
/// A train that nothing drives slows down by lag `θ` and friction `f`. A gradient adds to `f`, and changes the stopping distance by
/// `θ² g (ln(1 + v/u) − v/(v + u))` with `u = f θ`. The part of that which comes from the end of the stop, once the speed is `w`,
/// is the same with `w` for `v`; `θ (w − u ln(1 + w/u))` is left to run then. The same shape serves for other laws, on which
/// gradients have less effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StopEffect {
    /// The speed from which it stops (m/s), and the distance (m).
    pub(crate) speed: f64,
    pub(crate) distance: f64,
}

impl StopEffect {
    /// The part of the effect that comes from the track between two distances (m) before the place of rest, the farther first.
    pub(crate) fn between(self, far: f64, near: f64) -> f64 {
        (self.within(far) - self.within(near)).max(0.0)
    }

    /// The part of the effect that comes from the last so many metres.
    fn within(self, left: f64) -> f64 {
        if left <= 0.0 || left >= self.distance || self.speed <= 0.0 {
            return if left <= 0.0 { 0.0 } else { 1.0 };
        }
        let run = |speed: f64| speed - FRICTION_SPEED * libm::log1p(speed / FRICTION_SPEED);
        let goal = run(self.speed) * left / self.distance;
        let (mut low, mut high) = (0.0, self.speed);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if run(middle) < goal { low = middle } else { high = middle }
        }
        effect(0.5 * (low + high)) / effect(self.speed)
    }
}

fn effect(speed: f64) -> f64 {
    libm::log1p(speed / FRICTION_SPEED) - speed / (speed + FRICTION_SPEED)
}

/// The part of the offset of a stop from the reference speed that a stop from a speed (m/s) has.
pub(super) fn stop_offset_share(speed: f64) -> f64 {
    effect(speed.max(0.0)) / effect(REFERENCE_SPEED)
}

/// Stop offsets of all edges.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct StopOffsets {
    /// By edge: the offset of a stop from the reference speed that runs over this edge alone (m), and its variance.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(super) of_edge: BTreeMap<usize, (f64, f64)>,
    /// The prior standard deviation of offsets (m).
    pub(super) deviation: f64,
}

impl Default for StopOffsets {
    fn default() -> Self {
        Self { of_edge: BTreeMap::new(), deviation: USUAL_DEVIATION }
    }
}

impl StopOffsets {
    /// The offset of a stop on an edge, at the reference speed; the prior for an unknown edge.
    pub(super) fn of(&self, edge: usize) -> Gaussian {
        let (mean, variance) = self.of_edge.get(&edge).copied().unwrap_or((0.0, self.variance()));
        Gaussian { mean, variance }
    }

    /// The prior variance of offsets (m²).
    pub(super) fn variance(&self) -> f64 {
        self.deviation.max(LEAST_DEVIATION) * self.deviation.max(LEAST_DEVIATION)
    }

    /// Takes the offsets of a fit and updates their prior deviation: the squares of the offsets over the number of offsets that
    /// the data determine (MacKay, 1992).
    pub(super) fn learn(&mut self, found: BTreeMap<usize, (f64, f64)>) {
        let prior = self.variance();
        let squares: f64 = found.values().map(|(offset, _)| offset * offset).sum();
        let determined: f64 = found.values().map(|(_, variance)| (1.0 - variance / prior).max(0.0)).sum();
        self.deviation =
            libm::sqrt((squares + WORTH * USUAL_DEVIATION * USUAL_DEVIATION) / (determined + WORTH));
        self.of_edge = found;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_count_in_full_at_a_middle_speed_and_little_at_a_creep() {
        assert!((stop_offset_share(REFERENCE_SPEED) - 1.0).abs() < 1e-12);
        assert!((0.1..0.2).contains(&stop_offset_share(0.03)));
        assert_eq!(stop_offset_share(-1.0), 0.0);
    }

    #[test]
    fn the_parts_of_a_stop_are_those_of_a_train_that_rolls_to_rest_over_two_gradients() {
        // Given a train of 1.5 s lag and 20 mm/s² of friction that runs the end of its stop over a gradient,
        let (lag, friction, step) = (1.5, 0.02, 1e-4);
        let stop = |gradient_from: f64| {
            let (mut speed, mut distance) = (0.3_f64, 0.0);
            while speed > 0.0 {
                let gradient = if distance >= gradient_from { 1e-4 } else { 0.0 };
                speed -= step * (speed / lag + friction + gradient);
                distance += step * speed.max(0.0);
            }
            distance
        };
        let level = stop(10.0);
        let whole = level - stop(0.0);
        let effect = StopEffect { speed: 0.3, distance: level };
        for left in [0.05, 0.1, 0.2] {
            // then the part of the gradient's effect is the one expected.
            let part = (level - stop(level - left)) / whole;
            assert!((effect.between(left, 0.0) - part).abs() < 0.03, "{left} m: {part}");
        }
        assert_eq!(effect.between(1.0, 0.0), 1.0);
        assert_eq!(effect.between(0.0, -1.0), 0.0);
    }

    #[test]
    fn the_deviation_becomes_that_of_the_offsets() {
        let mut offsets = StopOffsets::default();
        let found = |size: f64| {
            (0..40).map(|edge| (edge, (if edge % 2 == 0 { size } else { -size }, 1e-6))).collect()
        };
        offsets.learn(found(0.03));
        assert!((0.027..0.031).contains(&offsets.deviation), "{}", offsets.deviation);
        offsets.learn(found(0.0));
        assert!(offsets.deviation < 0.002);
        assert_eq!(offsets.of(99).mean, 0.0);
    }
}
