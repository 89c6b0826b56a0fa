//! Wheel slide protection: valves that let braked wheelsets creep, but not lock.
//!
//! It sees nothing but wheel speeds. Its reference follows the fastest wheelset, and falls no faster than a train can
//! brake; while wheelsets slide, that line drifts off, so that every few seconds one of them is released until it runs
//! as fast as the train again: that is what an odometer sees as a touch.

use super::brake_cylinder::Valve;
use crate::draws::Draws;

/// How often the valves are set (s).
const CYCLE_S: f64 = 0.01;
/// A wheelset is released when it is slower than the reference by more than this (m/s) and this part of it ...
const RELEASE_M_PER_S: f64 = 0.8;
const RELEASE_PART: f64 = 0.09;
/// ... or decelerates more than this (m/s²).
const RELEASE_M_PER_S2: f64 = 3.5;
/// It is braked again when it is slower than the reference by less than this (m/s) or this part of it.
const APPLY_M_PER_S: f64 = 0.4;
const APPLY_PART: f64 = 0.035;
/// During a slide the brake comes back in pulses: one cycle in so many.
const PULSE_CYCLES: u32 = 3;
/// How fast the reference falls at most (m/s²): a little more than the train brakes on a dry rail.
const REFERENCE_M_PER_S2: (f64, f64) = (1.3, 1.6);
/// While wheelsets slide, one is released for the ground speed after so long (s) ...
const RESYNCHRONISE_S: (f64, f64) = (2.4, 3.2);
/// ... until it accelerates less than this (m/s²), after having been released for so long (s), or for that long.
const SETTLED_M_PER_S2: f64 = 0.5;
const SHORTEST_RELEASE_S: f64 = 0.25;
const LONGEST_RESYNCHRONISATION_S: f64 = 2.0;
/// A valve that let air out for longer is closed by its safety timer (s).
const LONGEST_RELEASE_S: f64 = 4.0;
/// Below this reference it is out of action (m/s): that is why wheels lock at the end of stops.
const SLOWEST_M_PER_S: f64 = 1.4;
/// How long no valve has to act until the slide is over (s).
const OVER_S: f64 = 1.0;

/// How a maker's protection works.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum ProtectionStyle {
    /// Valves that are open, closed or let air out, from wheel speeds alone.
    #[default]
    OnOff,
    /// Proportional valves that keep a creepage, with the speed of the ground from a radar.
    Proportional {
        /// The creepage that it keeps while the rail does not carry the brake.
        creepage: f64,
    },
}

/// A proportional protection lets pass this part of a full brake more for each m/s below its creepage, at once and for
/// each second that this lasts.
const PROPORTIONAL_PER_M_PER_S: f64 = 0.25;
const PROPORTIONAL_PER_M: f64 = 0.25;
/// The least speed difference that it keeps (m/s).
const LEAST_KEPT_M_PER_S: f64 = 0.3;

/// One wheelset as the protection sees it.
#[derive(Debug, Clone, Copy, Default)]
struct Guarded {
    speed: f64,
    valve: Valve,
    released_for: f64,
    /// What a proportional valve let pass lately, without what follows the speed at once.
    passed: f64,
}

/// The control unit of the two measured wheelsets.
#[derive(Debug, Clone)]
pub(crate) struct SlideProtection {
    style: ProtectionStyle,
    wheelsets: [Guarded; 2],
    works: [bool; 2],
    reference: f64,
    falls: f64,
    since_cycle: f64,
    cycles: u32,
    sliding_for: f64,
    quiet_for: f64,
    next_release: f64,
    releasing: Option<usize>,
    last_released: usize,
    draws: Draws,
}

impl SlideProtection {
    /// A protection that acts on the wheelsets for which it works.
    pub(crate) fn draw(works: [bool; 2], style: ProtectionStyle, speed: f64, draws: &mut Draws) -> Self {
        Self {
            style,
            wheelsets: [Guarded { speed, passed: 1.0, ..Guarded::default() }; 2],
            works,
            reference: speed,
            falls: draws.uniform(REFERENCE_M_PER_S2.0..REFERENCE_M_PER_S2.1),
            since_cycle: 0.0,
            cycles: 0,
            sliding_for: 0.0,
            quiet_for: OVER_S,
            next_release: 0.0,
            releasing: None,
            last_released: draws.below(2),
            draws: draws.split(),
        }
    }

    /// Whether a valve acted within the last second.
    pub(crate) fn is_active(&self) -> bool {
        self.quiet_for < OVER_S
    }

    /// The valves after `dt` more seconds, from the speeds of the wheels and of the train (m/s, in either direction).
    pub(crate) fn step(&mut self, dt: f64, speeds: [f64; 2], train: f64, braking: bool) -> [Valve; 2] {
        if let ProtectionStyle::Proportional { creepage } = self.style {
            return self.keep(creepage, dt, speeds.map(f64::abs), train.abs(), braking);
        }
        self.since_cycle += dt;
        // Half a nanosecond for rounding.
        if self.since_cycle >= CYCLE_S - 5e-10 {
            self.cycle(self.since_cycle, speeds.map(f64::abs), braking);
            self.since_cycle = 0.0;
            self.cycles = (self.cycles + 1) % PULSE_CYCLES;
        }
        let between_pulses = self.is_active() && self.cycles > 0;
        [0, 1].map(|at| match self.wheelsets[at].valve {
            _ if !self.works[at] => Valve::Apply,
            Valve::Apply if between_pulses => Valve::Hold,
            valve => valve,
        })
    }

    /// Keeps a creepage with proportional valves.
    fn keep(&mut self, creepage: f64, dt: f64, speeds: [f64; 2], train: f64, braking: bool) -> [Valve; 2] {
        let kept = LEAST_KEPT_M_PER_S.max(creepage * train);
        let mut acts = false;
        let valves = [0, 1].map(|at| {
            let wheelset = &mut self.wheelsets[at];
            if !braking || !self.works[at] || train < SLOWEST_M_PER_S {
                wheelset.passed = 1.0;
                return Valve::Apply;
            }
            let room = kept - (train - speeds[at]);
            wheelset.passed = (wheelset.passed + PROPORTIONAL_PER_M * room * dt).clamp(0.0, 1.0);
            let limit = (wheelset.passed + PROPORTIONAL_PER_M_PER_S * room).clamp(0.0, 1.0);
            acts |= limit < 1.0;
            if limit < 1.0 { Valve::Limit(limit) } else { Valve::Apply }
        });
        self.quiet_for = if acts { 0.0 } else { self.quiet_for + dt };
        valves
    }

    fn cycle(&mut self, dt: f64, speeds: [f64; 2], braking: bool) {
        let fastest = speeds[0].max(speeds[1]);
        self.reference = fastest.max(self.reference - self.falls * dt);
        if !braking || self.reference < SLOWEST_M_PER_S {
            // Nothing to protect, or too slow to tell.
            if !braking {
                self.reference = fastest;
            }
            self.quiet_for += dt;
            self.releasing = None;
            for (wheelset, speed) in self.wheelsets.iter_mut().zip(speeds) {
                *wheelset = Guarded { speed, ..Guarded::default() };
            }
            return;
        }
        let accelerations = [0, 1].map(|at| (speeds[at] - self.wheelsets[at].speed) / dt);
        for at in [0, 1] {
            self.judge(at, dt, speeds[at], accelerations[at]);
        }
        let acts = self.wheelsets.iter().any(|wheelset| wheelset.valve != Valve::Apply);
        self.quiet_for = if acts { 0.0 } else { self.quiet_for + dt };
        self.resynchronise(dt, accelerations);
    }

    fn judge(&mut self, at: usize, dt: f64, speed: f64, acceleration: f64) {
        let behind = self.reference - speed;
        let wheelset = &mut self.wheelsets[at];
        wheelset.speed = speed;
        let slow = behind > RELEASE_M_PER_S.max(RELEASE_PART * self.reference);
        let rolls = behind < APPLY_M_PER_S.max(APPLY_PART * self.reference);
        wheelset.valve =
            if (slow || acceleration < -RELEASE_M_PER_S2) && wheelset.released_for < LONGEST_RELEASE_S {
                Valve::Release
            } else if rolls || wheelset.released_for >= LONGEST_RELEASE_S {
                Valve::Apply
            } else {
                Valve::Hold
            };
        match wheelset.valve {
            Valve::Release => wheelset.released_for += dt,
            Valve::Apply => wheelset.released_for = 0.0,
            Valve::Hold | Valve::Limit(_) => {}
        }
    }

    /// Releases one wheelset after the other until it turns with the train.
    fn resynchronise(&mut self, dt: f64, accelerations: [f64; 2]) {
        if self.quiet_for >= OVER_S {
            (self.sliding_for, self.releasing) = (0.0, None);
            self.next_release = self.draws.uniform(RESYNCHRONISE_S.0..RESYNCHRONISE_S.1);
            return;
        }
        self.sliding_for += dt;
        if let Some(at) = self.releasing {
            let settled = self.sliding_for > SHORTEST_RELEASE_S && accelerations[at].abs() < SETTLED_M_PER_S2;
            if settled || self.sliding_for > LONGEST_RESYNCHRONISATION_S {
                (self.sliding_for, self.releasing) = (0.0, None);
                self.next_release = self.draws.uniform(RESYNCHRONISE_S.0..RESYNCHRONISE_S.1);
            } else {
                self.wheelsets[at].valve = Valve::Release;
            }
        } else if self.sliding_for >= self.next_release {
            let works = |at: &usize| self.works[*at];
            let at = Some(1 - self.last_released).filter(works).unwrap_or(self.last_released);
            (self.sliding_for, self.releasing, self.last_released) = (0.0, Some(at), at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Purpose;

    fn protection(speed: f64) -> SlideProtection {
        SlideProtection::draw([true; 2], ProtectionStyle::OnOff, speed, &mut Draws::new(1, Purpose::Motion))
    }

    #[test]
    fn a_wheelset_that_falls_behind_is_released_and_one_that_rolls_is_not() {
        let mut protection = protection(20.0);
        let mut falls_behind = Valve::Apply;
        for step in 0..50 {
            let [first, second] = protection.step(CYCLE_S, [20.0 - 0.1 * f64::from(step), 20.0], 20.0, true);
            falls_behind = first;
            assert_ne!(second, Valve::Release);
        }
        assert_eq!(falls_behind, Valve::Release);
    }

    #[test]
    fn at_walking_pace_and_without_a_brake_it_does_nothing() {
        for (speed, braking) in [(1.2, true), (20.0, false)] {
            let mut protection = protection(speed);
            for _ in 0..50 {
                assert_eq!(protection.step(CYCLE_S, [0.0, speed], speed, braking), [Valve::Apply; 2]);
            }
        }
    }

    #[test]
    fn while_both_slide_one_after_the_other_is_released_for_the_ground_speed() {
        let mut protection = protection(20.0);
        // Both hang back within the band in which the valves hold, whatever the valves do.
        let mut released = Vec::new();
        for _ in 0..1500 {
            let speed = protection.reference - 0.08 * protection.reference;
            protection.step(CYCLE_S, [speed; 2], 20.0, true);
            if let Some(at) = protection.releasing {
                released.push(at);
            }
        }
        released.dedup();
        assert!(released.len() >= 2 && released[0] != released[1], "{released:?}");
    }
}
