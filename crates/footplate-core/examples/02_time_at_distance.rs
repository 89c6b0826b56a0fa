//! When a train that pulls away passes three sensors, by each law of speed change.
//!
//! The laws agree on speed and time, and differ in between: that is why a train's own law has to be found out.

use footplate_core::kinematics::{Motion, SpeedLaw};
use footplate_core::{Length, Speed, TimeSpan};

fn main() {
    let target = Speed::from_mm_per_s(412.0);
    let sensors = [100.0, 300.0, 500.0].map(Length::from_mm);

    print!("{:<20}", "seconds from rest to");
    for sensor in sensors {
        print!("{:>9.0} mm", sensor.as_mm());
    }
    println!();
    for law in SpeedLaw::ALL {
        // The lag's time is its time constant: about a third of what it takes to be as good as there.
        let time = if law == SpeedLaw::Lag { TimeSpan::from_s(1.0) } else { TimeSpan::from_s(3.0) };
        let start = law.between(Speed::ZERO, target, time);
        print!("{:<20}", format!("{law:?}"));
        for sensor in sensors {
            match start.time_at(sensor) {
                Some(time) => print!("{:>12.3}", time.as_s()),
                None => print!("{:>12}", "never"),
            }
        }
        println!();
    }
}
