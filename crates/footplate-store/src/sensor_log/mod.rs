//! Sensor logs: what sensors reported and trains were commanded, in the forms in which people keep it.
//!
//! [`read_sensor_log`] tells the form from the header and reads any of them into a
//! [`Recording`]; [`write_sensor_log`] writes Footplate's own. A form is a file
//! here; what they share is in `runs`.

mod form_reader;
mod light_gate;
mod own;
mod read;
mod runs;
mod since_command;
mod write;

pub use form_reader::LogContext;
pub use read::{RecordingError, parse_sensor_log, read_sensor_log};
pub use write::{WriteLogError, write_sensor_log};
