//! Running times of real trains agree with those of TrainRuns.jl, another program with the same literature behind it.
//!
//! That program steps forward by 20 m with the acceleration of the step's begin. While a train gathers speed its
//! acceleration falls, so that such a step overestimates it, and its running times are too short. Two questions are
//! therefore kept apart: do both know the same forces, and does ours integrate them well?

use std::path::PathBuf;

use footplate_core::{Length, Speed, TimeSpan};
use footplate_sim::line::{DrivingPhase, Journey, LineProfile, Style, Train};
use footplate_store::{read_line, read_train};

/// One row of `reference_points.csv`.
struct Point {
    train: String,
    line: String,
    behaviour: String,
    at_m: f64,
    speed: f64,
    time: f64,
    acceleration: f64,
}

fn testdata(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../testdata").join(path)
}

fn rows(file: &str) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(testdata("running-times").join(file)).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(ToOwned::to_owned).collect()).collect()
}

fn points() -> Vec<Point> {
    let rows = rows("reference_points.csv");
    assert_eq!(rows.len(), 38);
    let point = |row: &Vec<String>| {
        let number = |column: usize| row[column].parse::<f64>().unwrap();
        Point {
            train: row[0].clone(),
            line: row[1].clone(),
            behaviour: row[2].clone(),
            at_m: number(4),
            speed: number(5),
            time: number(6),
            acceleration: number(7),
        }
    };
    rows.iter().map(point).collect()
}

/// The train as a point, which is what the reference computes with.
fn train(name: &str) -> Train {
    let path = testdata(&format!("trains/trainruns_{name}.yaml"));
    Train { weight_length: Length::ZERO, ..read_train(&path, None).unwrap().train }
}

fn line(name: &str) -> LineProfile {
    read_line(&testdata(&format!("lines/trainruns_{name}.yaml")), None).unwrap().line
}

/// What pulling with all it has gives the train (m/s²).
fn pulling(train: &Train, line: &LineProfile, at_m: f64, speed: f64) -> f64 {
    let speed = Speed::from_m_per_s(speed);
    let against = train.line_force(line, Length::from_m(at_m));
    train.acceleration(train.tractive_effort.at(speed), against, speed).as_m_per_s2()
}

/// Where a train is that pulls with all it has from rest, in steps as the reference makes them: `step` m long, with
/// the acceleration of the begin, ending at each place where something changes or is asked for. Gives (m, m/s, s).
fn stepped(train: &Train, line: &LineProfile, asked: &[f64], step: f64) -> Vec<(f64, f64, f64)> {
    let borders = line.gradient().steps().map(|(at, _)| at.as_m());
    let mut ends: Vec<f64> = asked.iter().copied().chain(borders).filter(|at| *at > 0.0).collect();
    ends.sort_by(f64::total_cmp);
    ends.dedup();
    let (mut at, mut speed, mut time) = (0.0, 0.0, 0.0);
    let mut passed = Vec::new();
    for end in ends {
        while at < end {
            let way = step.min(end - at);
            let squared = speed * speed + 2.0 * pulling(train, line, at, speed) * way;
            let reached = squared.sqrt();
            time += 2.0 * way / (speed + reached);
            speed = reached;
            // The last step ends at the place to the last bit.
            at = if way == step { at + step } else { end };
        }
        if asked.contains(&end) {
            passed.push((end, speed, time));
        }
    }
    passed
}

/// The points of a run before the train first does anything but pull; on the line with limits it meets one of 60
/// km/h beyond 5000 m, between two points.
fn pulled(train: &str, line: &str) -> Vec<Point> {
    let of_run = points().into_iter().filter(|point| point.train == train && point.line == line);
    let pulls =
        |point: &Point| point.behaviour == "accelerating" && (line != "speed" || point.at_m <= 5000.0);
    of_run.take_while(pulls).collect()
}

const RUNS: [(&str, &str); 6] = [
    ("freight", "const"),
    ("freight", "slope"),
    ("freight", "speed"),
    ("local", "const"),
    ("local", "slope"),
    ("local", "speed"),
];

#[test]
fn both_know_the_same_forces() {
    let mut compared = 0;
    for point in points().iter().filter(|point| point.behaviour == "accelerating") {
        let a = pulling(&train(&point.train), &line(&point.line), point.at_m, point.speed);
        // The reference prints five digits of the acceleration and four of the speed, and the steepest curve of
        // effort over speed makes 1.3e-5 m/s² of half a digit of that.
        let digits = 0.5e-5 + 1.5e-5;
        assert!(
            (a - point.acceleration).abs() < digits,
            "{} {} {}: {a}",
            point.train,
            point.line,
            point.at_m
        );
        compared += 1;
    }
    assert_eq!(compared, 26);
}

#[test]
fn in_steps_as_the_reference_makes_them_the_same_numbers_come_out() {
    let mut compared = 0;
    for (train_name, line_name) in RUNS {
        let expected = pulled(train_name, line_name);
        let asked: Vec<f64> = expected.iter().map(|point| point.at_m).collect();
        let passed = stepped(&train(train_name), &line(line_name), &asked, 20.0);
        for (point, (at, speed, time)) in expected.iter().zip(&passed) {
            let of = format!("{train_name} {line_name} {at} m: {speed} m/s, {time} s");
            // What is left is rounding: the reference prints 0.1 mm/s and 1 ms.
            assert!((speed - point.speed).abs() < 1e-4, "{of}");
            assert!((time - point.time).abs() < 2e-3, "{of}");
            compared += 1;
        }
    }
    assert_eq!(compared, 23);
}

#[test]
fn steps_made_small_lead_to_our_times() {
    for (train_name, line_name) in RUNS {
        let (train, line) = (train(train_name), line(line_name));
        let asked: Vec<f64> = pulled(train_name, line_name).iter().map(|point| point.at_m).collect();
        let run = Journey::run(&train, &line, Style::FASTEST, TimeSpan::from_ms(10)).unwrap();
        for (at, speed, time) in stepped(&train, &line, &asked, 0.05) {
            let ours = run.passing(Length::from_m(at)).unwrap();
            let (late, faster) = (ours.time.as_s() - time, ours.speed.as_m_per_s() - speed);
            // Steps of 0.05 m are still too fast by about a 400th of what steps of 20 m are, and the first of them,
            // from rest, by more.
            assert!(late.abs() < 0.1, "{train_name} {line_name} {at} m: {late} s");
            assert!(faster.abs() < 1e-3, "{train_name} {line_name} {at} m: {faster} m/s");
        }
    }
}

#[test]
fn running_times_differ_by_what_steps_of_20_m_make() {
    let style = Style { response: TimeSpan::from_ms(100), ..Style::FASTEST };
    for row in rows("reference_running_times.csv") {
        let (train, line, reference) = (train(&row[0]), line(&row[1]), row[2].parse::<f64>().unwrap());
        let time = Journey::run(&train, &line, style, TimeSpan::from_ms(10)).unwrap().time().as_s();
        // Steps of 20 m take 1.9 s off the first kilometre of the local train and 2.6 s off that of the freight
        // train, as the two tests above show; what follows adds at most half as much again.
        let share = (time - reference) / reference;
        assert!((0.0..0.006).contains(&share), "{} {}: {time} s, {reference} s", row[0], row[1]);
    }
}

#[test]
fn the_train_does_where_the_reference_does() {
    for (train_name, line_name) in RUNS {
        let (train, line) = (train(train_name), line(line_name));
        let run = Journey::run(&train, &line, Style::FASTEST, TimeSpan::from_ms(10)).unwrap();
        let of_run =
            points().into_iter().filter(|point| point.train == train_name && point.line == line_name);
        for point in of_run {
            let ours = run.passing(Length::from_m(point.at_m)).unwrap();
            let of = format!("{train_name} {line_name} {} m: {ours:?}", point.at_m);
            let phase = match point.behaviour.as_str() {
                "accelerating" => DrivingPhase::Accelerating,
                "cruising" => DrivingPhase::Cruising,
                _ => DrivingPhase::Braking,
            };
            // Where a limit falls, one thing ends and the next begins.
            let is_border = line.speed_limit().steps().any(|(at, _)| at.as_m() == point.at_m);
            assert!(ours.phase == phase || is_border, "{of}");
            assert!((ours.speed.as_m_per_s() - point.speed).abs() < 0.2, "{of}");
            assert!((0.0..4.0).contains(&(ours.time.as_s() - point.time)), "{of}");
        }
    }
}
