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
        take(sample.effort.unwrap_or(f64::NAN).to_bits() as i64);
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
    0xb737_522b_e418_2261,
    0x35c7_c7c3_6388_a85a,
    0x9fe6_ad60_8d3e_9ab3,
    0x179a_cec4_5b11_8905,
    0x24e7_2a8b_9768_730f,
    0x6e80_44d0_c0ac_485e,
    0x747b_1aca_4b8d_f529,
    0x3cc5_ed82_6020_c51b,
    0x986a_9022_d7c4_a0a4,
    0xb586_09cd_43c3_d354,
    0xf798_4153_8db1_0f0d,
    0xcbbd_82a2_9773_e619,
    0xb8cf_4442_f599_0764,
    0x275f_9f46_db92_6571,
    0xecf5_fd31_5cee_66d4,
    0xe2ba_e7f6_8479_e3cf,
    0x3753_02e1_94b0_3400,
    0x9d15_24bc_40c8_34b3,
    0xf844_3b8f_fe1b_e09f,
    0x202d_8cd7_0558_8927,
    0x3ed5_3b26_8908_485c,
    0xd781_489e_c814_0d83,
    0x20a6_8b4c_397b_f279,
    0xd9af_2466_c2c9_9f67,
    0x8d38_923b_208a_a830,
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
        let distance = |run: &LineRun| run.truth.last().unwrap().distance.as_m();
        let slower = scenario.run(3, slower);
        assert!((distance(&plain) - distance(&slower)).abs() < 0.02 * distance(&plain), "{name}");
    }
}

#[test]
fn seeds_differ() {
    for scenario in ["N5", "S1", "S2", "S5", "F3"].map(|name| LineScenario::by_name(name).unwrap()) {
        let of = |seed| fingerprint(&scenario.run(seed, LineConditions::default()));
        assert_ne!(of(1), of(2), "{}", scenario.name());
    }
}
