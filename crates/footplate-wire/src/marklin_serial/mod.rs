//! The Märklin 6050 and 6051 interfaces: one or two bytes a message over a 2400 baud serial line.
//!
//! The protocol has no frames, checksums or acknowledgements, and the line carries commands and sensor replies in turn. The first byte
//! must never be lost: it alone tells how many follow.
//!
//! - [`Message`] and [`ModuleState`] are bytes and their meaning.
//! - [`Interface`] is the session: it knows what is on the line and what comes next.

mod codec;
mod decoders;
mod exchange;
mod farewell;
mod line;
mod module_reads;
mod pacing;
mod polls;
mod readings;
mod recovery;
mod reply_time;
mod s88;
mod session;
mod settings;
mod silence;
mod solenoid;
mod unanswered;

pub use codec::{EncodeError, Frame, Message, TRAINS};
pub use line::{
    BYTE_TIME, REPLY_BYTE_SPACING, SOLENOID_HOLD_LONGEST, SOLENOID_HOLD_SHORTEST, TIME_MODEL, time_on_line,
};
pub use module_reads::ModuleReads;
pub use pacing::Pace;
pub use s88::{INPUTS_PER_MODULE, ModuleState, ReplyError, decode_reply};
pub use session::Interface;
pub use settings::Settings;
