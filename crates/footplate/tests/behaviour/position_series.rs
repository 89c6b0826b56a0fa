//! `footplate calibrate --from` a series of positions: four filmed stops, trains whose truth is known, and bad files.

use std::path::Path;

use serde_json::Value;

use crate::program::{assert_not_calibrated, footplate, written};

/// Stops of a filmed train, a pixel written as a millimetre (testdata/position-series).
fn filmed(number: u32) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/position-series");
    folder.join(format!("cs452_2015_stop_{number}.csv")).display().to_string()
}

fn fitted(path: &str) -> Value {
    let done = footplate(&["calibrate", "--from", path, "--json"]);
    assert_eq!(done.status, 0, "{}", done.errors);
    let report: Value = serde_json::from_str(&done.output).expect("JSON");
    report["series"][0].clone()
}

fn number(fit: &Value, name: &str) -> [f64; 2] {
    ["value", "uncertainty"].map(|part| fit[name][part].as_f64().expect("a number"))
}

#[test]
fn lag_and_friction_fit_filmed_stops_far_better_than_an_even_rate() {
    for stop in 1..=4 {
        let fit = fitted(&filmed(stop));
        assert_eq!(fit["change"], "stop");
        let residual = fit["residual_rms_mm"].as_f64().expect("a number");
        let even = fit["even_residual_rms_mm"].as_f64().expect("a number");
        assert!(residual < 3.0, "stop {stop}: {residual} pixels");
        assert!(even > 2.0 * residual, "stop {stop}: {residual} pixels, at an even rate {even}");
    }
}

/// A train that slows down by a law that is not of the fit: a quadratic drag and constant friction, in steps of 1 ms, with
/// a tracker's noise. Returns the file's text, and how far the train got since the brakes took effect.
fn other_physics(seed: u32) -> (String, f64) {
    const STEP_S: f64 = 0.001;
    const EFFECT_S: f64 = 1.0;
    let (mut text, mut position, mut speed, mut braked) = ("t_s,position_mm\n".to_owned(), 0.0, 480.0, 0.0);
    let mut state = u64::from(seed);
    for tick in 0..5_000_u32 {
        let time = f64::from(tick) * STEP_S;
        if tick % 20 == 0 {
            // Three uniform draws add up to a bell of a standard deviation of 0.5, scaled to 0.6 mm.
            let noise: f64 = (0..3).map(|_| drawn(&mut state)).sum::<f64>() * 1.2;
            text += &format!("{time:.3},{:.3}\n", position + noise);
        }
        if time >= EFFECT_S {
            speed = (speed - STEP_S * (40.0 + 1.0 * speed + 0.001 * speed * speed)).max(0.0);
            braked += speed * STEP_S;
        }
        position += speed * STEP_S;
    }
    (text, braked)
}

/// From −0.5 to 0.5 (Knuth's MMIX generator).
fn drawn(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 40) as f64 / f64::from(1_u32 << 24) - 0.5
}

#[test]
fn the_speed_of_a_train_of_other_physics_is_within_2_mm_per_s() {
    for seed in 1..=8 {
        let (text, _) = other_physics(seed);
        let fit = fitted(&written(&format!("position_series-drag{seed}.csv"), &text).display().to_string());
        let [speed, deviation] = number(&fit, "speed_mm_per_s");
        // Its ± supposes that the law holds, which it does not here.
        assert!((speed - 480.0).abs() < 2.0, "{speed} ± {deviation}");
        assert!(deviation < 1.0, "{speed} ± {deviation}");
    }
}

#[test]
fn the_stop_of_a_train_of_other_physics_is_within_its_uncertainty() {
    for seed in 1..=8 {
        let (text, braked) = other_physics(seed);
        let fit = fitted(&written(&format!("position_series-rest{seed}.csv"), &text).display().to_string());
        let [effect, effect_deviation] = number(&fit, "effect_s");
        let [way, deviation] = number(&fit, "stopping_distance_mm");
        assert!((effect - 1.0).abs() < 3.0 * effect_deviation, "{effect} ± {effect_deviation}");
        assert!((way - braked).abs() < 3.0 * deviation, "{way} ± {deviation}, true {braked}");
    }
}

#[test]
fn a_start_is_found_and_backwards_is_like_forwards() {
    let mut text = "t_s,position_mm\n".to_owned();
    for tick in 0..200_u32 {
        let time = f64::from(tick) * 0.02;
        let since = (time - 1.0).max(0.0);
        // A lag of 0.4 s to 300 mm/s, running down the tape.
        let position = 900.0 - 300.0 * (since - 0.4 * (1.0 - (-since / 0.4).exp()));
        text += &format!("{time:.2},{position:.4}\n");
    }
    let fit = fitted(&written("position_series-start.csv", &text).display().to_string());
    assert_eq!(fit["change"], "start");
    let [speed, _] = number(&fit, "speed_mm_per_s");
    let [lag, _] = number(&fit, "lag_s");
    let [effect, _] = number(&fit, "effect_s");
    assert!((speed - 300.0).abs() < 1.0 && (lag - 0.4).abs() < 0.02 && (effect - 1.0).abs() < 0.02);
}

#[test]
fn bad_series_are_refused_with_their_place_and_what_would_be_right() {
    let rows = |place: fn(u32) -> u32| {
        (0..40).map(|row| format!("{}.{},{}\n", row / 10, row % 10, place(row))).collect::<String>()
    };
    let cases = [
        ("backwards", "t_s,position_mm\n0.1,3\n0.1,4\n".to_owned(), "line 3"),
        ("missing", "time,position_mm\n0,1\n".to_owned(), "missing column `t_s`"),
        ("words", "t_s,position_mm\n0,here\n".to_owned(), "`here`"),
        ("one", "t_s,position_mm\n0,1\n".to_owned(), "1 positions are too few"),
        ("none", "t_s,position_mm\n".to_owned(), "0 positions are too few"),
        ("stands", format!("t_s,position_mm\n{}", rows(|_| 12)), "stood all the time"),
        (
            "steady",
            format!("t_s,position_mm\n{}", rows(|row| 40 * row)),
            "cut the series to one start or one stop",
        ),
        ("metres", "t_s,position_mm\n0,0\n1,90000\n".to_owned(), "a place in millimetres"),
        ("infinite", "t_s,position_mm\n0,inf\n".to_owned(), "`inf`"),
        ("cut_off", "t_s,position_mm\n0,1\n1".to_owned(), "the line breaks off"),
    ];
    for (name, text, expected) in cases {
        assert_not_calibrated(&format!("position_series-{name}.csv"), &text, expected);
    }
}

#[test]
fn a_series_with_options_of_sensor_logs_is_refused() {
    let done = footplate(&["calibrate", "--from", &filmed(1), "--layout", "track-a"]);
    assert_ne!(done.status, 0);
    assert!(done.errors.contains("--layout does not work with a series"), "{}", done.errors);
}
