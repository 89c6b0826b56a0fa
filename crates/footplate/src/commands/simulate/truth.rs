//! The truth of a simulated recording as files for a scorer; `docs/formats/simulated-truth.md` describes them.

use std::fmt::Write;

use footplate_core::track::Layout;
use footplate_core::{Approach, EventKind, SpeedStep, TimeSpan, Timestamp};
use footplate_sim::{Cause, Law, Railway, Scenario, SimulatedRecording, SimulatedRun, Train};
use serde_json::{Value, json};

/// Between two rows of motion (chosen: half a poll, so that a straight line between them is off by 0.3 mm at most).
const MOTION_SPACING: TimeSpan = TimeSpan::from_ms(50);

const HEADER: &str = "run,t_s,kind,name,cause,first,true_t_s,distance_mm,speed_mm_s,offset_mm\n";

/// A row for every report, command and hand measurement of the log, and rows of motion every 50 ms.
pub(super) fn csv(layout: &Layout, simulated: &SimulatedRecording) -> String {
    let mut text = HEADER.to_owned();
    for (number, run) in (1..).zip(&simulated.runs) {
        let mut rows = behind_events(layout, run);
        rows.extend(motion(layout, run));
        rows.sort_by_key(|(time, _)| *time);
        for (time, row) in rows {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{number},{},{row}", seconds(time));
        }
    }
    text
}

/// What lay behind the events, from the column `kind` on.
fn behind_events(layout: &Layout, run: &SimulatedRun) -> Vec<(Timestamp, String)> {
    let truth = &run.truth;
    let stamp = |event: usize| run.events.get(event).map_or(truth.motion.begins(), |event| event.time);
    let state = |time| {
        let (distance, speed) = (truth.motion.distance(time).as_mm(), truth.motion.speed(time).as_mm_per_s());
        format!("{},{distance:.3},{speed:.2}", seconds(time))
    };
    let reports = truth.reports.iter().map(|report| {
        let (sensor, cause, first) =
            (layout.sensor_name(report.sensor), cause_name(report.cause), report.first);
        (stamp(report.event), format!("report,{sensor},{cause},{first},{},", state(report.closed)))
    });
    let commands = truth.commands.iter().map(|command| {
        (stamp(command.event), format!("command,{},,,{},", command.step, state(command.heard)))
    });
    let stops = truth.stops.iter().map(|stop| {
        let landmark = run.events.get(stop.event).map(|event| event.kind);
        let name = match landmark {
            Some(EventKind::Stopped { landmark, .. }) => layout.sensor_name(landmark),
            _ => "",
        };
        (stamp(stop.event), format!("stopped,{name},,,{},{:.3}", state(stop.rested), stop.offset.as_mm()))
    });
    reports.chain(commands).chain(stops).collect()
}

/// Where the train was, from the column `kind` on; the name is that of the node it had passed last.
fn motion(layout: &Layout, run: &SimulatedRun) -> Vec<(Timestamp, String)> {
    let motion = &run.truth.motion;
    let mut rows = Vec::new();
    let mut time = motion.begins();
    while time <= motion.ends() {
        let (distance, speed) = (motion.distance(time).as_mm(), motion.speed(time).as_mm_per_s());
        let (name, offset) = motion.place(time).map_or(("", 0.0), |(edge, offset)| {
            (layout.edge(edge).map_or("", |edge| layout.node_name(edge.from)), offset.as_mm())
        });
        rows.push((time, format!("motion,{name},,,,{distance:.3},{speed:.2},{offset:.3}")));
        time += MOTION_SPACING;
    }
    rows
}

fn seconds(time: Timestamp) -> String {
    let ns = time.as_ns();
    let sign = if ns < 0 { "-" } else { "" };
    let (whole, rest) = (ns.unsigned_abs() / 1_000_000_000, ns.unsigned_abs() % 1_000_000_000);
    format!("{sign}{whole}.{rest:09}")
}

const fn cause_name(cause: Cause) -> &'static str {
    match cause {
        Cause::Train => "train",
        Cause::Stale => "stale",
        Cause::Stuck => "stuck",
        Cause::Spurious => "spurious",
    }
}

/// The numbers that an estimator would have to find.
pub(super) fn parameters(railway: &Railway<'_>, simulated: &SimulatedRecording, scenario: Scenario) -> Value {
    let SimulatedRecording { train, link, faults, .. } = simulated;
    let layout = railway.layout;
    let name = |node| layout.node_name(node);
    let edges: Vec<Value> = railway
        .circuit
        .edges()
        .iter()
        .filter_map(|id| Some((*id, layout.edge(*id)?)))
        .map(|(id, edge)| {
            json!({
                "from": name(edge.from), "to": name(edge.to), "surveyed_mm": edge.length.as_mm(),
                "length_mm": railway.track.length(id).as_mm(),
                "speed_factor": railway.track.speed_factor(id).as_parts(),
            })
        })
        .collect();
    let sensors: Vec<Value> = railway
        .circuit
        .sensors(layout)
        .into_iter()
        .map(|sensor| {
            json!({ "name": layout.sensor_name(sensor), "offset_mm": railway.track.sensor_offset(sensor).as_mm() })
        })
        .collect();
    json!({
        "layout": layout.name(),
        "scenario": scenario.name(),
        "train": simulated.train_id.0,
        "circuit": edges,
        "circuit_length_mm": railway.circuit_length().as_mm(),
        "sensors": sensors,
        "speeds": speeds(railway, train),
        "law": law(train.law),
        "command_delay_ms": train.command_delay.as_ms(),
        "command_jitter_ms": train.command_jitter.as_ms(),
        "start_dead_time_ms": train.start_dead_time.as_ms(),
        "change_dead_time_ms": train.change_dead_time.as_ms(),
        "friction_mm_s2": train.friction.as_mm_per_s2(),
        "breakaway_mm_s": train.breakaway.as_mm_per_s(),
        "stop_scatter_mid_mm": train.stop_scatter.at_mid.as_mm(),
        "stop_scatter_top_mm": train.stop_scatter.at_top.as_mm(),
        "run_deviation": train.run_deviation.as_parts(),
        "wander": train.wander.as_parts(),
        "wander_time_s": train.wander_time.as_s(),
        "warm_up": train.warm_up.as_parts(),
        "warm_up_time_s": train.warm_up_time.as_s(),
        "curve_feel": train.curve_sensitivity,
        "shoe_mm": train.shoe.as_mm(),
        "poll_period_ms": link.period.as_ms(),
        "poll_jitter_ms": link.jitter.as_ms(),
        "reading_to_stamp_ms": link.reading_to_stamp.as_ms(),
        "command_time_ms": link.command_time.as_ms(),
        "missed": faults.missed.as_parts(),
        "stuck": faults.stuck.as_parts(),
        "spurious_per_minute": faults.spurious_per_minute,
        "runs": runs(simulated),
    })
}

/// The speed of every step from both sides: on the level, over a lap of the circuit, and the stopping distance.
fn speeds(railway: &Railway<'_>, train: &Train) -> Vec<Value> {
    let steps = (1..=train.speeds.highest().get()).filter_map(SpeedStep::new);
    let rows = steps.flat_map(|step| [(step, Approach::Below, "below"), (step, Approach::Above, "above")]);
    let row = |(step, approach, name): (SpeedStep, Approach, &str)| {
        json!({
            "step": step.get(), "approach": name,
            "level_mm_s": train.speeds.speed(step, approach).as_mm_per_s(),
            "lap_mm_s": railway.lap_speed(train, step, approach).as_mm_per_s(),
            "way_to_rest_mm": train.stopping_distance(step, approach).as_mm(),
        })
    };
    rows.map(row).collect()
}

fn law(law: Law) -> Value {
    let name = law.family().name();
    match law {
        Law::Constant { up, down } => {
            json!({ "name": name, "up_mm_s2": up.as_mm_per_s2(), "down_mm_s2": down.as_mm_per_s2() })
        }
        Law::Smooth { up, down, shortest } => json!({
            "name": name, "up_mm_s2": up.as_mm_per_s2(), "down_mm_s2": down.as_mm_per_s2(),
            "shortest_s": shortest.as_s(),
        }),
        Law::SCurve { up, down, rounding } => json!({
            "name": name, "up_mm_s2": up.as_mm_per_s2(), "down_mm_s2": down.as_mm_per_s2(),
            "rounding_s": rounding.as_s(),
        }),
        Law::Lag { up, down } => json!({ "name": name, "up_s": up.as_s(), "down_s": down.as_s() }),
        Law::Momentum { up_per_count, down_per_count } => json!({
            "name": name, "up_per_count_s": up_per_count.as_s(), "down_per_count_s": down_per_count.as_s(),
        }),
        Law::Mixed { up, up_lag, down } => json!({
            "name": name, "up_mm_s2": up.as_mm_per_s2(), "up_lag_s": up_lag.as_s(), "down_s": down.as_s(),
        }),
    }
}

/// What differed from run to run.
fn runs(simulated: &SimulatedRecording) -> Vec<Value> {
    let row = |(number, run): (u32, &SimulatedRun)| {
        let approach = (run.running_at > SpeedStep::STAND).then_some(match run.truth.approach_at_start {
            Approach::Above => "above",
            Approach::Below | Approach::Unknown => "below",
        });
        json!({
            "run": number, "speed_factor": run.truth.run_factor, "approach_at_start": approach,
            "stalled": run.truth.stalled,
        })
    };
    (1..).zip(&simulated.runs).map(row).collect()
}
