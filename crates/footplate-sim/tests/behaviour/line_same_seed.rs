//! A seed means one run of a scenario, today and later: what is recorded and what is true are pinned here.

use footplate_core::{TimeSpan, Timestamp};
use footplate_sim::line::{LineConditions, LineRun, LineScenario, Turned};

/// A fingerprint of all samples and all truth (FNV-1a, 64 bits).
fn fingerprint(run: &LineRun) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut take = |number: i64| {
        for byte in number.to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    };
    for sample in &run.samples {
        take(sample.time.as_ns());
        for wheel in &sample.wheels {
            take(wheel.pulses.unwrap_or(-1));
            take(wheel.counter.unwrap_or(-1));
            take(wheel.turned.map_or(0, |turned| if turned == Turned::Forward { 1 } else { -1 }));
            take(wheel.last_edge.map_or(-1, Timestamp::as_ns));
        }
        take(sample.effort.to_bits() as i64);
        take(sample.acceleration.map_or(0, |a| a.as_m_per_s2().to_bits() as i64));
        take(sample.balise.map_or(0, |place| place.as_m().to_bits() as i64));
    }
    for truth in &run.truth {
        take(truth.speed.as_m_per_s().to_bits() as i64);
        take(truth.distance.as_m().to_bits() as i64);
        take(truth.acceleration.as_m_per_s2().to_bits() as i64);
        truth.wheel_speeds.iter().for_each(|speed| take(speed.as_m_per_s().to_bits() as i64));
    }
    take(run.events.len() as i64);
    hash
}

/// What seeds 7, 8, 9 … made when this was last changed on purpose.
const PINNED: [u64; 25] = [
    0x0b9d_d5a9_da8f_f4ff,
    0xd216_d65f_9df4_fc5e,
    0x358e_ee5f_bb7d_e30f,
    0xba99_1128_a0af_4089,
    0xce51_c8e1_9063_1524,
    0xc475_cddf_7990_598b,
    0x9cdd_8c20_2c77_dc5b,
    0xf3d9_054a_536c_a8c2,
    0xfff7_81a3_ed21_40bc,
    0xf889_080e_26ae_f307,
    0xb580_1bbb_8c56_0529,
    0x6506_856b_1bc0_6e92,
    0xb9d9_f5ee_7ce1_c030,
    0x2fdd_0de4_eade_716f,
    0x8bb0_fe4a_8de5_e771,
    0x34ee_8c6a_72fc_556e,
    0xea10_4b9f_a6e0_a39a,
    0x203f_22f3_f8c1_d1f4,
    0xa0aa_e430_3922_5e80,
    0x12cb_e5f0_f499_2a5e,
    0xa06c_b520_b9af_4317,
    0x7a31_eff8_e753_2c3f,
    0x9980_a57c_7e31_124d,
    0xccb7_501c_7708_4596,
    0xd18c_e34f_229c_80fd,
];

#[test]
fn the_runs_of_known_seeds_are_the_pinned_ones() {
    let conditions = LineConditions { inertial_sensor: true, ..LineConditions::default() };
    let mut found = Vec::new();
    for (seed, (scenario, pinned)) in (7..).zip(LineScenario::all().iter().zip(PINNED)) {
        let now = fingerprint(&scenario.run(seed, conditions));
        if now != pinned {
            found.push(format!("{}: {now:#018x}", scenario.name()));
        }
    }
    assert!(found.is_empty(), "other runs than before; if that is meant, pin them:\n{}", found.join("\n"));
}

#[test]
fn how_a_run_is_recorded_does_not_change_what_happens() {
    for name in ["N2", "S1", "S3", "S6"] {
        let scenario = LineScenario::by_name(name).unwrap();
        let plain = scenario.run(3, LineConditions::default());
        let other = LineConditions { teeth: 200, inertial_sensor: true, ..LineConditions::default() };
        assert_eq!(plain.truth, scenario.run(3, other).truth, "{name}");
        // Another period divides time into the same steps, but begins that much earlier or later.
        let slower = LineConditions { period: TimeSpan::from_ms(100), ..LineConditions::default() };
        let way = |run: &LineRun| run.truth.last().unwrap().distance.as_m();
        let slower = scenario.run(3, slower);
        assert!((way(&plain) - way(&slower)).abs() < 0.02 * way(&plain), "{name}");
    }
}

#[test]
fn seeds_differ() {
    for scenario in ["N5", "S1", "S2", "S5", "F3"].map(|name| LineScenario::by_name(name).unwrap()) {
        let of = |seed| fingerprint(&scenario.run(seed, LineConditions::default()));
        assert_ne!(of(1), of(2), "{}", scenario.name());
    }
}
