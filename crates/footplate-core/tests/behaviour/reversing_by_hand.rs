//! Reversing by hand: refused where the train would derail or its position be lost.

use footplate_core::control::{Dispatcher, Driver, Order, Refusal};
use footplate_core::track::Leg;
use footplate_core::{SpeedStep, TurnoutId};

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

#[test]
fn a_train_on_points_that_it_pushed_over_is_not_reversed_by_hand() {
    // Given a train that ran by hand over turnout 2 from its curved leg, while it was set straight, and stopped 30 mm
    // beyond it: its rear, at least 80 mm behind, is still on it.
    let mut traffic = Traffic::with(Dispatcher::watched, [("EN1", 150.0), ("C1", 100.0)]);
    let train = TRAINS[1];
    let order = |traffic: &mut Traffic, order| traffic.dispatcher.order(traffic.world.now, order);
    order(&mut traffic, Order::Speed { train, step: step(5) }).expect("a step");
    while traffic.world.trains[1].at.offset.as_mm() < 380.0 {
        traffic.run(0.02);
    }
    order(&mut traffic, Order::Speed { train, step: SpeedStep::STAND }).expect("a step");
    traffic.run(4.0);
    // then it is not reversed, until it has run off the turnout.
    let reverse = Order::Reverse { train, then: SpeedStep::STAND };
    let refused = order(&mut traffic, reverse);
    assert_eq!(refused, Err(Refusal::OnTrailedPoints { train, turnout: TurnoutId(2) }));
    order(&mut traffic, Order::Speed { train, step: step(5) }).expect("a step");
    traffic.run(3.5);
    order(&mut traffic, Order::Speed { train, step: SpeedStep::STAND }).expect("a step");
    traffic.run(4.0);
    order(&mut traffic, reverse).expect("off the turnout");
}
