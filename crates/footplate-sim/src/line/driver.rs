//! A driver who runs as fast as allowed, brakes to limits and stops where the line says.
//!
//! Called as often as the world is stepped, with what the train does now; the answer is a force. So the same
//! driver takes a single body through a line ([`Journey`](super::Journey)) and one on wheels that slip.
//!
//! Braking to a place is steered by the deceleration that is still needed, `(v² - v_target²) / 2d`: it is begun when
//! that reaches the planned one, and what was braked too little is made up later.

use core::fmt;

use footplate_core::{Acceleration, Jerk, Length, Ratio, Speed, TimeSpan};

use super::profile::LineProfile;
use super::stepped::Stepped;
use super::train::Train;

/// Slower than this a train counts as standing (m/s): a wheel of 0.9 m would take five minutes for a turn.
const STANDING_M_PER_S: f64 = 0.01;
/// Standing this far before the place still counts as having stopped there (m), on either side.
const STOP_WINDOW_M: f64 = 5.0;
/// Braking towards a place is given up when less than this share of the planned deceleration is needed (chosen, so
/// that it is not begun and given up in turns).
const GIVEN_UP: f64 = 0.8;
/// The driver may brake harder than planned by this factor to make up for what was missed (chosen).
const MAKING_UP: f64 = 1.5;
/// Within this share of the limit a train counts as running at it.
const AT_LIMIT: f64 = 0.995;
/// From the gentlest start to what would knock passengers over (m/s³); 0.3 to 0.8 is usual.
const JERKS_M_PER_S3: [f64; 2] = [0.01, 100.0];
/// Slower than any driver or brake (s).
const LONGEST_DELAY_S: f64 = 60.0;
/// The least deceleration with which a stop is eased off (m/s²), so that it ends.
const LAST_BRAKING_M_PER_S2: f64 = 0.05;

/// How a driver drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    /// The share of the tractive effort that is used.
    pub traction: Ratio,
    /// The share of the planned deceleration that is used.
    pub braking: Ratio,
    /// How fast acceleration may change; at once if absent.
    pub jerk: Option<Jerk>,
    /// Shut off at the limit and let the speed fall to this share of it before pulling again; absent: hold it.
    pub coast_to: Option<Ratio>,
    /// How much earlier the brake is applied, for a train whose brake takes time to build up.
    pub anticipation: TimeSpan,
    /// In what time a deviation from the limit is made good.
    pub response: TimeSpan,
}

impl Style {
    /// Everything the train can do, at once: the shortest running time.
    pub const FASTEST: Self = Self {
        traction: Ratio::from_parts(1.0),
        braking: Ratio::from_parts(1.0),
        jerk: None,
        coast_to: None,
        anticipation: TimeSpan::ZERO,
        response: TimeSpan::from_ms(1000),
    };

    /// Whether every value is one that a driver can keep to.
    ///
    /// # Errors
    /// The first value that is out of range.
    pub fn check(&self) -> Result<(), StyleError> {
        let within = |what, value: f64, [lowest, highest]: [f64; 2]| {
            let fits = lowest <= value && value <= highest;
            if fits { Ok(()) } else { Err(StyleError { what, value, lowest, highest }) }
        };
        within("share of traction", self.traction.as_parts(), [0.01, 1.0])?;
        within("share of braking", self.braking.as_parts(), [0.01, 1.0])?;
        within("share to coast to", self.coast_to.map_or(0.5, Ratio::as_parts), [0.1, AT_LIMIT])?;
        within("jerk", self.jerk.map_or(1.0, Jerk::as_m_per_s3), JERKS_M_PER_S3)?;
        within("anticipation", self.anticipation.as_s(), [0.0, LONGEST_DELAY_S])?;
        within("response", self.response.as_s(), [0.0, LONGEST_DELAY_S])
    }
}

/// A value that no driver can keep to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StyleError {
    /// What it is the value of, in SI units.
    pub what: &'static str,
    /// The value.
    pub value: f64,
    /// The least it can be.
    pub lowest: f64,
    /// The most it can be.
    pub highest: f64,
}

impl fmt::Display for StyleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, value, lowest, highest } = self;
        write!(f, "the driver's {what} is {value}; it should lie between {lowest} and {highest}")
    }
}

impl core::error::Error for StyleError {}

/// What a train does at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Where its front is along the line.
    pub front: Length,
    /// Its speed.
    pub speed: Speed,
}

/// What the driver is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DrivingPhase {
    /// At a stop.
    Standing,
    /// Faster, as far as the train can.
    Accelerating,
    /// Holding the permitted speed.
    Cruising,
    /// Rolling without traction.
    Coasting,
    /// Slower, to a limit or a stop.
    Braking,
}

/// What the driver does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// From −1, all of the brake, to 1, all traction there is at this speed.
    pub effort: f64,
    /// The same as a force (N), negative for the brake.
    pub force_n: f64,
    /// What it is for.
    pub phase: DrivingPhase,
}

/// A place at which the train must not be faster than a speed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Target {
    at: f64,
    speed: f64,
}

/// A driver on a run along a line.
#[derive(Debug, Clone)]
pub struct Driver {
    train: Train,
    line: LineProfile,
    style: Style,
    /// The limit for the front of the train, so that its tail keeps to it (m/s).
    permitted: Stepped,
    /// Where that limit falls, in order.
    drops: Vec<Target>,
    /// The stop that is next, or where the train stands.
    next_stop: usize,
    /// How long the train still stands, if it does; counted down.
    standing: Option<TimeSpan>,
    /// What is braked to.
    braking_to: Option<Target>,
    coasting: bool,
    /// The acceleration that the last command was meant to give (m/s²).
    acceleration: f64,
}

impl Driver {
    /// A driver who stands at the first stop of the line. Of a train or a style that
    /// [`Train::check`] or [`Style::check`] refuses, nothing is promised.
    pub fn new(train: Train, line: LineProfile, style: Style) -> Self {
        let max_speed = train.max_speed.as_m_per_s();
        let permitted = line.speed_limit().least_behind(train.length);
        let limits: Vec<(Length, f64)> =
            permitted.steps().map(|(from, limit)| (from, limit.min(max_speed))).collect();
        let falls = limits.windows(2).filter(|pair| pair[1].1 < pair[0].1);
        let drops = falls.map(|pair| Target { at: pair[1].0.as_m(), speed: pair[1].1 }).collect();
        let dwell = line.stops().first().map(|stop| stop.dwell);
        Self {
            train,
            line,
            style,
            permitted,
            drops,
            next_stop: 0,
            standing: dwell,
            braking_to: None,
            coasting: false,
            acceleration: 0.0,
        }
    }

    /// The train.
    pub const fn train(&self) -> &Train {
        &self.train
    }

    /// The line.
    pub const fn line(&self) -> &LineProfile {
        &self.line
    }

    /// The stop of the line at which the train is at rest, or the next one.
    pub const fn stop(&self) -> usize {
        self.next_stop
    }

    /// Whether the train stands at the last stop.
    pub fn has_arrived(&self) -> bool {
        self.standing.is_some() && self.next_stop + 1 >= self.line.stops().len()
    }

    /// The limit for the front of the train at a place: of the line, for its whole length, and its own.
    pub fn permitted_speed(&self, front: Length) -> Speed {
        Speed::from_m_per_s(self.permitted.at(front)).min(self.train.max_speed)
    }

    /// What to do for the next `step`.
    pub fn command(&mut self, state: State, step: TimeSpan) -> Command {
        if let Some(left) = self.standing {
            if left > TimeSpan::ZERO || self.has_arrived() {
                self.standing = Some(left - step);
                return self.hold(state);
            }
            self.standing = None;
            self.next_stop += 1;
        }
        let stops_at = self.line.stops().get(self.next_stop).map_or(state.front, |stop| stop.at);
        let distance_left = (stops_at - state.front).as_m();
        if state.speed.as_m_per_s() < STANDING_M_PER_S && distance_left < STOP_WINDOW_M {
            self.standing = self.line.stops().get(self.next_stop).map(|stop| stop.dwell - step);
            (self.braking_to, self.coasting, self.acceleration) = (None, false, 0.0);
            return self.hold(state);
        }
        self.run(state, step, Target { at: stops_at.as_m(), speed: 0.0 })
    }

    /// The brake that keeps a standing train where it is.
    fn hold(&self, state: State) -> Command {
        let force_n = -self.train.inertia_kg() * self.train.brake.service.as_m_per_s2();
        Command { effort: self.train.effort(force_n, state.speed), force_n, phase: DrivingPhase::Standing }
    }

    fn run(&mut self, state: State, step: TimeSpan, stop: Target) -> Command {
        let line_n = self.train.line_force(&self.line, state.front);
        let against_n = line_n + self.train.resistance.at(state.speed);
        let inertia = self.train.inertia_kg();
        let pull_n = self.train.tractive_effort.at(state.speed) * self.style.traction.as_parts();
        let strongest = self.train.max_acceleration.map_or(f64::INFINITY, Acceleration::as_m_per_s2);
        let fullest = ((pull_n - against_n) / inertia).min(strongest);

        let speed = state.speed.as_m_per_s();
        let limit = self.permitted_speed(state.front).as_m_per_s();
        // A response shorter than two steps would swing.
        let response = self.style.response.as_s().max(2.0 * step.as_s());
        let hold = self.approach(limit - speed, response);
        self.coasting = self.style.coast_to.is_some_and(|share| {
            let from = if self.coasting { share.as_parts() } else { AT_LIMIT };
            speed >= from * limit
        });
        let freely = -against_n / inertia;
        let (mut wanted, mut phase) = if self.coasting {
            (hold.min(freely), DrivingPhase::Coasting)
        } else if hold < fullest && speed >= AT_LIMIT * limit {
            (hold, DrivingPhase::Cruising)
        } else {
            (hold.min(fullest), DrivingPhase::Accelerating)
        };
        if let Some(needed) = self.braking(state, stop, response, step)
            && needed < wanted
        {
            (wanted, phase) = (needed, DrivingPhase::Braking);
        }
        if let Some(jerk) = self.style.jerk {
            let change = jerk.as_m_per_s3() * step.as_s();
            wanted = wanted.min(self.acceleration + change).max(self.acceleration - change);
        }
        // Rolling freely is no force at all, and not a rounding of one.
        let force_n = if wanted == freely { 0.0 } else { wanted * inertia + against_n };
        let force_n = force_n.min(pull_n).max(-self.train.brake.full_n);
        self.acceleration = (force_n - against_n) / inertia;
        Command { effort: self.train.effort(force_n, state.speed), force_n, phase }
    }

    /// The acceleration (m/s²) that closes a gap of speed (m/s) in the response time, and from further off no faster
    /// than can be eased off again within the limit of jerk.
    fn approach(&self, gap: f64, response: f64) -> f64 {
        let Some(jerk) = self.style.jerk.map(Jerk::as_m_per_s3) else { return gap / response };
        let linear = jerk * response * response;
        if gap.abs() <= linear {
            return gap / response;
        }
        libm::copysign(libm::sqrt(2.0 * jerk * (gap.abs() - 0.5 * linear)), gap)
    }

    /// The acceleration (m/s²) that the place braked to asks for, if there is one.
    fn braking(&mut self, state: State, stop: Target, response: f64, step: TimeSpan) -> Option<f64> {
        let planned = self.train.brake.service.as_m_per_s2() * self.style.braking.as_parts();
        let jerk = self.style.jerk.map_or(f64::INFINITY, Jerk::as_m_per_s3);
        let speed = state.speed.as_m_per_s();
        let (front, meets) = self.when_brake_bites(state, planned, jerk);

        let needed = |target: &Target| {
            let distance = (target.at - eased(planned, target.speed, jerk) - front).max(0.0);
            let faster = meets * meets - target.speed * target.speed;
            // Without any distance left, the strongest braking.
            if faster <= 0.0 { 0.0 } else { (faster / (2.0 * distance)).min(MAKING_UP * planned) }
        };
        // The command holds for a step, so that easing off looks one step ahead.
        let after = speed + self.acceleration.min(0.0) * step.as_s();
        let asked = |target: &Target| {
            let easing = self.style.jerk.map_or(f64::INFINITY, |jerk| {
                let gap = (after - target.speed).max(0.0);
                libm::sqrt(2.0 * jerk.as_m_per_s3() * gap).max(LAST_BRAKING_M_PER_S2)
            });
            if speed > target.speed { needed(target).min(easing) } else { 0.0 }
        };
        let first = self.drops.partition_point(|drop| drop.at <= state.front.as_m());
        let horizon = front + meets * meets / (2.0 * planned) + eased(planned, meets, jerk);
        let due = self.drops[first..].iter().take_while(|drop| drop.at <= horizon).chain([&stop]);
        let most = due
            .filter(|target| needed(target) >= planned)
            .max_by(|one, other| asked(one).total_cmp(&asked(other)))
            .copied();
        let held = self.braking_to.filter(|target| {
            let before = target.speed == 0.0 || state.front.as_m() < target.at;
            before && (speed <= target.speed || needed(target) >= GIVEN_UP * planned)
        });
        // What is braked to already stays, unless something else asks for more now: who eases off to a limit may have
        // to brake again for the stop behind it.
        self.braking_to = match (held, most) {
            (Some(held), Some(most)) if asked(&held) >= asked(&most) => Some(held),
            (held, most) => most.or(held),
        };
        let target = self.braking_to?;
        if speed <= target.speed {
            return Some(self.approach(target.speed - speed, response));
        }
        Some(-asked(&target))
    }

    /// Where the front is and how fast the train runs (m, m/s) when what the driver does now has come to bear: after
    /// the anticipated time, and after traction has gone and the brake has come as fast as jerk allows.
    fn when_brake_bites(&self, state: State, planned: f64, jerk: f64) -> (f64, f64) {
        let (early, now) = (self.style.anticipation.as_s(), self.acceleration);
        let speed = (state.speed.as_m_per_s() + now * early).max(0.0);
        let distance = (state.speed.as_m_per_s() + speed) * 0.5 * early;
        // Until traction has gone: a / j long.
        let pull = now.max(0.0);
        let fastest = speed + pull * pull / (2.0 * jerk);
        let pulled = speed * pull / jerk + pull * pull * pull / (3.0 * jerk * jerk);
        // A brake that comes on evenly is as good as all of it half of that time later.
        let missing = (planned + now.min(0.0)).max(0.0);
        let late = missing * missing / (2.0 * jerk * planned);
        (state.front.as_m() + distance + pulled + fastest * late, fastest)
    }
}

/// The distance (m) that easing off takes beyond braking evenly down to a speed: v b / 2j + b³ / 24 j².
fn eased(braking: f64, speed: f64, jerk: f64) -> f64 {
    braking * (speed / (2.0 * jerk) + braking * braking / (24.0 * jerk * jerk))
}
