//! Motion from an accelerometer, which no wheel can deceive and which drifts.
//!
//! An accelerometer along the track reads acceleration, a bias that wanders slowly, and what gravity adds on a gradient.
//! While the wheels roll, the difference is learnt; while they slide, [`InertialFilter`] carries the speed on with a standard
//! deviation that grows, and [`InertialBounds`] with bounds that hold as long as what they assume is true. A standing
//! train is known by its quiet ([`StandstillDetector`]), which sets the speed back to zero. Between two stops that is
//! enough to reconstruct a whole trip ([`TripRecorder`]).

mod acceleration_block;
mod axis_alignment;
mod high_pass;
mod inertial_bounds;
mod inertial_filter;
mod standstill;
mod trip;
mod trip_ends;

pub use acceleration_block::{AccelerationBlock, BlockAverage};
pub use axis_alignment::{AxisAlignment, ForwardAxis};
pub use high_pass::HighPassRestorer;
pub use inertial_bounds::{InertialBounds, InertialLimits};
pub use inertial_filter::{InertialFilter, InertialNoise, SpeedInnovation};
pub use standstill::{DriftLimits, Standing, StandstillDetector, StandstillThresholds};
pub use trip::{RunningTrip, Trip, TripRecorder};
pub use trip_ends::{BiasWalk, TripEnds};
