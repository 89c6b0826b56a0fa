//! `footplate odometry --imu`: recordings of an accelerometer alone to standstills and hops.

use std::io::Write;
use std::path::{Path, PathBuf};

use footplate_core::odometry::inertial::{StandstillThresholds, Trip};
use footplate_store::accelerometer::{
    AccelerometerRecording, AccelerometerRide, LeftOutScore, SensorForm, StandingScore, StopMarks,
    leave_one_out,
};
use serde_json::{Value, json};

use crate::commands::Outcome;
use crate::counted::counted;

/// For which part of the marked time it has to be right (per cent).
const RIGHT_PCT: f64 = 97.0;

/// How results are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Style {
    Text,
    Json,
    /// The score as a table for the documentation.
    Markdown,
}

/// A recording, walked.
struct Walked {
    recording: AccelerometerRecording,
    ride: AccelerometerRide,
    score: Option<StandingScore>,
    left_out: Option<LeftOutScore>,
}

/// Walks every file and writes what came of it; with `score`, beside the marks that lie beside each file.
///
/// # Errors
/// What is wrong with a file.
pub(super) fn run(
    files: &[PathBuf],
    score: bool,
    style: Style,
    output: &mut dyn Write,
) -> anyhow::Result<Outcome> {
    let mut walked = Vec::new();
    let mut days = Vec::new();
    for file in files {
        let recording = AccelerometerRecording::read(file)?;
        let ride = AccelerometerRide::walk(&recording, StandstillThresholds::default());
        let marks = if score { Some(StopMarks::read(&StopMarks::beside(file))?) } else { None };
        let score = marks.as_ref().map(|marks| StandingScore::of(&ride, marks));
        days.extend(marks.map(|marks| (recording.clone(), marks)));
        walked.push(Walked { recording, ride, score, left_out: None });
    }
    for (walked, left_out) in walked.iter_mut().zip(leave_one_out(&days)) {
        walked.left_out = Some(left_out);
    }
    match style {
        Style::Json => writeln!(output, "{}", serde_json::to_string_pretty(&json_of(&walked))?)?,
        Style::Markdown => score_table(output, &walked)?,
        Style::Text => {
            for walked in &walked {
                trip_table(output, walked)?;
            }
            if score {
                score_table(output, &walked)?;
            }
        }
    }
    let falls_short = |score: &StandingScore| score.right_pct() < RIGHT_PCT;
    let short = walked.iter().any(|walked| {
        let left_out = walked.left_out.as_ref().map(|left_out| &left_out.score);
        walked.score.iter().chain(left_out).any(falls_short)
    });
    Ok(if short { Outcome::FallsShort } else { Outcome::Done })
}

fn form(form: SensorForm) -> &'static str {
    match form {
        SensorForm::WithGravity => "with gravity",
        SensorForm::WithoutGravity => "gravity removed by a high pass, which is undone",
        SensorForm::Along => "one axis along the track",
    }
}

fn trip_table(output: &mut dyn Write, walked: &Walked) -> std::io::Result<()> {
    let Walked { recording, ride, .. } = walked;
    let [rows, out_of_order] = recording.rows();
    writeln!(
        output,
        "{}: {:.1} s, {} ({})",
        recording.file,
        recording.duration_s(),
        counted(rows, "reading"),
        form(recording.form())
    )?;
    if out_of_order > 0 {
        writeln!(output, "  {} left out: the time does not go on", counted(out_of_order, "row"))?;
    }
    match ride.forward {
        Some(forward) if forward.departures > 0 => {
            let [x, y, z] = forward.direction;
            let departures = counted(forward.departures, "departure");
            writeln!(output, "  forward is ({x:.2}, {y:.2}, {z:.2}), from {departures}")?;
        }
        Some(_) => {}
        None => writeln!(
            output,
            "  no departure seen: which direction is forward is not known; record from a stop on"
        )?,
    }
    if ride.known_from.is_none() {
        writeln!(output, "  no standstill found; it takes 1.5 s of quiet after a ride, or at the beginning")?;
    }
    let stood = ride.standing.iter().map(|stretch| (stretch.to - stretch.from).as_s());
    let standing = stood.fold(0.0, |sum, stood| sum + stood);
    writeln!(
        output,
        "  at rest {} for {standing:.1} s in all; {}",
        counted(ride.standing.len(), "time"),
        counted(ride.hops.len(), "hop")
    )?;
    if !ride.hops.is_empty() {
        writeln!(
            output,
            "  {:>10} {:>10} {:>10} {:>10} {:>8}",
            "left s", "arrived s", "lasted s", "m", "± m"
        )?;
    }
    for hop in &ride.hops {
        writeln!(
            output,
            "  {:>10.1} {:>10.1} {:>10.1} {:>10.0} {:>8.0}",
            hop.departure.as_s(),
            hop.arrival.as_s(),
            (hop.arrival - hop.departure).as_s(),
            hop.length.as_m(),
            hop.length_deviation.as_m()
        )?;
    }
    writeln!(output)
}

/// The last part of a path: tables are the same wherever the files lie.
fn name(file: &str) -> String {
    Path::new(file).file_name().map_or_else(|| file.to_owned(), |name| name.to_string_lossy().into_owned())
}

fn score_table(output: &mut dyn Write, walked: &[Walked]) -> std::io::Result<()> {
    writeln!(
        output,
        "| recording | marked s | right % | as it happens % | thresholds of the other days: right % | as it happens % | \
         marks found | off s, median | most | hops found | others |"
    )?;
    writeln!(output, "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|")?;
    let (mut all, mut all_left_out) = (StandingScore::default(), StandingScore::default());
    for each in walked {
        let Some(score) = &each.score else { continue };
        all.merge(score);
        if let Some(left_out) = &each.left_out {
            all_left_out.merge(&left_out.score);
        }
        let left_out = each.left_out.as_ref().map(|left_out| &left_out.score);
        score_row(output, &name(&each.recording.file), score, left_out)?;
    }
    if walked.len() > 1 {
        score_row(output, "all", &all, Some(&all_left_out))?;
    }
    Ok(())
}

fn score_row(
    output: &mut dyn Write,
    name: &str,
    score: &StandingScore,
    left_out: Option<&StandingScore>,
) -> std::io::Result<()> {
    let pct = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.2}"));
    let off = score.off_median_and_most_s();
    let [hops, found, others] = score.hops;
    writeln!(
        output,
        "| {name} | {:.0} | {:.2} | {:.2} | {} | {} | {} of {} | {} | {} | {found} of {hops} | {others} |",
        score.marked_s,
        score.right_pct(),
        score.right_live_pct(),
        pct(left_out.map(StandingScore::right_pct)),
        pct(left_out.map(StandingScore::right_live_pct)),
        score.off_s.len(),
        score.marks,
        pct(off.map(|[median, _]| median)),
        pct(off.map(|[_, most]| most)),
    )
}

fn json_of(walked: &[Walked]) -> Value {
    let recordings: Vec<Value> = walked.iter().map(recording).collect();
    json!({ "recordings": recordings })
}

fn recording(walked: &Walked) -> Value {
    let Walked { recording, ride, score, left_out } = walked;
    let [rows, out_of_order] = recording.rows();
    let standing: Vec<Value> = ride
        .standing
        .iter()
        .map(|stretch| json!({ "from_s": stretch.from.as_s(), "to_s": stretch.to.as_s(), "ended": !stretch.open }))
        .collect();
    json!({
        "file": recording.file,
        "duration_s": recording.duration_s(),
        "readings": rows,
        "readings_left_out": out_of_order,
        "sensor": form(recording.form()),
        "forward": ride.forward.map(|forward| forward.direction),
        "departures": ride.forward.map(|forward| forward.departures),
        "standing": standing,
        "hops": ride.hops.iter().map(hop).collect::<Vec<_>>(),
        "score": score.as_ref().map(figures),
        "score_with_thresholds_of_other_recordings": left_out.as_ref().map(|left_out| figures(&left_out.score)),
    })
}

fn hop(trip: &Trip) -> Value {
    json!({
        "departure_s": trip.departure.as_s(),
        "arrival_s": trip.arrival.as_s(),
        "length_m": trip.length.as_m(),
        "length_deviation_m": trip.length_deviation.as_m(),
    })
}

fn figures(score: &StandingScore) -> Value {
    let off = score.off_median_and_most_s();
    let [hops, found, others] = score.hops;
    json!({
        "marked_s": score.marked_s,
        "right_pct": score.right_pct(),
        "right_live_pct": score.right_live_pct(),
        "marks": score.marks,
        "marks_found": score.off_s.len(),
        "off_median_s": off.map(|[median, _]| median),
        "off_most_s": off.map(|[_, most]| most),
        "hops": hops,
        "hops_found": found,
        "hops_found_beside": others,
    })
}
