//! When to command a stop on a controller without floating point: a computer calculates nine constants, the controller takes
//! them, and everything after that is integers, tenths of a millimetre and ticks of a millisecond.

use std::error::Error;

use footplate_core::kinematics::{Braking, FromCommand, IntegerStop, Motion, StoppingLaw};
use footplate_core::{Acceleration, Speed, TimeSpan};

/// Where the train shall come to rest, in tenths of a millimetre from the sensor that it passes at tick 0.
const TARGET: i32 = 15_000;

fn main() -> Result<(), Box<dyn Error>> {
    // On a computer: what a calibration says of the train at one step.
    let speed = Speed::from_mm_per_s(544.0);
    let braking = Braking::Constant(Acceleration::from_mm_per_s2(160.0));
    let law = StoppingLaw::new(TimeSpan::from_ms(180), braking)?;
    let constants = IntegerStop::new(speed, &law, TimeSpan::from_ms(1))?.constants();
    println!("constants: {constants:?}");

    // On the controller, from here on without floating point.
    let stop = IntegerStop::from_constants(constants)?;
    let command = stop.command_in(TARGET);
    println!("stopping distance: {} units in {} ticks", stop.stopping_distance(), stop.stopping_time());
    println!("command the stop at tick {command}");
    println!("commanded at tick 0 the train ends {} units before the target", -stop.overrun(TARGET));
    let late = command + 50;
    println!("commanded 50 ticks late it ends {} units beyond", stop.overrun(TARGET - stop.run(late)));
    println!("\n   tick    units   in floating point");
    for tick in (0..=5_000).step_by(1_000) {
        let since = tick - command;
        let units =
            if since < 0 { stop.run(tick) } else { stop.run(command) + stop.run_since_command(since) };
        let exact = exact_place(speed, &law, tick, command);
        println!("{tick:>7} {units:>8} {exact:>19.2}");
    }
    Ok(())
}

/// The same place by the law in floating point, in units.
fn exact_place(speed: Speed, law: &StoppingLaw<FromCommand>, tick: i64, command: i64) -> f64 {
    let since = TimeSpan::from_ms((tick - command).max(0));
    let delayed = since.min(law.delay());
    let steady = speed * (TimeSpan::from_ms(tick.min(command)) + delayed);
    let braked = law.change_from(speed).state_at(since - delayed).distance;
    (steady + braked).as_m() / IntegerStop::UNIT.as_m()
}
