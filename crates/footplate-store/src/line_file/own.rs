//! Footplate's own form of a line: TOML, speeds in km/h as the boards beside the track have them.

use std::fmt::Write as _;

use footplate_core::{Length, TimeSpan};
use footplate_sim::line::{LineParts, LineProfile, Stepped, Stop};

use super::form::{KILOMETRES_PER_HOUR, LineFile, LineFileForm, at_places, built, limits};
use crate::document::{Fault, Node, Table, pairs};

/// The version of the form.
const FORMAT: i64 = 1;

const KEYS: [&str; 7] = [
    "format",
    "name",
    "about",
    "speed_limits_km_h",
    "gradients_per_mille",
    "curve_resistances_per_mille",
    "stops",
];

pub(super) fn read(node: &Node) -> Result<LineFile, Fault> {
    let table = Table::of(node, "a line")?;
    table.check_format(FORMAT)?;
    table.only(&KEYS)?;
    let steps = |key: &str, unit| match table.get(key) {
        Some(node) => pairs(node, &format!("`{key}`"), ["place in m", unit]),
        None => Ok(Vec::new()),
    };
    table.needs("speed_limits_km_h")?;
    let stops = table.list("stops")?.iter().map(stop).collect::<Result<_, Fault>>()?;
    let parts = LineParts {
        name: table.text("name")?.to_owned(),
        gradients: at_places(&steps("gradients_per_mille", "rise in per mille")?),
        curve_resistances: at_places(&steps("curve_resistances_per_mille", "resistance in per mille")?),
        speed_limits: limits(&steps("speed_limits_km_h", "limit in km/h")?),
        stops,
    };
    let line = built(parts, |error| {
        let key = match error.what {
            "gradient" => "gradients_per_mille",
            "curve resistance" => "curve_resistances_per_mille",
            "stop" => "stops",
            _ => "speed_limits_km_h",
        };
        table.place_of_entry(key, error.index)
    })?;
    let about = table.optional_text("about")?.unwrap_or_default().trim().to_owned();
    Ok(LineFile { form: LineFileForm::Own, about, line })
}

fn stop(node: &Node) -> Result<Stop, Fault> {
    let table = Table::of(node, "a stop")?;
    table.only(&["name", "at_m", "dwell_s"])?;
    Ok(Stop {
        name: table.text("name")?.to_owned(),
        at: Length::from_m(table.number("at_m")?),
        dwell: TimeSpan::from_s(table.optional_number("dwell_s")?.unwrap_or(0.0)),
    })
}

/// The text of a line's file; reading it gives the same line, but for the last bit of a speed that is no decimal
/// number of km/h.
pub fn write_line(line: &LineProfile, about: &str) -> String {
    let quoted = |text: &str| toml::Value::String(text.to_owned()).to_string();
    let mut text = format!("format = {FORMAT}\nname = {}\n", quoted(line.name()));
    if !about.is_empty() {
        let _ = writeln!(text, "about = {}", quoted(about));
    }
    // `{:?}` writes the shortest digits that read back as the same number, always with a point or an exponent.
    let mut steps = |key: &str, steps: &Stepped, written: fn(f64) -> f64| {
        let _ = writeln!(text, "\n{key} = [");
        for (from, value) in steps.steps() {
            let _ = writeln!(text, "  [{:?}, {:?}],", from.as_m(), written(value));
        }
        text.push_str("]\n");
    };
    steps("speed_limits_km_h", line.speed_limit(), km_per_h);
    steps("gradients_per_mille", line.gradient(), |value| value);
    let is_straight = line.curve_resistance().steps().all(|(_, value)| value == 0.0);
    if !is_straight {
        steps("curve_resistances_per_mille", line.curve_resistance(), |value| value);
    }
    text.push_str("\nstops = [\n");
    for stop in line.stops() {
        let (name, at) = (quoted(&stop.name), Length::as_m(stop.at));
        let _ = write!(text, "  {{ name = {name}, at_m = {at:?}");
        if stop.dwell != TimeSpan::ZERO {
            let _ = write!(text, ", dwell_s = {:?}", stop.dwell.as_s());
        }
        text.push_str(" },\n");
    }
    text.push_str("]\n");
    text
}

/// A speed in km/h: of the numbers that read back as it, the one a person would have written.
fn km_per_h(m_per_s: f64) -> f64 {
    let exact = m_per_s * KILOMETRES_PER_HOUR;
    // Boards and tables have a few decimals at most.
    let rounded = libm::round(exact * 1e6) / 1e6;
    if rounded / KILOMETRES_PER_HOUR == m_per_s { rounded } else { exact }
}
