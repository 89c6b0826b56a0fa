//! Wheels slip, slide and lock as they do on railways, at the times that the scenarios promise.

use footplate_sim::line::{LineConditions, LineEventKind, LineRun, LineScenario, WheelTruth};

fn run(name: &str, seed: u64) -> LineRun {
    LineScenario::by_name(name).unwrap().run(seed, LineConditions::default())
}

/// The sample at a time since the first (s).
fn row(run: &LineRun, time: f64) -> usize {
    run.samples.partition_point(|sample| sample.time.as_s() < time - 1e-6)
}

/// How much slower each wheelset is than the train, as part of its speed, row by row within a time.
fn slides(run: &LineRun, from: f64, to: f64) -> Vec<[f64; 2]> {
    let rows = &run.truth[row(run, from)..row(run, to)];
    rows.iter().map(|truth| truth.wheel_speeds.map(|wheel| 1.0 - wheel / truth.speed)).collect()
}

/// The mean acceleration of the train within a time (m/s²).
fn mean_acceleration(run: &LineRun, from: f64, to: f64) -> f64 {
    (run.truth[row(run, to)].speed - run.truth[row(run, from)].speed).as_m_per_s() / (to - from)
}

#[test]
fn a_long_slide_is_what_slide_protection_makes_of_it() {
    for seed in 0..12 {
        let run = run("S3", seed);
        // The brake comes on at 9 to 11 s and holds for a minute.
        let slides = slides(&run, 13.0, 68.0);
        let all = slides.iter().flatten();
        let mean = all.clone().sum::<f64>() / (2 * slides.len()) as f64;
        let most = all.copied().fold(0.0, f64::max);
        // A prototype of the same control: mean 7 %, at most 20 %, on 0.05.
        assert!((0.04..0.09).contains(&mean), "seed {seed}: mean slide {mean}");
        assert!((0.12..0.30).contains(&most), "seed {seed}: largest slide {most}");
        // A touch: one wheelset is within 1 % of the train after none was.
        let rolls: Vec<bool> = slides.iter().map(|two| two.iter().any(|slide| *slide < 0.01)).collect();
        let touches = rolls.windows(2).filter(|pair| !pair[0] && pair[1]).count();
        let apart = 55.0 / touches as f64;
        assert!((2.5..6.0).contains(&apart), "seed {seed}: a touch every {apart} s");
        let train = mean_acceleration(&run, 13.0, 68.0);
        assert!((-0.54..-0.42).contains(&train), "seed {seed}: {train} m/s²");
        assert!((run.truth[row(&run, 9.0)].speed.as_m_per_s() - 50.0).abs() < 0.3);
    }
}

/// When a wheelset began to do something (s), in order.
fn begins(run: &LineRun, wheelset: usize, what: WheelTruth) -> Vec<f64> {
    let times = run.events.iter().filter(|event| event.what == LineEventKind::Wheel { wheelset, does: what });
    times.map(|event| event.time.as_s()).collect()
}

#[test]
fn both_wheelsets_slide_touch_lock_and_stand_at_their_times() {
    for seed in 0..12 {
        let run = run("S2", seed);
        // The published times, five seconds later.
        let lead = 5.0;
        for wheelset in [0, 1] {
            let slides = begins(&run, wheelset, WheelTruth::Slide);
            let touch = begins(&run, wheelset, WheelTruth::Rolling)[0];
            let locked = begins(&run, wheelset, WheelTruth::Locked);
            assert!((slides[0] - lead - 0.65).abs() < 0.2, "seed {seed}: slides at {slides:?}");
            assert!((touch - lead - 1.95).abs() < 0.2, "seed {seed}: touches at {touch}");
            assert_eq!(locked.len(), 1, "seed {seed}");
            assert!((locked[0] - lead - 7.2).abs() < 0.3, "seed {seed}: locks at {locked:?}");
        }
        let stands = run.truth.iter().position(|truth| truth.speed.as_m_per_s() == 0.0).unwrap();
        let stands = run.samples[stands].time.as_s() - lead;
        assert!((14.0..18.0).contains(&stands), "seed {seed}: stands at {stands}");
        let train = mean_acceleration(&run, lead + 2.0, lead + 12.0);
        assert!((train + 0.33).abs() < 0.04, "seed {seed}: {train} m/s²");
        let at_touch = run.truth[row(&run, lead + 2.0)].speed.as_m_per_s();
        assert!((4.5..5.0).contains(&at_touch), "seed {seed}: {at_touch} m/s at the touch");
    }
}

#[test]
fn a_single_slide_leaves_the_other_wheelset_alone() {
    for (name, seed) in [("S1", 0), ("S1", 1), ("S1", 2), ("S1b", 0), ("S1b", 1), ("S1b", 2)] {
        let run = run(name, seed);
        let first = begins(&run, 0, WheelTruth::Slide);
        assert!((37.5..38.6).contains(&first[0]), "{name} {seed}: slides at {first:?}");
        assert!(run.truth.iter().all(|truth| truth.wheels[1] == WheelTruth::Rolling), "{name} {seed}");
        let locked = begins(&run, 0, WheelTruth::Locked);
        assert_eq!(locked.len(), usize::from(name == "S1b"), "{name} {seed}: locks at {locked:?}");
        let deepest = slides(&run, 38.0, 45.0).iter().map(|two| two[0]).fold(0.0, f64::max);
        assert!(deepest > 0.05, "{name} {seed}: {deepest}");
        // A powered wheelset of 160 to 260 kg m² takes a few seconds to lock from 20 m/s.
        assert!(locked.iter().all(|at| at - first[0] < 8.0), "{name} {seed}: {locked:?}");
    }
}

#[test]
fn a_drawn_away_bogie_gives_no_sign_but_its_deceleration() {
    let mut extras = Vec::new();
    for seed in 0..20 {
        let run = run("S5", seed);
        let (begins, extra) = run
            .events
            .iter()
            .find_map(|event| match event.what {
                LineEventKind::DrawnAway { extra } => Some((event.time.as_s(), extra.as_m_per_s2())),
                _ => None,
            })
            .unwrap();
        extras.push(extra);
        let train = mean_acceleration(&run, begins + 1.0, begins + 10.0);
        assert!((-0.65..-0.4).contains(&train), "seed {seed}: {train}");
        // Both wheels fall by the deceleration commanded and as much more, until they stand.
        let at = |time: f64| run.truth[row(&run, begins + time)];
        let (early, late) = (at(1.0), at(6.0));
        for wheel in [0, 1] {
            let fallen = (early.wheel_speeds[wheel] - late.wheel_speeds[wheel]).as_m_per_s() / 5.0;
            assert!((fallen - extra - 0.5).abs() < 0.06, "seed {seed}: {fallen} for {extra}");
        }
        let apart = (late.wheel_speeds[0] - late.wheel_speeds[1]).abs().as_m_per_s();
        assert!(apart < 0.1, "seed {seed}: the wheels differ by {apart} m/s");
    }
    assert!(extras.iter().any(|extra| *extra < 0.3) && extras.iter().any(|extra| *extra > 1.5), "{extras:?}");
    assert!(extras.iter().all(|extra| (0.1..=3.0).contains(extra)));
}

#[test]
fn wheels_spin_at_a_start_and_slip_control_ends_it() {
    let mut both = 0;
    for seed in 0..12 {
        let run = run("S6", seed);
        let spins = |wheelset| !begins(&run, wheelset, WheelTruth::Slip).is_empty();
        assert!(spins(0), "seed {seed}");
        assert_eq!(spins(1), run.vehicle.wheelsets[1].is_powered, "seed {seed}");
        both += usize::from(spins(1));
        let fastest = run.truth.iter().map(|truth| (truth.wheel_speeds[0] - truth.speed).as_m_per_s());
        let most = fastest.fold(0.0, f64::max);
        assert!((0.8..8.0).contains(&most), "seed {seed}: {most} m/s beyond the train");
    }
    assert!((2..=10).contains(&both), "one and two in turns: {both}");
}

#[test]
fn a_released_brake_ends_a_slide() {
    for seed in 0..8 {
        let run = run("S7", seed);
        let release = run
            .samples
            .windows(2)
            .find(|pair| pair[0].effort.is_some_and(|effort| effort < -0.5) && pair[1].effort == Some(0.0));
        let release = release.unwrap()[1].time.as_s();
        let sliding = run.truth[row(&run, release)].wheels;
        assert!(sliding.contains(&WheelTruth::Slide), "seed {seed}: {sliding:?}");
        let later = run.truth[row(&run, release + 4.0)].wheels;
        assert_eq!(later, [WheelTruth::Rolling; 2], "seed {seed}");
    }
}

#[test]
fn creepage_grows_with_the_film_and_never_becomes_a_spin() {
    let mut largest = 0.0_f64;
    for seed in 0..8 {
        let run = run("S4", seed);
        let slips: Vec<f64> = slides(&run, 15.0, 59.0).iter().map(|two| -two[0]).collect();
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        assert!(slips.iter().all(|slip| (0.0..0.06).contains(slip)), "seed {seed}");
        largest = largest.max(mean(&slips[500..]));
        // On a good rail the same effort would creep by less than 0.1 %.
        assert!(mean(&slips) > 0.002, "seed {seed}: {}", mean(&slips));
    }
    assert!(largest > 0.005, "{largest}");
}

#[test]
fn leaves_and_dry_rail_change_what_a_wheel_passes_on() {
    for seed in 0..4 {
        let run = run("S8", seed);
        let turns = begins(&run, 0, WheelTruth::Slide).len();
        assert!((3..40).contains(&turns), "seed {seed}: {turns} slides");
        let friction: Vec<f64> = run.truth.iter().map(|truth| truth.friction[0]).collect();
        assert!(friction.iter().any(|mu| *mu < 0.05) && friction.iter().any(|mu| *mu > 0.35));
        // Nothing passes on more than there is, whatever lies there.
        assert!(
            run.truth.iter().all(|truth| (0..2).all(|at| truth.adhesion[at].abs() <= truth.friction[at]))
        );
    }
}
