//! Prints how Footplate's running times compare with those of another program: `docs/tables/running-times.md`.

use std::error::Error;
use std::path::PathBuf;

use footplate_core::{Length, TimeSpan};
use footplate_sim::line::{Journey, LineProfile, Style, Train};
use footplate_store::{read_line, read_train};

/// Fine enough that half of it changes no digit printed but the last.
const STEP: TimeSpan = TimeSpan::from_ms(10);
/// The reference is at its limit at once.
const STYLE: Style = Style { response: TimeSpan::from_ms(100), ..Style::FASTEST };

fn testdata(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../testdata").join(path)
}

/// The rows of a table of the reference, and its header first.
fn rows(file: &str) -> Result<Vec<Vec<String>>, Box<dyn Error>> {
    let text = std::fs::read_to_string(testdata("running-times").join(file))?;
    Ok(text.lines().skip(1).map(|line| line.split(',').map(ToOwned::to_owned).collect()).collect())
}

/// A train as a point, as the reference has it, and the line.
fn read(train: &str, line: &str) -> Result<(Train, LineProfile), Box<dyn Error>> {
    let train = read_train(&testdata(&format!("trains/trainruns_{train}.yaml")), None)?.train;
    let line = read_line(&testdata(&format!("lines/trainruns_{line}.yaml")), None)?.line;
    Ok((Train { weight_length: Length::ZERO, ..train }, line))
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("# Running times, beside another program's\n");
    println!(
        "Printed by `cargo run -p footplate-store --example running_times`; `./ci.sh scenarios` compares it."
    );
    println!(
        "Trains, lines and reference are those of TrainRuns.jl: [where they come from and what to mind]\
              (../../testdata/running-times/README.md).\n"
    );
    println!(
        "Both programs know the same forces: the behaviour test `running_times` of `footplate-store` steps our"
    );
    println!(
        "train as the reference does, 20 m at a time, and meets all 23 of its points before the first braking"
    );
    println!(
        "to 0.1 mm/s and 2 ms. What stands here is what remains when we integrate finely, 10 ms at a time:"
    );
    println!(
        "a step of 20 m keeps the acceleration of its begin, which a train that gathers speed no longer has,"
    );
    println!("so that the reference is too fast.\n");
    println!("## From the first stop to the last\n");
    println!(
        "The last column lets the weight lie over the whole train; the reference has it all under the front.\n"
    );
    println!("| train | line | reference s | Footplate s | difference s | % | over its length s |");
    println!("|---|---|---:|---:|---:|---:|---:|");
    for row in rows("reference_running_times.csv")? {
        let [train_name, line_name, reference] = row.as_slice() else { continue };
        let (train, line) = read(train_name, line_name)?;
        let reference: f64 = reference.parse()?;
        let time = Journey::run(&train, &line, STYLE, STEP)?.time().as_s();
        let long = Train { weight_length: train.length, ..train };
        let over_length = Journey::run(&long, &line, STYLE, STEP)?.time().as_s();
        let difference = time - reference;
        println!(
            "| {train_name} | {line_name} | {reference:.2} | {time:.2} | {difference:+.2} | {:+.2} | {over_length:.2} |",
            100.0 * difference / reference,
        );
    }
    println!("\n## On the way\n");
    println!(
        "| train | line | does | at m | reference s | Footplate s | difference s | reference m/s | Footplate m/s |"
    );
    println!("|---|---|---|---:|---:|---:|---:|---:|---:|");
    for row in rows("reference_points.csv")? {
        let [train_name, line_name, does, _, at, speed, time, _] = row.as_slice() else { continue };
        let (train, line) = read(train_name, line_name)?;
        let [at, speed, time]: [f64; 3] = [at.parse()?, speed.parse()?, time.parse()?];
        let run = Journey::run(&train, &line, STYLE, STEP)?;
        let Some(ours) = run.passing(Length::from_m(at)) else { continue };
        let (our_time, our_speed) = (ours.time.as_s(), ours.speed.as_m_per_s());
        println!(
            "| {train_name} | {line_name} | {does} | {at:.0} | {time:.2} | {our_time:.2} | {:+.2} | {speed:.3} | \
             {our_speed:.3} |",
            our_time - time,
        );
    }
    Ok(())
}
