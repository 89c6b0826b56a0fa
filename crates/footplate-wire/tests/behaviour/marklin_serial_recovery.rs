//! A lost reply costs little: sensors are read again within 300 ms, stops do not wait for that, and an interface that
//! does not answer reads of single modules, or answers late, is found out.

use footplate_core::{Command, SensorId, TimeSpan, Timestamp, TrainId};
use footplate_wire::marklin_serial::{Message, ModuleReads, Pace, Settings};
use footplate_wire::{LinkNotice, Session};

use crate::marklin_serial_bench::{Bench, ms, speed};

const PACES: [Pace; 3] = [Pace::Cts, Pace::FAST, Pace::CAREFUL];

/// A line in use for a second on which, from the next request on, these of the bytes to the host are lost.
fn losing(pace: Pace, places: &[usize]) -> Bench {
    let mut bench = Bench::new(Settings::timed(5, pace));
    bench.run_until(ms(2_000));
    let asked = bench.said().len();
    while bench.said().len() == asked {
        bench.run_for(1);
    }
    bench.lose_to_host(places);
    bench
}

/// When the station had heard the first message of a kind after a time.
fn heard(bench: &Bench, after: Timestamp, wanted: impl Fn(&Message) -> bool) -> Option<Timestamp> {
    bench.station.messages.iter().find(|(at, message)| *at > after && wanted(message)).map(|(at, _)| *at)
}

/// When the loss was noticed: `run` goes on until then.
fn run_until_lost(bench: &mut Bench) -> Timestamp {
    let is_lost = |notice: &LinkNotice| matches!(notice, LinkNotice::ReplyLost { .. });
    while !bench.notices.iter().any(is_lost) {
        bench.run_for(1);
    }
    bench.now
}

#[test]
fn sensors_are_read_again_within_300_ms_of_a_lost_reply() {
    let mut longest = [0.0_f64; PACES.len()];
    for (pace, longest) in PACES.into_iter().zip(&mut longest) {
        // Given any part of a reply that is lost,
        for places in (0..10).map(|place| vec![place]).chain([(0..10).collect(), vec![0, 1], vec![8, 9]]) {
            let mut bench = losing(pace, &places);
            let began = bench.now;
            let noticed = run_until_lost(&mut bench);
            // when a train comes over an input then,
            bench.station.input(70, true);
            bench.run_for(1_000);
            // then its reading is over within 300 ms of the moment in which the loss was noticed.
            let reply = TimeSpan::from_us(10 * 4_870 + 2_000);
            let [(read, _)] = bench.reports(70)[..] else {
                panic!("{pace:?} {places:?}: {:?}", bench.events)
            };
            let took = (read + reply - noticed).as_ms();
            assert!(took <= 300.0, "{pace:?} {places:?}: {took} ms");
            assert!((read + reply - began).as_ms() <= 380.0, "{pace:?}: nothing was read for longer");
            *longest = longest.max(took);
            assert_eq!(bench.station.violations, [], "{pace:?} {places:?}");
        }
    }
    // With the hand-shake less than half of that.
    assert!(longest[0] < 160.0, "{longest:?} ms");
}

#[test]
fn a_stop_does_not_wait_for_the_recovery() {
    for pace in PACES {
        for delay in [0, 1, 15, 30, 60, 90, 120, 160, 200] {
            for places in [vec![], vec![9], (0..10).collect()] {
                let mut bench = losing(pace, &places);
                if !places.is_empty() {
                    run_until_lost(&mut bench);
                }
                bench.run_for(delay);
                let said = bench.now;
                bench.say(speed(24, 0));
                bench.run_for(1_000);
                let stop = heard(&bench, said, |message| matches!(message, Message::Drive { .. })).unwrap();
                let took = (stop - said).as_ms();
                // It waits for a reply that has begun (51 ms of it, 20 of allowance), for 20 ms of silence, or for
                // the gap that the station is given after a word.
                assert!(took <= 95.0, "{pace:?} {delay} {places:?}: {took} ms");
                assert_eq!(bench.station.violations, [], "{pace:?} {delay} {places:?}");
            }
        }
    }
}

#[test]
fn a_stop_that_is_lost_in_the_disturbance_is_said_again() {
    for pace in PACES {
        for lost in 0..5 {
            let mut bench = losing(pace, &(0..10).collect::<Vec<_>>());
            bench.station.steps.insert(TrainId(24), 9);
            run_until_lost(&mut bench);
            let said = bench.now;
            bench.lose_to_station(&[lost]);
            bench.say(speed(24, 0));
            bench.run_for(400);
            assert_eq!(bench.station.steps[&TrainId(24)], 0, "{pace:?}, byte {lost}");
            assert!(bench.now - said <= TimeSpan::from_ms(400));
        }
    }
}

#[test]
fn an_interface_that_answers_reads_of_all_modules_only_is_found_out_and_read_so() {
    for (pace, lateness) in [(Pace::Cts, 2), (Pace::CAREFUL, 2), (Pace::Cts, 100), (Pace::CAREFUL, 60)] {
        let mut bench = Bench::new(Settings::timed(5, pace));
        bench.station.answers_single = false;
        bench.station.turnaround = TimeSpan::from_ms(lateness);
        bench.run_until(ms(3_000));
        assert_eq!(bench.session.module_reads(), Some(ModuleReads::AllOnly), "{pace:?} {lateness} ms");
        let how = ModuleReads::AllOnly.text();
        assert!(bench.notices.contains(&LinkNotice::LimitedReads { how }));
        // Nothing is lost any more, a watched input or not, and every input is seen.
        let (lost, before) = (bench.notices.len(), bench.now);
        bench.session.watch(Some(SensorId(3)));
        bench.station.input(3, true);
        bench.run_until(ms(6_000));
        assert_eq!(bench.notices.len(), lost, "{:?}", bench.notices);
        assert_eq!(bench.reports(3).len(), 1);
        assert_eq!(heard(&bench, before, |message| matches!(message, Message::ReadModule { .. })), None);
        assert_eq!(bench.station.violations, []);
    }
}

#[test]
fn a_late_interface_is_waited_for_and_a_usual_one_is_known_by_its_first_reads() {
    for lateness in [0, 10, 50, 100] {
        let mut bench = Bench::with_cts();
        bench.station.turnaround = TimeSpan::from_ms(lateness);
        bench.run_until(ms(5_000));
        assert_eq!(bench.notices, [LinkNotice::Answers], "{lateness} ms");
        assert_eq!(bench.session.module_reads(), Some(ModuleReads::Single));
        let learnt = bench.session.reply_lateness().unwrap() - TimeSpan::from_ms(lateness);
        assert!(learnt.abs() < TimeSpan::from_ms(1), "{lateness} ms: off by {learnt:?}");
    }
}

#[test]
fn an_interface_that_becomes_late_is_followed() {
    let mut bench = Bench::with_cts();
    bench.run_until(ms(1_000));
    bench.station.turnaround = TimeSpan::from_ms(70);
    bench.run_until(ms(2_500));
    let lost = bench.notices.len();
    bench.run_until(ms(6_000));
    assert_eq!(bench.notices.len(), lost, "{:?}", bench.notices);
    assert!(bench.session.reply_lateness().unwrap() > TimeSpan::from_ms(60));
}

#[test]
fn a_lost_reply_never_repeats_a_step_over_a_newer_stop() {
    for pace in PACES {
        for place in 0..10 {
            for before in [0, 30, 60, 90] {
                // Given a step and soon after it a stop, both before the next whole reply,
                let mut bench = losing(pace, &[]);
                bench.say(speed(24, 8));
                bench.run_for(before);
                bench.lose_to_host(&[place]);
                bench.say(speed(24, 0));
                // when one byte of the next reply is lost,
                bench.run_for(1_500);
                // then the stop is what counts.
                assert_eq!(bench.station.steps[&TrainId(24)], 0, "{pace:?}, byte {place}, {before} ms");
            }
        }
    }
}

#[test]
fn a_lost_reply_never_repeats_power_off_over_a_newer_power_on() {
    for (first, then, power) in
        [(Command::PowerOff, Command::PowerOn, true), (Command::PowerOn, Command::PowerOff, false)]
    {
        for before in [0, 30, 60, 90] {
            let mut bench = losing(Pace::Cts, &[]);
            bench.say(first);
            bench.run_for(before);
            bench.lose_to_host(&[3]);
            bench.say(then);
            bench.run_for(1_500);
            assert_eq!(bench.station.power, power, "{first:?}, {before} ms");
        }
    }
}
