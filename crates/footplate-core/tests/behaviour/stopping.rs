//! Stopping distances and times follow their laws, state what they are measured from, and lead back to the speed.

use footplate_core::kinematics::{
    Braking, FromBraking, FromCommand, Motion, StoppingDistance, StoppingError, StoppingLaw,
};
use footplate_core::{Acceleration, Length, Speed, TimeSpan};
use proptest::prelude::*;

use crate::draw::Draw;

fn constant(deceleration_mm_per_s2: f64) -> Braking {
    Braking::Constant(Acceleration::from_mm_per_s2(deceleration_mm_per_s2))
}

#[test]
fn half_a_metre_from_half_a_metre_per_second_takes_two_seconds() {
    // τ₃ = 2σ₃/v
    let law = StoppingLaw::<FromBraking>::new(TimeSpan::ZERO, constant(250.0)).unwrap();
    let speed = Speed::from_mm_per_s(500.0);
    assert!((law.distance(speed).length().as_mm() - 500.0).abs() < 1e-9);
    assert_eq!(law.time(speed), TimeSpan::from_ms(2000));
}

#[test]
fn two_terms_add_up() {
    // 1.1 s and 400 mm/s²: 480 mm/s runs 528 mm before and 288 mm while braking.
    let law = StoppingLaw::<FromCommand>::new(TimeSpan::from_ms(1100), constant(400.0)).unwrap();
    let speed = Speed::from_mm_per_s(480.0);
    assert!((law.distance(speed).length().as_mm() - 816.0).abs() < 1e-9);
    assert_eq!(law.time(speed), TimeSpan::from_ms(2300));
    let back = law.speed_for(StoppingDistance::new(Length::from_mm(816.0)));
    assert!((back - speed).abs() < Speed::from_mm_per_s(1e-9));
}

#[test]
fn an_exponential_stop_runs_its_delay_and_its_time_constant() {
    let law = StoppingLaw::<FromCommand>::new(
        TimeSpan::from_ms(200),
        Braking::Exponential(TimeSpan::from_ms(1200)),
    )
    .unwrap();
    let speed = Speed::from_mm_per_s(400.0);
    assert!((law.distance(speed).length().as_mm() - 560.0).abs() < 1e-9);
    // 400 mm/s shrink to 1 mm/s in ln 400 time constants.
    assert!((law.time(speed).as_s() - (0.2 + 1.2 * 400.0_f64.ln())).abs() < 2e-9);
    // The rest is 1 mm/s times 1.2 s.
    let run = law.change_from(speed).distance().as_mm();
    assert!((run - (480.0 - 1.2)).abs() < 1e-9);
}

#[test]
fn a_delay_of_the_command_moves_into_the_law() {
    let braking = StoppingLaw::<FromBraking>::new(TimeSpan::from_ms(700), constant(300.0)).unwrap();
    let (command_delay, to_stamp, poll) =
        (TimeSpan::from_ms(120), TimeSpan::from_ms(10), TimeSpan::from_ms(66));
    let command = braking.counted_from_command(command_delay).unwrap();
    let report = command.counted_from_report(to_stamp, poll).unwrap();
    assert_eq!(report.delay(), TimeSpan::from_ms(700 + 120 + 10 + 33));
    assert_eq!(
        braking.counted_from_command(TimeSpan::from_ms(-780)),
        Err(StoppingError::NegativeDelay { found: TimeSpan::from_ms(-80) })
    );
}

#[test]
fn laws_that_never_stop_a_train_are_rejected() {
    type Law = StoppingLaw<FromBraking>;
    for deceleration in [0.0, -100.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            Law::new(TimeSpan::ZERO, constant(deceleration)),
            Err(StoppingError::NoDeceleration { .. })
        ));
    }
    let refused = Law::new(TimeSpan::ZERO, Braking::Exponential(TimeSpan::ZERO)).unwrap_err();
    assert_eq!(refused.to_string(), "the time constant of a stop should be above zero, not 0 ms");
    let refused = Law::new(TimeSpan::from_ms(-80), constant(100.0)).unwrap_err();
    assert_eq!(refused.to_string(), "the delay before braking should be zero or more, not -80 ms");
}

#[test]
fn a_hundred_thousand_random_stops_lead_back_to_their_speed() {
    let mut draw = Draw::new(3);
    for _ in 0..100_000 {
        let delay = TimeSpan::from_s(if draw.one_in(4) { 0.0 } else { draw.magnitude(0.01, 3.0) });
        let braking = if draw.one_in(3) {
            Braking::Exponential(TimeSpan::from_s(draw.magnitude(0.1, 5.0)))
        } else {
            Braking::Constant(Acceleration::from_m_per_s2(draw.magnitude(0.02, 3.0)))
        };
        let law = StoppingLaw::<FromCommand>::new(delay, braking).unwrap();
        let speed = draw.speed();
        let distance = law.distance(speed);
        let back = law.speed_for(distance);
        assert!(
            (back - speed).abs().as_m_per_s() <= 1e-14 * speed.as_m_per_s(),
            "{law:?} from {speed:?}: {back:?}"
        );
        // The braking motion covers what remains of the law's distance after the delay.
        let braked = law.change_from(speed).distance() + speed * delay;
        let unfinished = match braking {
            // Braking time is rounded to nanoseconds, in each of which the train runs at half of its speed.
            Braking::Constant(_) => 1e-9 * speed.as_m_per_s() + 1e-14 * distance.length().as_m(),
            Braking::Exponential(time_constant) => 1.000_001e-3 * time_constant.as_s(),
        };
        assert!((distance.length() - braked).abs().as_m() <= unfinished, "{law:?} from {speed:?}");
    }
}

proptest! {
    #[test]
    fn any_numbers_give_a_law_or_an_error(ns in any::<i64>(), number in any::<f64>(), speed in any::<f64>()) {
        let braking = [
            Braking::Constant(Acceleration::from_m_per_s2(number)),
            Braking::Exponential(TimeSpan::from_s(number)),
        ];
        for braking in braking {
            if let Ok(law) = StoppingLaw::<FromBraking>::new(TimeSpan::from_ns(ns), braking) {
                let distance = law.distance(Speed::from_m_per_s(speed));
                let _ = (law.time(Speed::from_m_per_s(speed)), law.speed_for(distance));
            }
        }
    }
}
