//! What two sensors say of an acceleration: whether the train reached its target speed between them, and how fast it
//! got there.
//!
//! The command leaves at the first sensor. The true train speeds up from 200 to 500 mm/s at 150 mm/s², 90 ms after the
//! command, so that the change is over after 2.09 s and 718 mm.

use footplate_core::kinematics::{
    ConstantAcceleration, Motion, TwoSensorError, TwoSensorRun, TwoSensorVerdict,
};
use footplate_core::{Acceleration, Estimate, Length, Speed, TimeSpan, Timestamp};

fn main() -> Result<(), TwoSensorError> {
    let (from, to) = (Speed::from_mm_per_s(200.0), Speed::from_mm_per_s(500.0));
    let command_delay = TimeSpan::from_ms(90);
    let truth = ConstantAcceleration::with_acceleration(from, to, Acceleration::from_mm_per_s2(150.0));

    for distance in [100.0, 300.0, 700.0, 1000.0, 3000.0].map(Length::from_mm) {
        let Some(time) = truth.time_at(distance - from * command_delay) else { continue };
        // Known as well as a tape, a poll of 65 ms and a speed table know them.
        let run = TwoSensorRun {
            distance: known(distance, Length::from_mm(3.0)),
            before_command: known(TimeSpan::ZERO, TimeSpan::ZERO),
            time: known(time + command_delay, TimeSpan::from_ms(19)),
            from: known(from, Speed::from_mm_per_s(2.0)),
            to: known(to, Speed::from_mm_per_s(4.0)),
            command_delay: known(command_delay, TimeSpan::from_ms(5)),
        };
        print!("second sensor after {:>4.0} mm: ", distance.as_mm());
        match run.verdict()? {
            TwoSensorVerdict::Completed { acceleration, duration } => {
                println!("target speed reached after {:.2} s, {}", duration.as_s(), shown(acceleration));
            }
            TwoSensorVerdict::Unfinished { acceleration, speed } => {
                println!("still changing at {:.0} mm/s, {}", speed.as_mm_per_s(), shown(acceleration));
            }
            TwoSensorVerdict::Undecided { if_completed, if_unfinished } => {
                println!("cannot tell: {} if reached, {} if not", shown(if_completed), shown(if_unfinished));
            }
            TwoSensorVerdict::TooQuick => println!("over too soon to be measured: take a nearer sensor"),
            TwoSensorVerdict::NotNoticed => println!("no change noticed yet: take a sensor farther on"),
        }
    }
    Ok(())
}

fn known<Q>(value: Q, uncertainty: Q) -> Estimate<Q> {
    Estimate { value, uncertainty, count: 1, date: Timestamp::ZERO }
}

fn shown(acceleration: Estimate<Acceleration>) -> String {
    let (value, deviation) = (acceleration.value.as_mm_per_s2(), acceleration.uncertainty.as_mm_per_s2());
    format!("{value:.0} ± {deviation:.0} mm/s²")
}
