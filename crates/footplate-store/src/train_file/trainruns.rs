//! Trains of the rolling-stock schema of railtoolkit (YAML), composed as by TrainRuns.jl.
//!
//! A train is a formation of vehicles. Cars are fully loaded. The resistance of the traction unit is in per mille of
//! its own mass without load: a base value for the driving axles, rolling resistance for the carrying axles, and air
//! resistance with a head wind of 15 km/h. Freight cars follow Strahl without wind, passenger cars Sauthoff with wind.
//! Rotating masses are a share of the mass without load.

use footplate_core::{Acceleration, Length, Ratio, Speed};
use footplate_sim::line::{Brake, PerMille, Resistance, TractiveEffort, Train};

use super::form::{TrainFile, TrainFileForm, checked, full_brake_n};
use crate::document::{DocumentProblem, Fault, Node, Range, Table, pairs};
use crate::railtoolkit::{VERSION, after_schema, chosen, listed};

/// The schema that is read.
const SCHEMA: &str = "https://railtoolkit.org/schema/rolling-stock.json";
/// The longest formation: more vehicles than any train has.
const LONGEST_FORMATION: usize = 1000;

const KILOMETRES_PER_HOUR: f64 = 3.6;
const TONNE_KG: f64 = 1000.0;
/// The head wind of locomotives and passenger trains (Sauthoff).
const HEAD_WIND: Speed = Speed::from_m_per_s(15.0 / KILOMETRES_PER_HOUR);
/// The rotating-mass factor of a traction unit and of a car that state none (Hansen and Pachl, Railway Timetabling &
/// Operations, 2014, page 71).
const ROTATING: [f64; 2] = [1.09, 1.06];
/// The deceleration of a traction unit that states none: freight and passenger (m/s²; the defaults of TrainRuns.jl).
const BRAKING: [f64; 2] = [0.225, 0.375];
/// The maximum speed if no vehicle states one (m/s; the default of TrainRuns.jl).
const FASTEST_M_PER_S: f64 = 140.0;

const POSITIVE: Range = Range(0.0, 1e9);

/// One vehicle of a formation, in the units of the schema.
struct Vehicle<'a> {
    table: Table<'a>,
    is_driven: bool,
    is_passenger: bool,
    length_m: f64,
    mass_kg: f64,
    load_kg: f64,
    /// The rotating-mass factor.
    rotating: f64,
}

pub(super) fn read(node: &Node, which: Option<&str>) -> Result<TrainFile, Fault> {
    let table = Table::of(node, "a file of rolling stock")?;
    after_schema(&table, SCHEMA)?;
    let train = chosen(&table, "trains", which)?;
    let formation = train.list("formation")?;
    if formation.is_empty() || formation.len() > LONGEST_FORMATION {
        let problem = DocumentProblem::Kind {
            what: "`formation`".to_owned(),
            found: format!("a list of {}", formation.len()),
            expected: format!("a list of 1 to {LONGEST_FORMATION} vehicles"),
        };
        return Err((train.place_of("formation"), problem));
    }
    let known = table.list("vehicles")?;
    let vehicles: Vec<Vehicle<'_>> =
        formation.iter().map(|id| vehicle(id, known)).collect::<Result<_, Fault>>()?;
    let mut driven = vehicles.iter().filter(|vehicle| vehicle.is_driven);
    let (Some(unit), None) = (driven.next(), driven.next()) else {
        let problem = DocumentProblem::Form {
            found: "a formation with none or several traction units".to_owned(),
            expected: "there should be one `traction unit` or `multiple unit`",
        };
        return Err((train.place_of("formation"), problem));
    };
    let is_passenger = vehicles.iter().any(|vehicle| vehicle.is_passenger);
    let sum = |of: fn(&Vehicle<'_>) -> f64| vehicles.iter().map(of).sum::<f64>();
    let empty_kg = sum(|vehicle| vehicle.mass_kg);
    let mass_kg = empty_kg + sum(|vehicle| vehicle.load_kg);
    let rotating_mass = sum(|vehicle| vehicle.mass_kg * vehicle.rotating) / empty_kg - 1.0;
    let max_speed = vehicles.iter().try_fold(FASTEST_M_PER_S, |fastest, vehicle| {
        let limit = vehicle.table.optional_within("speed_limit", POSITIVE)?;
        Ok(limit.map_or(fastest, |limit| fastest.min(limit / KILOMETRES_PER_HOUR)))
    })?;
    let cars = vehicles.iter().filter(|vehicle| !vehicle.is_driven);
    let resistance = cars
        .map(|car| car_resistance(car, is_passenger))
        .try_fold(unit_resistance(unit)?, |sum, car| Ok::<_, Fault>(sum + car?))?;
    let default = BRAKING[usize::from(is_passenger)];
    let service = unit.table.optional_number("a_braking")?.map_or(default, |braking| -braking);
    let inertia = mass_kg * (1.0 + rotating_mass);
    let length = Length::from_m(sum(|vehicle| vehicle.length_m));
    let built = Train {
        name: train.text("name")?.to_owned(),
        length,
        weight_length: length,
        mass_kg,
        rotating_mass: Ratio::from_parts(rotating_mass),
        resistance,
        tractive_effort: effort(unit)?,
        brake: Brake {
            service: Acceleration::from_m_per_s2(service),
            full_n: full_brake_n(inertia, service),
        },
        max_speed: Speed::from_m_per_s(max_speed),
        max_acceleration: None,
    };
    let built = checked(built, |error| match error.what {
        "service braking" | "full brake force" => unit.table.place_of("a_braking"),
        what if what.contains("tractive effort") => unit.table.place_of("tractive_effort"),
        _ => train.place_of("formation"),
    })?;
    let about = format!("From {SCHEMA}, {VERSION}: {}", train.text("id")?);
    Ok(TrainFile { form: TrainFileForm::TrainRuns, about, train: built })
}

fn vehicle<'a>(id: &Node, known: &'a [Node]) -> Result<Vehicle<'a>, Fault> {
    let wanted = id.text("a vehicle of `formation`")?;
    for node in known {
        let table = Table::of(node, "a vehicle")?;
        if table.text("id")? != wanted {
            continue;
        }
        let (is_driven, is_passenger) = match table.text("vehicle_type")? {
            "traction unit" => (true, false),
            "multiple unit" => (true, true),
            "passenger" => (false, true),
            "freight" => (false, false),
            _ => {
                let kinds = "\"traction unit\", \"multiple unit\", \"passenger\" or \"freight\"";
                return Err(table.needs("vehicle_type")?.not("`vehicle_type`", kinds));
            }
        };
        let rotating = ROTATING[usize::from(!is_driven)];
        return Ok(Vehicle {
            table,
            is_driven,
            is_passenger,
            length_m: table.number_within("length", POSITIVE)?,
            mass_kg: TONNE_KG * table.number_within("mass", Range(0.1, 1e5))?,
            load_kg: TONNE_KG * table.optional_within("load_limit", POSITIVE)?.unwrap_or(0.0),
            rotating: table.optional_within("rotation_mass", Range(1.0, 2.0))?.unwrap_or(rotating),
        });
    }
    let ids = known.iter().filter_map(|node| Table::of(node, "a vehicle").ok()?.text("id").ok());
    let found = listed(&ids.collect::<Vec<_>>());
    Err((id.place, DocumentProblem::NotThere { wanted: wanted.escape_debug().to_string(), found }))
}

/// The resistance of a traction unit (Wende, page 151).
fn unit_resistance(unit: &Vehicle<'_>) -> Result<Resistance, Fault> {
    let [base, rolling, air] = coefficients(unit)?;
    let most = Range(0.0, unit.mass_kg / TONNE_KG);
    let driving =
        unit.table.optional_within("mass_traction", most)?.map_or(unit.mass_kg, |mass| TONNE_KG * mass);
    let axles = |mass, base, air| {
        Resistance::per_mille(mass, PerMille { base, rolling: 0.0, air, head_wind: HEAD_WIND })
    };
    Ok(axles(driving, base, air) + axles(unit.mass_kg - driving, rolling, air))
}

/// The resistance of a loaded car (Strahl or Sauthoff; Wende, page 153).
fn car_resistance(car: &Vehicle<'_>, is_passenger: bool) -> Result<Resistance, Fault> {
    let [base, rolling, air] = coefficients(car)?;
    let per_mille = if is_passenger {
        PerMille { base, rolling, air, head_wind: HEAD_WIND }
    } else {
        PerMille { base, rolling: 0.0, air, head_wind: Speed::ZERO }
    };
    Ok(Resistance::per_mille(car.mass_kg + car.load_kg, per_mille))
}

fn coefficients(vehicle: &Vehicle<'_>) -> Result<[f64; 3], Fault> {
    let read = |key| Ok(vehicle.table.optional_within(key, Range(0.0, 1000.0))?.unwrap_or(0.0));
    Ok([read("base_resistance")?, read("rolling_resistance")?, read("air_resistance")?])
}

fn effort(unit: &Vehicle<'_>) -> Result<TractiveEffort, Fault> {
    let node = unit.table.needs("tractive_effort")?;
    let points = pairs(node, "`tractive_effort`", ["speed in km/h", "force in N"])?;
    let point = |(km_h, force)| (Speed::from_m_per_s(km_h / KILOMETRES_PER_HOUR), force);
    Ok(TractiveEffort::Table(points.into_iter().map(point).collect()))
}
