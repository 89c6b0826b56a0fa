//! The virtual 6051 keeps the times and the habits of the real one.

use footplate_core::{Ratio, TimeSpan, Timestamp, TurnoutId};
use footplate_sim::{CtsSwitch, FromStation, IncidentKind, LivingSwitches, StationSwitches, VirtualStation};

use crate::yard::{OTHER, TRAIN, ask, empty, put, say, two_loops, wait};

/// One byte of 11 bits at 2400 baud.
const BYTE: TimeSpan = TimeSpan::from_ns(4_583_333);

fn poll_takes(station: &mut VirtualStation<'_>, request: u8, count: usize) -> TimeSpan {
    let began = station.now();
    station.write(request);
    let mut left = count;
    while left > 0 {
        if let Some(FromStation::Byte(_)) = station.advance(began + TimeSpan::from_ms(500)) {
            left -= 1;
        }
    }
    let took = station.now() - began;
    wait(station, 0.01);
    took
}

#[test]
fn polls_take_what_real_ones_take() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    // Request, modules, and the least that the bits alone take: 13.8, 22.9, 50.4, 288.8 ms.
    for (request, modules, least, most) in
        [(193, 1, 13.7, 22.0), (130, 2, 22.9, 32.0), (133, 5, 50.4, 60.0), (159, 31, 288.7, 320.0)]
    {
        let takes: Vec<f64> =
            (0..50).map(|_| poll_takes(&mut station, request, 2 * modules).as_ms()).collect();
        assert!(takes.iter().all(|ms| (least..most).contains(ms)), "{request}: {takes:?}");
        let (min, max) =
            takes.iter().fold((f64::MAX, 0.0_f64), |(min, max), ms| (min.min(*ms), max.max(*ms)));
        assert!((3.0..=5.01).contains(&(max - min)), "the first byte varies by about 5 ms: {min} to {max}");
    }
}

#[test]
fn answer_bytes_follow_each_other_every_4_87_ms() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    station.write(133);
    let mut times: Vec<Timestamp> = Vec::new();
    while times.len() < 10 {
        if let Some(FromStation::Byte(_)) = station.advance(Timestamp::ZERO + TimeSpan::from_ms(500)) {
            times.push(station.now());
        }
    }
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] == TimeSpan::from_us(4870)), "{times:?}");
}

#[test]
fn readiness_drops_after_each_byte_and_stays_away_while_it_answers() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    station.write(96);
    let far = Timestamp::ZERO + TimeSpan::from_ms(100);
    assert!(station.cts(), "the box needs a moment to take it back");
    assert_eq!(station.advance(far), Some(FromStation::Cts(false)));
    assert!(station.now() - Timestamp::ZERO > BYTE);
    assert_eq!(station.advance(far), Some(FromStation::Cts(true)));
    station.write(193);
    let heard: Vec<_> = std::iter::from_fn(|| station.advance(far)).collect();
    assert_eq!(
        heard,
        [FromStation::Cts(false), FromStation::Byte(0), FromStation::Byte(0), FromStation::Cts(true)]
    );
}

#[test]
fn bytes_that_do_not_wait_are_lost_and_tear_answers() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    put(&mut station, TRAIN, "S1", "S2", 300.0);
    // Both bytes at once: the second is not heard, and the next one is taken for it.
    station.write(10);
    station.write(24);
    wait(&mut station, 5.0);
    assert!(station.world.truth().train(TRAIN).unwrap().at_rest_since.is_some());
    say(&mut station, &[24]);
    wait(&mut station, 5.0);
    assert!(station.world.truth().train(TRAIN).unwrap().at_rest_since.is_none());

    station.write(133);
    wait(&mut station, 0.015);
    station.write(133);
    let mut bytes = 0;
    let until = station.now() + TimeSpan::from_ms(200);
    while let Some(heard) = station.advance(until) {
        bytes += usize::from(matches!(heard, FromStation::Byte(_)));
    }
    assert!(bytes < 10, "{bytes} bytes of the answer came through");
}

#[test]
fn without_the_wire_bytes_may_follow_each_other() {
    let layout = two_loops();
    let no_wire = StationSwitches { cts: CtsSwitch::None, ..StationSwitches::default() };
    let mut station = empty(&layout, no_wire);
    put(&mut station, TRAIN, "S1", "S2", 300.0);
    station.write(10);
    station.write(24);
    assert_eq!(station.advance(Timestamp::ZERO + TimeSpan::from_ms(5000)), None);
    assert!(station.world.truth().train(TRAIN).unwrap().at_rest_since.is_none());
}

#[test]
fn detections_are_remembered_until_they_are_read_module_by_module() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    put(&mut station, TRAIN, "S1", "S2", 800.0);
    put(&mut station, OTHER, "R8", "M3", 100.0);
    say(&mut station, &[192]);
    // Over S2, number 4, and on.
    station.world.push(TRAIN, footplate_core::Length::from_mm(400.0));
    wait(&mut station, 0.1);
    assert_eq!(ask(&mut station, 194, 2), [0, 0], "the second module has nothing");
    assert_eq!(ask(&mut station, 193, 2), [0b0000_1000, 0]);
    assert_eq!(ask(&mut station, 193, 2), [0, 0], "read, and so forgotten");
    say(&mut station, &[128]);
    station.world.push(TRAIN, footplate_core::Length::from_mm(800.0));
    wait(&mut station, 0.1);
    for _ in 0..2 {
        assert_eq!(ask(&mut station, 129, 2), [0b0000_0010, 0], "without the mode it is kept");
    }
}

#[test]
fn a_sensor_that_stays_closed_is_seen_again_and_again() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    put(&mut station, TRAIN, "S1", "S2", 890.0);
    say(&mut station, &[192]);
    station.world.push(TRAIN, footplate_core::Length::from_mm(20.0));
    for _ in 0..3 {
        assert_eq!(ask(&mut station, 193, 2), [0b0000_1000, 0]);
    }
}

#[test]
fn a_solenoid_left_on_raises_an_alarm_and_burns() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    say(&mut station, &[34, 1]);
    wait(&mut station, 0.45);
    say(&mut station, &[32]);
    wait(&mut station, 10.0);
    assert!(station.alarms().is_empty());
    say(&mut station, &[34, 2]);
    wait(&mut station, 0.3);
    say(&mut station, &[34, 3]);
    wait(&mut station, 0.4);
    assert!(station.alarms().is_empty(), "the next turnout lets the one before go");
    wait(&mut station, 0.2);
    assert_eq!(station.alarms().iter().map(|alarm| alarm.turnout).collect::<Vec<_>>(), [TurnoutId(3)]);
    wait(&mut station, 6.0);
    let kinds: Vec<IncidentKind> = station.world.incidents().iter().map(|incident| incident.kind).collect();
    assert_eq!(kinds, [IncidentKind::CoilBurnt { turnout: TurnoutId(3) }]);
}

#[test]
fn points_need_a_tenth_of_a_second_of_power() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    say(&mut station, &[34, 1]);
    say(&mut station, &[32]);
    wait(&mut station, 1.0);
    assert_eq!(station.world.lies(TurnoutId(1)), Some(footplate_core::track::Leg::Straight));
}

/// All that a host sees in half a minute of driving, and what the world came to.
fn seen(seed: u64) -> (Vec<(Timestamp, FromStation)>, String) {
    let layout = two_loops();
    let mut switches = LivingSwitches::well_kept();
    switches.faults.missed = Ratio::from_percent(10.0);
    switches.faults.spurious_per_minute = 5.0;
    let mut station = VirtualStation::draw(&layout, seed, &[TRAIN, OTHER], &switches).unwrap();
    let mut seen = Vec::new();
    say(&mut station, &[192, 9, 24, 11, 58]);
    for turn in 0..400_u32 {
        let until = station.now() + TimeSpan::from_ms(80);
        if turn % 40 == 39 {
            say(&mut station, &[(turn % 13) as u8, 24]);
        }
        station.write(133);
        while let Some(heard) = station.advance(until) {
            seen.push((station.now(), heard));
        }
    }
    let truth = station.world.truth();
    (seen, format!("{:?} {:?} {:?}", truth.passes(), truth.rests(), station.world.incidents()))
}

#[test]
fn a_seed_means_the_same_bytes_at_the_same_times() {
    assert_eq!(seen(3), seen(3));
    assert_ne!(seen(3).0, seen(4).0);
}

#[test]
fn how_often_the_host_looks_changes_nothing() {
    let layout = two_loops();
    let run = |look_ms: f64| {
        let mut station = empty(&layout, StationSwitches::default());
        put(&mut station, TRAIN, "S1", "S2", 300.0);
        say(&mut station, &[10, 24]);
        let until = Timestamp::ZERO + TimeSpan::from_s(8.0);
        while station.now() < until {
            let next = (station.now() + TimeSpan::from_s(look_ms * 1e-3)).min(until);
            station.advance(next);
        }
        station.world.truth().train(TRAIN).unwrap()
    };
    assert_eq!(run(0.37), run(8000.0));
}

#[test]
fn modules_without_a_latch_forget_at_once_and_some_boxes_know_no_single_module() {
    let layout = two_loops();
    let plain = StationSwitches { latches: false, reads_single_modules: false, ..StationSwitches::default() };
    let mut station = empty(&layout, plain);
    put(&mut station, TRAIN, "S1", "S2", 800.0);
    say(&mut station, &[192]);
    // Over S2, number 4, and on: nothing is left of it when the modules are read.
    station.world.push(TRAIN, footplate_core::Length::from_mm(400.0));
    wait(&mut station, 0.1);
    assert_eq!(ask(&mut station, 130, 4), [0; 4]);
    assert_eq!(ask(&mut station, 193, 2), [0_u8; 0], "it does not know the question");
}

#[test]
fn whole_answers_are_lost_as_often_as_asked() {
    let layout = two_loops();
    let lossy = StationSwitches { lost_replies: Ratio::from_percent(20.0), ..StationSwitches::default() };
    let mut station = empty(&layout, lossy);
    let answers: Vec<usize> = (0..200).map(|_| ask(&mut station, 130, 4).len()).collect();
    assert!(answers.iter().all(|bytes| *bytes == 0 || *bytes == 4), "{answers:?}");
    // 40 expected, within four standard deviations.
    let lost = answers.iter().filter(|bytes| **bytes == 0).count();
    assert!((18..=62).contains(&lost), "{lost} of 200");
}
