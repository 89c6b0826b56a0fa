//! What the train and its wheels can do under the command.
//!
//! A brake takes time to build up and to release, and a braked wheel takes time to turn with the train again. What may still act
//! is assumed to act; what may not act yet is not.

use super::recent::Recent;
use super::sound::sound;
use super::wheels::{Range, Vehicle, larger, smaller};

/// Efforts nearer to zero are coasting: what analogue controllers show at rest.
const COASTING: f64 = 0.02;
/// How long full traction or full brake takes to fade (s): by 0.5 m/s³, the comfort limit of passenger trains.
const FADE_S: f64 = 2.5;
/// How long an acceleration counts (s): windows of counts reach back so far.
const REMEMBERED_S: f64 = 0.9;

/// The command and its after-effects.
#[derive(Debug, Clone)]
pub(super) struct CommandWatch {
    since_brake: f64,
    since_traction: f64,
    /// Least effort that the brake has built up, and largest from which it has not faded.
    built_up: f64,
    brake: f64,
    /// Largest effort from which traction has not faded.
    traction: f64,
    /// The strongest deceleration and acceleration lately (m/s²).
    lately: [Recent; 2],
}

/// What the command allows in one period, in the direction of travel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Allowed {
    /// A braked wheel may turn slower than the train moves.
    pub(super) slide: bool,
    /// A powered wheel may turn faster than the train moves.
    pub(super) slip: bool,
    /// Acceleration of the train (m/s²) within the last windows of counts, whatever the rail carries.
    pub(super) acceleration: Range,
    /// The same for a train whose wheels roll: brakes and motors do what is claimed of them.
    pub(super) rolling: Range,
    /// The commanded acceleration (m/s²); none if the command is not recorded.
    pub(super) commanded: Option<f64>,
    /// How much of full traction and of the full brake may act, 0 to 1.
    pub(super) traction: f64,
    pub(super) brake: f64,
}

impl CommandWatch {
    pub(super) const fn new() -> Self {
        Self {
            since_brake: f64::INFINITY,
            since_traction: f64::INFINITY,
            built_up: 0.0,
            brake: 0.0,
            traction: 0.0,
            lately: [Recent::new(0.0, REMEMBERED_S); 2],
        }
    }

    /// The command of the next `t` seconds, for a train that runs backward or not.
    pub(super) fn next(&mut self, effort: Option<f64>, backward: bool, t: f64, vehicle: &Vehicle) -> Allowed {
        let max_traction = vehicle.max_traction.as_m_per_s2();
        let max_brake = vehicle.max_brake.as_m_per_s2();
        let Some(effort) = effort else {
            let any = Range { low: -max_brake, high: max_traction };
            *self = Self {
                since_brake: 0.0,
                since_traction: 0.0,
                built_up: 0.0,
                brake: 1.0,
                traction: 1.0,
                ..self.clone()
            };
            let acceleration = self.lately(any, t);
            return Allowed {
                slide: true,
                slip: true,
                acceleration,
                rolling: acceleration,
                commanded: None,
                traction: 1.0,
                brake: 1.0,
            };
        };
        let command = &vehicle.brake_command;
        let release = command.release.as_s();
        self.since_brake = if effort < -COASTING { 0.0 } else { self.since_brake + t };
        self.since_traction = if effort > COASTING { 0.0 } else { self.since_traction + t };
        let slide = self.since_brake < release;
        let slip = self.since_traction < release;
        let full = command.full.as_m_per_s2();
        let wanted = sound(-effort, 0.0, 1.0);
        let driven = sound(effort, 0.0, 1.0);
        self.built_up = smaller(wanted, self.built_up + t / larger(command.build_up.as_s(), t));
        // All of the brake may act until it must have released.
        self.brake = larger(wanted, if slide { self.brake } else { self.brake - t / FADE_S });
        self.traction = larger(driven, if slip { self.traction } else { self.traction - t / FADE_S });

        let gradient = command.gradient.as_m_per_s2();
        let strongest =
            self.brake * full * (1.0 + command.tolerance) + gradient + command.resistance.as_m_per_s2();
        // A train that rolls back is braked by its traction.
        let against = if backward { self.traction * max_traction + gradient } else { 0.0 };
        let low = -larger(smaller(strongest, max_brake), smaller(against, max_traction));
        let high = smaller(self.traction * max_traction + gradient, max_traction);
        let least = vehicle.thresholds.least_sliding_deceleration.as_m_per_s2();
        let by_brake = gradient - self.built_up * full * (1.0 - command.tolerance);
        let held = effort < -COASTING && self.traction <= 0.0;
        let now = Range { low, high: if held && least > 0.0 { larger(by_brake, -least) } else { high } };
        let acceleration = self.lately(now, t);
        let rolling = Range {
            low: acceleration.low,
            high: if held { larger(by_brake, low) } else { acceleration.high },
        };
        let commanded = if effort < 0.0 { -wanted * full } else { driven * max_traction };
        Allowed {
            slide,
            slip,
            acceleration,
            rolling,
            commanded: Some(commanded),
            traction: self.traction,
            brake: self.brake,
        }
    }

    /// The widest range of the last windows, on each side.
    fn lately(&mut self, now: Range, t: f64) -> Range {
        let [low, high] = &mut self.lately;
        Range { low: -low.push(-now.low, t), high: high.push(now.high, t) }
    }
}
