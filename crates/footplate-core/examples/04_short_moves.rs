//! When to command the stop of a short move: by the laws of starting and stopping alone, and by a table of measured
//! moves that corrects them.
//!
//! The moves are a team's tape measure: train 58, course CS 452 of the University of Waterloo, autumn 2023. Each is
//! predicted from the others: a table is as good as each of its tapes, a law averages over them.

use std::error::Error;

use footplate_core::model::report::ShortMoveFit;
use footplate_core::{Length, TimeSpan};

/// How far the train got (mm) when the stop was commanded after 0.25 s, 0.5 s and so on.
const MEASURED_MM: [f64; 16] = [
    10.0, 25.0, 72.0, 118.0, 192.0, 245.0, 290.0, 330.0, 384.0, 446.0, 477.0, 540.0, 575.0, 639.0, 672.0,
    714.0,
];

fn main() -> Result<(), Box<dyn Error>> {
    let moves: Vec<(TimeSpan, Length)> = (1..)
        .zip(MEASURED_MM)
        .map(|(quarter, mm)| (TimeSpan::from_ms(250 * quarter), Length::from_mm(mm)))
        .collect();
    let fit = ShortMoveFit::of(&moves)?;

    println!("stop after   measured   by law   by table");
    for one in &fit.moves {
        let by_table = one.by_table.unwrap_or(one.by_law);
        println!(
            "{:>8.2} s {:>7.0} mm {:>5.0} mm {:>7.0} mm",
            one.time.as_s(),
            one.measured.as_mm(),
            one.by_law.as_mm(),
            by_table.as_mm()
        );
    }
    let table_error = fit.table_error().unwrap_or(Length::ZERO);
    println!("error (rms): {:.1} mm by law, {:.1} mm by table", fit.law_error().as_mm(), table_error.as_mm());
    for distance in [37.0, 150.0, 500.0].map(Length::from_mm) {
        if let Some(time) = fit.better().command_time(distance) {
            println!("to move {:.0} mm: command the stop after {:.2} s", distance.as_mm(), time.as_s());
        }
    }
    Ok(())
}
