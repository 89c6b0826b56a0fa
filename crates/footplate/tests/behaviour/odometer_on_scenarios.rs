//! What the odometer promises on simulated trains that slip, slide and have broken sensors: the figures demanded of it,
//! on seeds that nothing was tuned on.
//!
//! The truth is only looked at here. The full table, on a hundred seeds a family, is `docs/tables/odometry.md`.

use footplate_core::TimeSpan;
use footplate_core::odometry::{
    MotionEstimate, Odometer, OdometrySettings, WheelState, distance_tolerance, speed_tolerance,
};
use footplate_sim::line::{LineConditions, LineRun, LineScenario, WheelTruth};
use footplate_store::odometry::{simulated_rows, simulated_vehicle};

/// Seeds beyond those that anything was tried on.
const SEEDS: std::ops::Range<u64> = 5001..5009;

struct Score {
    rms: f64,
    worst: f64,
    /// Error of the distance at the end: of the way, and in metres.
    distance_part: f64,
    distance_m: f64,
    width: f64,
    /// Periods in which the truth was outside the bounds of the speed and of the distance.
    outside: [usize; 2],
    /// Part of the periods outside the tolerances of ETCS for speed and for distance.
    violations: [f64; 2],
    /// From the first wheel that slips or slides to the first flag (s).
    delay: f64,
    false_flags: usize,
    last: MotionEstimate,
}

fn walk(run: &LineRun, settings: OdometrySettings) -> Score {
    let believed = simulated_vehicle(&run.vehicle).expect("a claimed vehicle");
    let mut odometer = Odometer::new(believed.vehicle, settings).expect("a claimed vehicle");
    let (mut squares, mut worst, mut width) = (0.0, 0.0_f64, 0.0);
    let (mut outside, mut violations, mut false_flags) = ([0; 2], [0; 2], 0);
    let (mut onset, mut flagged) = (None, None);
    let mut last = None;
    for ((period, _), truth) in simulated_rows(run).zip(&run.truth) {
        let estimate = odometer.step(&period);
        let guaranteed = estimate.guaranteed;
        let error = (estimate.speed - truth.speed).as_m_per_s();
        squares += error * error;
        worst = worst.max(error.abs());
        width += (estimate.confidence.speed_high - estimate.confidence.speed_low).as_m_per_s();
        outside[0] += usize::from(truth.speed < guaranteed.speed_low || truth.speed > guaranteed.speed_high);
        outside[1] += usize::from(
            truth.distance < guaranteed.distance_low || truth.distance > guaranteed.distance_high,
        );
        let off = estimate.distance - truth.distance;
        violations[0] += usize::from(error.abs() > speed_tolerance(truth.speed).as_m_per_s());
        violations[1] += usize::from(off.abs() > distance_tolerance(truth.distance));
        let lost = estimate.wheels.iter().any(|wheel| matches!(wheel, WheelState::Slide | WheelState::Spin));
        let really = truth.wheels.iter().any(|wheel| *wheel != WheelTruth::Rolling);
        false_flags += usize::from(lost && !really);
        onset = onset.or(really.then_some(period.time));
        flagged = flagged.or((lost && onset.is_some()).then_some(period.time));
        last = Some((estimate, off, truth.distance));
    }
    let (last, off, way) = last.expect("a run has samples");
    let periods = run.samples.len() as f64;
    let delay = onset.zip(flagged).map_or(f64::NAN, |(onset, flagged)| (flagged - onset).as_s());
    Score {
        rms: (squares / periods).sqrt(),
        worst,
        distance_part: (off / way).abs(),
        distance_m: off.as_m().abs(),
        width: width / periods,
        outside,
        violations: violations.map(|count| count as f64 / periods),
        delay,
        false_flags,
        last,
    }
}

fn scores(name: &str, conditions: LineConditions) -> Vec<Score> {
    let scenario = LineScenario::by_name(name).expect("a scenario");
    SEEDS.map(|seed| walk(&scenario.run(seed, conditions), OdometrySettings::recommended())).collect()
}

fn teeth(teeth: u32) -> LineConditions {
    LineConditions { teeth, ..LineConditions::default() }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn assert_bounds_held(name: &str, scores: &[Score]) {
    for (score, seed) in scores.iter().zip(SEEDS) {
        assert_eq!(score.outside, [0, 0], "{name}, seed {seed}: the truth left its bounds");
        assert!(score.last.over.as_m() >= 0.0 && score.last.under.as_m() >= 0.0);
    }
}

#[test]
fn a_normal_run_is_followed_closely() {
    for (pulses, rms, worst) in [(80, 0.035, 0.25), (200, 0.026, 0.15)] {
        let scores = scores("N1", LineConditions { exact_diameters: true, ..teeth(pulses) });
        assert_bounds_held("N1", &scores);
        for score in &scores {
            assert!(score.rms <= rms, "{pulses} teeth: {}", score.rms);
            assert!(score.distance_part <= 3e-4, "{pulses} teeth: {}", score.distance_part);
            assert_eq!(score.false_flags, 0);
        }
        let typical = median(scores.iter().map(|score| score.worst).collect());
        assert!(typical <= worst, "{pulses} teeth: {typical}");
    }
}

#[test]
fn one_wheelset_that_slides_or_locks_is_told_from_the_train() {
    for name in ["S1", "S1b"] {
        let scores = scores(name, teeth(100));
        assert_bounds_held(name, &scores);
        for score in &scores {
            assert!(score.rms <= 0.05, "{name}: {}", score.rms);
            assert!(score.worst <= 0.5, "{name}: {}", score.worst);
            assert_eq!(score.violations, [0.0, 0.0], "{name}");
        }
        let delay = median(scores.iter().map(|score| score.delay).collect());
        assert!(delay <= 0.2, "{name}: seen after {delay} s");
    }
}

#[test]
fn both_wheelsets_sliding_under_slide_protection_cost_less_than_a_hundredth_of_the_way() {
    let scores = scores("S3", teeth(100));
    assert_bounds_held("S3", &scores);
    for score in &scores {
        assert!(score.distance_part <= 0.01, "{}", score.distance_part);
        assert!(score.rms <= 0.45, "{}", score.rms);
    }
    let violations = median(scores.iter().map(|score| score.violations[0]).collect());
    assert!(violations <= 0.005, "{violations} of the time outside the tolerance of ETCS");
}

#[test]
fn both_wheelsets_locked_until_the_train_stands_are_survived() {
    let scores = scores("S2", teeth(100));
    assert_bounds_held("S2", &scores);
    for score in &scores {
        assert!(score.rms <= 0.35 && score.worst <= 1.1, "{} {}", score.rms, score.worst);
        assert!(score.distance_part <= 0.08, "{}", score.distance_part);
        assert_eq!(score.violations[1], 0.0, "within 5 m and 5 %");
    }
}

#[test]
fn a_spin_at_the_start_costs_less_than_two_metres() {
    let scores = scores("S6", teeth(100));
    assert_bounds_held("S6", &scores);
    let typical = median(scores.iter().map(|score| score.distance_m).collect());
    assert!(typical <= 2.0, "{typical} m");
}

#[test]
fn wrong_diameters_are_learnt_from_balises() {
    let scores = scores("N6", teeth(100));
    assert_bounds_held("N6", &scores);
    for score in &scores {
        assert!(score.distance_part <= 5e-4, "{}", score.distance_part);
    }
}

#[test]
fn no_family_leaves_its_bounds() {
    // Late rows (F9) lie outside what bounds by counts take for granted: a time that is right.
    for scenario in LineScenario::all().iter().filter(|scenario| scenario.name() != "F9") {
        assert_bounds_held(scenario.name(), &scores(scenario.name(), teeth(80))[..3]);
    }
}

#[test]
fn bounds_are_tight_where_wheels_roll() {
    for name in ["N2", "F3", "F4", "F7", "F10"] {
        let scores = scores(name, teeth(200));
        let width = median(scores.iter().map(|score| score.width).collect());
        assert!(width <= 0.6, "{name}: {width} m/s");
    }
}

#[test]
fn a_common_slide_drawn_out_slowly_is_within_the_bounds_all_the_same() {
    let scores = scores("S5", LineConditions { period: TimeSpan::from_ms(20), ..teeth(100) });
    assert_bounds_held("S5", &scores);
}

#[test]
fn the_published_algorithm_is_worse_where_both_slide() {
    let scenario = LineScenario::by_name("S3").expect("a scenario");
    let of = |settings: OdometrySettings| {
        median(SEEDS.map(|seed| walk(&scenario.run(seed, teeth(100)), settings).rms).collect())
    };
    let (published, ours) = (of(OdometrySettings::paper()), of(OdometrySettings::recommended()));
    assert!(published > 2.0 * ours, "{published} against {ours}");
}
