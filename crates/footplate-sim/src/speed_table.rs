//! The true steady speed of a train at every throttle step, reached from below and from above.
//!
//! Two shapes represent the locomotives whose tables student teams have published since 2011: *even* ones, nearly
//! linear in the step, and *steep* ones, slow at low steps and steep above. A train's own table is one of them,
//! scaled, tilted and roughened as much as the same locomotive differs between teams.

use footplate_core::{Approach, DecoderSteps, Speed, SpeedStep};

use crate::draws::Draws;

/// The highest step of the Märklin decoders on which all measurements were made.
const HIGHEST_STEP: u8 = 14;

/// The shape of speed over step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Shape {
    /// Speed nearly linear in the step, slow to start.
    Even,
    /// Slow at low steps, steep above, quick to start.
    Steep,
}

/// Mean of trains 2, 49, 62 and 74 in mm/s at steps 0 to 14 (measured 2013 to 2024 by five teams).
const EVEN: [f64; 15] =
    [0.0, 10.0, 76.0, 130.0, 178.0, 229.0, 283.0, 338.0, 390.0, 444.0, 493.0, 543.0, 594.0, 628.0, 654.0];
/// Mean of trains 1, 14, 24 and 77 in mm/s at steps 0 to 14 (measured 2018 to 2025 by five teams).
const STEEP: [f64; 15] =
    [0.0, 9.0, 17.0, 26.0, 44.0, 75.0, 113.0, 166.0, 217.0, 282.0, 346.0, 405.0, 468.0, 539.0, 602.0];

/// Standard deviation of the scale of a table: the same locomotive differs by 4 to 20 % between teams and years.
const SCALE_SD: f64 = 0.06;
/// Standard deviation of the change of that scale from the lowest to the highest step (chosen: half the above).
const TILT_SD: f64 = 0.03;
/// Standard deviation of one step about its smooth curve (measured: second differences of the real tables).
const ROUGHNESS_SD: f64 = 0.012;
/// Seven of eight teams measured a train that runs faster at a step reached from above, by 13 to 31 mm/s.
const WITH_HYSTERESIS: f64 = 7.0 / 8.0;
const HYSTERESIS_MM_PER_S: core::ops::Range<f64> = 13.0..31.0;
/// Below this speed the difference shrinks in proportion (measured on trains 1 and 78: 7 mm/s at 16 mm/s, 15 at 70).
const FULL_HYSTERESIS_FROM_MM_PER_S: f64 = 120.0;
/// A step is at least this much slower than the next one (chosen: what an observer could still distinguish).
const MIN_RISE_MM_PER_S: f64 = 2.0;
/// The largest part of the difference to the next step that hysteresis may take (chosen below 1: steps keep their
/// order).
const MAX_PART_OF_A_STEP: f64 = 0.9;

/// Highest speed of a model train (chosen: five times the fastest measured).
const MAX_MM_PER_S: f64 = 5000.0;

/// True steady speeds on level straight track, the train warm and its run an average one.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeedTable {
    below_mm_per_s: Vec<f64>,
    above_mm_per_s: Vec<f64>,
}

impl SpeedTable {
    /// A table from speeds at steps 0, 1, 2 … reached from below and from above.
    ///
    /// The shorter of the two determines the number of steps; step 0 is at rest whatever its speed. Speeds are
    /// limited to the range from 0 to 5 m/s.
    pub fn new(below: &[Speed], above: &[Speed]) -> Self {
        let steps = below.len().min(above.len());
        let column = |speeds: &[Speed]| {
            let mut column: Vec<f64> = speeds
                .iter()
                .take(steps)
                .map(|speed| Speed::ZERO.max(*speed).as_mm_per_s().min(MAX_MM_PER_S))
                .collect();
            if let Some(stand) = column.first_mut() {
                *stand = 0.0;
            }
            column
        };
        Self { below_mm_per_s: column(below), above_mm_per_s: column(above) }
    }

    /// A random but plausible table of a shape.
    pub(crate) fn draw(shape: Shape, draws: &mut Draws) -> Self {
        let anchors = match shape {
            Shape::Even => EVEN,
            Shape::Steep => STEEP,
        };
        let scale = draws.normal_within(1.0, SCALE_SD, 2.5);
        let tilt = draws.normal_within(0.0, TILT_SD, 2.5);
        let mut below = Vec::with_capacity(anchors.len());
        let mut slowest = 0.0_f64;
        for (step, anchor) in anchors.into_iter().enumerate() {
            let along = step as f64 / f64::from(HIGHEST_STEP) - 0.5;
            let roughness = draws.normal_within(1.0, ROUGHNESS_SD, 2.5);
            let speed = if step == 0 { 0.0 } else { anchor * scale * (1.0 + tilt * along) * roughness };
            let speed = if step == 0 { 0.0 } else { speed.max(slowest + MIN_RISE_MM_PER_S) };
            below.push(speed);
            slowest = speed;
        }
        let has_hysteresis = draws.chance(WITH_HYSTERESIS);
        let full = draws.uniform(HYSTERESIS_MM_PER_S);
        let mut above = below.clone();
        if has_hysteresis {
            for (fast, pair) in above.iter_mut().zip(below.windows(2)) {
                let (&[own, next], room) = (pair, MAX_PART_OF_A_STEP) else { continue };
                let taper = (own / FULL_HYSTERESIS_FROM_MM_PER_S).min(1.0);
                *fast = own + (full * taper).min(room * (next - own));
            }
        }
        Self { below_mm_per_s: below, above_mm_per_s: above }
    }

    /// The same engine behind a decoder of other steps: a smooth curve without overshoot through the steps of this one (the
    /// monotone cubic of Fritsch and Carlson, 1980), as motors have it.
    #[must_use]
    pub(crate) fn refined(&self, decoder: DecoderSteps) -> Self {
        let highest = usize::from(decoder.highest().get());
        let own = self.below_mm_per_s.len().saturating_sub(1) as f64;
        let along = |step: usize| step as f64 * own / highest as f64;
        let column = |speeds: &[f64]| (0..=highest).map(|step| monotone_cubic(speeds, along(step))).collect();
        Self { below_mm_per_s: column(&self.below_mm_per_s), above_mm_per_s: column(&self.above_mm_per_s) }
    }

    /// The highest step.
    pub fn highest(&self) -> SpeedStep {
        let highest = self.below_mm_per_s.len().saturating_sub(1).min(usize::from(SpeedStep::HIGHEST));
        SpeedStep::new(highest as u8).unwrap_or(SpeedStep::STAND)
    }

    /// The true steady speed at a step; beyond the highest step, that of the highest.
    ///
    /// An unknown approach counts as from below, as after a start from rest.
    pub fn speed(&self, step: SpeedStep, approach: Approach) -> Speed {
        Speed::from_mm_per_s(
            self.mm_per_s(f64::from(step.get()), if approach == Approach::Above { 1.0 } else { 0.0 }),
        )
    }

    /// The speed between steps, for decoders that count finer than the throttle; `above` blends from 0, the
    /// speeds reached from below, to 1.
    pub(crate) fn mm_per_s(&self, step: f64, above: f64) -> f64 {
        let last = self.below_mm_per_s.len().saturating_sub(1);
        let lower = (step.max(0.0) as usize).min(last);
        let upper = (lower + 1).min(last);
        let part = (step - lower as f64).clamp(0.0, 1.0);
        let at = |column: &[f64], index: usize| column.get(index).copied().unwrap_or(0.0);
        let between = |column: &[f64]| at(column, lower) + (at(column, upper) - at(column, lower)) * part;
        let (slow, fast) = (between(&self.below_mm_per_s), between(&self.above_mm_per_s));
        slow + (fast - slow) * above
    }
}

/// A monotone cubic through points at 0, 1, 2 …, with the harmonic mean of the neighbouring rises as slope.
fn monotone_cubic(points: &[f64], at: f64) -> f64 {
    let last = points.len().saturating_sub(1);
    let low = (at as usize).min(last.saturating_sub(1));
    let point = |index: usize| points.get(index.min(last)).copied().unwrap_or(0.0);
    let rise = |index: usize| point(index + 1) - point(index);
    let slope = |index: usize| match (index.checked_sub(1).map(rise), index < last) {
        (None, _) => rise(0),
        (Some(before), false) => before,
        (Some(before), true) if before * rise(index) > 0.0 => {
            2.0 * before * rise(index) / (before + rise(index))
        }
        _ => 0.0,
    };
    let t = at - low as f64;
    let (start, end) = (slope(low), slope(low + 1));
    let bend = 3.0 * rise(low) - 2.0 * start - end;
    let twist = start + end - 2.0 * rise(low);
    point(low) + t * (start + t * (bend + t * twist))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Purpose;

    #[test]
    fn finer_steps_run_through_the_speeds_of_the_coarse_ones_and_never_fall() {
        for seed in 0..100 {
            let coarse = drawn(seed, if seed % 2 == 0 { Shape::Even } else { Shape::Steep });
            for decoder in [DecoderSteps::TwentyEight, DecoderSteps::All] {
                let fine = coarse.refined(decoder);
                assert_eq!(fine.highest(), decoder.highest());
                let each = decoder.highest().get() / HIGHEST_STEP;
                for approach in [Approach::Below, Approach::Above] {
                    for step in 0..=HIGHEST_STEP {
                        let (one, other) = (at(&coarse, step, approach), at(&fine, each * step, approach));
                        assert!((one - other).abs() < 1e-9, "seed {seed} step {step}: {one} and {other}");
                    }
                    let speeds: Vec<f64> =
                        (0..=decoder.highest().get()).map(|step| at(&fine, step, approach)).collect();
                    assert!(speeds.windows(2).all(|pair| pair[0] <= pair[1]), "seed {seed}: {speeds:?}");
                }
            }
        }
    }

    fn drawn(seed: u64, shape: Shape) -> SpeedTable {
        SpeedTable::draw(shape, &mut Draws::new(seed, Purpose::Train))
    }

    fn at(table: &SpeedTable, step: u8, approach: Approach) -> f64 {
        table.speed(SpeedStep::new(step).unwrap(), approach).as_mm_per_s()
    }

    #[test]
    fn hysteresis_is_13_to_31_mm_per_s_on_seven_trains_of_eight() {
        let mut with = 0;
        for seed in 0..400 {
            let table = drawn(seed, if seed % 2 == 0 { Shape::Even } else { Shape::Steep });
            let difference = at(&table, 10, Approach::Above) - at(&table, 10, Approach::Below);
            if difference > 0.0 {
                with += 1;
                assert!((13.0..=31.0).contains(&difference), "seed {seed}: {difference} mm/s");
            }
        }
        // 350 expected; four standard deviations of a count are 26.
        assert!((324..=376).contains(&with), "{with} of 400");
    }

    #[test]
    fn speeds_rise_with_the_step_and_hysteresis_never_reaches_the_next_step() {
        for seed in 0..400 {
            let table = drawn(seed, if seed % 2 == 0 { Shape::Even } else { Shape::Steep });
            assert_eq!(table.highest().get(), HIGHEST_STEP);
            assert_eq!(at(&table, 0, Approach::Below), 0.0);
            for step in 0..HIGHEST_STEP {
                assert!(
                    at(&table, step, Approach::Above) < at(&table, step + 1, Approach::Below),
                    "seed {seed}"
                );
            }
        }
    }

    #[test]
    fn the_two_shapes_differ_where_the_real_engines_do() {
        for seed in 0..100 {
            let share = |shape| {
                let table = drawn(seed, shape);
                at(&table, 5, Approach::Below) / at(&table, 14, Approach::Below)
            };
            // Real locomotives: 0.34 to 0.39 (trains 2, 47), 0.11 to 0.16 (trains 1, 24, 58, 77).
            assert!(share(Shape::Even) > 0.28 && share(Shape::Steep) < 0.18);
        }
    }
}
