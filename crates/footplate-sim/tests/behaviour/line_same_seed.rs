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
    0x0422_3996_35a0_419f,
    0x6287_664a_d717_eabd,
    0x2e45_1ddb_b110_b0cf,
    0x6750_8f8a_fa0f_aca2,
    0x174e_477b_8e4f_3b49,
    0x6147_52f5_f35d_c562,
    0xdbed_c7e3_550f_770a,
    0xd4a3_edee_5160_c685,
    0xad99_eb45_d9a2_cf54,
    0x6d44_8142_e88f_f0b3,
    0x11e4_b03d_0fba_440a,
    0x44b3_1642_3972_65c5,
    0xd804_9e11_2698_5cdc,
    0xc70c_3ab4_8ee9_5648,
    0x56b2_ff1b_8fac_f5f1,
    0xfd7e_bbfd_c6ec_ab26,
    0xa79b_dcb9_34cf_b46c,
    0xfbce_df06_35ba_4141,
    0xa7cd_4f8f_6ace_c53f,
    0x73c2_56da_bedb_8740,
    0xf9a3_7077_76ad_fb2c,
    0x0ed1_21df_1af4_e9a9,
    0xb163_ac72_edd5_d260,
    0xb14b_59ad_c4fd_f9ea,
    0x5611_d336_1e4f_b5c1,
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
