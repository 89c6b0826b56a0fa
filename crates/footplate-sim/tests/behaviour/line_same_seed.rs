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
    0x5eb8_e0d1_67c8_784d,
    0x50ac_f448_33da_a166,
    0x2250_0e40_7542_3e62,
    0xa362_c36c_bd53_ca7a,
    0xb10f_8e82_d731_6553,
    0x6e80_44d0_c0ac_485e,
    0x1347_3a32_4f27_7a2a,
    0x328b_94d3_4d02_31c4,
    0xc938_3fb1_5e79_ce66,
    0xd3a4_46cf_11d9_eec4,
    0x7f95_aea6_8a05_b8e2,
    0xf61d_1db5_81e1_f6be,
    0x3613_37b3_3a85_cedd,
    0x965e_c41a_3f89_f885,
    0x7494_4a6e_f4aa_76c4,
    0x77c4_1ef3_999c_dca6,
    0xafb3_4977_26ea_4a64,
    0xc1a6_99b7_4842_b5be,
    0x3d31_4f3e_c3f6_6dc1,
    0xda61_1096_fe0d_a3ef,
    0x0e0b_9925_b280_5a9e,
    0x7753_3ed0_9568_4678,
    0x6e38_a52c_6404_7b1c,
    0x1117_7f3b_40f8_8c9d,
    0xc316_3ed5_b006_df7d,
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
