//! Trains do not jump: places and speeds are continuous, and speeds stay possible for a locomotive.

use footplate_core::{Approach, TimeSpan};
use footplate_sim::{LawFamily, Script, SimulatedRun, Train, What, When};

use crate::oval::{Yard, oval, seconds, step};

/// Largest rate of change of speed under any law or stiction (driven wheels of 80 g locomotives slip at about 2 m/s²;
/// a motor released at its breakaway speed gains 14 mm/s within 40 ms).
const MOST_MM_PER_S2: f64 = 1000.0;

fn up_down_and_stop() -> Script {
    let report = |skipped| When::OnReport { skipped, wait: TimeSpan::ZERO };
    Script::from_rest(0, seconds(120))
        .then(When::After(seconds(1)), What::Speed(step(12)))
        .then(report(5), What::Speed(step(6)))
        .then(report(3), What::Speed(step(10)))
        .then(When::After(TimeSpan::from_ms(400)), What::Speed(step(8)))
        .then(report(2), What::Speed(step(0)))
        .then(When::AtRest, What::Measure)
}

fn check(run: &SimulatedRun, name: &str) {
    let motion = &run.truth.motion;
    let millisecond = TimeSpan::from_ms(1);
    let mut at = motion.begins();
    let (mut place, mut speed) = (motion.distance(at), motion.speed(at));
    while at < motion.ends() {
        at += millisecond;
        let (next_place, next_speed) = (motion.distance(at), motion.speed(at));
        let gone = (next_place - place).as_mm();
        let change = (next_speed - speed).as_mm_per_s() * 1000.0;
        let mean = 0.5 * (speed + next_speed).as_mm_per_s() * 1e-3;
        assert!(next_speed.as_mm_per_s() >= 0.0, "{name}: runs backwards at {at:?}");
        assert!((gone - mean).abs() < 2e-3, "{name}: goes {gone} mm instead of {mean} mm at {at:?}");
        assert!(change.abs() < MOST_MM_PER_S2, "{name}: changes speed by {change} mm/s² at {at:?}");
        (place, speed) = (next_place, next_speed);
    }
}

#[test]
fn place_and_speed_are_continuous_under_every_law() {
    let layout = oval();
    for family in LawFamily::ALL {
        for seed in 0..8 {
            let yard = Yard::new(&layout, Train::draw(seed, family), seed);
            let run = yard.run(&up_down_and_stop(), seed);
            check(&run, &format!("{family} {seed}"));
            assert_eq!(run.truth.stops.len(), 1, "{family} {seed} did not stop within two minutes");
            let gone = run.truth.motion.distance(run.truth.motion.ends()).as_m();
            assert!((3.0..20.0).contains(&gone), "{family} {seed}: went {gone} m");
        }
    }
}

#[test]
fn steady_speeds_are_those_of_the_table_from_both_sides() {
    let layout = oval();
    for family in LawFamily::ALL {
        for seed in 0..4 {
            let mut train = Train::draw(seed, family);
            train.run_deviation = footplate_core::Ratio::ZERO;
            train.wander = footplate_core::Ratio::ZERO;
            train.warm_up = footplate_core::Ratio::ZERO;
            train.curve_sensitivity = 0.0;
            let mut yard = Yard::new(&layout, train, seed);
            yard.railway.track = footplate_sim::TrueTrack::as_surveyed(&layout);
            for (first, approach) in [(6, Approach::Below), (12, Approach::Above)] {
                let script = Script::from_rest(0, seconds(36))
                    .then(When::After(TimeSpan::ZERO), What::Speed(step(first)))
                    .then(When::After(seconds(10)), What::Speed(step(9)));
                let run = yard.run(&script, seed);
                let reached = run.truth.motion.speed(run.truth.motion.ends()).as_mm_per_s();
                let wanted = yard.train.speeds.speed(step(9), approach).as_mm_per_s();
                assert!(
                    (reached - wanted).abs() < 0.01,
                    "{family} {seed}: {reached} instead of {wanted} mm/s"
                );
            }
        }
    }
}
