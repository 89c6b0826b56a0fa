//! Wheel diameters from known places: balises, stops and other wheels.

mod balise_passage;
mod scale_filter;
mod scale_interval;
mod wheel_diameter;

pub use balise_passage::BaliseAccuracy;
pub use scale_interval::ScaleInterval;
pub use wheel_diameter::{ForeignScale, PairVerdict, WheelDiameters, WheelScale};
