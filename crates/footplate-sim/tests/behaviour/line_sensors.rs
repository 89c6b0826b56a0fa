//! What tachometers, balises and the inertial sensor say is what happened, less what each of them gets wrong.

use core::f64::consts::PI;

use footplate_core::TimeSpan;
use footplate_sim::line::{LineConditions, LineRun, LineScenario, Turned};

fn run_with(name: &str, seed: u64, conditions: LineConditions) -> LineRun {
    LineScenario::by_name(name).unwrap().run(seed, conditions)
}

fn run(name: &str, seed: u64) -> LineRun {
    run_with(name, seed, LineConditions::default())
}

/// The distance that a tachometer counted while the train moved, with the true diameter (m): a standing wheel can chatter.
fn counted(run: &LineRun, wheel: usize) -> f64 {
    let moving =
        run.samples.iter().zip(&run.truth).skip(1).filter(|(_, truth)| truth.speed.as_m_per_s() != 0.0);
    let pulses: i64 = moving.filter_map(|(sample, _)| sample.wheels[wheel].pulses).sum();
    pulses as f64 * PI * run.diameters[wheel].as_m() / f64::from(run.vehicle.wheelsets[wheel].teeth)
}

fn distance(run: &LineRun) -> f64 {
    run.truth.last().unwrap().distance.as_m()
}

#[test]
fn pulses_add_up_to_the_distance_with_every_wheel_and_period() {
    for (teeth, ms) in [(80, 50), (100, 20), (200, 100), (200, 20)] {
        let conditions = LineConditions { teeth, period: TimeSpan::from_ms(ms), ..LineConditions::default() };
        for (name, seed) in [("N1", 1), ("N2", 2), ("F8", 3)] {
            let run = run_with(name, seed, conditions);
            if name == "F8" {
                continue;
            }
            for wheel in [0, 1] {
                let (counted, distance) = (counted(&run, wheel), distance(&run));
                // Creepage on dry rail: a few hundredths of a percent, and a pulse at either end.
                let slack = 6e-4 * distance + 0.1;
                assert!(
                    (counted - distance).abs() < slack,
                    "{name} {teeth} {ms}: {counted} m of {distance} m"
                );
            }
        }
    }
}

#[test]
fn a_driven_wheel_runs_ahead_and_a_braked_one_lags_by_hundredths_of_a_percent() {
    // Accelerating for six minutes and braking for three: the driven wheel gains, the other only loses.
    let run = run("N1", 4);
    let [driven, trailing] = [0, 1].map(|wheel| counted(&run, wheel) / distance(&run) - 1.0);
    assert!((0.0..5e-4).contains(&driven), "{driven}");
    assert!((-4e-4..0.0).contains(&trailing), "{trailing}");
}

#[test]
fn counters_and_pulses_tell_the_same_story() {
    for (name, seed) in [("N2", 1), ("N5", 2), ("S3", 3)] {
        let run = run(name, seed);
        let modulus = run.vehicle.counter_modulus;
        let mut backward = 0;
        for pair in run.samples.windows(2) {
            for wheel in [0, 1] {
                let now = pair[1].wheels[wheel];
                let moved =
                    (now.counter.unwrap() - pair[0].wheels[wheel].counter.unwrap()).rem_euclid(modulus);
                let moved = if moved > modulus / 2 { moved - modulus } else { moved };
                let pulses = now.pulses.unwrap();
                // Both directions within a period add up in pulses and cancel in the counter.
                assert!(moved.abs() <= pulses && (pulses - moved) % 2 == 0, "{name}: {moved} {pulses}");
                backward += i64::from(moved < 0);
                if moved.abs() > 1 {
                    let expected = if moved > 0 { Turned::Forward } else { Turned::Backward };
                    assert_eq!(now.turned, Some(expected));
                }
            }
        }
        assert_eq!(backward > 50, name == "N5", "{name}: {backward} periods backward");
    }
}

#[test]
fn time_stamps_measure_speed_to_a_centimetre_a_second() {
    let run = run("N1", 6);
    let pitch = PI * run.diameters[1].as_m() / 100.0;
    let (mut squares, mut count) = (0.0, 0.0);
    for (rows, truth) in run.samples.windows(2).zip(run.truth.windows(2)) {
        let (before, now) = (rows[0].wheels[1], rows[1].wheels[1]);
        let (Some(from), Some(to), Some(pulses)) = (before.last_edge, now.last_edge, now.pulses) else {
            continue;
        };
        assert!(to <= rows[1].time && to > rows[0].time - TimeSpan::from_ms(50));
        // While it cruises.
        if truth[0].acceleration.as_m_per_s2().abs() < 0.02 && truth[0].speed.as_m_per_s() > 10.0 {
            let measured = pitch * pulses as f64 / (to - from).as_s();
            let wheel = 0.5 * (truth[0].wheel_speeds[1] + truth[1].wheel_speeds[1]).as_m_per_s();
            squares += (measured - wheel) * (measured - wheel);
            count += 1.0;
        }
    }
    assert!(count > 1000.0);
    let rms = libm::sqrt(squares / count);
    // Teeth of 0.5 % of a pitch of 27 mm over 50 ms, twice: 4 mm/s; eccentricity and jitter on top.
    assert!((0.003..0.02).contains(&rms), "{rms}");
}

#[test]
fn a_missing_tooth_costs_one_pulse_a_turn() {
    for seed in 0..3 {
        let faulty = run("F1", seed);
        let lost = 1.0 - counted(&faulty, 0) / distance(&faulty);
        assert!((lost - 0.01).abs() < 8e-4, "seed {seed}: {lost}");
        let sound = 1.0 - counted(&faulty, 1) / distance(&faulty);
        assert!(sound.abs() < 8e-4, "seed {seed}: {sound}");
    }
}

#[test]
fn a_dead_sensor_says_zero_from_the_time_the_events_name() {
    for seed in 0..3 {
        let run = run("F6", seed);
        let dead = run.events.first().unwrap().time;
        assert!((30.0..=70.1).contains(&dead.as_s()));
        for sample in run.samples.iter().filter(|sample| sample.time > dead) {
            assert_eq!(sample.wheels[1].pulses, Some(0));
        }
        let first: i64 = run.samples.iter().filter_map(|sample| sample.wheels[0].pulses).sum();
        assert!(first > 50_000);
    }
}

#[test]
fn a_bad_clock_loses_rows_and_stretches_time() {
    let run = run("F9", 2);
    let gaps =
        run.samples.windows(2).filter(|pair| pair[1].time - pair[0].time > TimeSpan::from_ms(60)).count();
    // 6600 rows, two in a thousand.
    assert!((3..=30).contains(&gaps), "{gaps}");
    assert!(run.samples.windows(2).all(|pair| pair[1].time > pair[0].time));
    // The counter has seen what the lost rows have not.
    let pulses = counted(&run, 0);
    assert!(pulses < distance(&run));
}

#[test]
fn balises_are_where_the_map_has_them() {
    let (mut read, mut kilometres) = (0, 0.0);
    for seed in 0..6 {
        let run = run("N6", seed);
        kilometres += distance(&run) / 1000.0;
        for (sample, pair) in run.samples[1..].iter().zip(run.truth.windows(2)) {
            if let Some(place) = sample.balise {
                read += 1;
                // Passed in this period or, by latency, in the one before; surveyed to 0.9 m at worst.
                let late = 0.012 * pair[1].speed.as_m_per_s();
                let from = (pair[0].distance - place).as_m() - late;
                let to = (pair[1].distance - place).as_m();
                assert!(from < 1.0 && to > -1.0, "seed {seed}: {from} to {to}");
            }
        }
        assert!(run.samples.iter().all(|sample| sample.acceleration.is_none()));
    }
    let apart = kilometres / f64::from(read);
    assert!((1.35..1.75).contains(&apart), "one every {apart} km");
}

#[test]
fn an_inertial_sensor_reads_acceleration_with_its_errors() {
    let conditions = LineConditions { inertial_sensor: true, ..LineConditions::default() };
    let mut biases = Vec::new();
    for seed in 0..6 {
        let run = run_with("S1", seed, conditions);
        let (mut error, mut squares) = (0.0, 0.0);
        let n = run.samples.len() as f64 - 1.0;
        for (sample, pair) in run.samples[1..].iter().zip(run.truth.windows(2)) {
            let gained = (pair[1].speed - pair[0].speed).as_m_per_s() / 0.05;
            let off = sample.acceleration.unwrap().as_m_per_s2() - gained;
            error += off / n;
            squares += off * off / n;
        }
        biases.push(error);
        let noise = libm::sqrt(squares - error * error);
        // White noise of 0.013 to 0.03 over a period, and vibration of up to 0.05 at 22 m/s.
        assert!((0.01..0.08).contains(&noise), "seed {seed}: {noise}");
    }
    // Bias, and gravity along a sensor that is one degree off: 0.17 m/s².
    assert!(biases.iter().all(|bias| bias.abs() < 0.55), "{biases:?}");
    assert!(biases.iter().any(|bias| bias.abs() > 0.02), "{biases:?}");
}
