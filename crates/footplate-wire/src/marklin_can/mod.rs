//! Märklin CAN: Central Stations 2 and 3 on a network, and a track box (Gleisbox) behind a serial CAN adapter.
//!
//! Inputs report by themselves and say for how long they were in the state before, directions are absolute and can be asked for,
//! and what is commanded is confirmed by the same frame with one bit set.
//!
//! - [`Frame`] is an identifier and eight bytes, [`Message`] what they mean, [`Framing`] finds frames among what arrives.
//! - [`Client`] is the session: it knows what is outstanding and what comes next.

mod frame;
mod framing;
mod inputs;
mod message;
mod outstanding;
mod roster;
mod session;
mod settings;
mod speed;
mod time_model;
mod uid;

pub use frame::{FRAME_BYTES, Frame, MOST_DATA, Payload, hash_of};
pub use framing::{Framing, LONGEST_LINE};
pub use message::{Direction, InputChange, Message, kind_in_words};
pub use roster::{LOCOMOTIVES_FILE, ListedLocomotive, check_sum, read_list};
pub use session::Client;
pub use settings::{Settings, Transport};
pub use speed::{HIGHEST_SPEED, speed_of, step_of};
pub use time_model::{
    BIT_TIME, INPUTS_PER_MODULE, NETWORK_LONGEST, NETWORK_SHORTEST, SCAN_EVERY, TICK, TIME_MODEL, USUAL_LINE,
};
pub use uid::{AccessoryProtocol, LocomotiveProtocol, Uid};
