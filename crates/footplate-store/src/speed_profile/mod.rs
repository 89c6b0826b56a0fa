//! Speed profiles of other programs: read, checked, kept in a store, and written back.
//!
//! [`SpeedProfile`] is what every form becomes: a roster entry of JMRI (`jmri`), a table of Rocrail's MVTrack or a plain CSV
//! (`tables`). [`write_roster_entry`] writes the numbers of a motion model into a roster entry of JMRI and leaves all other bytes
//! as they are; [`write_profile_table`] writes the same numbers as CSV. `hold_out` scores how well half of a profile predicts
//! the other half.

mod error;
mod hold_out;
mod jmri;
mod model_row;
mod profile;
mod roster_entry;
mod tables;

pub use error::{ProfileError, ProfileProblem};
pub use hold_out::HoldOut;
pub use model_row::{ModelRow, write_profile_table};
pub use profile::{FASTEST_MM_S, ProfileNote, ProfileSpeed, SpeedProfile};
pub use roster_entry::write_roster_entry;
pub use tables::{LARGEST_PROFILE, ProfileContext, parse_profile, read_profile};
