//! The virtual Z21 answers as such stations were seen to, to each of its clients, and its world does what it is asked.

use footplate_core::track::{Layout, Leg, Position};
use footplate_core::{DecoderSteps, Length, Ratio, TimeSpan, TrainId, TurnoutId};
use footplate_sim::{End, LawFamily, SpeedReports, Train, VirtualZ21, Z21Switches};
use footplate_wire::z21::{
    Broadcasts, Datasets, Feedback, FunctionSwitch, Reply, Request, Throttle, TurnoutPosition,
};

use crate::yard::{TRAIN, odometer, one_train, two_loops};

/// A station in front of the two loops, with one train 100 mm behind S0 that leads with an end.
fn station(layout: &Layout, leads: End, switches: Z21Switches) -> VirtualZ21<'_> {
    VirtualZ21::new(one_train(layout, leads), 7, switches)
}

/// What reaches which client within a time.
fn wait(station: &mut VirtualZ21<'_>, ms: i64) -> Vec<(usize, Reply)> {
    let until = station.now() + TimeSpan::from_ms(ms);
    let mut heard = Vec::new();
    while let Some((client, datagram)) = station.advance(until) {
        for dataset in Datasets::of(&datagram) {
            heard.push((client, Reply::read(&dataset).unwrap().expect("a known kind")));
        }
    }
    heard
}

fn write(station: &mut VirtualZ21<'_>, client: usize, requests: &[Request]) {
    let mut datagram = Vec::new();
    requests.iter().for_each(|request| request.write(&mut datagram));
    station.write(client, &datagram);
}

fn ask(station: &mut VirtualZ21<'_>, requests: &[Request]) -> Vec<Reply> {
    write(station, 0, requests);
    wait(station, 40).into_iter().map(|(_, reply)| reply).collect()
}

fn drive(step: u8, forward: bool) -> Request {
    let throttle = if step == 0 { Throttle::Stop } else { Throttle::Step(step) };
    Request::Drive { address: 24, steps: DecoderSteps::All, throttle, forward }
}

#[test]
fn requests_are_answered_one_dataset_after_the_other() {
    let layout = two_loops();
    let mut station = station(&layout, End::Nose, Z21Switches::default());
    let answers = ask(&mut station, &[Request::SerialNumber, Request::LockCode, Request::Broadcasts]);
    assert_eq!(answers.len(), 3, "{answers:?}");
    assert_eq!(ask(&mut station, &[Request::Power { on: true }]), [Reply::Power { on: true }]);
    let state = |answers: Vec<Reply>| match answers[..] {
        [Reply::Locomotive(state)] => state,
        _ => panic!("{answers:?}"),
    };
    ask(
        &mut station,
        &[drive(62, true), Request::Function { address: 24, function: 3, switch: FunctionSwitch::On }],
    );
    let driven = state(ask(&mut station, &[Request::Locomotive { address: 24 }]));
    assert_eq!((driven.throttle, driven.forward, driven.functions), (Throttle::Step(62), true, 1 << 3));
    // What it does not know it says so; what is not on the X-BUS it does not answer.
    station.write(0, &[0x07, 0x00, 0x40, 0x00, 0x99, 0x00, 0x99, 0x05, 0x00, 0x77, 0x00, 0x00]);
    assert_eq!(wait(&mut station, 40), [(0, Reply::Unknown)]);
    station.write(0, b"\xff\xff\xff");
    assert_eq!(wait(&mut station, 40), []);
}

#[test]
fn clients_receive_what_they_subscribed_to_and_are_forgotten_after_a_minute() {
    let layout = two_loops();
    let mut station = station(&layout, End::Nose, Z21Switches { rail_com: false, ..Z21Switches::default() });
    for client in [1, 2, 3] {
        let broadcasts = if client == 3 { Broadcasts::NONE } else { Broadcasts::STATES };
        write(&mut station, client, &[Request::SetBroadcasts(broadcasts)]);
    }
    write(&mut station, 2, &[Request::Locomotive { address: 24 }]);
    wait(&mut station, 40);
    write(&mut station, 1, &[drive(9, true)]);
    let heard = wait(&mut station, 40);
    assert_eq!(heard.iter().map(|(client, _)| *client).collect::<Vec<_>>(), [2], "{heard:?}");
    // The third hears of the power only if it has switched it itself.
    write(&mut station, 3, &[Request::Power { on: true }]);
    let mut informed: Vec<usize> = wait(&mut station, 40).into_iter().map(|(client, _)| client).collect();
    informed.sort_unstable();
    assert_eq!(informed, [1, 2, 3]);
    // Seventeen locomotives are one too many.
    for address in 100..116 {
        write(&mut station, 2, &[Request::Locomotive { address }]);
    }
    wait(&mut station, 40);
    write(&mut station, 1, &[drive(18, true)]);
    assert_eq!(wait(&mut station, 40), []);
    wait(&mut station, 61_000);
    write(&mut station, 3, &[Request::Power { on: false }]);
    let informed: Vec<usize> = wait(&mut station, 40).into_iter().map(|(client, _)| client).collect();
    assert_eq!(informed, [3]);
    // Twenty are known at a time, and the next is not answered.
    for client in 10..40 {
        write(&mut station, client, &[Request::SerialNumber]);
    }
    assert_eq!(wait(&mut station, 40).len(), 19);
}

#[test]
fn sensors_are_reported_within_a_cycle_of_their_bus_or_by_their_detectors() {
    for feedback in [Feedback::RBus, Feedback::Can, Feedback::LocoNet] {
        let layout = two_loops();
        let switches = Z21Switches { feedback, ..Z21Switches::default() };
        let mut station = station(&layout, End::Nose, switches);
        ask(
            &mut station,
            &[Request::SetBroadcasts(feedback.broadcasts()), Request::Power { on: true }, drive(99, true)],
        );
        let until = station.now() + TimeSpan::from_s(40.0);
        let mut known = [false; 200];
        let mut delays = Vec::new();
        while let Some((_, datagram)) = station.advance(until) {
            for dataset in Datasets::of(&datagram) {
                let Ok(Some(reply)) = Reply::read(&dataset) else { continue };
                for (number, occupied) in feedback.detections(&reply) {
                    if std::mem::replace(&mut known[usize::from(number)], occupied) || !occupied {
                        continue;
                    }
                    let truth = station.world.truth();
                    let pass =
                        truth.passes().iter().rfind(|pass| pass.sensor.0 + 1 == number).expect("a pass");
                    delays.push((station.now() - pass.at).as_ms());
                }
            }
        }
        assert!(delays.len() > 10, "{feedback:?}: {} reports", delays.len());
        // The longest: a cycle of 33 ms, 3 ms in the station, 4 ms until it is sent and 2 ms on the network; detectors are sooner.
        assert!(delays.iter().all(|delay| (0.5..44.0).contains(delay)), "{feedback:?}: {delays:?}");
    }
}

#[test]
fn turnouts_obey_repeated_commands_and_trains_stop_at_once_when_all_do() {
    let layout = two_loops();
    let mut station = station(&layout, End::Nose, Z21Switches::default());
    ask(&mut station, &[Request::Power { on: true }]);
    let set = |activate| Request::SetTurnout { address: 0, second: false, activate, queue: false };
    // As RailControl does: every pulse twice.
    for activate in [true, false, true, false] {
        ask(&mut station, &[set(activate)]);
        wait(&mut station, if activate { 150 } else { 10 });
    }
    wait(&mut station, 500);
    assert_eq!(station.world.lies(TurnoutId(1)), Some(Leg::Curved), "the second output is straight");
    let position = TurnoutPosition::Output { second: false };
    assert_eq!(
        ask(&mut station, &[Request::Turnout { address: 0 }]),
        [Reply::Turnout { address: 0, position }]
    );
    write(&mut station, 0, &[drive(72, true)]);
    wait(&mut station, 6_000);
    assert!(ask(&mut station, &[Request::StopAll]).contains(&Reply::Stopped));
    wait(&mut station, 1_500);
    let stopped = odometer(&station.world);
    wait(&mut station, 2_000);
    assert_eq!(odometer(&station.world).to_bits(), stopped.to_bits(), "it stands");
    assert!(station.world.is_powered());
}

#[test]
fn directions_are_absolute_and_every_number_of_steps_is_driven() {
    let layout = two_loops();
    for (steps, step) in
        [(DecoderSteps::Fourteen, 8), (DecoderSteps::TwentyEight, 16), (DecoderSteps::All, 72)]
    {
        for leads in [End::Nose, End::Tail] {
            let mut station = station(&layout, leads, Z21Switches::default());
            let throttle = Throttle::Step(step);
            let request = Request::Drive { address: 24, steps, throttle, forward: true };
            ask(&mut station, &[Request::Power { on: true }, request]);
            wait(&mut station, 3_000);
            let truth = station.world.truth().train(TRAIN).unwrap();
            assert_eq!(truth.leads, End::Nose);
            assert!(odometer(&station.world) > 100.0, "{steps:?}: {}", odometer(&station.world));
        }
    }
}

#[test]
fn a_train_with_a_long_address_is_driven() {
    let layout = two_loops();
    let long = TrainId(3_078);
    let mut station = station(&layout, End::Nose, Z21Switches::default());
    let world = &mut station.world;
    world.lift(TRAIN);
    world.add(long, Train::draw(24, LawFamily::Constant), 1.0);
    let edge =
        layout.edge_between(layout.node_named("S0").unwrap(), layout.node_named("B1").unwrap()).unwrap();
    world.place(long, Position { edge, offset: Length::from_mm(100.0) }, End::Nose).unwrap();
    let throttle = Throttle::Step(72);
    let request = Request::Drive { address: 3_078, steps: DecoderSteps::All, throttle, forward: true };
    ask(&mut station, &[Request::Power { on: true }, request]);
    wait(&mut station, 3_000);
    assert!(station.world.truth().train(long).unwrap().odometer.as_mm() > 100.0);
}

#[test]
fn trains_run_on_without_commands_and_stop_when_the_station_is_restarted() {
    let layout = two_loops();
    let mut station = station(&layout, End::Nose, Z21Switches::default());
    let subscribe = Request::SetBroadcasts(Broadcasts::STATES);
    ask(&mut station, &[subscribe, Request::Power { on: true }, drive(72, true)]);
    wait(&mut station, 10_000);
    let before = odometer(&station.world);
    wait(&mut station, 5_000);
    assert!(odometer(&station.world) > before + 500.0);
    station.restart();
    assert_eq!(ask(&mut station, &[Request::SerialNumber]), [], "it starts");
    wait(&mut station, 6_000);
    assert_eq!(ask(&mut station, &[Request::Broadcasts]), [Reply::Broadcasts(Broadcasts::NONE)]);
    assert!(station.world.is_powered(), "it gives power when it has started");
    assert!(station.world.truth().train(TRAIN).unwrap().at_rest_since.is_some());
}

#[test]
fn each_quirk_does_what_it_says() {
    let layout = two_loops();
    let with = |switches| station(&layout, End::Nose, switches);
    let locked = Z21Switches { is_locked: true, ..Z21Switches::default() };
    let mut station = with(locked);
    ask(&mut station, &[Request::Power { on: true }, drive(99, true)]);
    wait(&mut station, 3_000);
    assert!(odometer(&station.world) < 1.0, "it is locked");

    let wrong = [0x07, 0x00, 0x40, 0x00, 0x21, 0x81, 0xa1];
    for (strict_xor, powered) in [(false, true), (true, false)] {
        let mut station = with(Z21Switches { strict_xor, ..Z21Switches::default() });
        station.write(0, &wrong);
        wait(&mut station, 40);
        assert_eq!(station.world.is_powered(), powered);
    }
    let mut station = with(Z21Switches { loses_first_subscription: true, ..Z21Switches::default() });
    let subscribes = [Request::SetBroadcasts(Broadcasts::STATES), Request::Broadcasts];
    assert_eq!(ask(&mut station, &subscribes), [Reply::Broadcasts(Broadcasts::NONE)]);
    assert_eq!(ask(&mut station, &subscribes), [Reply::Broadcasts(Broadcasts::STATES)]);
    let mut station = with(Z21Switches { first_only: true, ..Z21Switches::default() });
    assert_eq!(ask(&mut station, &[Request::SerialNumber, Request::LockCode]).len(), 1);

    let share = Ratio::from_percent(20.0);
    let lossy = Z21Switches { lost: share, ..Z21Switches::default() };
    let twice = Z21Switches { duplicated: share, ..Z21Switches::default() };
    // Of 400 requests 0.8² are answered where a fifth is lost, and 1.2² times where a fifth comes twice.
    for (switches, expected) in [(lossy, 256.0), (twice, 576.0)] {
        let mut station = with(switches);
        let answered: usize = (0..400).map(|_| ask(&mut station, &[Request::SerialNumber]).len()).sum();
        assert!((answered as f64 - expected).abs() < 45.0, "{answered}");
    }
}

#[test]
fn decoders_report_whole_numbers_at_a_scale_of_their_own() {
    let layout = two_loops();
    for speeds in [SpeedReports::None, SpeedReports::Speed, SpeedReports::Nonsense] {
        let mut station = station(&layout, End::Nose, Z21Switches { speeds, ..Z21Switches::default() });
        let all = Request::SetBroadcasts(Broadcasts::ALL_RAIL_COM);
        write(&mut station, 0, &[all, Request::Power { on: true }, drive(72, true)]);
        wait(&mut station, 4_000);
        let before = odometer(&station.world);
        let heard = wait(&mut station, 5_000);
        let km_h = 87.0 * 3.6e-3 * (odometer(&station.world) - before) / 5.0;
        let numbers: Vec<Option<u16>> = heard
            .iter()
            .filter_map(|(_, reply)| match reply {
                Reply::RailCom(report) => Some(report.reported_speed()),
                _ => None,
            })
            .collect();
        assert_eq!(numbers.len(), 10, "{numbers:?}");
        let ratios = || numbers.iter().flatten().map(|number| f64::from(*number) / km_h);
        let spread = ratios().fold(0.0, f64::max) - ratios().fold(f64::INFINITY, f64::min);
        match speeds {
            SpeedReports::None => assert!(numbers.iter().all(Option::is_none), "{numbers:?}"),
            SpeedReports::Speed => {
                assert!(
                    ratios().all(|ratio| (0.75..1.3).contains(&ratio)) && spread < 0.06,
                    "{numbers:?}, {km_h}"
                );
            }
            SpeedReports::Nonsense => assert!(spread > 0.5, "{numbers:?}, {km_h}"),
        }
    }
}
