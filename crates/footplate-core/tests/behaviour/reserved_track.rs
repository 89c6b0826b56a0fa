//! A dispatched train keeps the track on which it may be, and no more: when it stalls, is placed by hand, or when a report is
//! ambiguous. A journey whose turnouts cannot be set is given up.

use footplate_core::control::{Dispatcher, LinkNews, Machine, Notice, Order, Refusal};
use footplate_core::track::{Leg, Position};
use footplate_core::tracking::PathPoint;
use footplate_core::{Length, Timestamp, TurnoutId};

use crate::dispatching::{LENGTHS, STARTS, TRAINS, Traffic, is_held, knowing};
use crate::toy_railway::{step, straight};

#[test]
fn a_train_that_stalls_while_it_is_driven_by_hand_keeps_the_track_under_it() {
    // Given a train that stalls 100 mm beyond `A1`, before a turnout,
    let mut traffic = Traffic::with(Dispatcher::new, [STARTS[0], ("E1", 300.0)]);
    let [train, _] = TRAINS;
    let speed = |number| Order::Speed { train, step: step(number) };
    traffic.dispatcher.order(traffic.world.now, speed(9)).expect("free");
    traffic.run_to("A1");
    traffic.run(0.35);
    traffic.world.trains.iter_mut().filter(|toy| toy.id == train).for_each(|toy| toy.wheels = 0.0);
    // when it is estimated to run on, and is stopped,
    traffic.run(0.8);
    traffic.dispatcher.order(traffic.world.now, speed(0)).expect("stops");
    traffic.run(20.0);
    let located = traffic.dispatcher.driver().locate(train, traffic.world.now).expect("located");
    assert!(located.at_rest && located.at.distance > Length::from_mm(300.0), "{located:?}");
    // then the track on which it stands is reserved for it, and the turnout before it does not move.
    assert_eq!(traffic.wrongs, Vec::<String>::new());
    let throw = Order::Turnout { turnout: TurnoutId(1), curved: true };
    assert!(traffic.dispatcher.order(traffic.world.now, throw).is_err());
    // A journey does not release it either, until a sensor reports the train.
    traffic.world.trains.iter_mut().for_each(|toy| toy.wheels = 1.0);
    traffic.go(train, "D1+150mm");
    traffic.run(60.0);
    assert_eq!(traffic.wrongs, Vec::<String>::new());
    assert_eq!(traffic.arrivals(train), 1, "{:#?}", traffic.notices);
}

#[test]
fn a_train_that_stalls_as_it_starts_keeps_its_track_until_a_sensor_reports_it() {
    // Given a train that does not move at all on a run past no sensor,
    let mut traffic = Traffic::with(Dispatcher::new, [("D1", 100.0), ("E1", 300.0)]);
    let [train, _] = TRAINS;
    traffic.world.trains.iter_mut().filter(|toy| toy.id == train).for_each(|toy| toy.wheels = 0.0);
    traffic.go(train, "D1+600mm");
    traffic.run(20.0);
    assert_eq!(traffic.arrivals(train), 1, "{:#?}", traffic.notices);
    // when two journeys are given up one after the other, because no path leads there,
    for given_up in 1..=2 {
        traffic.go(train, "E1+100mm");
        traffic.run(4.0);
        let is_given_up =
            |notice: &&Notice| matches!(notice, Notice::GivenUp { why: Refusal::Unreachable { .. }, .. });
        assert_eq!(traffic.notices.iter().filter(is_given_up).count(), given_up, "{:#?}", traffic.notices);
    }
    // then the track on which it stands is still reserved for it, and released once a sensor has reported it.
    assert_eq!(traffic.wrongs, Vec::<String>::new());
    let place = traffic.world.trains.iter().find(|toy| toy.id == train).expect("on the rails").at;
    let is_reserved = |traffic: &Traffic| {
        is_held(&traffic.world.layout, place, traffic.dispatcher.reservation(train).expect("dispatched"))
    };
    assert!(is_reserved(&traffic));
    traffic.world.trains.iter_mut().for_each(|toy| toy.wheels = 1.0);
    traffic.go(train, "B1+250mm");
    traffic.run(60.0);
    assert_eq!((traffic.arrivals(train), is_reserved(&traffic)), (2, false), "{:#?}", traffic.notices);
    assert_eq!(traffic.wrongs, Vec::<String>::new());
}

#[test]
fn a_train_in_danger_that_is_placed_before_points_of_unknown_position_occupies_the_track_there() {
    // Given a train that is measured again, and points whose position is unknown,
    let points_1 = [(TurnoutId(1), Leg::Straight)].into_iter().collect();
    let mut traffic = knowing(&points_1, [STARTS[0], ("E1", 300.0)]);
    let [train, _] = TRAINS;
    traffic.go(train, "B1+100mm");
    traffic.run(2.5);
    traffic.dispatcher.handle_link(traffic.world.now, LinkNews::Silent);
    traffic.run(3.0);
    traffic.dispatcher.handle_link(traffic.world.now, LinkNews::Answers);
    let is_located =
        |traffic: &Traffic| traffic.notices.iter().any(|notice| matches!(notice, Notice::Located { .. }));
    while !is_located(&traffic) && traffic.world.now < Timestamp::from_s(60.0) {
        traffic.run(0.5);
    }
    assert!(is_located(&traffic), "{:#?}", traffic.notices);
    // when a person puts it down before them,
    let d2 = traffic.world.layout.node_named("D2").expect("a node");
    let at = PathPoint { node: d2, distance: Length::from_mm(70.0) };
    traffic.dispatcher.place(traffic.world.now, train, at, Length::from_mm(2.0));
    assert!(traffic.dispatcher.is_in_danger(train));
    // then the track there is reserved for it, although it depends on them what is ahead.
    assert_eq!(traffic.dispatcher.driver().position(train, traffic.world.now), None);
    let edge = traffic.world.layout.outgoing(d2).edges().next().expect("track");
    let reserved = traffic.dispatcher.reservation(train).expect("dispatched");
    assert!(is_held(&traffic.world.layout, Position { edge, offset: at.distance }, reserved), "{reserved:?}");
}

#[test]
fn a_train_that_is_placed_occupies_the_track_that_the_turnouts_lead_to() {
    let mut traffic = Traffic::new();
    let [train, _] = TRAINS;
    let layout = traffic.world.layout.clone();
    let [b1, c1, mr2] = ["B1", "C1", "MR2"].map(|name| layout.node_named(name).expect("a node"));
    let mut place = |node, beyond_mm| {
        let at = PathPoint { node, distance: Length::from_mm(beyond_mm) };
        traffic.dispatcher.place(traffic.world.now, train, at, Length::from_mm(2.0));
        traffic.dispatcher.handle_timeout(traffic.world.now);
    };
    // Given a train on the curved leg of a turnout that is set straight,
    place(c1, 200.0);
    // when it is lifted and put down just beyond the turnout,
    place(b1, 520.0);
    traffic.dispatcher.set_lengths(traffic.world.now, train, LENGTHS);
    // then its rear is on the straight leg, not on the one where it was before.
    let reserved = traffic.dispatcher.reservation(train).expect("dispatched");
    let holds = |from, length_mm: f64| {
        let edge = layout.edge_between(from, mr2).expect("an edge");
        is_held(&layout, Position { edge, offset: Length::from_mm(length_mm - 30.0) }, reserved)
    };
    assert!(holds(b1, 500.0));
    assert!(!holds(c1, 450.0));
}

#[test]
fn an_arrived_train_keeps_its_run_only_while_its_position_is_ambiguous() {
    // Given a train that has passed the last sensor on its run,
    let mut traffic = Traffic::with(Dispatcher::new, [STARTS[0], ("E1", 300.0)]);
    let [train, _] = TRAINS;
    let elsewhere = traffic.world.layout.sensor_named("F1").expect("a sensor");
    traffic.go(train, "B1+250mm");
    traffic.run_to("B1");
    traffic.run(0.2);
    let place = traffic.world.layout.landmark("BR1+450mm").expect("a place");
    let behind = traffic.world.layout.locate(place, &straight()).expect("a place");
    let is_reserved = |traffic: &Traffic| {
        is_held(&traffic.world.layout, behind, traffic.dispatcher.reservation(train).expect("dispatched"))
    };
    // when another sensor reports what may be that train, if it was lifted, and the train arrives,
    traffic.world.close(elsewhere);
    for _ in 0..60 {
        if traffic.arrivals(train) == 0 {
            traffic.run(0.5);
        }
    }
    assert_eq!(traffic.arrivals(train), 1, "{:#?}", traffic.notices);
    let now = traffic.world.now;
    assert_eq!(
        (traffic.dispatcher.driver().is_position_ambiguous(train, now), is_reserved(&traffic)),
        (true, true),
        "{now:?} {:#?}",
        traffic.notices
    );
    // then it releases its run once no later report can show otherwise.
    traffic.run(20.0);
    traffic.dispatcher.handle_timeout(traffic.world.now);
    assert!(!is_reserved(&traffic));
    assert_eq!(traffic.wrongs, Vec::<String>::new());
}

#[test]
fn a_journey_over_a_turnout_that_the_link_cannot_address_is_given_up() {
    let mut traffic = Traffic::new();
    traffic.unsent = Some(TurnoutId(1));
    traffic.go(TRAINS[0], "C1+150mm");
    traffic.run(40.0);
    let why = traffic.notices.iter().find_map(|notice| match notice {
        Notice::GivenUp { train, why, .. } if *train == TRAINS[0] => Some(why.clone()),
        _ => None,
    });
    let why = why.map(|why| why.to_string());
    assert_eq!(
        why.as_deref(),
        Some(
            "the commands to turnout 1 were not sent: the line garbles data, or this link does not have its address; \
             check cable and adapter, then the address in the layout, or choose a place that needs no turnout 1"
        ),
        "{:#?}",
        traffic.notices
    );
    // Once its address is right, the same journey is carried out.
    traffic.unsent = None;
    traffic.go(TRAINS[0], "C1+150mm");
    traffic.run(60.0);
    assert_eq!((traffic.arrivals(TRAINS[0]), traffic.wrongs.len()), (1, 0), "{:#?}", traffic.notices);
}

#[test]
fn a_train_that_one_report_puts_on_another_leg_keeps_both_until_a_sensor_decides() {
    // Given a train whose position is known to 40 mm, and which runs over the straight leg of turnout 1 towards `B1`,
    let mut traffic = Traffic::with(Dispatcher::new, [("A1", 60.0), ("E1", 300.0)]);
    let [train, _] = TRAINS;
    let [a1, b1, br1] =
        ["A1", "B1", "BR1"].map(|name| traffic.world.layout.node_named(name).expect("a node"));
    let at = PathPoint { node: a1, distance: Length::from_mm(100.0) };
    traffic.dispatcher.place(traffic.world.now, train, at, Length::from_mm(40.0));
    traffic.go(train, "B1+250mm");
    let leg = traffic.world.layout.edge_between(br1, b1).expect("an edge");
    let is_near = |at: Position| at.edge == leg && at.offset >= Length::from_mm(360.0);
    while !is_near(traffic.world.trains[0].at) && traffic.world.now < Timestamp::from_s(60.0) {
        traffic.run(0.05);
    }
    // when the sensor on the other leg reports 140 mm before `B1`, which no train caused,
    let elsewhere = traffic.world.layout.sensor_named("C1").expect("a sensor");
    traffic.world.close(elsewhere);
    traffic.run(0.1);
    let showed = |curved| Notice::TurnoutMismatch { turnout: TurnoutId(1), curved, train };
    assert!(traffic.notices.contains(&showed(true)), "{:#?}", traffic.notices);
    // and the train is stopped before it, and at rest for 20 s,
    traffic.dispatcher.order(traffic.world.now, Order::Speed { train, step: step(0) }).expect("a stop");
    traffic.run(20.0);
    assert!(!traffic.notices.contains(&showed(false)), "{:#?}", traffic.notices);
    // then it keeps the track where it really is, and is located there as it starts again.
    traffic.go(train, "D1+300mm");
    traffic.run(60.0);
    assert_eq!(traffic.wrongs, Vec::<String>::new());
    assert!(traffic.notices.contains(&showed(false)), "{:#?}", traffic.notices);
    assert_eq!(traffic.arrivals(train), 1, "{:#?}", traffic.notices);
}

#[test]
fn by_blocks_a_train_reserves_all_track_between_sensors_with_its_turnouts() {
    // Given a train between D1 and A1, and one beyond B1, on a layout that is reserved by blocks,
    let by_blocks = |now, driver| {
        let mut dispatcher = Dispatcher::new(now, driver);
        dispatcher.reserve_blocks();
        dispatcher
    };
    let mut traffic = Traffic::with(by_blocks, STARTS);
    traffic.run(1.0);
    let layout = traffic.world.layout.clone();
    // Block by block of the drawing: the stretches, and the turnout between them.
    let blocks = [
        (vec![("D1", "A1")], vec![]),
        (vec![("B1", "MR2"), ("C1", "MR2"), ("MR2", "D1")], vec![TurnoutId(2)]),
    ];
    for (train, (stretches, turnouts)) in TRAINS.into_iter().zip(blocks) {
        let reserved = traffic.dispatcher.reservation(train).expect("known");
        assert_eq!(reserved.turnouts().collect::<Vec<_>>(), turnouts, "{train}");
        let node = |name: &str| layout.node_named(name).expect("a node");
        let of_block: Vec<_> =
            stretches.iter().filter_map(|(from, to)| layout.edge_between(node(from), node(to))).collect();
        assert_eq!(of_block.len(), stretches.len());
        for (id, edge) in layout.edges() {
            let is_of_block = of_block.iter().any(|edge| edge.stretch() == id.stretch());
            for part in [0.02, 0.5, 0.98] {
                let place = Position { edge: id, offset: part * edge.length };
                assert_eq!(is_held(&layout, place, reserved), is_of_block, "train {train}: {place:?}");
            }
        }
    }
    // A train drives on by whole blocks: no turnout of another's block moves.
    let throw = Order::Turnout { turnout: TurnoutId(2), curved: true };
    let taken = traffic.dispatcher.order(traffic.world.now, throw);
    assert!(matches!(taken, Err(Refusal::TurnoutOccupied { turnout: TurnoutId(2), .. })), "{taken:?}");
    traffic.go(TRAINS[1], "D1");
    traffic.run(60.0);
    assert_eq!(traffic.wrongs, Vec::<String>::new());
    assert_eq!(traffic.arrivals(TRAINS[1]), 1, "{:#?}", traffic.notices);
}
