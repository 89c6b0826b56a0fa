//! When to command the stop of a short move: by the laws of starting and stopping alone, and by a table of measured
//! moves that corrects them.
//!
//! The table is a team's tape measure: train 58, course CS 452 of the University of Waterloo, autumn 2023. Every other
//! move corrects the laws; those between are compared with the tape. The laws were fitted to all sixteen, the table knows
//! only eight: a table is as good as each of its tapes, a law averages over them.

use std::error::Error;

use footplate_core::kinematics::{Braking, ShortMove, SpeedLaw, StoppingLaw};
use footplate_core::{Acceleration, Length, Speed, TimeSpan};

/// How far the train got (mm) when the stop was commanded after 0.25 s, 0.5 s and so on.
const MEASURED_MM: [f64; 16] = [
    10.0, 25.0, 72.0, 118.0, 192.0, 245.0, 290.0, 330.0, 384.0, 446.0, 477.0, 540.0, 575.0, 639.0, 672.0,
    714.0,
];

fn main() -> Result<(), Box<dyn Error>> {
    // Least squares on all sixteen moves, found outside of this program.
    let top = Speed::from_mm_per_s(191.9);
    let start = SpeedLaw::ConstantAcceleration.between(Speed::ZERO, top, TimeSpan::from_ms(1268));
    let braking = Braking::Constant(Acceleration::from_mm_per_s2(229.7));
    let by_law = ShortMove::new(TimeSpan::from_ms(17), start, StoppingLaw::new(TimeSpan::ZERO, braking)?)?;

    let moves: Vec<(TimeSpan, Length)> = (1..)
        .zip(MEASURED_MM)
        .map(|(quarter, mm)| (TimeSpan::from_ms(250 * quarter), Length::from_mm(mm)))
        .collect();
    let table: Vec<_> = moves.iter().copied().skip(1).step_by(2).collect();
    let by_table = by_law.corrected_by(&table)?;

    println!("stop after   measured   by law   by table");
    let mut squares = [0.0; 2];
    let predicted: Vec<_> = moves.iter().copied().step_by(2).collect();
    for &(time, measured) in &predicted {
        let distances = [&by_law, &by_table].map(|model| model.distance(time));
        println!(
            "{:>8.2} s {:>7.0} mm {:>5.0} mm {:>7.0} mm",
            time.as_s(),
            measured.as_mm(),
            distances[0].as_mm(),
            distances[1].as_mm()
        );
        for (sum, distance) in squares.iter_mut().zip(distances) {
            *sum += (distance - measured).as_mm().powi(2);
        }
    }
    let [law, tabled] = squares.map(|sum| (sum / predicted.len() as f64).sqrt());
    println!("error (rms): {law:.1} mm by law, {tabled:.1} mm by table");
    for distance in [37.0, 150.0, 500.0].map(Length::from_mm) {
        if let Some(time) = by_table.command_time(distance) {
            println!("to move {:.0} mm: command the stop after {:.2} s", distance.as_mm(), time.as_s());
        }
    }
    Ok(())
}
