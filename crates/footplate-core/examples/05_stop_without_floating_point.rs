//! When to command a stop on a controller without floating point: constants are made once, and everything after that is whole
//! numbers, tenths of a millimetre and ticks of a millisecond.

use std::error::Error;

use footplate_core::kinematics::{Braking, IntegerStop, StoppingLaw};
use footplate_core::{Acceleration, Speed, TimeSpan};

/// Where the train shall rest, in tenths of a millimetre from the sensor that it passes at tick 0.
const TARGET: i32 = 15_000;

fn main() -> Result<(), Box<dyn Error>> {
    // On a computer: what a calibration says of the train at one step.
    let speed = Speed::from_mm_per_s(544.0);
    let braking = Braking::Constant(Acceleration::from_mm_per_s2(160.0));
    let law = StoppingLaw::new(TimeSpan::from_ms(180), braking)?;
    let stop = IntegerStop::new(speed, &law, TimeSpan::from_ms(1))?;

    // On the controller, from here on without floating point.
    let command = stop.command_in(TARGET);
    println!("rests {} units and {} ticks after the command", stop.stopping_distance(), stop.stopping_time());
    println!("passes the sensor at tick 0, is told to stop at tick {command}");
    println!("told at once it would end {} units before the target", -stop.overrun(TARGET));
    println!(
        "told 50 ticks late it ends {} units beyond it",
        stop.run(command + 50) + stop.stopping_distance() - TARGET
    );
    println!("\n   tick    units");
    for tick in (0..=5_000).step_by(1_000) {
        let before = stop.run(tick.min(command));
        println!("{tick:>7} {:>8}", before + stop.run_since_command((tick - command).max(0)));
    }
    Ok(())
}
