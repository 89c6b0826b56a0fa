//! Any train on any line, on wheels: it keeps to the line's limits and stops where trains stop.

use footplate_core::{Acceleration, Length, Ratio, Speed, TimeSpan};
use footplate_sim::line::{
    Brake, Journey, JourneyError, LineConditions, LineParts, LineProfile, LineService, Resistance, Stop,
    Style, TractiveEffort, Train, WheelTruth,
};

fn train() -> Train {
    Train {
        name: "unit".to_owned(),
        length: Length::from_m(100.0),
        weight_length: Length::from_m(100.0),
        mass_kg: 180e3,
        rotating_mass: Ratio::from_percent(7.0),
        resistance: Resistance::davis(3000.0, 40.0, 8.0),
        tractive_effort: TractiveEffort::ForceAndPower { force_n: 150e3, power_w: 2.4e6 },
        brake: Brake { service: Acceleration::from_m_per_s2(0.7), full_n: 193e3 },
        max_speed: Speed::from_m_per_s(44.0),
        max_acceleration: None,
    }
}

fn line() -> LineProfile {
    let place = Length::from_m;
    let stop = |at: f64| Stop { name: format!("at {at}"), at: place(at), dwell: TimeSpan::from_s(20.0) };
    LineProfile::new(LineParts {
        name: "valley".to_owned(),
        gradients: vec![(place(0.0), 0.0), (place(2000.0), 12.0), (place(5000.0), -8.0)],
        curve_resistances: vec![(place(0.0), 0.0), (place(3000.0), 1.5), (place(3600.0), 0.0)],
        speed_limits: vec![
            (place(0.0), Speed::from_m_per_s(22.0)),
            (place(1500.0), Speed::from_m_per_s(36.0)),
            (place(6000.0), Speed::from_m_per_s(25.0)),
        ],
        stops: vec![stop(500.0), stop(4200.0), stop(8000.0)],
    })
    .unwrap()
}

#[test]
fn a_train_on_wheels_keeps_to_limits_and_stops_where_it_should() {
    let service = LineService::new(train(), line()).unwrap();
    let body = Journey::run(&train(), &line(), Style::FASTEST, TimeSpan::from_ms(50)).unwrap();
    for seed in 0..6 {
        let run = service.run(seed, LineConditions::default());
        let at = |distance: Length| (distance.as_m() + 500.0).clamp(500.0, 8000.0);
        for truth in &run.truth {
            let place = at(truth.distance);
            let limit = if place < 1500.0 { 22.0 } else { 36.0 };
            // The tail clears the last limit 100 m on; braking to it is a second's work.
            let limit = if place > 6000.0 { 25.0 } else { limit };
            assert!(truth.speed.as_m_per_s() < limit + 1.0, "seed {seed} at {place}: {:?}", truth.speed);
            assert_eq!(truth.wheels, [WheelTruth::Rolling; 2]);
        }
        let last = run.truth.last().unwrap();
        assert_eq!(last.speed, Speed::ZERO, "seed {seed}");
        assert!((last.distance.as_m() - 7500.0).abs() < 8.0, "seed {seed}: {:?}", last.distance);
        // Brakes that build up and a tired motor cost some time; a good one gains a little.
        let took = run.samples.last().unwrap().time.as_s() - 10.0;
        let ideal = body.time().as_s();
        assert!((0.95 * ideal..1.25 * ideal).contains(&took), "seed {seed}: {took} s, as one body {ideal} s");
        let stands =
            run.truth.iter().filter(|truth| truth.speed == Speed::ZERO && truth.distance.as_m() > 100.0);
        assert!(stands.count() > 20 * 20, "seed {seed}: it stands at the stop between");
        assert!(run.samples.iter().filter(|sample| sample.balise.is_some()).count() >= 3);
    }
}

#[test]
fn a_train_of_a_service_does_no_more_than_is_claimed_of_it() {
    let service = LineService::new(train(), line()).unwrap();
    for seed in 0..6 {
        let run = service.run(seed, LineConditions::default());
        for truth in &run.truth {
            assert!(truth.acceleration <= run.vehicle.max_traction, "seed {seed}: {truth:?}");
            assert!(
                Acceleration::ZERO - truth.acceleration <= run.vehicle.max_brake,
                "seed {seed}: {truth:?}"
            );
            assert!(truth.speed <= run.vehicle.max_speed, "seed {seed}: {truth:?}");
        }
    }
}

#[test]
fn a_train_that_cannot_climb_is_refused() {
    let weak =
        Train { tractive_effort: TractiveEffort::ForceAndPower { force_n: 15e3, power_w: 1e6 }, ..train() };
    assert!(matches!(LineService::new(weak, line()), Err(JourneyError::Stalled { .. })));
}
