//! LocoNet over TCP: stations of Digitrax and Uhlenbrock and everything else on their bus, behind a server of the LbServer kind.
//!
//! The server forwards each message of the bus as a line of text and puts a client's messages on it one at a time. Locomotives are
//! driven through slots of the command station; detectors report by themselves.
//!
//! - [`Line`] is a line of the server, [`Lines`] cuts a stream into them; [`Message`] is a message of the bus.
//! - [`Client`] is the session: it takes slots, keeps them, and reads them back to see what the station has understood.

mod functions;
mod line;
mod message;
mod operand;
mod outbox;
mod outstanding;
mod request;
mod session;
mod settings;
mod slot;
mod time_model;

pub use functions::{FunctionGroup, FunctionPacket};
pub use line::{LONGEST_LINE, Line, Lines, SentReport};
pub use message::{Malformed, Message};
pub use request::{LOCOMOTIVES, TURNOUTS, speed_of};
pub use session::Client;
pub use settings::Settings;
pub use slot::{SlotData, SlotUse};
pub use time_model::{BUS_BYTE, SENSOR_DELAY_LONGEST, SENSOR_DELAY_SHORTEST, TIME_MODEL, USUAL_LINE};
