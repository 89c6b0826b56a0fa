//! A second train model: a direct-current motor under a decoder with load control.
//!
//! It shares no equation with [`motor`](crate::motor) or the estimator. The pull is proportional to the voltage minus
//! the back EMF; dry friction with a Stribeck peak, viscous friction, gradients and curves oppose it. The decoder
//! measures the back EMF every few milliseconds and sets the voltage by a PI controller. Forces are expressed as
//! accelerations in mm/s², that is, divided by the train's mass.

use footplate_core::{DecoderSteps, Speed, SpeedStep};

use crate::draws::Draws;
use crate::speed_table::SpeedTable;
use crate::traits::Session;

/// The step of the integration.
const STEP_S: f64 = 1e-3;
/// Positions of the decoder's counter.
const COUNTS: f64 = 126.0;
/// Acceleration of free fall.
const GRAVITY_MM_PER_S2: f64 = 9810.0;
/// A curve that reduces the usual model's speed by a part acts on this one as a force of this times the part, in
/// mm/s² (chosen: a tight curve as strong as the dry friction).
const CURVE_MM_PER_S2: f64 = 2500.0;
/// Below this speed without a voltage, friction stops it within one step.
const REST_MM_PER_S: f64 = 0.02;
/// Dry friction of a cold train over that of a warm one (chosen: oil).
const COLD_FRICTION: f64 = 1.35;
/// Commands reach steady speed within this, in s.
const SETTLED_S: f64 = 25.0;

/// Motor, gears and decoder of one train.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElectricEngine {
    /// No-load speed at full voltage, in mm/s.
    no_load: f64,
    /// Stall pull at full voltage, in mm/s².
    stall: f64,
    /// Dry friction in motion; its peak at rest relative to that; the speed over which the peak falls off; viscous
    /// friction per s.
    dry: f64,
    peak: f64,
    stribeck: f64,
    viscous: f64,
    /// Proportional and integral gain of the load control (the latter per s), and its measuring interval, in s.
    proportional: f64,
    integral: f64,
    period_s: f64,
    /// Relative noise of a back-EMF measurement.
    noise: f64,
    /// The steps of the decoder.
    pub(crate) decoder: DecoderSteps,
    /// Set speeds at the lowest, the middle and the highest step, in mm/s (CV 2, 6 and 5).
    curve: [f64; 3],
    /// Seconds for a count up and down (CV 3 and 4).
    count_s: [f64; 2],
    /// Whether the decoder shorts the motor at step 0, which brakes, or leaves it open.
    shorts: bool,
    /// Relative decrease of the back EMF from cold to warm: the load control lets a warm motor run faster by as much.
    fade: f64,
}

impl ElectricEngine {
    pub(crate) fn draw(draws: &mut Draws) -> Self {
        let top = draws.uniform(420.0..680.0);
        let count_s = [draws.uniform(0.006..0.03), draws.uniform(0.008..0.03)];
        Self {
            no_load: top * draws.uniform(1.25..1.7),
            stall: draws.uniform(1200.0..3500.0),
            dry: draws.uniform(60.0..170.0),
            peak: draws.uniform(1.2..2.2),
            stribeck: draws.uniform(4.0..20.0),
            viscous: draws.uniform(0.02..0.2),
            proportional: draws.uniform(0.6..3.0),
            integral: draws.uniform(0.8..6.0),
            period_s: draws.uniform(0.008..0.03),
            noise: draws.uniform(0.003..0.02),
            decoder: DecoderSteps::Fourteen,
            curve: [draws.uniform(8.0..30.0), top * draws.uniform(0.28..0.5), top],
            count_s,
            shorts: draws.chance(0.5),
            fade: draws.uniform(0.0..0.04),
        }
    }

    /// Steady speeds at every step, warm, on the level, on an average day, from a simulated run.
    pub(crate) fn speed_table(&self) -> SpeedTable {
        let mut draws = Draws::new(0, crate::draws::Purpose::Physics);
        let quiet = Self { noise: 0.0, ..*self };
        let speeds: Vec<Speed> = (0..=self.decoder.highest().get())
            .map(|step| {
                let mut running = ElectricMotor::at_rest(quiet);
                running.command(SpeedStep::new(step).unwrap_or(SpeedStep::STAND), &mut draws);
                let calm = Surroundings { rail: 1.0, grade: 0.0, warmth: 1.0 };
                for _ in 0..(SETTLED_S / STEP_S) as usize {
                    running.advance(calm, &mut draws);
                }
                Speed::from_mm_per_s(running.speed)
            })
            .collect();
        SpeedTable::new(&speeds, &speeds)
    }

    fn set_speed(&self, count: f64) -> f64 {
        let [low, middle, high] = self.curve;
        let along = (count / COUNTS).clamp(0.0, 1.0);
        if count <= 0.0 {
            0.0
        } else if along < 0.5 {
            low + (middle - low) * 2.0 * along
        } else {
            middle + (high - middle) * (2.0 * along - 1.0)
        }
    }
}

/// The conditions of a train at a moment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Surroundings {
    /// The rail's speed factor in the usual model.
    pub(crate) rail: f64,
    /// The gradient, uphill positive.
    pub(crate) grade: f64,
    /// 0 cold, 1 warm.
    pub(crate) warmth: f64,
}

/// Such a motor in operation.
#[derive(Debug, Clone)]
pub(crate) struct ElectricMotor {
    engine: ElectricEngine,
    session: Session,
    target: f64,
    count: f64,
    until_count: f64,
    until_measured: f64,
    summed: f64,
    /// Motor voltage as a part of the full one.
    voltage: f64,
    pub(crate) speed: f64,
    /// Static friction of this start, relative to the dry friction.
    sticks_at: f64,
    /// At rest on dirt without current.
    is_cut_off: bool,
}

impl ElectricMotor {
    pub(crate) fn at_rest(engine: ElectricEngine) -> Self {
        Self {
            engine,
            session: Session::AVERAGE,
            target: 0.0,
            count: 0.0,
            until_count: 0.0,
            until_measured: 0.0,
            summed: 0.0,
            voltage: 0.0,
            speed: 0.0,
            sticks_at: engine.peak,
            is_cut_off: false,
        }
    }

    /// The same motor at rest in the same session.
    pub(crate) fn reset(&self) -> Self {
        Self { session: self.session, ..Self::at_rest(self.engine) }
    }

    pub(crate) fn begin_session(&mut self, session: Session) {
        self.session = session;
    }

    pub(crate) fn command(&mut self, step: SpeedStep, draws: &mut Draws) {
        let target =
            (f64::from(step.get()) / f64::from(self.engine.decoder.highest().get()) * COUNTS).round();
        if target > self.target {
            self.is_cut_off = false;
        }
        if self.speed == 0.0 {
            self.sticks_at = (self.engine.peak * draws.normal_within(1.0, 0.25, 2.5)).max(1.0);
        }
        self.target = target;
    }

    pub(crate) fn cut_off(&mut self) {
        self.is_cut_off = true;
    }

    pub(crate) fn stays_at_rest(&self) -> bool {
        self.speed == 0.0 && (self.target == 0.0 && self.count == 0.0 || self.is_cut_off)
    }

    /// The speed after one more step of a millisecond.
    pub(crate) fn advance(&mut self, around: Surroundings, draws: &mut Draws) -> f64 {
        self.turn_counter();
        self.control(around, draws);
        let ElectricEngine { stall, no_load, dry, peak, stribeck, viscous, .. } = self.engine;
        let no_load = no_load * (1.0 + self.engine.fade * (around.warmth - 1.0));
        let generated = self.speed / no_load;
        let supply = self.session.speed * (1.0 + self.session.top * generated);
        let is_open = self.is_cut_off || self.voltage == 0.0 && !(self.engine.shorts && self.count == 0.0);
        let pull = if is_open { 0.0 } else { stall * (self.voltage * supply - generated) };
        let oil = 1.0 + (COLD_FRICTION - 1.0) * (1.0 - around.warmth);
        let dry = dry * oil * self.session.stop;
        let slope = GRAVITY_MM_PER_S2 * around.grade;
        let curve = CURVE_MM_PER_S2 * (1.0 - around.rail).max(0.0);
        // Motor and gear friction do not grow with the pulled load.
        let driving = pull / self.session.mass - slope;
        if self.speed == 0.0 {
            let sticks = dry * self.sticks_at;
            if driving > sticks {
                self.speed = (driving - dry) * STEP_S;
            }
            return self.speed;
        }
        let falls_off = self.speed / stribeck;
        let friction =
            dry * (1.0 + (peak - 1.0) * libm::exp(-falls_off * falls_off)) + viscous * self.speed + curve;
        let next = self.speed + (driving - friction / self.session.mass) * STEP_S;
        // Worm gears: no slope moves it without a voltage.
        self.speed = if next < REST_MM_PER_S { 0.0 } else { next };
        self.speed
    }

    fn turn_counter(&mut self) {
        self.until_count -= STEP_S;
        if self.until_count > 0.0 || self.count == self.target {
            self.until_count = self.until_count.max(0.0);
            return;
        }
        let [up, down] = self.engine.count_s;
        let rises = self.target > self.count;
        self.count += if rises { 1.0 } else { -1.0 };
        self.until_count += if rises { up } else { down };
    }

    fn control(&mut self, around: Surroundings, draws: &mut Draws) {
        self.until_measured -= STEP_S;
        if self.until_measured > 0.0 {
            return;
        }
        let ElectricEngine { no_load, proportional, integral, period_s, noise, fade, .. } = self.engine;
        self.until_measured += period_s;
        if self.count == 0.0 {
            (self.voltage, self.summed) = (0.0, 0.0);
            return;
        }
        let wanted = self.engine.set_speed(self.count) / no_load;
        let generated = self.speed / (no_load * (1.0 + fade * (around.warmth - 1.0)));
        let measured = if noise > 0.0 { generated * draws.normal(1.0, noise) } else { generated };
        let short = wanted - measured;
        self.summed = (self.summed + integral * short * period_s).clamp(-0.3, 0.8);
        self.voltage = (wanted + proportional * short + self.summed).clamp(0.0, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Purpose;

    const LEVEL: Surroundings = Surroundings { rail: 1.0, grade: 0.0, warmth: 1.0 };

    fn drawn(seed: u64) -> (ElectricEngine, Draws) {
        let mut draws = Draws::new(seed, Purpose::Physics);
        (ElectricEngine::draw(&mut draws), draws)
    }

    /// The stopping distance from a step, in mm.
    fn stop(engine: ElectricEngine, step: u8, around: Surroundings, draws: &mut Draws) -> f64 {
        let mut motor = ElectricMotor::at_rest(engine);
        motor.command(SpeedStep::new(step).unwrap(), draws);
        for _ in 0..15_000 {
            motor.advance(around, draws);
        }
        motor.command(SpeedStep::STAND, draws);
        let distance = (0..20_000).map(|_| motor.advance(around, draws) * STEP_S).sum();
        assert!(motor.stays_at_rest(), "it rests after 20 s");
        distance
    }

    #[test]
    fn speeds_rise_with_the_step_to_those_of_model_trains() {
        for seed in 0..20 {
            let table = drawn(seed).0.speed_table();
            let speeds: Vec<f64> = (4..=14)
                .filter_map(SpeedStep::new)
                .map(|step| table.speed(step, footplate_core::Approach::Below).as_mm_per_s())
                .collect();
            assert!(speeds.windows(2).all(|pair| pair[0] < pair[1]), "seed {seed}: {speeds:?}");
            assert!((400.0..700.0).contains(speeds.last().unwrap()), "seed {seed}: {speeds:?}");
        }
    }

    #[test]
    fn it_stops_within_what_real_trains_take_and_later_downhill() {
        let mut longer = 0;
        for seed in 0..20 {
            let (engine, mut draws) = drawn(seed);
            let level = stop(engine, 14, LEVEL, &mut draws);
            // Real stopping distances at top step: 580 to 1588 mm; the ranges are deliberately wider.
            assert!((150.0..2500.0).contains(&level), "seed {seed}: {level} mm");
            let falling = Surroundings { grade: -0.005, ..LEVEL };
            longer += usize::from(stop(engine, 14, falling, &mut draws) > level);
        }
        assert!(longer >= 15, "{longer} of 20");
    }

    #[test]
    fn one_that_is_cut_off_waits_for_a_higher_step() {
        let (engine, mut draws) = drawn(3);
        let mut motor = ElectricMotor::at_rest(engine);
        let step = |step| SpeedStep::new(step).unwrap();
        motor.command(step(6), &mut draws);
        motor.cut_off();
        for _ in 0..5000 {
            motor.advance(LEVEL, &mut draws);
        }
        assert_eq!(motor.speed, 0.0);
        motor.command(step(7), &mut draws);
        for _ in 0..5000 {
            motor.advance(LEVEL, &mut draws);
        }
        assert!(motor.speed > 0.0);
    }
}
