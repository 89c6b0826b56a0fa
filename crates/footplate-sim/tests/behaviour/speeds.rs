//! A stopwatch, a light gate and repeated runs find the parameters that the train was given.

use footplate_core::{Approach, Length, Ratio, SensorId};
use footplate_sim::{Cause, LawFamily, Script, SimulatedRun, Train};

use crate::oval::{Yard, oval, seconds, step};

fn even_tempered(seed: u64) -> Train {
    let none = Ratio::ZERO;
    Train { run_deviation: none, wander: none, warm_up: none, ..Train::draw(seed, LawFamily::Constant) }
}

/// Mean speed between the first and the last time a sensor closed.
fn over_whole_laps(run: &SimulatedRun, lap: Length) -> f64 {
    let closed = run.truth.reports.iter().filter(|report| report.first && report.cause == Cause::Train);
    let at_one: Vec<_> = closed.filter(|report| report.sensor == SensorId(0)).collect();
    let laps = (at_one.len() - 1) as f64;
    laps * lap.as_mm() / (at_one[at_one.len() - 1].closed - at_one[0].closed).as_s()
}

#[test]
fn a_lap_takes_the_sum_of_its_curves_and_straights() {
    let layout = oval();
    for seed in 0..10 {
        let yard = Yard::new(&layout, even_tempered(seed), seed);
        for approach in [Approach::Below, Approach::Above] {
            let run = yard.run(&Script::running(0, step(12), approach, seconds(120)), seed);
            let found = over_whole_laps(&run, yard.railway.circuit_length());
            let lap = yard.railway.lap_speed(&yard.train, step(12), approach).as_mm_per_s();
            // Dirty spots slow the train by 15 % over 15 mm each, which the closed sum does not include.
            assert!((found / lap - 1.0).abs() < 0.003, "seed {seed}: {found} instead of {lap} mm/s");
        }
    }
}

#[test]
fn runs_differ_by_the_given_deviation() {
    let layout = oval();
    let asked = 0.006;
    let train = Train { run_deviation: Ratio::from_parts(asked), ..even_tempered(2) };
    let yard = Yard::new(&layout, train, 2);
    let script = Script::running(0, step(10), Approach::Below, seconds(30));
    let lap = yard.railway.circuit_length();
    let speeds: Vec<f64> = (0..200).map(|seed| over_whole_laps(&yard.run(&script, seed), lap)).collect();
    let mean = speeds.iter().sum::<f64>() / 200.0;
    let sd = (speeds.iter().map(|speed| (speed / mean - 1.0).powi(2)).sum::<f64>() / 199.0).sqrt();
    // Four standard errors of a standard deviation of 200.
    assert!((sd / asked - 1.0).abs() < 4.0 / 19.9, "{sd}");
}

#[test]
fn light_gates_measure_the_local_speed_to_a_millisecond() {
    let layout = oval();
    let yard = Yard::new(&layout, even_tempered(3), 3);
    let script = Script { has_gates: true, ..Script::running(0, step(9), Approach::Below, seconds(60)) };
    let run = yard.run(&script, 3);
    assert!(run.gates.len() >= 8);
    let level = yard.train.speeds.speed(step(9), Approach::Below).as_mm_per_s();
    for pair in run.gates.chunks_exact(2) {
        assert_eq!([pair[0].gate, pair[1].gate], [1, 0]);
        assert_eq!(pair[0].time.as_ns() % 1_000_000, 0);
        let took = (pair[1].time - pair[0].time).as_s();
        // Two times rounded to 1 ms, and curves and dirt at the gates.
        let (fast, slow) = (20.0 / (level * 1.03) - 1.1e-3, 20.0 / (level * 0.9) + 1.1e-3);
        assert!((fast..slow).contains(&took), "{took} s for 20 mm at {level} mm/s");
    }
}

#[test]
fn a_cold_train_changes_its_speed_as_it_warms() {
    let layout = oval();
    let warms = Train { warm_up: Ratio::from_percent(4.0), ..even_tempered(8) };
    let yard = Yard::new(&layout, warms, 8);
    let run = yard.run(&Script::running(0, step(10), Approach::Below, seconds(1200)), 8);
    let early = run.truth.motion.distance(run.truth.motion.begins() + seconds(60));
    let late = run.truth.motion.distance(run.truth.motion.ends())
        - run.truth.motion.distance(run.truth.motion.ends() - seconds(60));
    // Half warm at the start, so half of 4 %, of which a minute has already taken up to a fifth.
    let gained = late / early - 1.0;
    assert!((0.008..0.022).contains(&gained), "{gained}");
}
