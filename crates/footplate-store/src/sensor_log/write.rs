//! Writes a recording as Footplate's own sensor log, which reads back as the same recording.

use std::io::{self, Write};

use footplate_core::{EventKind, Length, RunId, SensorId, Timestamp};

use crate::decimal::unscaled;
use crate::recording::{Recording, Run};
use crate::sensor_names::SensorNames;

const HEADER: &str = "run,t_s,kind,name,train,step,leg,landmark,offset_mm,poll_interval_ms\n";

/// Why a sensor log could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteLogError {
    /// The system refused.
    #[error("cannot write the sensor log: {0}")]
    Write(#[from] io::Error),
    /// A sensor that the railway does not have.
    #[error("sensor {sensor} in run {run} has no name on this railway; was it recorded on another layout?")]
    NamelessSensor {
        /// The sensor.
        sensor: SensorId,
        /// The run that reports it.
        run: RunId,
    },
}

/// Writes every run of `recording`. Lines, notes and the form it came in are not kept; all else is.
pub fn write_sensor_log(
    recording: &Recording,
    sensors: &dyn SensorNames,
    mut out: impl Write,
) -> Result<(), WriteLogError> {
    out.write_all(HEADER.as_bytes())?;
    for run in &recording.runs {
        let name_of = |sensor| {
            let name =
                sensors.name_of(sensor).ok_or(WriteLogError::NamelessSensor { sensor, run: run.id })?;
            Ok::<_, WriteLogError>(quoted(name))
        };
        for at_start in &run.trains {
            let (time, train, step) = (seconds(run, Timestamp::ZERO), at_start.train, at_start.step);
            writeln!(out, "{},{time},running,,{train},{step},,,,", run.id)?;
        }
        for raw in &run.events {
            write!(out, "{},{},", run.id, seconds(run, raw.event.time))?;
            match raw.event.kind {
                EventKind::Sensor(report) | EventKind::Freed(report) => {
                    let is_detection = matches!(raw.event.kind, EventKind::Sensor(_));
                    let kind = if is_detection { "sensor" } else { "freed" };
                    let poll =
                        report.poll_interval.map_or_else(String::new, |span| unscaled(span.as_ns(), 6));
                    writeln!(out, "{kind},{},,,,,,{poll}", name_of(report.sensor)?)?;
                }
                EventKind::Speed { train, step } => writeln!(out, "speed,,{train},{step},,,,")?,
                EventKind::Reverse { train } => writeln!(out, "reverse,,{train},,,,,")?,
                EventKind::Turnout { turnout, curved } => {
                    let leg = if curved { "curved" } else { "straight" };
                    writeln!(out, "turnout,{turnout},,,{leg},,,")?;
                }
                EventKind::Stopped { train, landmark, offset } => {
                    writeln!(out, "stopped,,{train},,,{},{},", name_of(landmark)?, millimetres(offset))?;
                }
            }
        }
        for pass in &run.gates {
            writeln!(out, "{},{},gate,L{},,,,,,", run.id, unscaled(pass.time.as_ns(), 9), pass.gate)?;
        }
    }
    Ok(out.flush()?)
}

/// A time of a run: since the Unix epoch where the run knows it, otherwise since the run's own origin.
fn seconds(run: &Run, time: Timestamp) -> String {
    unscaled((run.began_at.unwrap_or_default() + (time - Timestamp::ZERO)).as_ns(), 9)
}

/// To the nanometre, so that the rounding of `f64` does not show.
fn millimetres(length: Length) -> String {
    unscaled((length.as_mm() * 1e6).round() as i64, 6)
}

/// A name as a field of the file.
fn quoted(name: String) -> String {
    if name.contains([',', '"']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name }
}
