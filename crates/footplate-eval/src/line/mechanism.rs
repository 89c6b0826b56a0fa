//! What made the largest error of a world, as far as its truth at that moment tells.

use footplate_core::odometry::Mode;
use footplate_core::{Acceleration, Speed, TimeSpan};
use footplate_sim::line::WheelTruth;
use footplate_store::odometry::WorstMoment;

/// A speed below which a part of it says nothing (m/s): creepage is then given as a difference.
const SLOW_M_S: f64 = 1.0;

/// Wheels, sensors, command, rail and train at the moment, and what the odometer took them to do.
pub(crate) fn mechanism(worst: &WorstMoment) -> String {
    let mut parts = vec![wheels(worst)];
    parts.extend(worst.faulty_count.map(|count| match count {
        0 => "second sensor dead".to_owned(),
        count => format!("second sensor stuck at {count}"),
    }));
    parts.push(command(worst.command));
    // The rail matters where wheels have left its speed.
    let slips = worst.truth.wheels.map(|does| does != WheelTruth::Rolling);
    let adhesion = worst.truth.adhesion.iter().zip(slips).filter(|(_, slips)| *slips);
    let carried: Vec<String> = adhesion.map(|(adhesion, _)| format!("{:.3}", adhesion.abs())).collect();
    if !carried.is_empty() {
        parts.push(format!("adhesion {}", carried.join(" and ")));
    }
    parts.push(format!(
        "train at {:.1} m/s with {} m/s², {}, estimated {}",
        worst.truth.speed.as_m_per_s(),
        hundredths(worst.truth.acceleration),
        taken_for(worst.mode),
        hundredths(worst.estimated),
    ));
    parts.join("; ")
}

/// With its sign, and no −0.00.
fn hundredths(acceleration: Acceleration) -> String {
    format!("{:+.2}", (100.0 * acceleration.as_m_per_s2()).round() / 100.0 + 0.0)
}

fn wheels(worst: &WorstMoment) -> String {
    let [first, second] = [0, 1].map(|wheel: usize| {
        does(worst.truth.wheels[wheel], worst.truth.wheel_speeds[wheel], worst.truth.speed)
    });
    let lasts = |wheel: usize| match worst.slipping_for[wheel] {
        TimeSpan::ZERO => String::new(),
        span => format!(" for {:.1} s", span.as_s()),
    };
    if first == second && lasts(0) == lasts(1) {
        format!("both {first}{}", lasts(0))
    } else {
        format!("first {first}{}, second {second}{}", lasts(0), lasts(1))
    }
}

/// What a wheelset does, and by how much.
fn does(does: WheelTruth, wheel: Speed, train: Speed) -> String {
    let by = || {
        let creep = (wheel - train).as_m_per_s() * if train < Speed::ZERO { -1.0 } else { 1.0 };
        if train.abs().as_m_per_s() < SLOW_M_S {
            format!("{creep:+.1} m/s")
        } else {
            format!("{:+.0} %", 100.0 * creep / train.abs().as_m_per_s())
        }
    };
    match does {
        WheelTruth::Rolling => "rolling".to_owned(),
        WheelTruth::Slip => format!("spinning {}", by()),
        WheelTruth::Slide => format!("sliding {}", by()),
        WheelTruth::Locked => "locked".to_owned(),
    }
}

fn command(effort: Option<f64>) -> String {
    match effort {
        None => "command not recorded".to_owned(),
        Some(0.0) => "coasting".to_owned(),
        Some(effort) if effort < 0.0 => format!("brake {:.2}", -effort),
        Some(effort) => format!("traction {effort:.2}"),
    }
}

fn taken_for(mode: Mode) -> &'static str {
    match mode {
        Mode::Normal => "both taken to roll",
        Mode::OneSlip => "one taken to slip",
        Mode::Correction => "both taken to slip",
        Mode::Ambiguous => "nothing taken for sure",
        Mode::Degraded => "a sensor taken for dead",
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::{Length, Timestamp};
    use footplate_sim::line::LineTruth;
    use footplate_store::odometry::WheelPhase;

    use super::*;

    fn moment() -> WorstMoment {
        let speed = Speed::from_m_per_s;
        WorstMoment {
            time: Timestamp::ZERO,
            error_m_s: 9.0,
            phase: WheelPhase::BothSlip,
            mode: Mode::Correction,
            estimated: Acceleration::from_m_per_s2(-0.1),
            truth: LineTruth {
                speed: speed(20.0),
                distance: Length::ZERO,
                acceleration: Acceleration::from_m_per_s2(-0.455),
                wheel_speeds: [0.0, 0.0].map(speed),
                adhesion: [-0.012, -0.014],
                friction: [0.015; 2],
                wheels: [WheelTruth::Locked; 2],
            },
            slipping_for: [TimeSpan::from_ms(23_400); 2],
            command: Some(-0.8),
            faulty_count: None,
        }
    }

    #[test]
    fn it_says_what_wheels_rail_and_train_did_and_what_they_were_taken_for() {
        assert_eq!(
            mechanism(&moment()),
            "both locked for 23.4 s; brake 0.80; adhesion 0.012 and 0.014; train at 20.0 m/s with -0.46 m/s², both taken to \
             slip, estimated -0.10"
        );
    }

    #[test]
    fn it_names_the_wheel_that_slips_and_the_sensor_that_is_dead() {
        let mut moment = moment();
        moment.truth.wheels = [WheelTruth::Slip, WheelTruth::Rolling];
        moment.truth.wheel_speeds = [24.0, 20.0].map(Speed::from_m_per_s);
        moment.slipping_for = [TimeSpan::from_ms(500), TimeSpan::ZERO];
        (moment.command, moment.faulty_count, moment.mode) = (None, Some(0), Mode::Degraded);
        assert_eq!(
            mechanism(&moment),
            "first spinning +20 % for 0.5 s, second rolling; second sensor dead; command not recorded; adhesion 0.012; train \
             at 20.0 m/s with -0.46 m/s², a sensor taken for dead, estimated -0.10"
        );
        moment.truth.speed = Speed::ZERO;
        moment.faulty_count = Some(7);
        let said = mechanism(&moment);
        assert!(
            said.starts_with("first spinning +24.0 m/s for 0.5 s")
                && said.contains("second sensor stuck at 7"),
            "{said}"
        );
    }
}
