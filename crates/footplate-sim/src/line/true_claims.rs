//! What an operator of a level can claim of a world, so that it is true there.
//!
//! Brakes and protection are type-tested: what is claimed of them is the worst that the run shows, and a margin. Nothing
//! else of the truth reaches the claims.

use footplate_core::{Acceleration, Speed, TimeSpan};

use super::brake_cylinder::BrakeTimes;
use super::random_world::LineLevel;
use super::recording::LineRun;
use super::vehicle::{LineBrake, LineSlideProtection};

/// The result of a test is claimed with this margin: a part of what it found, and so much more (s).
const MARGIN: f64 = 1.2;
const MARGIN_S: f64 = 1.0;
/// Wheels with less creepage than this turn with the train, as far as a claim of release goes: a part of its speed, and at
/// least so much (m/s).
const TURNS_PART: f64 = 0.002;
const TURNS_M_PER_S: f64 = 0.02;
/// No operator claims a release of more than two minutes.
const LONGEST_RELEASE_S: f64 = 120.0;
/// Efforts nearer to zero are none.
const NO_EFFORT: f64 = 0.02;
/// How long a full effort takes to fade by the gentlest limit of jerk of all trains (s).
const COMMAND_FADES_S: f64 = 1.7;
/// The creepage of which protection is claimed that one wheelset keeps below it; nothing is claimed beyond the longest
/// time (s).
const CREEPAGE: f64 = 0.1;
const LONGEST_S: f64 = 30.0;
/// Below this speed protection is out of action and claims nothing (m/s).
const PROTECTS_M_PER_S: f64 = 3.0;

/// Puts into a run what an operator of a level knows.
pub(crate) fn claim(run: &mut LineRun, level: LineLevel, times: &BrakeTimes) {
    let vehicle = &run.vehicle;
    let usual = usual(vehicle.max_brake);
    let release = release(run).max(fades(times));
    let largest = |one: Acceleration, other: Acceleration| if one > other { one } else { other };
    let known = vehicle.brake_command;
    let brake_command = match level {
        // What is usual, but for what this train exceeds.
        LineLevel::L0 | LineLevel::L1 => LineBrake {
            full: usual.full,
            tolerance: usual.tolerance,
            gradient: largest(usual.gradient, known.gradient + known.resistance),
            resistance: usual.resistance,
            build_up: usual.build_up.max(build_up(known.build_up, times)),
            release: usual.release.map(|usual| usual.max(release)),
        },
        LineLevel::L2 => {
            LineBrake { build_up: build_up(known.build_up, times), release: Some(release), ..known }
        }
    };
    let brake_command = LineBrake {
        resistance: brake_command.resistance + brakes_beyond(run, &brake_command),
        ..brake_command
    };
    let fastest = run.truth.iter().map(|truth| truth.speed.abs().as_m_per_s()).fold(0.0, f64::max);
    let protects = (level == LineLevel::L2).then(|| protection(run)).flatten();
    let vehicle = &mut run.vehicle;
    vehicle.max_speed = vehicle.max_speed.max(Speed::from_m_per_s(1.02 * fastest));
    vehicle.brake_command = brake_command;
    vehicle.slide_protection = protects;
    vehicle.independent &= level == LineLevel::L2;
    if level == LineLevel::L0 {
        run.samples.iter_mut().for_each(|sample| sample.effort = None);
    }
}

/// What a vehicle file claims of the brake where it has no table of it (docs/formats/vehicle.md).
fn usual(max_brake: Acceleration) -> LineBrake {
    LineBrake {
        full: max_brake * 0.75,
        tolerance: 0.4,
        gradient: Acceleration::from_m_per_s2(0.4),
        resistance: Acceleration::ZERO,
        build_up: TimeSpan::from_s(4.0),
        release: Some(TimeSpan::from_s(10.0)),
    }
}

/// How long the brake takes to build up: on top of what the design says, dead time and slow cylinders.
fn build_up(of_design: TimeSpan, times: &BrakeTimes) -> TimeSpan {
    of_design + TimeSpan::from_s(times.dead[0] + 4.0 * times.fill)
}

/// How long a brake acts after its command ended: until it answers, until the command has faded, and until its cylinders
/// are empty but for 2 %.
fn fades(times: &BrakeTimes) -> TimeSpan {
    TimeSpan::from_s((times.dead[1] + COMMAND_FADES_S + 4.0 * times.empty).ceil())
}

/// What an operator claims of the release: what the run shows with a margin.
fn release(run: &LineRun) -> TimeSpan {
    TimeSpan::from_s((shown_release_s(run) * MARGIN + MARGIN_S).ceil().min(LONGEST_RELEASE_S))
}

/// Whether all wheels turned with the train once the claimed release was over. Converters take wheels away under a command of less than
/// 2 %, and no operator claims as long a release as that would take.
pub(crate) fn releases_as_claimed(run: &LineRun) -> bool {
    run.vehicle.brake_command.release.is_none_or(|claimed| shown_release_s(run) <= claimed.as_s())
}

/// How long after the end of a command a wheel turned otherwise than the train, at most (s).
fn shown_release_s(run: &LineRun) -> f64 {
    let (mut since, mut longest) = ([f64::INFINITY; 2], 0.0_f64);
    let mut before = 0.0;
    for (sample, truth) in run.samples.iter().zip(&run.truth) {
        let now = sample.time.as_s();
        let passed = now - before;
        before = now;
        // Where the command is lost, anything may act.
        let effort = sample.effort;
        let acts =
            [effort.is_none_or(|effort| effort < -NO_EFFORT), effort.is_none_or(|effort| effort > NO_EFFORT)];
        for (since, acts) in since.iter_mut().zip(acts) {
            *since = if acts { 0.0 } else { *since + passed };
        }
        let train = truth.speed.as_m_per_s();
        if train < 0.0 {
            // A train that rolls back is no test of its brake.
            continue;
        }
        let tolerated = TURNS_M_PER_S.max(TURNS_PART * train);
        for wheel in truth.wheel_speeds {
            let creep = wheel.as_m_per_s() - train;
            let of =
                if creep < -tolerated { Some(since[0]) } else { (creep > tolerated).then_some(since[1]) };
            longest = of.filter(|of| of.is_finite()).map_or(longest, |of| longest.max(of));
        }
    }
    longest
}

/// By how much more than claimed the train decelerated at most within a second, with a margin: a converter that takes its
/// wheels away on its own brakes harder than its command.
fn brakes_beyond(run: &LineRun, claimed: &LineBrake) -> Acceleration {
    let period = run.vehicle.period.as_s();
    let (second, release) = ((1.0 / period).round() as usize, claimed.release.map_or(0.0, TimeSpan::as_s));
    let may_act = (release / period).ceil() as usize + second;
    let least = -(claimed.gradient + claimed.resistance).as_m_per_s2();
    let mut most = 0.0_f64;
    for (end, (truth, before)) in run.truth.iter().skip(second).zip(&run.truth).enumerate() {
        let fell = (before.speed - truth.speed).as_m_per_s() / (second as f64 * period);
        if before.speed.as_m_per_s() < 0.0 || truth.speed.as_m_per_s() < 0.0 || fell + least <= most {
            continue;
        }
        let acted = &run.samples[(end + second).saturating_sub(may_act)..=end + second];
        let effort = acted.iter().map(|sample| -sample.effort.unwrap_or(-1.0)).fold(0.0, f64::max);
        most = most.max(fell + least - effort * claimed.full.as_m_per_s2() * (1.0 + claimed.tolerance));
    }
    Acceleration::from_m_per_s2((100.0 * MARGIN * most).ceil() / 100.0)
}

/// For how long both wheelsets crept at once, if protection ends that.
fn protection(run: &LineRun) -> Option<LineSlideProtection> {
    let (mut since, mut longest) = (0.0, 0.0_f64);
    for (sample, truth) in run.samples.iter().zip(&run.truth) {
        let now = sample.time.as_s();
        let train = truth.speed.as_m_per_s().abs();
        let creeps = |wheel: &Speed| (wheel.as_m_per_s().abs() - train).abs() > 0.8 * CREEPAGE * train;
        if truth.wheel_speeds.iter().all(creeps) {
            if train < PROTECTS_M_PER_S {
                return None;
            }
            longest = longest.max(now - since);
        } else {
            since = now;
        }
    }
    let longest = longest * MARGIN + MARGIN_S;
    (longest <= LONGEST_S)
        .then(|| LineSlideProtection { creepage: CREEPAGE, longest: TimeSpan::from_s(longest) })
}
