//! Reversing: refused to a person where the train would derail or its position be lost, and avoided by journeys.
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "a test may stop at the first surprise")]

use footplate_core::control::{Dispatcher, Driver, Order, OrderId, Refusal};
use footplate_core::track::Leg;
use footplate_core::tracking::PathPoint;
use footplate_core::{Command, Length, SpeedStep, TurnoutId};

use crate::dispatching::{STARTS, TRAINS, Traffic, model};
use crate::toy_railway::{step, straight};

#[test]
fn a_train_before_points_that_are_set_against_it_is_not_reversed_by_hand() {
    // Given a train before turnout 2, which it would trail, and which is set for its other leg,
    let (train, turnout) = (TRAINS[1], TurnoutId(2));
    let with_turnout = |leg: Leg| {
        let set = |now, driver: Driver| {
            let mut turnouts = straight();
            turnouts.set(turnout, leg);
            let mut other = Driver::new(driver.layout().clone(), turnouts);
            for train in TRAINS {
                let located = driver.locate(train, now).expect("placed");
                other.add_train(model(train));
                other.place(now, train, located.at, located.uncertainty);
            }
            Dispatcher::watched(now, other)
        };
        Traffic::with(set, STARTS)
    };
    let reverse = |traffic: &mut Traffic| {
        traffic.dispatcher.order(traffic.world.now, Order::Reverse { train, then: SpeedStep::STAND })
    };
    // then it is not reversed: no path would lead to it from the sensor that is then behind it.
    let mut traffic = with_turnout(Leg::Curved);
    assert_eq!(reverse(&mut traffic), Err(Refusal::PositionLost { train, turnout, curved: false }));
    // Set as the answer says, it is, and its position stays known.
    let mut traffic = with_turnout(Leg::Straight);
    reverse(&mut traffic).expect("set as was asked");
    traffic.run(2.0);
    assert!(traffic.dispatcher.driver().locate(train, traffic.world.now).is_some());
}

/// A train that ran by hand over turnout 2 from its curved leg, while it was set straight, and stopped 30 mm
/// beyond it: its rear, at least 80 mm behind, is still on it. No sensor has reported it.
fn on_points_that_it_pushed_over() -> Traffic {
    let mut traffic = Traffic::with(Dispatcher::watched, [("EN1", 150.0), ("C1", 100.0)]);
    let train = TRAINS[1];
    by_hand(&mut traffic, Order::Speed { train, step: step(5) }).expect("a step");
    while traffic.world.trains[1].at.offset.as_mm() < 380.0 {
        traffic.run(0.02);
    }
    by_hand(&mut traffic, Order::Speed { train, step: SpeedStep::STAND }).expect("a step");
    traffic.run(4.0);
    traffic
}

fn by_hand(traffic: &mut Traffic, order: Order) -> Result<OrderId, Refusal> {
    traffic.dispatcher.order(traffic.world.now, order)
}

#[test]
fn a_train_placed_on_points_that_it_pushed_over_is_not_reversed_by_a_journey() {
    // Given a train on points that it pushed over, of which a person says where its end is, and not over which leg it came,
    let mut traffic = on_points_that_it_pushed_over();
    let train = TRAINS[1];
    let (now, layout) = (traffic.world.now, &traffic.world.layout);
    let at = traffic.world.trains[1].at;
    let from = layout.edge(at.edge).expect("an edge").from;
    traffic.dispatcher.place(
        now,
        train,
        PathPoint { node: from, distance: at.offset },
        Length::from_mm(10.0),
    );
    // when it is sent back to where it came from,
    traffic.go(train, "C2");
    let is_reversed = |traffic: &Traffic| {
        let reverses = |(_, command): &(_, Command)| *command == Command::Reverse { train };
        traffic.world.commands.iter().any(reverses)
    };
    let passes = traffic.world.passes.len();
    let goes_on = |traffic: &Traffic| traffic.wrongs.is_empty() && traffic.world.passes.len() == passes;
    while goes_on(&traffic) && !is_reversed(&traffic) {
        traffic.run(0.5);
    }
    // then it runs on ahead to the next sensor first, on track that is reserved for it over both legs until then.
    assert!(!is_reversed(&traffic), "{:#?}", traffic.notices);
    assert_eq!(traffic.wrongs, Vec::<String>::new());
}

#[test]
fn a_train_on_points_that_it_pushed_over_is_not_reversed_by_hand() {
    let mut traffic = on_points_that_it_pushed_over();
    let train = TRAINS[1];
    // Then it is not reversed, until it has run off the turnout.
    let reverse = Order::Reverse { train, then: SpeedStep::STAND };
    let refused = by_hand(&mut traffic, reverse);
    assert_eq!(refused, Err(Refusal::OnTrailedPoints { train, turnout: TurnoutId(2) }));
    by_hand(&mut traffic, Order::Speed { train, step: step(5) }).expect("a step");
    traffic.run(3.5);
    by_hand(&mut traffic, Order::Speed { train, step: SpeedStep::STAND }).expect("a step");
    traffic.run(4.0);
    by_hand(&mut traffic, reverse).expect("off the turnout");
}
