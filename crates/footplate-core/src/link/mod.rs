//! When things really happened: from the time of a report to the time of the contact.
//!
//! A contact that closed is reported by the first poll that reads it, so the report says only that it closed
//! within the poll interval before. `poll_timing` finds the poll intervals of a link in the reports
//! themselves and `poll_rhythm` foresees the next ones, `contact_window` turns a report into
//! an interval of contact times, `time_model` is what planners need of a link and `round_trips` what a measured line changes in it, `uniform_normal` is the distribution of a report about a forecast, and
//! `truncated_normal` what a report leaves of a forecast.

mod contact_window;
mod period_search;
mod poll_regression;
mod poll_rhythm;
mod poll_timing;
mod round_trips;
mod time_model;
mod truncated_normal;
mod uniform_normal;

pub use contact_window::ContactWindow;
pub use poll_rhythm::PollRhythm;
pub use poll_timing::{PollTiming, PollTimingEstimator};
pub use round_trips::{RoundTrips, UsualLine};
pub use time_model::TimeModel;
pub use truncated_normal::TruncatedNormal;
pub use uniform_normal::UniformNormal;
