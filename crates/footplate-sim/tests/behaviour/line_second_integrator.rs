//! The odometer on trains of a second simulator that shares no equation with `footplate_sim::line`.
//!
//! That one takes Polach's creep force, semi-implicit steps, valves that step a cylinder's pressure and a reference speed of
//! its own. This one takes Burckhardt's law of slip, Runge and Kutta's fourth order in steps of a millisecond, and a
//! protection that ramps the brake by the true slip. Were the odometer tuned to the first, it would fail here.
//!
//! ```text
//! mu(s) = c1 (1 - exp(-c2 s)) - c3 s          s = |wheel - train| / max(wheel, train)
//! J dw/dt = T - r mu N sign                   m dv/dt = sum of forces - m g i - m d
//! ```
//!
//! Source of the law: M. Burckhardt, Fahrwerktechnik: Radschlupf-Regelsysteme (1993); its constants for low adhesion are
//! scaled down to what railways have.

use footplate_core::odometry::wheels::{Axle, Period, Vehicle, Wheelset};
use footplate_core::odometry::{MotionEstimate, Odometer, OdometrySettings};
use footplate_core::{Acceleration, Length, Speed, TimeSpan, Timestamp};

const GRAVITY: f64 = 9.81;
const STEP_S: f64 = 0.001;
const PERIOD_STEPS: usize = 50;
/// What one wheelset carries (kg), how many the train has, what a wheelset's rotation weighs (kg m²).
const LOAD_KG: f64 = 14_000.0;
const WHEELSETS: f64 = 8.0;
const INERTIA: f64 = 120.0;
const RADIUS_M: f64 = 0.425;
const TEETH: u32 = 96;
/// Full brake and full traction of the train (m/s²), rolling resistance (m/s²), and how fast handles act (1/s).
const BRAKE: f64 = 1.0;
const TRACTION: f64 = 0.8;
const RESISTANCE: f64 = 0.02;
const HANDLE_PER_S: f64 = 0.8;

/// Burckhardt's constants of a rail.
#[derive(Clone, Copy)]
struct Rail {
    c1: f64,
    c2: f64,
    c3: f64,
}

const DRY: Rail = Rail { c1: 0.35, c2: 60.0, c3: 0.12 };
const LEAVES: Rail = Rail { c1: 0.045, c2: 40.0, c3: 0.02 };
const ICE: Rail = Rail { c1: 0.03, c2: 30.0, c3: 0.015 };

impl Rail {
    /// What part of its load a wheel passes on, forward if it turns faster than the train moves.
    fn grip(&self, wheel: f64, train: f64) -> f64 {
        let s = (wheel - train).abs() / wheel.abs().max(train.abs()).max(0.3);
        let mu = self.c1 * (1.0 - libm::exp(-self.c2 * s)) - self.c3 * s;
        mu.copysign(wheel - train)
    }
}

/// What a protection does about slip.
#[derive(Clone, Copy)]
enum Protection {
    None,
    /// Lets the torque go beyond the larger slip, and gives it back below the smaller.
    Ramps(f64, f64),
}

/// A stretch of time with a handle and a rail under each measured wheelset, and under the others.
struct Stretch {
    lasts_s: f64,
    handle: f64,
    rails: [Rail; 3],
}

/// Place, speed, and angle and speed of each wheelset.
type State = [f64; 6];

struct Train {
    state: State,
    effort: f64,
    /// Part of the torque that the protection leaves each measured wheelset.
    left: [f64; 2],
    powered: [bool; 2],
    protection: Protection,
    gradient: f64,
}

impl Train {
    fn new(powered: [bool; 2], protection: Protection, gradient: f64) -> Self {
        Self { state: [0.0; 6], effort: 0.0, left: [1.0; 2], powered, protection, gradient }
    }

    fn torque(&self, at: usize) -> f64 {
        let brakes = (-self.effort).max(0.0) * BRAKE;
        let pulls = if self.powered[at] { self.effort.max(0.0) * TRACTION } else { 0.0 };
        self.left[at] * (pulls - brakes) * LOAD_KG * RADIUS_M
    }

    fn derivative(&self, state: &State, rails: &[Rail; 3]) -> State {
        let [_, v, _, first, _, second] = *state;
        let others = (WHEELSETS - 2.0) * LOAD_KG;
        // The others pass on what their rail carries at the best slip.
        let carried = 0.9 * rails[2].c1 * others * GRAVITY;
        let wanted = self.effort * if self.effort < 0.0 { BRAKE } else { TRACTION } * others;
        let mut force = wanted.clamp(-carried, carried);
        let mut turns = [0.0; 2];
        for (at, omega) in [first, second].into_iter().enumerate() {
            let rim = rails[at].grip(omega * RADIUS_M, v) * LOAD_KG * GRAVITY;
            turns[at] = (self.torque(at) - RADIUS_M * rim) / INERTIA;
            force += rim;
        }
        let a = force / (WHEELSETS * LOAD_KG) - RESISTANCE - GRAVITY * self.gradient;
        [v, a, first, turns[0], second, turns[1]]
    }

    fn step(&mut self, handle: f64, rails: &[Rail; 3]) {
        let change = (handle - self.effort).clamp(-HANDLE_PER_S * STEP_S, HANDLE_PER_S * STEP_S);
        self.effort += change;
        for at in 0..2 {
            let slip = (self.state[3 + 2 * at] * RADIUS_M - self.state[1]).abs() / self.state[1].max(0.5);
            if let Protection::Ramps(low, high) = self.protection {
                let rate = if slip > high {
                    -6.0
                } else if slip < low {
                    1.5
                } else {
                    0.0
                };
                self.left[at] = (self.left[at] + rate * STEP_S).clamp(0.0, 1.0);
            }
        }
        let add = |a: &State, b: &State, k: f64| core::array::from_fn(|i| a[i] + k * b[i]);
        let s = self.state;
        let k1 = self.derivative(&s, rails);
        let k2 = self.derivative(&add(&s, &k1, STEP_S / 2.0), rails);
        let k3 = self.derivative(&add(&s, &k2, STEP_S / 2.0), rails);
        let k4 = self.derivative(&add(&s, &k3, STEP_S), rails);
        self.state = core::array::from_fn(|i| s[i] + STEP_S / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        // Friction holds what has come to rest.
        if self.effort <= 0.0 {
            self.state[1] = self.state[1].max(0.0);
            self.state[3] = self.state[3].max(0.0);
            self.state[5] = self.state[5].max(0.0);
        }
    }
}

/// What an odometer made of a run.
#[derive(Debug, Default)]
struct Score {
    periods: usize,
    outside: usize,
    outside_likely: usize,
    left_distance: bool,
    squares: f64,
    worst: f64,
    rolling_squares: f64,
    rolling: usize,
    both_slip: usize,
}

/// An odometer of a vehicle file without optional keys, whose diameters are wrong by 0.1 %.
fn odometer(powered: [bool; 2]) -> Odometer {
    let wheelset = |is_powered| Wheelset {
        teeth: TEETH,
        diameter: Length::from_m(2.0 * RADIUS_M * 1.001),
        diameter_tolerance: 0.003,
        axle: if is_powered { Axle::Powered } else { Axle::Trailing },
    };
    let limits = [1.2, 1.5].map(Acceleration::from_m_per_s2);
    let period = TimeSpan::from_s(STEP_S * PERIOD_STEPS as f64);
    let vehicle = Vehicle::new(period, Speed::from_m_per_s(50.0), limits, powered.map(wheelset)).unwrap();
    Odometer::new(vehicle, OdometrySettings::recommended()).unwrap()
}

/// Runs a train from a speed (m/s) through its stretches.
fn scored(speed: f64, mut train: Train, stretches: &[Stretch]) -> Score {
    train.state = [0.0, speed, 0.3, speed / RADIUS_M, 0.7, speed / RADIUS_M];
    let mut odometer = odometer(train.powered);
    let pulse = core::f64::consts::TAU / f64::from(TEETH);
    let counted =
        |train: &Train| [train.state[2], train.state[4]].map(|angle| libm::floor(angle / pulse) as i64);
    let mut score = Score::default();
    let (mut before, mut steps, mut start, mut rolled_for) = (counted(&train), 0, None, 0);
    for stretch in stretches {
        for _ in 0..libm::round(stretch.lasts_s / STEP_S) as usize / PERIOD_STEPS {
            for _ in 0..PERIOD_STEPS {
                train.step(stretch.handle, &stretch.rails);
                steps += 1;
            }
            let now = counted(&train);
            let time = Timestamp::ZERO + TimeSpan::from_s(f64::from(steps) * STEP_S);
            let pulses = [now[0] - before[0], now[1] - before[1]];
            let period = Period { effort: Some(train.effort), ..Period::with_pulses(time, pulses) };
            before = now;
            let estimate = odometer.step(&period);
            // Distance begins at the end of the first period.
            let start = *start.get_or_insert(train.state[0]);
            rolled_for = score.see(&estimate, &train, start, rolled_for);
        }
    }
    score
}

impl Score {
    fn see(&mut self, estimate: &MotionEstimate, train: &Train, start: f64, rolled_for: usize) -> usize {
        let (v, s) = (train.state[1], train.state[0] - start);
        let slips =
            [train.state[3], train.state[5]].map(|w| (w * RADIUS_M - v).abs() > 0.1_f64.max(0.01 * v));
        let off = estimate.speed.as_m_per_s() - v;
        self.periods += 1;
        let outside = |low: f64, high: f64, value: f64| value < low - 1e-9 || value > high + 1e-9;
        let (sure, likely) = (estimate.guaranteed, estimate.confidence);
        self.outside += usize::from(outside(sure.speed_low.as_m_per_s(), sure.speed_high.as_m_per_s(), v));
        self.outside_likely +=
            usize::from(outside(likely.speed_low.as_m_per_s(), likely.speed_high.as_m_per_s(), v));
        self.left_distance |= outside(sure.distance_low.as_m(), sure.distance_high.as_m(), s);
        self.squares += off * off;
        self.worst = self.worst.max(off.abs());
        self.both_slip += usize::from(slips == [true; 2]);
        let rolled_for = if slips == [false; 2] { rolled_for + 1 } else { 0 };
        // A second after they gripped again.
        if rolled_for > 20 {
            self.rolling += 1;
            self.rolling_squares += off * off;
        }
        rolled_for
    }

    fn rms(&self) -> f64 {
        libm::sqrt(self.squares / self.periods as f64)
    }

    fn rolling_rms(&self) -> f64 {
        libm::sqrt(self.rolling_squares / self.rolling.max(1) as f64)
    }
}

fn stretch(lasts_s: f64, handle: f64, rails: [Rail; 3]) -> Stretch {
    Stretch { lasts_s, handle, rails }
}

/// Every interval holds, and wheels that roll are trusted.
fn holds(what: &str, score: &Score, rolling: f64) {
    assert_eq!((score.outside, score.left_distance), (0, false), "{what}");
    assert!(score.outside_likely * 5000 <= score.periods, "{what}: {score:?}");
    assert!(score.rolling_rms() < rolling, "{what}: {}", score.rolling_rms());
}

#[test]
fn a_dry_run_is_known_to_centimetres_a_second() {
    for gradient in [-0.02, 0.0, 0.02] {
        let run = [stretch(20.0, 0.6, [DRY; 3]), stretch(15.0, 0.0, [DRY; 3]), stretch(30.0, -0.6, [DRY; 3])];
        let score = scored(8.0, Train::new([true, false], Protection::None, gradient), &run);
        assert_eq!(score.both_slip, 0);
        holds("dry", &score, 0.05);
    }
}

#[test]
fn one_wheelset_on_leaves_locks_and_the_other_tells_the_speed() {
    for rails in [[LEAVES, DRY, DRY], [DRY, LEAVES, DRY]] {
        let run = [stretch(5.0, 0.0, [DRY; 3]), stretch(8.0, -0.8, rails), stretch(10.0, 0.0, [DRY; 3])];
        let score = scored(25.0, Train::new([true, false], Protection::None, 0.0), &run);
        holds("one", &score, 0.05);
        assert!(score.rms() < 0.08, "{}", score.rms());
    }
}

#[test]
fn both_slide_with_protection_and_grip_again() {
    for (low, high) in [(0.03, 0.08), (0.08, 0.16), (0.15, 0.25)] {
        let run = [
            stretch(5.0, 0.0, [DRY; 3]),
            stretch(12.0, -0.9, [LEAVES; 3]),
            stretch(4.0, -0.5, [DRY; 3]),
            stretch(10.0, 0.0, [DRY; 3]),
        ];
        let score = scored(25.0, Train::new([true, false], Protection::Ramps(low, high), 0.0), &run);
        assert!(score.both_slip > 100, "{score:?}");
        holds("protected", &score, 0.05);
    }
}

#[test]
fn both_lock_and_come_free() {
    for (rail, gradient) in [(LEAVES, 0.0), (ICE, 0.01), (ICE, -0.005)] {
        let run = [stretch(5.0, 0.0, [DRY; 3]), stretch(8.0, -0.7, [rail; 3]), stretch(10.0, 0.0, [DRY; 3])];
        let score = scored(22.0, Train::new([true, false], Protection::None, gradient), &run);
        assert!(score.both_slip > 100, "{score:?}");
        holds("locked", &score, 0.15);
    }
}

#[test]
fn both_spin_on_ice_and_grip_again() {
    for (low, high) in [(0.02, 0.05), (0.1, 0.3)] {
        let run = [stretch(8.0, 0.5, [DRY; 3]), stretch(15.0, 0.8, [ICE; 3]), stretch(10.0, 0.0, [DRY; 3])];
        let score = scored(6.0, Train::new([true; 2], Protection::Ramps(low, high), 0.0), &run);
        assert!(score.both_slip > 100, "{score:?}");
        holds("spin", &score, 0.15);
    }
}
