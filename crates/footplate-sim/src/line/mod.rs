//! Full-size trains on full-size lines: one body for running times, and a train on wheels that slip and slide.
//!
//! **One body.** A [`Train`] is a body with a [`Resistance`], a [`TractiveEffort`] and a [`Brake`]; a [`LineProfile`]
//! says how steep, how curved and how fast the line is and where trains stop. A [`Driver`] gives an effort for what the
//! train does now. [`Journey`] puts the three together as one body, for running times.
//!
//! ```text
//! journey          running times, energy
//! driver           effort from what the train does and what lies ahead
//! train  profile   what it is, where it runs
//! resistance  tractive_effort  stepped
//! ```
//!
//! **On wheels.** [`LineScenario::run`] draws a train of many wheelsets and what lies on its rails from a seed, and
//! runs it step by step: two wheelsets with their own rotation, the rest in groups. [`LineRun`] is what two tachometers
//! recorded of it and, beside that, what is true.
//!
//! ```text
//! scenario  normal_runs  slide_runs  fault_runs     named runs, drawn from a seed
//! random_world  true_claims                      worlds drawn from ranges, and what is true of them
//! service  kinds                                    any train on any line; the trains of scenarios
//! setup  run  recording  diary                      the recorder reads; what comes out
//! vehicle  claimed                                  what is claimed of the train
//! tachometer  faults  balises  inertial_sensor      what is read
//! world  steering  plan                             what happens between two samples, and who drives
//! motion  consist  bogie  gradients                 a train of many wheelsets
//! slide_protection  slip_control  brake_cylinder    what keeps wheels turning as they should
//! rotation  creep_force  rail                       one wheelset on what lies on the rail
//! ```

mod balises;
mod bogie;
mod brake_cylinder;
mod claimed;
mod consist;
mod creep_force;
mod diary;
mod driver;
mod fault_runs;
mod faults;
mod gradients;
mod inertial_sensor;
mod journey;
mod kinds;
mod motion;
mod normal_runs;
mod plan;
mod profile;
mod rail;
mod random_world;
mod recording;
mod resistance;
mod rotation;
mod run;
mod scenario;
mod service;
mod setup;
mod slide_protection;
mod slide_runs;
mod slip_control;
mod steering;
mod stepped;
mod tachometer;
mod tractive_effort;
mod train;
mod true_claims;
mod vehicle;
mod world;

pub use driver::{Command, Driver, DrivingPhase, State, Style, StyleError};
pub use journey::{Call, Journey, JourneyError, Moment, Work};
pub use profile::{
    LineError, LineParts, LineProblem, LineProfile, STEEPEST_PER_MILLE, Stop, TIGHTEST_PER_MILLE,
};
pub use random_world::{LineLevel, LineWorld};
pub use recording::{
    LineEnergy, LineEvent, LineEventKind, LineRun, LineSample, LineTruth, Turned, WheelSample, WheelTruth,
};
pub use resistance::{PerMille, Resistance};
pub use run::LineConditions;
pub use scenario::LineScenario;
pub use service::LineService;
pub use stepped::Stepped;
pub use tractive_effort::TractiveEffort;
pub use train::{Brake, Train, TrainError};
pub use vehicle::{LineBrake, LineSlideProtection, LineVehicle, LineWheelset};
