//! A train keeps its gap to its leader, never comes too close, and unsafe gaps are rejected.
#![expect(clippy::expect_used, reason = "a test may stop at the first surprise")]

use footplate_core::control::{Driver, Gap, Notice, Order, Refusal};
use footplate_core::track::{Layout, LayoutPlan, Leg, Place, RailEnd, Stretch, Survey};
use footplate_core::tracking::PathPoint;
use footplate_core::{Command, Length, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};
use proptest::prelude::{ProptestConfig, prop_assert, proptest};

use crate::toy_railway::{ToyRailway, add_train, driver_of, step, straight};

/// The follower, and its leader.
const FOLLOWER: TrainId = TrainId(24);
const LEADER: TrainId = TrainId(58);
/// Lengths ahead of and behind the pickup's leading end.
const REACH: [Length; 2] = [Length::from_mm(25.0), Length::from_mm(125.0)];

fn two_trains() -> (ToyRailway, Driver) {
    let mut world = ToyRailway::new(24, "D1", 100.0);
    world.put(58, "D1", 800.0);
    let mut driver = driver_of(&world, "D1", 100.0);
    add_train(&mut driver, &world, 58, Some(("D1", 800.0)));
    for train in [FOLLOWER, LEADER] {
        driver.set_reach(train, REACH[0], REACH[1]);
    }
    (world, driver)
}

fn follow(gap: Gap) -> Order {
    Order::Follow { train: FOLLOWER, leader: LEADER, gap }
}

fn seconds(seconds: f64) -> Gap {
    Gap::Time(TimeSpan::from_s(seconds))
}

fn run_leader(world: &ToyRailway, driver: &mut Driver, at: u8) {
    driver.order(world.now, Order::Speed { train: LEADER, step: step(at) }).expect("a step");
}

/// True clearance between the two (mm).
fn between(world: &ToyRailway) -> f64 {
    let at = |id: TrainId| world.trains.iter().find(|train| train.id == id).expect("a train").at;
    let apart = world.layout.distance_ahead(at(FOLLOWER), at(LEADER), &world.turnouts);
    (apart.expect("one oval") - REACH[0] - REACH[1]).as_mm()
}

/// True gaps (s) since a time.
fn gaps(world: &ToyRailway, since: Timestamp) -> Vec<f64> {
    let led = |at: Timestamp, sensor: SensorId| {
        let passes = world.passes.iter().rev();
        passes.filter(|(_, _, passer)| *passer == LEADER).find(|(led, of, _)| *of == sensor && *led <= at)
    };
    let own = world.passes.iter().filter(|(at, _, passer)| *passer == FOLLOWER && *at >= since);
    own.filter_map(|(at, sensor, _)| Some((*at - led(*at, *sensor)?.0).as_s())).collect()
}

#[test]
fn a_gap_in_time_is_kept_while_the_leader_changes_its_speed() {
    let (mut world, mut driver) = two_trains();
    run_leader(&world, &mut driver, 7);
    world.run(&mut driver, 2.0);
    driver.order(world.now, follow(seconds(3.0))).expect("a safe gap");
    world.run(&mut driver, 40.0);
    let since = world.now;
    for at in [8, 6, 9, 7] {
        run_leader(&world, &mut driver, at);
        world.run(&mut driver, 20.0);
    }
    let gaps = gaps(&world, since);
    assert!(gaps.len() > 20, "{gaps:?}");
    let off = gaps.iter().map(|gap| (gap - 3.0).abs()).fold(0.0, f64::max);
    assert!(off < 0.3, "{gaps:?}");
}

#[test]
fn too_short_a_gap_is_rejected_with_the_shortest_safe_one() {
    let (mut world, mut driver) = two_trains();
    run_leader(&world, &mut driver, 8);
    world.run(&mut driver, 3.0);
    let refused = driver.order(world.now, follow(seconds(0.3))).expect_err("less than its own length");
    let Refusal::GapTooShort { shortest: Gap::Time(shortest), .. } = refused else { panic!("{refused}") };
    assert!((0.5..4.0).contains(&shortest.as_s()), "{shortest:?}");
    driver.order(world.now, follow(Gap::Time(shortest + TimeSpan::from_ms(1)))).expect("what was offered");
    let own = Order::Follow { train: LEADER, leader: FOLLOWER, gap: seconds(5.0) };
    assert!(matches!(driver.order(world.now, own), Err(Refusal::FollowsInCircle { .. })));
    let unknown = Order::Follow { train: FOLLOWER, leader: TrainId(99), gap: seconds(5.0) };
    assert!(matches!(driver.order(world.now, unknown), Err(Refusal::UnknownTrain { .. })));
}

#[test]
fn a_sensor_that_misses_only_the_leader_neither_stops_the_follower_nor_adds_a_lap() {
    let (mut world, mut driver) = two_trains();
    run_leader(&world, &mut driver, 7);
    world.run(&mut driver, 2.0);
    driver.order(world.now, follow(seconds(3.0))).expect("a safe gap");
    world.run(&mut driver, 40.0);
    let (since, notices) = (world.now, world.notices.len());
    let [failing, before] = [SensorId(0), SensorId(6)];
    let mut failed = 0;
    for _ in 0..600 {
        let leads_to_it = world.passes.iter().rfind(|(_, _, passer)| *passer == LEADER);
        let fails = leads_to_it.is_some_and(|(_, sensor, _)| *sensor == before);
        failed += usize::from(fails && world.dead.is_empty());
        world.dead = fails.then_some(failing).into_iter().collect();
        world.run(&mut driver, 0.1);
    }
    assert!(failed > 3, "once a round");
    let held_back = |notice: &Notice| matches!(notice, Notice::HeldBack { .. });
    assert!(!world.notices[notices..].iter().any(held_back));
    let gaps = gaps(&world, since);
    let off = gaps.iter().map(|gap| (gap - 3.0).abs()).fold(0.0, f64::max);
    assert!(off < 0.3, "{gaps:?}");
}

#[test]
fn a_follower_slows_down_behind_a_slower_leader_and_is_not_stopped() {
    let (mut world, mut driver) = two_trains();
    run_leader(&world, &mut driver, 10);
    world.run(&mut driver, 2.0);
    let shortest = match driver.order(world.now, follow(seconds(0.1))) {
        Err(Refusal::GapTooShort { shortest: Gap::Time(shortest), .. }) => shortest.as_s(),
        other => panic!("{other:?}"),
    };
    driver.order(world.now, follow(seconds(shortest + 0.05))).expect("a safe gap");
    world.run(&mut driver, 30.0);
    let notices = world.notices.len();
    for at in [7, 9, 6, 8] {
        run_leader(&world, &mut driver, at);
        world.run(&mut driver, 15.0);
    }
    let held_back = |notice: &Notice| matches!(notice, Notice::HeldBack { .. });
    assert!(!world.notices[notices..].iter().any(held_back));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn no_follower_touches_its_leader_whatever_the_leader_is_commanded(
        commanded in proptest::collection::vec((0_u8..11, 2.0..9.0_f64), 4..9),
        more in 0.0..1.5_f64,
        dead in proptest::option::of(0_u16..8),
    ) {
        let (mut world, mut driver) = two_trains();
        world.dead = dead.into_iter().map(SensorId).collect();
        run_leader(&world, &mut driver, 7);
        world.run(&mut driver, 2.0);
        let shortest = match driver.order(world.now, follow(seconds(0.1))) {
            Err(Refusal::GapTooShort { shortest: Gap::Time(shortest), .. }) => shortest.as_s(),
            other => panic!("{other:?}"),
        };
        driver.order(world.now, follow(seconds(shortest + 0.05 + more))).expect("a safe gap");
        for (at, lasts) in commanded {
            run_leader(&world, &mut driver, at);
            let until = world.now + TimeSpan::from_s(lasts);
            while world.now < until {
                world.run(&mut driver, 0.1);
                // A leader almost one lap ahead comes up behind a stopped follower.
                if between(&world) > 1_500.0 {
                    return Ok(());
                }
                prop_assert!(between(&world) > 0.0, "{} mm at {:?}", between(&world), world.now);
            }
        }
    }
}

/// An oval of 2.3 m whose only sensor is D.
fn one_sensor() -> Layout {
    let turnout = |number: u16| Place::Turnout {
        names: [format!("BR{number}"), format!("MR{number}")],
        turnout: TurnoutId(number),
    };
    let end = |node: &str, leg| RailEnd { node: node.into(), leg };
    let stretch =
        |from: RailEnd, to: RailEnd, mm: f64| Stretch { from, to, length: Length::from_mm(mm).into() };
    let legs = [(Leg::Straight, 1_000.0), (Leg::Curved, 970.0)];
    let mut stretches = vec![
        stretch(end("D1", None), end("BR1", None), 1_100.0),
        stretch(end("MR2", None), end("D1", None), 200.0),
    ];
    stretches.extend(legs.map(|(leg, mm)| stretch(end("BR1", Some(leg)), end("MR2", Some(leg)), mm)));
    let sensor = Place::Sensor { names: ["D1".into(), "D2".into()], sensors: [SensorId(6), SensorId(7)] };
    let plan = LayoutPlan {
        name: "one sensor".into(),
        survey: Survey::taped(Length::from_mm(2.0), "made up".into()),
        places: vec![sensor, turnout(1), turnout(2)],
        stretches,
        never_both_curved: vec![],
        zones: vec![],
        blocks: vec![],
    };
    Layout::build(&plan).expect("a layout")
}

#[test]
fn a_gap_is_kept_on_a_circuit_with_one_sensor() {
    let (mut world, known) = two_trains();
    world.layout = one_sensor();
    world.put(24, "D1", 100.0);
    world.put(58, "D1", 800.0);
    let mut driver = Driver::new(world.layout.clone(), straight());
    for (train, mm) in [(FOLLOWER, 100.0), (LEADER, 800.0)] {
        driver.add_train(known.model(train).expect("a model").clone());
        let node = world.layout.node_named("D1").expect("a node");
        let at = PathPoint { node, distance: Length::from_mm(mm) };
        driver.place(world.now, train, at, Length::from_mm(2.0));
        driver.set_reach(train, REACH[0], REACH[1]);
    }
    run_leader(&world, &mut driver, 7);
    world.run(&mut driver, 2.0);
    driver.order(world.now, follow(seconds(5.0))).expect("a safe gap");
    // One report in a lap of 10 s: the speed is corrected once in that time.
    world.run(&mut driver, 90.0);
    let (since, notices) = (world.now, world.notices.len());
    world.run(&mut driver, 80.0);
    let gaps = gaps(&world, since);
    let held_back = |notice: &Notice| matches!(notice, Notice::HeldBack { .. });
    assert!(!world.notices[notices..].iter().any(held_back));
    assert!(gaps.len() >= 6, "{gaps:?}");
    let off = gaps.iter().map(|gap| (gap - 5.0).abs()).fold(0.0, f64::max);
    assert!(off < 1.0, "{gaps:?}");
    let mean = gaps.iter().sum::<f64>() / gaps.len() as f64;
    assert!((mean - 5.0).abs() < 0.25, "{gaps:?}");
}

#[test]
fn a_follower_waits_at_the_end_of_its_authority_and_goes_on_when_it_is_extended() {
    // Given a follower at rest whose authority ends 0.3 m ahead, behind a train that runs on,
    let (mut world, mut driver) = two_trains();
    let node = world.layout.node_named("D1").expect("a node");
    let end = |mm: f64| Some(PathPoint { node, distance: Length::from_mm(mm) });
    driver.set_end_of_authority(world.now, FOLLOWER, end(400.0));
    run_leader(&world, &mut driver, 7);
    world.run(&mut driver, 1.0);
    driver.order(world.now, follow(seconds(3.0))).expect("a safe gap");
    world.run(&mut driver, 3.0);
    // then it comes to rest before that and keeps its order,
    let follower =
        |world: &ToyRailway| world.trains.iter().find(|train| train.id == FOLLOWER).expect("a train").clone();
    let (at, is_at_rest) = (follower(&world).travelled_mm, follower(&world).speed_mm_per_s < 1.0);
    assert!(is_at_rest && (20.0..300.0).contains(&at), "{at} mm");
    assert!(world.notices.iter().any(|notice| matches!(notice, Notice::HeldBack { .. })));
    assert!(!world.notices.iter().any(|notice| matches!(notice, Notice::GivenUp { .. })));
    // and follows once the authority is extended.
    driver.set_end_of_authority(world.now, FOLLOWER, None);
    world.run(&mut driver, 3.0);
    assert!(follower(&world).travelled_mm > at + 200.0, "{} mm after {at} mm", follower(&world).travelled_mm);
    assert_eq!(driver.leader(FOLLOWER), Some(LEADER));
}

#[test]
fn behind_a_leader_that_stops_a_follower_is_commanded_one_stop_and_no_slower_step_before() {
    // Given a follower that keeps its gap,
    let (mut world, mut driver) = two_trains();
    run_leader(&world, &mut driver, 10);
    world.run(&mut driver, 2.0);
    driver.order(world.now, follow(seconds(3.0))).expect("a safe gap");
    world.run(&mut driver, 40.0);
    // when its leader is commanded to stop,
    let (since, speed) = (world.now, driver.commanded(FOLLOWER));
    run_leader(&world, &mut driver, 0);
    world.run(&mut driver, 15.0);
    // then it is commanded nothing but a stop, rests behind its leader, and keeps its order.
    let commanded: Vec<SpeedStep> = world
        .commands
        .iter()
        .filter_map(|(at, command)| match command {
            Command::Speed { train: FOLLOWER, step } if *at > since && *step != speed => Some(*step),
            _ => None,
        })
        .collect();
    assert_eq!(commanded, [SpeedStep::STAND]);
    assert!((50.0..900.0).contains(&between(&world)), "{} mm", between(&world));
    assert_eq!(driver.leader(FOLLOWER), Some(LEADER));
}
