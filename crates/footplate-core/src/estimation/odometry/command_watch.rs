//! What the command allows the train and its wheels to do right now.
//!
//! A brake takes time to build up and to let go, and a wheel that was held back takes time to turn with the train
//! again. What may still hold is assumed to hold; what may not yet is not.

use super::sound::sound;
use crate::wheels::{Range, Vehicle, larger, smaller};

/// Efforts nearer to zero are coasting: what analogue controllers show at rest.
const COASTING: f64 = 0.02;
/// How long after the brake is let go a wheel may still slide (s): 1 s for the cylinder to empty, 1 s for the wheel to
/// be turned up, by 10 m/s² and more on the poorest rail seen.
const LET_GO_BRAKE_S: f64 = 2.0;
/// The same for a wheel that does slide as the brake is let go (s): it has to be turned up from far below.
const LET_GO_SLIDING_S: f64 = 5.0;
/// How long after traction ends a wheel may still slip (s): as for the brake, motors let go faster.
const LET_GO_TRACTION_S: f64 = 1.5;
/// How long full traction or full brake takes to fade (s): by 0.5 m/s³, the comfort limit of passenger trains.
const FADE_S: f64 = 2.5;
/// Without a recorded command, a deceleration of all wheels beyond what resistance and gradients of main lines do
/// (m/s²: 15 mm/m and 1 % of weight) is taken for braking, and an acceleration beyond it for traction.
const BY_ITSELF: f64 = 0.25;
/// How long an acceleration is remembered because a window of counts may reach back over it (s).
const REMEMBERED_S: f64 = 0.9;

/// Follows the command.
#[derive(Debug, Clone)]
pub(super) struct CommandWatch {
    since_brake: f64,
    since_traction: f64,
    /// Effort to which the brake has built up at least, and from which it has faded at most.
    built_up: f64,
    brake: f64,
    /// Effort from which traction has faded at most.
    traction: f64,
    widest: Range,
    narrower_for: f64,
    /// A slide was seen in this application of the brake: adhesion does not carry the command.
    disproved: bool,
}

/// What the command allows in one period.
#[derive(Debug, Clone, Copy)]
pub(super) struct Allowed {
    /// A braked wheel may turn slower than the train moves.
    pub(super) slide: bool,
    /// A powered wheel may turn faster than the train moves.
    pub(super) slip: bool,
    /// Acceleration of the train (m/s², in the direction of travel) within the last windows of counts.
    pub(super) acceleration: Range,
    /// The highest acceleration if the command is believed: below `acceleration.high` while the brake is on.
    pub(super) at_most_by_command: f64,
    /// How much of full traction may act, 0 to 1.
    pub(super) traction_effort: f64,
    /// By how much the train decelerates by its command where the rail carries it (m/s²); infinite if there is none.
    pub(super) commanded: f64,
    /// How much of the full brake may act, 0 to 1.
    pub(super) brake_effort: f64,
}

impl CommandWatch {
    pub(super) const fn new() -> Self {
        Self {
            since_brake: f64::INFINITY,
            since_traction: f64::INFINITY,
            built_up: 0.0,
            brake: 0.0,
            traction: 0.0,
            widest: Range { low: 0.0, high: 0.0 },
            narrower_for: 0.0,
            disproved: false,
        }
    }

    /// A slide was seen: until the brake is let go, its command says nothing about the train.
    pub(super) fn disprove(&mut self) {
        self.disproved = true;
    }

    /// The command of the next `t` seconds; where it is not recorded, `seen` tells it: how all wheels accelerate.
    /// `held` if a wheel slides now.
    pub(super) fn next(
        &mut self,
        effort: Option<f64>,
        seen: f64,
        held: bool,
        t: f64,
        vehicle: &Vehicle,
    ) -> Allowed {
        let (braking, traction) = match effort {
            Some(effort) => (effort < -COASTING, effort > COASTING),
            None => (seen < -BY_ITSELF, seen > BY_ITSELF),
        };
        self.since_brake = if braking { 0.0 } else { self.since_brake + t };
        self.since_traction = if traction { 0.0 } else { self.since_traction + t };
        let let_go = if held { LET_GO_SLIDING_S } else { LET_GO_BRAKE_S };
        let slide = self.since_brake < let_go;
        let slip = self.since_traction < LET_GO_TRACTION_S;
        self.disproved &= slide;

        let command = &vehicle.brake_command;
        let full = command.full.as_m_per_s2();
        let wanted = effort.map_or(0.0, |effort| sound(-effort, 0.0, 1.0));
        let driven = effort.map_or(f64::from(u8::from(traction)), |effort| sound(effort, 0.0, 1.0));
        self.built_up = smaller(wanted, self.built_up + t / larger(command.build_up.as_s(), t));
        self.brake = larger(wanted, self.brake - t / FADE_S);
        self.traction = larger(driven, self.traction - t / FADE_S);

        let gradient = command.gradient.as_m_per_s2();
        let resistance = command.resistance.as_m_per_s2();
        let max_traction = vehicle.max_traction.as_m_per_s2();
        let max_brake = vehicle.max_brake.as_m_per_s2();
        let now = if effort.is_some() {
            Range {
                low: -smaller(
                    self.brake * full * (1.0 + command.tolerance) + gradient + resistance,
                    max_brake,
                ),
                high: smaller(self.traction * max_traction + gradient, max_traction),
            }
        } else {
            Range { low: -max_brake, high: max_traction }
        };
        let acceleration = self.lately(now, t);
        let by_command = if traction {
            acceleration.high
        } else if self.disproved {
            -vehicle.thresholds.least_sliding_deceleration.as_m_per_s2()
        } else {
            gradient - self.built_up * full * (1.0 - command.tolerance)
        };
        let at_most_by_command = smaller(by_command, acceleration.high);
        Allowed {
            slide,
            slip,
            acceleration,
            at_most_by_command,
            traction_effort: self.traction,
            commanded: if effort.is_some() { self.brake * full } else { f64::INFINITY },
            brake_effort: if effort.is_some() { self.brake } else { 1.0 },
        }
    }

    /// The widest range of the last windows.
    fn lately(&mut self, now: Range, t: f64) -> Range {
        let as_wide = now.low <= self.widest.low || now.high >= self.widest.high;
        self.narrower_for = if as_wide { 0.0 } else { self.narrower_for + t };
        self.widest = if self.narrower_for > REMEMBERED_S { now } else { self.widest.or(now) };
        self.widest
    }
}
