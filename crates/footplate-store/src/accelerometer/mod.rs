//! Recordings of an accelerometer alone: when the train stood, and the hops from stop to stop.
//!
//! The columns are described in `docs/formats/accelerometer-recording.md`.

mod leave_one_out;
mod recording;
mod ride;
mod standing_score;
mod stop_marks;

pub use leave_one_out::{LeftOutScore, leave_one_out};
pub use recording::AccelerometerError;
pub use recording::{AccelerometerRecording, SensorForm};
pub use ride::{AccelerometerRide, StandingStretch};
pub use standing_score::StandingScore;
pub use stop_marks::StopMarks;
