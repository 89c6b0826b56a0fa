//! Lines of TTOBench, a benchmark for time-optimal driving: JSON in which each quantity carries its unit.

use footplate_core::{Length, TimeSpan};
use footplate_sim::line::{LineParts, Stop};

use super::form::{LineFile, LineFileForm, at_places, built, limits};
use crate::document::{Fault, Node, Table, pairs};
use crate::ttobench::about;

pub(super) fn read(node: &Node) -> Result<LineFile, Fault> {
    let table = Table::of(node, "a track")?;
    let metadata = Table::of(table.needs("metadata")?, "`metadata`")?;
    let name = metadata.text("id")?.to_owned();

    let stops = Table::of(table.needs("stops")?, "`stops`")?;
    unit(&stops, "unit", "m")?;
    let stop = |(index, node): (usize, &Node)| {
        let at = Length::from_m(node.number("a stop")?);
        Ok(Stop { name: format!("stop {}", index + 1), at, dwell: TimeSpan::ZERO })
    };
    let places = stops.list("values")?.iter().enumerate().map(stop).collect::<Result<_, Fault>>()?;

    let speeds = Table::of(table.needs("speed limits")?, "`speed limits`")?;
    let speed_units = Table::of(speeds.needs("units")?, "`units`")?;
    unit(&speed_units, "position", "m")?;
    unit(&speed_units, "velocity", "km/h")?;
    let speed_limits = pairs(speeds.needs("values")?, "`values`", ["place in m", "limit in km/h"])?;

    // A level line may leave its gradients out.
    let slopes = table.get("gradients").map(|node| Table::of(node, "`gradients`")).transpose()?;
    let mut gradients = Vec::new();
    if let Some(slopes) = &slopes {
        let units = Table::of(slopes.needs("units")?, "`units`")?;
        unit(&units, "position", "m")?;
        unit(&units, "slope", "permil")?;
        gradients = pairs(slopes.needs("values")?, "`values`", ["place in m", "rise in per mille"])?;
    }
    let parts = LineParts {
        name,
        gradients: at_places(&gradients),
        curve_resistances: Vec::new(),
        speed_limits: limits(&speed_limits),
        stops: places,
    };
    let line = built(parts, |error| {
        let of = match error.what {
            "gradient" => slopes.as_ref().unwrap_or(&table),
            "stop" => &stops,
            _ => &speeds,
        };
        of.place_of_entry("values", error.index)
    })?;
    let about = about(&metadata)?;
    Ok(LineFile { form: LineFileForm::TtoBench, about, line })
}

/// Whether a unit is the one that every file of the benchmark has.
fn unit(table: &Table<'_>, key: &str, expected: &str) -> Result<(), Fault> {
    if table.text(key)? == expected {
        return Ok(());
    }
    Err(table.needs(key)?.not(&format!("the unit `{key}`"), &format!("\"{expected}\"")))
}
