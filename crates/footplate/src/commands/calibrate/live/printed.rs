//! What a calibration says, in words.

use footplate_core::control::learn::{
    CalibrationNotice, CalibrationPhase, Done, Experiment, Fault, Progress, Why,
};
use footplate_core::track::Layout;

/// A line that is worth keeping; nothing for what only moves a bar.
pub(in crate::commands) fn line(layout: &Layout, notice: &CalibrationNotice) -> Option<String> {
    Some(match notice {
        CalibrationNotice::Found { node, step } => {
            format!("found at {} at step {step}", layout.node_name(*node))
        }
        CalibrationNotice::Circuit(circuit) => {
            let legs: Vec<String> =
                circuit.legs.iter().map(|(turnout, leg)| format!("{turnout} {leg}")).collect();
            format!(
                "circuit: {} sensors in {:.2} m, turnouts {}",
                circuit.lap.len(),
                circuit.length.as_m(),
                legs.join(", ")
            )
        }
        CalibrationNotice::TurnsAround { node } => {
            format!("no circuit can be reached beyond {}: it reverses", layout.node_name(*node))
        }
        CalibrationNotice::Begins { experiment, why: Why::MostPerSecond { gain, takes } } => {
            format!("{experiment}: takes {:.0} s; expected information {gain:.1}", takes.as_s())
        }
        CalibrationNotice::Begins { .. } => return None,
        CalibrationNotice::Done(done) => measured(done),
        CalibrationNotice::Mishap(mishap) => format!("! {}", happened(layout, mishap)),
        CalibrationNotice::Progress(_) | CalibrationNotice::Finished { .. } => return None,
    })
}

fn measured(done: &Done) -> String {
    let (before, after) = (&done.before, &done.after);
    let took = done.took.as_s();
    match done.experiment {
        Experiment::Speed { .. } => format!(
            "  {}: {:.0} ± {:.1} mm/s, in {took:.0} s",
            done.experiment,
            after.speed.value.as_mm_per_s(),
            after.speed.uncertainty.as_mm_per_s()
        ),
        Experiment::Stop { .. } | Experiment::Move { .. } => format!(
            "  {}: {:.0} ± {:.0} mm (was ± {:.0}), in {took:.0} s",
            done.experiment,
            after.stop.distance.as_mm(),
            after.stop.doubt.as_mm(),
            before.stop.doubt.as_mm()
        ),
    }
}

fn happened(layout: &Layout, mishap: &Fault) -> String {
    match mishap {
        Fault::Stalled { step } => format!("it stalled at step {step}; this step is not used any more"),
        Fault::Missed { count, before } => {
            format!("{count} sensor(s) before {} did not report", layout.sensor_name(*before))
        }
        Fault::Unexplained { sensor } => {
            format!("{} reported, where the train cannot be", layout.sensor_name(*sensor))
        }
        Fault::WrongLeg { turnout, wanted } => {
            format!("turnout {turnout} is not {wanted} as commanded; commanded again")
        }
        Fault::Moved { from, to } => format!(
            "it is at {}, where it cannot have run to from {}: was it lifted?",
            layout.node_name(*to),
            from.map_or("?", |from| layout.node_name(from))
        ),
        Fault::Lost { last } => format!(
            "no sensor report for too long after {}: it is stopped and located again",
            last.map_or("?", |last| layout.node_name(last))
        ),
        Fault::OtherSpeeds { ratio } => format!(
            "it runs at {:.0} % of the speeds in the store: it is not the train of the store, or its decoder was set \
             anew; begin again with --afresh, or use another store",
            100.0 * ratio
        ),
        Fault::LengthsDiffer { hops } => {
            let each = hops.iter().filter_map(|(hop, surveyed, path_length)| {
                let hop = layout.hop(*hop)?;
                let (from, to) = (layout.node_name(hop.from), layout.node_name(hop.to));
                Some(format!(
                    "{from} to {to} {:.0} instead of {:.0} mm",
                    path_length.as_mm(),
                    surveyed.as_mm()
                ))
            });
            format!("lengths differ from the layout: {}", each.collect::<Vec<_>>().join(", "))
        }
    }
}

/// The line beside the bar: what it is about, and how well stops are known by now.
pub(super) fn state(progress: &Progress) -> String {
    let about = match &progress.phase {
        CalibrationPhase::Finding => "looking for the train".to_owned(),
        CalibrationPhase::Joining => "running to a circuit".to_owned(),
        CalibrationPhase::Experiment(experiment) => experiment.to_string(),
        CalibrationPhase::Ending => "coming to rest".to_owned(),
        CalibrationPhase::Finished => "done".to_owned(),
    };
    let middle = progress.accuracy.get(progress.accuracy.len() / 2);
    let reached = middle.map(|line| {
        format!(
            "; step {}: stop ±{:.0} mm (95 %), speed ±{:.1} %",
            line.step,
            line.stop_within().as_mm(),
            line.speed_within().as_parts() * 100.0
        )
    });
    about + &reached.unwrap_or_default()
}
