//! Trains of TTOBench, a benchmark for time-optimal driving: JSON in which each quantity carries its unit.
//!
//! The format has no length: its trains are points.

use footplate_core::{Acceleration, Length, Ratio, Speed};
use footplate_sim::line::{Brake, Resistance, TractiveEffort, Train};

use super::form::{TrainFile, TrainFileForm, checked, full_brake_n};
use crate::document::{DocumentProblem, Fault, Node, Table};
use crate::ttobench::about;

/// The units of a kind of quantity, each with its value in SI units.
type Units = &'static [(&'static str, f64)];

const KILOMETRE_PER_HOUR: f64 = 1.0 / 3.6;
const MASS: Units = &[("kg", 1.0), ("t", 1000.0)];
const SHARE: Units = &[("%", 0.01), ("-", 1.0)];
const POWER: Units = &[("kW", 1e3), ("W", 1.0), ("MW", 1e6)];
const FORCE: Units = &[("kN", 1e3), ("N", 1.0)];
const SPEED: Units = &[("km/h", KILOMETRE_PER_HOUR), ("m/s", 1.0)];
const ACCELERATION: Units = &[("m/s^2", 1.0)];
const LINEAR: Units = &[("kN/(km/h)", 1e3 / KILOMETRE_PER_HOUR), ("N/(m/s)", 1.0)];
const SQUARE: Units = &[("kN/(km/h)^2", 1e3 / (KILOMETRE_PER_HOUR * KILOMETRE_PER_HOUR)), ("N/(m/s)^2", 1.0)];

pub(super) fn read(node: &Node) -> Result<TrainFile, Fault> {
    let table = Table::of(node, "a train")?;
    let metadata = Table::of(table.needs("metadata")?, "`metadata`")?;
    let name = metadata.text("id")?.to_owned();
    let needs = |key, units| quantity(table.needs(key)?, key, units);
    let has = |key, units| table.get(key).map(|node| quantity(node, key, units)).transpose();

    let mass_kg = needs("mass", MASS)?;
    let rotating_mass = Ratio::from_parts(needs("rho", SHARE)?);
    let inertia = mass_kg * (1.0 + rotating_mass.as_parts());
    // The sum of both brake forces is a bound, not a braking law: friction brakes of 1220 kN would stop a train of 122
    // t almost at once. A stated planned deceleration therefore takes precedence.
    let brakes_n =
        needs("max reg braking force", FORCE)? + has("max pn braking force", FORCE)?.unwrap_or(0.0);
    let strongest = brakes_n / inertia;
    let service = has("max deceleration", ACCELERATION)?.unwrap_or(strongest).min(strongest);
    let train = Train {
        name,
        length: Length::ZERO,
        weight_length: Length::ZERO,
        mass_kg,
        rotating_mass,
        resistance: Resistance::davis(
            needs("rolling resistance r0", FORCE)?,
            needs("rolling resistance r1", LINEAR)?,
            needs("rolling resistance r2", SQUARE)?,
        ),
        tractive_effort: TractiveEffort::ForceAndPower {
            force_n: needs("max traction force", FORCE)?,
            power_w: needs("max traction power", POWER)?,
        },
        brake: Brake {
            service: Acceleration::from_m_per_s2(service),
            full_n: full_brake_n(inertia, service).min(brakes_n),
        },
        max_speed: Speed::from_m_per_s(needs("max speed", SPEED)?),
        max_acceleration: has("max acceleration", ACCELERATION)?.map(Acceleration::from_m_per_s2),
    };
    let train = checked(train, |error| match error.what {
        "mass" => table.place_of("mass"),
        "rotating mass" => table.place_of("rho"),
        "maximum speed" => table.place_of("max speed"),
        "maximum acceleration" => table.place_of("max acceleration"),
        "service braking" | "full brake force" => table.place_of("max reg braking force"),
        "power" => table.place_of("max traction power"),
        "constant resistance" => table.place_of("rolling resistance r0"),
        "linear resistance" => table.place_of("rolling resistance r1"),
        "square resistance" => table.place_of("rolling resistance r2"),
        _ => table.place_of("max traction force"),
    })?;
    let about = about(&metadata)?;
    Ok(TrainFile { form: TrainFileForm::TtoBench, about, train })
}

/// A quantity in SI units.
fn quantity(node: &Node, key: &str, units: Units) -> Result<f64, Fault> {
    let of = format!("`{key}`");
    let table = Table::of(node, &of)?;
    let unit = table.text("unit")?;
    let Some((_, worth)) = units.iter().find(|(name, _)| *name == unit) else {
        let known: Vec<&str> = units.iter().map(|(name, _)| *name).collect();
        let (what, found) = (format!("the unit of {of}"), format!("\"{}\"", unit.escape_debug()));
        return Err((
            table.place_of("unit"),
            DocumentProblem::Kind { what, found, expected: known.join(" or ") },
        ));
    };
    Ok(table.number("value")? * worth)
}
