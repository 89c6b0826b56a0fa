//! How far a train still runs when it is commanded to stop: counted from the brakes, from the command, and from the
//! report that prompts it.

use footplate_core::kinematics::{Braking, FromBraking, StoppingError, StoppingLaw};
use footplate_core::{Acceleration, Speed, TimeSpan};

fn main() -> Result<(), StoppingError> {
    // An H0 train at a brisk pace, whose decoder lets it down evenly.
    let speed = Speed::from_mm_per_s(412.0);
    let braking = Braking::Constant(Acceleration::from_mm_per_s2(120.0));

    // On a 6051: a command waits its turn on the line, and sensors are read every 65 ms.
    let command_delay = TimeSpan::from_ms(90);
    let (to_stamp, poll_interval) = (TimeSpan::from_ms(50), TimeSpan::from_ms(65));

    let from_braking = StoppingLaw::<FromBraking>::new(TimeSpan::ZERO, braking)?;
    let from_command = from_braking.counted_from_command(command_delay)?;
    let from_report = from_command.counted_from_report(to_stamp, poll_interval)?;

    println!("at {:.0} mm/s the train stops", speed.as_mm_per_s());
    println!("  {:.0} mm after it begins to brake", from_braking.distance(speed).length().as_mm());
    println!("  {:.0} mm after the command", from_command.distance(speed).length().as_mm());
    println!(
        "  {:.0} mm after the sensor whose report prompts it",
        from_report.distance(speed).length().as_mm()
    );
    Ok(())
}
