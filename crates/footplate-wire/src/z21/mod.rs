//! Z21: stations of Roco and Fleischmann, and their many clones, spoken to in datagrams over UDP.
//!
//! The station says by itself what changes, to those who have asked for it with broadcast flags. Datagrams may be lost, come
//! twice or overtake one another, so everything is repeated until the station's own words confirm it.
//!
//! - [`Datasets`] cuts a datagram into datasets; [`Request`] and [`Reply`] are datasets and their meaning, [`Feedback`] finds
//!   the sensors in them.
//! - [`Client`] is the session: it knows what is outstanding and what comes next.

mod broadcasts;
mod dataset;
mod detectors;
mod outstanding;
mod reply;
mod request;
mod sensors;
mod session;
mod settings;
mod speed;
mod states;
mod time_model;
mod turnouts;

pub use broadcasts::Broadcasts;
pub use dataset::{Dataset, Datasets, LONGEST_DATAGRAM};
pub use detectors::{CanDetection, Feedback, GROUP_INPUTS, GROUP_MODULES, LocoNetDetection, RailCom};
pub use reply::{Malformed, Reply};
pub use request::{FunctionSwitch, LOCOMOTIVES, Request, TURNOUTS};
pub use session::Client;
pub use settings::Settings;
pub use speed::Throttle;
pub use states::{CentralState, Firmware, Lock, LocomotiveState, SystemState, TurnoutPosition};
pub use time_model::{SENSOR_DELAY_LONGEST, SENSOR_DELAY_SHORTEST, TIME_MODEL, USUAL_LINE};
