//! The time model of a link: from the time of a report to the time of the detection.
//!
//! A detection is reported by the first poll after it, so its time is only known within the poll interval:
//! - `poll_timing` estimates the poll intervals of a link from the reports, and predicts the next polls;
//! - `detection_window` is the interval of a detection, from one report;
//! - `time_model` is the timing of a link for planners, `round_trips` its correction for a measured line;
//! - `uniform_normal` is the distribution of a report about its prediction, `truncated_normal` the prediction given a
//!   report.

mod detection_window;
mod period_search;
mod poll_timing;
mod round_trips;
mod time_model;
mod truncated_normal;
mod uniform_normal;

pub use detection_window::DetectionWindow;
pub use poll_timing::{PollRhythm, PollTiming, PollTimingEstimator};
pub use round_trips::{RoundTrips, UsualLine};
pub use time_model::TimeModel;
pub use truncated_normal::TruncatedNormal;
pub use uniform_normal::UniformNormal;
