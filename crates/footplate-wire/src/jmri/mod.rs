//! JMRI's JSON protocol, version 5: the program that drives most kinds of command stations, as a server.
//!
//! Each message is an object of JSON, and a frame of a WebSocket or a line of a stream; here it is a line. JMRI reports sensors and
//! throttles of which a client has asked, and states what it has passed on, not what a decoder has done.
//!
//! - [`Request`] is what a client says, [`Reply`] what the server says; [`ThrottleMessage`] both say of a locomotive.
//! - [`Client`] is the session: it learns how JMRI names the layout's sensors and turnouts, and asks for throttles.

mod json;
mod outstanding;
mod reply;
mod request;
mod session;
mod settings;
mod throttle;
mod time_model;

pub use json::{LONGEST_LINE, Lines, Malformed};
pub use reply::Reply;
pub use request::{LOCOMOTIVES, Request};
pub use session::Client;
pub use settings::{Settings, System};
pub use throttle::ThrottleMessage;
pub use time_model::{SENSOR_DELAY_LONGEST, SENSOR_DELAY_SHORTEST, TIME_MODEL, USUAL_LINE};
