//! DCC-EX: an EX-CommandStation spoken to in short texts between `<` and `>`, over a serial port or a network.
//!
//! Sensors report by themselves, directions are absolute and can be asked for, and almost every request is answered. What is
//! written faster than the board reads is lost without a word, so the session paces itself.
//!
//! - [`Request`] and [`Reply`] are texts and their meaning, [`Framing`] finds them among what arrives.
//! - [`Client`] is the session: it knows what is outstanding and what comes next.

mod definition_number;
mod definitions;
mod framing;
mod opening;
mod outstanding;
mod reply;
mod request;
mod session;
mod settings;
mod time_model;

pub use framing::{Framing, LONGEST_DIAGNOSTIC, LONGEST_MESSAGE};
pub use reply::{Malformed, Reply};
pub use request::{CABS, Power, Request, Throttle, speed_of};
pub use session::Client;
pub use settings::{Settings, TurnoutRequests};
pub use time_model::{
    ANSWER_LONGEST, ANSWER_SHORTEST, SENSOR_DELAY_LONGEST, SENSOR_DELAY_SHORTEST, TIME_MODEL, USUAL_LINE,
};
