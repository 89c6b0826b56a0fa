//! Why a vehicle file could not be read: where, what stands there and what would be right.

use footplate_core::odometry::wheels::VehicleError;

use crate::text_file::{TextFileError, TextPlace};

/// A vehicle file that could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VehicleFileError {
    /// It is no such text.
    #[error(transparent)]
    Text(#[from] TextFileError),
    /// Something in the text is wrong.
    #[error("{place}: {problem}")]
    Wrong {
        /// Where.
        place: TextPlace,
        /// What.
        problem: VehicleProblem,
    },
}

/// What is wrong with the text of a vehicle.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VehicleProblem {
    /// It is no TOML.
    #[error("{0}")]
    Toml(String),
    /// A key that says nothing about a vehicle.
    #[error("`{key}` is not a key of {table}; {}", match near {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("its keys are {known}"),
    })]
    UnknownKey {
        /// The key.
        key: String,
        /// The table it stands in, as people call it.
        table: &'static str,
        /// The key that is nearly written like that.
        near: Option<&'static str>,
        /// What would be right.
        known: String,
    },
    /// A key that the table cannot do without.
    #[error("{table} lacks `{key}`; docs/formats/vehicle.md shows an example")]
    MissingKey {
        /// The key.
        key: &'static str,
        /// The table, as people call it.
        table: &'static str,
    },
    /// A value of another kind.
    #[error("{key} is {found}; it should be {expected}")]
    Kind {
        /// The key.
        key: &'static str,
        /// What stands there.
        found: String,
        /// What would be right.
        expected: &'static str,
    },
    /// More or fewer wheelsets than there are tachometers.
    #[error(
        "{0} tables `[[wheelset]]`; there should be two, the first for pulses_1 and the second for pulses_2"
    )]
    Wheelsets(usize),
    /// A value that no railway has.
    #[error(transparent)]
    Range(#[from] VehicleError),
}
