//! Vehicles on disk: a TOML file that says what is known of a train before it moves.
//!
//! The grammar is described in `docs/formats/vehicle.md`. Where no file is given, [`default_vehicle`] stands in.

mod built_in;
mod entries;
mod error;
mod keys;
mod read;
mod write;

pub use built_in::{DEFAULT_VEHICLE, default_vehicle};
pub use error::{VehicleFileError, VehicleProblem};
pub use read::{LARGEST_VEHICLE, VehicleFile, parse_vehicle, read_vehicle};
pub use write::write_vehicle;
