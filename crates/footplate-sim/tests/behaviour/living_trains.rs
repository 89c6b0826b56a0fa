//! Trains on a living layout go where turnouts lead them, close what they come to, and come to grief.

use footplate_core::track::{Leg, Position};
use footplate_core::{Length, SensorId, TurnoutId};
use footplate_sim::living::End;
use footplate_sim::{CtsSwitch, IncidentKind, LivingSwitches, StationSwitches, VirtualStation};

use crate::yard::{OTHER, TRAIN, empty, put, say, two_loops, wait};

fn sensors_passed(station: &footplate_sim::VirtualStation<'_>) -> Vec<u16> {
    station.world.truth().passes().iter().map(|pass| pass.sensor.0).collect()
}

#[test]
fn a_train_goes_round_and_closes_only_the_sensors_of_its_direction() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    put(&mut station, TRAIN, "S1", "S2", 300.0);
    say(&mut station, &[10, 24]);
    wait(&mut station, 15.0);
    let passed = sensors_passed(&station);
    assert!(passed.len() >= 4, "{passed:?}");
    let round = [4, 6, 0, 2];
    assert!(passed.iter().zip(round.iter().cycle()).all(|(found, due)| found == due), "{passed:?}");
    assert!(station.world.incidents().is_empty());
}

#[test]
fn it_goes_where_the_turnout_lies_when_it_comes_to_it() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    put(&mut station, TRAIN, "S3", "B3", 200.0);
    say(&mut station, &[34, 1]);
    wait(&mut station, 0.4);
    say(&mut station, &[32]);
    assert_eq!(station.world.lies(TurnoutId(1)), Some(Leg::Curved));
    say(&mut station, &[10, 24]);
    wait(&mut station, 20.0);
    let passed = sensors_passed(&station);
    assert_eq!(passed.get(..4), Some([0, 10, 12, 14].as_slice()), "over S0 into the inner loop: {passed:?}");
    // Märklin's points are moved by a train that comes from the wrong leg.
    assert!(station.world.incidents().is_empty(), "{:?}", station.world.incidents());
}

#[test]
fn a_reversed_train_stops_dead_and_comes_back() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    put(&mut station, TRAIN, "S1", "S2", 300.0);
    say(&mut station, &[10, 24]);
    wait(&mut station, 6.0);
    let before = station.world.truth().train(TRAIN).unwrap();
    assert!(before.speed.as_mm_per_s() > 200.0);
    say(&mut station, &[15, 24]);
    wait(&mut station, 1.0);
    let stopped = station.world.truth().train(TRAIN).unwrap();
    assert!(stopped.at_rest_since.is_some());
    let gone = (stopped.odometer - before.odometer).as_mm();
    let heard = before.speed.as_mm_per_s() * 0.2;
    assert!(gone < heard + 70.0, "{gone} mm");
    let edge_before = stopped.position.unwrap().edge;
    let last = *station.world.truth().passes().last().unwrap();
    say(&mut station, &[10, 24]);
    wait(&mut station, 8.0);
    let passes = station.world.truth().passes();
    let next = passes.iter().find(|pass| pass.at > last.at).unwrap();
    assert_eq!(next.sensor, SensorId(last.sensor.0 ^ 1), "the same place, in the other direction");
    assert!(layout.edge(edge_before).is_some());
}

#[test]
fn the_other_end_of_the_shoe_leads_after_turning() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    put(&mut station, TRAIN, "S1", "S2", 300.0);
    let shoe = station.world.truth().engine(TRAIN).unwrap().shoe.as_mm();
    say(&mut station, &[15, 24]);
    wait(&mut station, 0.5);
    let position = station.world.truth().train(TRAIN).unwrap().position.unwrap();
    assert!((position.offset.as_mm() - (900.0 - 300.0 + shoe)).abs() < 1e-6, "{position:?}");
}

#[test]
fn trains_that_meet_collide_and_stay_where_they_are() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    put(&mut station, TRAIN, "S1", "S2", 300.0);
    put(&mut station, OTHER, "R3", "R2", 300.0);
    say(&mut station, &[8, 24]);
    say(&mut station, &[12, 58]);
    wait(&mut station, 20.0);
    let incidents = station.world.incidents();
    let kinds: Vec<IncidentKind> = incidents.iter().map(|incident| incident.kind).collect();
    assert_eq!(kinds, [IncidentKind::Collision { with: OTHER }, IncidentKind::Collision { with: TRAIN }]);
    let truth = station.world.truth();
    for train in [TRAIN, OTHER] {
        assert_eq!(truth.train(train).unwrap().at_rest_since, Some(incidents[0].at));
        assert!(truth.train(train).unwrap().is_wrecked);
    }
}

#[test]
fn trains_that_meet_on_a_crossing_collide() {
    let plain = two_loops();
    let at = |from: &str, to: &str, mm| {
        let node = |name| plain.node_named(name).unwrap();
        Position { edge: plain.edge_between(node(from), node(to)).unwrap(), offset: Length::from_mm(mm) }
    };
    let crossed = plain.clone().with_crossing([at("S1", "S2", 600.0), at("S5", "S6", 600.0)]).unwrap();
    for (layout, expected) in [(&plain, 0), (&crossed, 2)] {
        let mut station = empty(layout, StationSwitches::default());
        put(&mut station, TRAIN, "S1", "S2", 100.0);
        put(&mut station, OTHER, "S5", "S6", 100.0);
        say(&mut station, &[8, 24]);
        say(&mut station, &[8, 58]);
        wait(&mut station, 5.0);
        assert_eq!(station.world.incidents().len(), expected);
    }
}

#[test]
fn points_thrown_under_a_train_derail_it() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    // The shoe 60 mm past the toe: its tail is on the blades.
    put(&mut station, TRAIN, "B1", "S1", 60.0);
    say(&mut station, &[34, 1]);
    wait(&mut station, 0.4);
    let kinds: Vec<IncidentKind> = station.world.incidents().iter().map(|incident| incident.kind).collect();
    assert_eq!(kinds, [IncidentKind::Derailment { turnout: TurnoutId(1) }]);
}

#[test]
fn a_train_that_backs_over_points_it_has_forced_derails() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    // From the curved leg of turnout 1, which lies straight, half through its toe.
    put(&mut station, TRAIN, "M1", "R0", 60.0);
    station.world.lay(TurnoutId(1), Leg::Curved);
    say(&mut station, &[15, 24]);
    assert!(station.world.incidents().is_empty());
    say(&mut station, &[10, 24]);
    wait(&mut station, 3.0);
    let kinds: Vec<IncidentKind> = station.world.incidents().iter().map(|incident| incident.kind).collect();
    assert_eq!(kinds, [IncidentKind::Derailment { turnout: TurnoutId(1) }]);
}

#[test]
fn a_train_runs_off_the_end_of_a_siding() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    put(&mut station, TRAIN, "S8", "X", 300.0);
    say(&mut station, &[10, 24]);
    wait(&mut station, 20.0);
    let incidents = station.world.incidents();
    assert_eq!(incidents.iter().map(|incident| incident.kind).collect::<Vec<_>>(), [IncidentKind::Overrun]);
}

#[test]
fn without_power_everything_stops_and_with_power_it_goes_on() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    put(&mut station, TRAIN, "S1", "S2", 300.0);
    say(&mut station, &[10, 24]);
    wait(&mut station, 6.0);
    let before = station.world.truth().train(TRAIN).unwrap().odometer;
    say(&mut station, &[97]);
    wait(&mut station, 1.0);
    let stopped = station.world.truth().train(TRAIN).unwrap();
    assert!(stopped.at_rest_since.is_some());
    assert!((stopped.odometer - before).as_mm() < 200.0);
    say(&mut station, &[96]);
    wait(&mut station, 3.0);
    assert!(station.world.truth().train(TRAIN).unwrap().speed.as_mm_per_s() > 50.0);
}

#[test]
fn hands_lift_push_dirty_and_swap() {
    let layout = two_loops();
    let no_wire = StationSwitches { cts: CtsSwitch::None, ..StationSwitches::default() };
    let mut station = empty(&layout, no_wire);
    put(&mut station, TRAIN, "S1", "S2", 800.0);
    station.world.push(TRAIN, footplate_core::Length::from_mm(150.0));
    assert_eq!(sensors_passed(&station), [4]);
    station.world.lift(TRAIN);
    assert!(station.world.truth().train(TRAIN).unwrap().position.is_none());
    put(&mut station, TRAIN, "S5", "S6", 300.0);
    station.world.dirty_wheels(TRAIN, 0.8);
    for byte in [10, 24] {
        station.write(byte);
    }
    wait(&mut station, 10.0);
    let truth = station.world.truth();
    let engine = truth.engine(TRAIN).unwrap();
    let step = footplate_core::SpeedStep::new(10).unwrap();
    let clean = engine.speeds.speed(step, footplate_core::Approach::Below).as_mm_per_s();
    let now = truth.train(TRAIN).unwrap().speed.as_mm_per_s();
    assert!((now / clean - 0.8).abs() < 0.04, "{now} of {clean}");
    let other = footplate_sim::Train::draw(5, footplate_sim::LawFamily::Lag);
    station.world.swap(TRAIN, other.clone(), 1.0).unwrap();
    assert_eq!(station.world.truth().engine(TRAIN), Some(&other));
    assert!(station.world.truth().train(TRAIN).unwrap().at_rest_since.is_some());
}

#[test]
fn what_a_train_passed_before_it_was_lifted_is_no_distance_from_there() {
    let layout = two_loops();
    let mut station = empty(&layout, StationSwitches::default());
    put(&mut station, TRAIN, "S1", "S2", 300.0);
    let node = |name| layout.node_named(name).unwrap();
    let behind = layout.sensor_at(node("S2")).unwrap();
    let past = |station: &VirtualStation<'_>| station.world.truth().past(TRAIN, behind).unwrap().as_mm();
    say(&mut station, &[10, 24]);
    while sensors_passed(&station).is_empty() {
        wait(&mut station, 0.2);
    }
    say(&mut station, &[0, 24]);
    wait(&mut station, 8.0);
    assert!(past(&station) > 0.0);
    let edge = layout.edge_between(node("S2"), node("S3")).unwrap();
    let mut put_down = |mm: f64| {
        let at = Position { edge, offset: Length::from_mm(mm) };
        station.world.place(TRAIN, at, End::Nose).unwrap();
        past(&station)
    };
    // It has not come by there since: the next time is nearly a round ahead.
    let (first, second) = (put_down(250.0), put_down(300.0));
    assert!(first < -1000.0 && (second - first - 50.0).abs() < 1e-6, "{first} {second}");
}

#[test]
fn every_train_drawn_can_run_round_its_circuit_while_the_others_stand() {
    let layout = two_loops();
    for seed in 1..20 {
        let switches = LivingSwitches { turnouts_set: true, ..LivingSwitches::faultless() };
        for (nth, train) in [TRAIN, OTHER].into_iter().enumerate() {
            let mut station = VirtualStation::draw(&layout, seed, &[TRAIN, OTHER], &switches).unwrap();
            let (id, circuit) = station.world.homes()[nth].clone();
            assert_eq!(id, train);
            for (turnout, leg) in circuit.turnouts() {
                station.world.lay(turnout, leg);
            }
            say(&mut station, &[11, train.0 as u8]);
            wait(&mut station, 30.0);
            assert!(station.world.incidents().is_empty(), "seed {seed}: {:?}", station.world.incidents());
            // In one direction of the circuit or the other.
            let met = |sensor: SensorId| {
                let passes = station.world.truth().passes();
                passes.iter().any(|pass| pass.sensor == sensor || pass.sensor.0 == sensor.0 ^ 1)
            };
            assert!(circuit.sensors(&layout).into_iter().all(met), "seed {seed}: train {train}");
        }
    }
}
