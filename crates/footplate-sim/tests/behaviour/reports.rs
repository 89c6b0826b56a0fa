//! Every report comes from a closed sensor, delayed by the polls only.

use std::collections::BTreeMap;

use footplate_core::{Approach, EventKind, Ratio, SensorId, TimeSpan};
use footplate_sim::{Cause, LawFamily, Link, Script, SimulatedRun, Train};

use crate::oval::{Yard, oval, seconds, step};

fn steady(yard: &Yard<'_>, seed: u64) -> SimulatedRun {
    yard.run(&Script::running(2, step(11), Approach::Below, seconds(60)), seed)
}

#[test]
fn sensors_close_at_times_uniform_between_two_readings() {
    let layout = oval();
    let mut parts: Vec<f64> = Vec::new();
    for seed in 0..30 {
        let yard = Yard::new(&layout, Train::draw(seed, LawFamily::Constant), seed);
        for report in steady(&yard, seed).truth.reports.iter().filter(|report| report.first) {
            if report.cause == Cause::Train {
                let span = (report.reading - report.reading_before).as_s();
                parts.push((report.reading - report.closed).as_s() / span);
            }
        }
    }
    parts.sort_by(f64::total_cmp);
    let n = parts.len() as f64;
    let worst = parts.iter().enumerate().map(|(rank, part)| (part - (rank as f64 + 0.5) / n).abs());
    let distance = worst.fold(0.0, f64::max);
    assert!(n > 500.0, "only {n} reports");
    // Kolmogorov and Smirnov: beyond 1.95 / √n once in a thousand.
    assert!(distance < 1.95 / n.sqrt(), "{distance} from uniform with {n} reports");
}

#[test]
fn a_sensor_is_reported_while_the_shoe_is_on_it_at_its_true_place() {
    let layout = oval();
    let yard = Yard::new(&layout, Train::draw(3, LawFamily::Lag), 3);
    let run = steady(&yard, 3);
    let motion = &run.truth.motion;
    for report in run.truth.reports.iter().filter(|report| report.cause == Cause::Train) {
        let closed_at = motion.distance(report.closed).as_mm();
        let nearest = motion.sensors().filter(|(sensor, _)| *sensor == report.sensor);
        let off = nearest.map(|(_, at)| (at.as_mm() - closed_at).abs()).fold(f64::INFINITY, f64::min);
        assert!(off < 1e-3, "{} closed {off} mm from its place", report.sensor);
        // Still under the shoe at the previous reading, or closed since then.
        let held_until = motion.distance(report.reading_before).as_mm() - closed_at;
        assert!(held_until <= yard.train.shoe.as_mm() + 1e-3, "{held_until} mm past the sensor");
        let EventKind::Sensor(written) = run.events[report.event].kind else { panic!("no report") };
        assert_eq!(written.sensor, report.sensor);
        let late = run.events[report.event].time - report.reading;
        assert_eq!(late.as_ns() / 1000, yard.link.reading_to_stamp.as_ns() / 1000);
    }
    // At 400 mm/s and 65 ms, a latched shoe of 25 to 45 mm is seen by two or three polls.
    let repeats = run.truth.reports.iter().filter(|report| !report.first).count();
    assert!(repeats * 2 > run.truth.reports.len());
}

#[test]
fn events_are_in_order_of_time_and_repeats_are_optional() {
    let layout = oval();
    let mut yard = Yard::new(&layout, Train::draw(5, LawFamily::Momentum), 5);
    yard.link = Link { intervals: true, ..Link::first_reports() };
    yard.faults.missed = Ratio::from_percent(10.0);
    yard.faults.spurious_per_minute = 5.0;
    let run = steady(&yard, 5);
    assert!(run.events.is_sorted_by_key(|event| event.time));
    assert!(run.truth.reports.iter().all(|report| report.first));
    assert!(run.truth.reports.iter().any(|report| report.cause == Cause::Spurious));
    for event in &run.events {
        if let EventKind::Sensor(report) = event.kind {
            let interval = report.poll_interval.expect("this program records intervals");
            assert!((interval - TimeSpan::from_us(69_640)).abs() < TimeSpan::from_us(600));
        }
    }
}

#[test]
fn hop_times_vary_and_sensors_repeat_as_in_the_recordings() {
    let layout = oval();
    let (mut squares, mut count, mut passed, mut reported) = (0.0, 0, 0, 0);
    for seed in 0..12 {
        let yard = Yard::new(&layout, Train::draw(seed, LawFamily::Constant), seed);
        let speed = yard.train.speeds.speed(step(13), Approach::Below).as_mm_per_s();
        let run = yard.run(&Script::running(2, step(13), Approach::Below, seconds(60)), seed);
        let own: Vec<_> = run.truth.reports.iter().filter(|report| report.cause == Cause::Train).collect();
        let first: Vec<_> = own.iter().filter(|report| report.first).collect();
        (passed, reported) = (passed + first.len(), reported + own.len());
        // The same hop lap after lap: relative to its own mean, only the variation remains.
        let mut hops: BTreeMap<SensorId, Vec<f64>> = BTreeMap::new();
        for pair in first.windows(2) {
            let took = (run.events[pair[1].event].time - run.events[pair[0].event].time).as_s();
            hops.entry(pair[0].sensor).or_default().push(took * speed);
        }
        for times in hops.values() {
            let mean = times.iter().sum::<f64>() / times.len() as f64;
            squares += times.iter().map(|time| (time - mean).powi(2)).sum::<f64>();
            count += times.len() - 1;
        }
    }
    // Real hops vary by 11 to 15 mm about a constant speed. At step 14, four real trains caused 192 reports in 97
    // passages, 1.7 to 2.2 per train.
    let scatter = (squares / count as f64).sqrt();
    assert!((11.0..16.0).contains(&scatter), "{scatter} mm");
    let repeats = reported as f64 / passed as f64;
    assert!((1.7..2.2).contains(&repeats), "{repeats} reports a passing");
}

#[test]
fn the_same_seed_is_the_same_run() {
    let layout = oval();
    let yard = Yard::new(&layout, Train::draw(9, LawFamily::Mixed), 9);
    assert_eq!(steady(&yard, 9), steady(&yard, 9));
    assert_ne!(steady(&yard, 9).events, steady(&yard, 10).events);
}
