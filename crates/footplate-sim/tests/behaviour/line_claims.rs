//! What a vehicle file says of a simulated train is true of it: an odometer may build on that.

use footplate_sim::line::{LineConditions, LineLevel, LineRun, LineScenario, LineWorld, WheelTruth};

const SEEDS: u64 = 4;

/// Every motion, each with a few seeds: all faults but the clock's happen to the same journey.
fn each_run(mut check: impl FnMut(&str, u64, &LineRun)) {
    for scenario in LineScenario::all() {
        let is_new = !scenario.name().starts_with('F') || ["F1", "F9"].contains(&scenario.name());
        for seed in 0..if is_new { SEEDS } else { 0 } {
            check(scenario.name(), seed, &scenario.run(seed, LineConditions::default()));
        }
    }
}

#[test]
fn no_train_does_more_than_is_claimed_of_it() {
    each_run(|name, seed, run| {
        let vehicle = &run.vehicle;
        for truth in &run.truth {
            let speed = truth.speed.as_m_per_s();
            let along = truth.acceleration.as_m_per_s2() * if speed < 0.0 { -1.0 } else { 1.0 };
            assert!(speed.abs() <= vehicle.max_speed.as_m_per_s(), "{name} {seed}: {speed} m/s");
            assert!(
                along <= vehicle.max_traction.as_m_per_s2(),
                "{name} {seed}: {along} m/s² at {speed} m/s"
            );
            assert!(-along <= vehicle.max_brake.as_m_per_s2(), "{name} {seed}: {along} m/s² at {speed} m/s");
        }
        // Nor from sample to sample, so that a jump between them would be noticed.
        for pair in run.truth.windows(2) {
            let gained = (pair[1].speed - pair[0].speed).as_m_per_s() / 0.05;
            // A recorder that reads late has waited for up to twice as long; one that lost rows for longer.
            if name != "F9" {
                assert!(gained.abs() <= vehicle.max_brake.max(vehicle.max_traction).as_m_per_s2() + 1e-6);
            }
        }
    });
}

#[test]
fn a_brake_command_does_what_it_says_where_the_rail_carries_it() {
    // In these the rail lets the train down: by intention.
    const SLIPPERY: [&str; 3] = ["S3", "S7", "S8"];
    each_run(|name, seed, run| {
        if SLIPPERY.contains(&name) {
            return;
        }
        let brake = run.vehicle.brake_command;
        let (full, slope) = (brake.full.as_m_per_s2(), brake.gradient.as_m_per_s2());
        let resistance = brake.resistance.as_m_per_s2();
        let periods = (brake.build_up.as_s() / 0.05).ceil() as usize;
        let mut judged = 0;
        for (samples, truth) in run.samples.windows(periods + 1).zip(run.truth.iter().skip(periods)) {
            let efforts = samples.iter().map(|sample| sample.effort.expect("a command that is recorded"));
            let hardest = efforts.clone().fold(f64::INFINITY, f64::min);
            let softest = efforts.fold(f64::NEG_INFINITY, f64::max);
            if softest > 0.0 || hardest == 0.0 || truth.speed.as_m_per_s() < 0.01 {
                continue;
            }
            judged += 1;
            let deceleration = -truth.acceleration.as_m_per_s2();
            let most = -hardest * full * (1.0 + brake.tolerance) + slope + resistance;
            let least = -softest * full * (1.0 - brake.tolerance) - slope;
            let at = samples[periods].time.as_s();
            assert!((least..=most).contains(&deceleration), "{name} {seed} at {at} s: {deceleration} m/s²");
        }
        // Three seconds at least; reversing and creeping trains brake least.
        assert!(judged > 60, "{name} {seed}: {judged}");
    });
}

#[test]
fn diameters_lie_within_their_tolerance_and_use_it() {
    for (name, tolerance) in [("S2", 0.001), ("S6", 0.001), ("N6", 0.012)] {
        let scenario = LineScenario::by_name(name).unwrap();
        let mut widest = 0.0_f64;
        for seed in 0..8 {
            let run = scenario.run(seed, LineConditions::default());
            for (true_one, assumed) in run.diameters.iter().zip(&run.vehicle.wheelsets) {
                let off = (true_one.as_m() / assumed.diameter.as_m() - 1.0).abs();
                assert_eq!(assumed.diameter_tolerance, tolerance);
                assert!(off <= tolerance);
                widest = widest.max(off);
            }
        }
        assert!(widest > 0.5 * tolerance, "{name}: {widest}");
        let exact = scenario.run(1, LineConditions { exact_diameters: true, ..LineConditions::default() });
        assert_eq!(exact.diameters, exact.vehicle.wheelsets.map(|wheelset| wheelset.diameter));
    }
}

#[test]
fn wheelsets_on_one_bogie_are_not_claimed_to_slide_apart() {
    // In S2, S4 and S5 one converter feeds both; in S6 as well where both are driven.
    each_run(|name, seed, run| {
        let both_driven = run.vehicle.wheelsets.iter().all(|wheelset| wheelset.is_powered);
        let on_one_bogie = ["S2", "S4", "S5"].contains(&name) || (name == "S6" && both_driven);
        assert_eq!(run.vehicle.independent, !on_one_bogie, "{name} {seed}");
    });
}

#[test]
fn no_energy_comes_from_nowhere() {
    each_run(|name, seed, run| {
        let energy = run.energy;
        let spent = energy.braked_j + energy.crept_j + energy.resisted_j + energy.climbed_j + energy.gained_j;
        let moved = energy.driven_j.abs() + energy.braked_j.abs() + energy.gained_j.abs();
        assert!((energy.driven_j - spent).abs() <= 1e-10 * moved, "{name} {seed}: {energy:?}");
        assert!(energy.braked_j > 0.0 && energy.resisted_j > 0.0, "{name} {seed}: {energy:?}");
        assert!(energy.crept_j > -1e-4 * moved, "{name} {seed}: {energy:?}");
    });
}

#[test]
fn acceleration_speed_and_distance_are_one_motion() {
    each_run(|name, seed, run| {
        for (at, pair) in run.truth.windows(2).enumerate() {
            let span = (run.samples[at + 1].time - run.samples[at].time).as_s();
            let distance = (pair[1].distance - pair[0].distance).as_m();
            let mean = 0.5 * (pair[0].speed + pair[1].speed).as_m_per_s();
            // Acceleration changes by at most 1 m/s² within a period; late rows last longer than they say.
            let slack = if name == "F9" { 0.06 * mean.abs() + 1e-2 } else { 0.25 * 0.05 * 0.05 };
            assert!((distance - mean * span).abs() <= slack, "{name} {seed} row {at}: {distance} m");
        }
        assert_eq!(run.truth[0].distance.as_m(), 0.0);
        assert_eq!(run.samples[0].time.as_ns(), 0);
        assert_eq!(run.truth.len(), run.samples.len());
    });
}

#[test]
fn wheels_roll_where_nothing_else_is_said() {
    each_run(|name, seed, run| {
        let rolls = run.truth.iter().all(|truth| truth.wheels == [WheelTruth::Rolling; 2]);
        let is_normal = name.starts_with(['N', 'F']) || name == "S4";
        if is_normal && name != "S4" {
            assert!(rolls, "{name} {seed}");
        } else if !is_normal {
            assert!(!rolls, "{name} {seed}");
        }
    });
}

#[test]
fn a_release_longer_than_any_operator_claims_does_not_hold() {
    // World 4155708: a converter takes wheels away under a command of less than 2 %, more than 120 s after the last brake.
    let world = LineWorld::draw(4_155_708);
    let holds = LineLevel::ALL.map(|level| world.claims_hold(&world.run(level)));
    assert_eq!(holds, [true, false, false], "without a command, brakes may always act");
}
