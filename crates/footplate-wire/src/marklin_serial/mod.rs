//! The Märklin 6050 and 6051 interfaces: one or two bytes a message over a 2400 baud serial line.
//!
//! Nothing is framed, checked or acknowledged, and the line carries commands and sensor replies in turn. So the
//! first byte must never be lost: it alone says how many follow.

mod codec;
mod line;
mod s88;

pub use codec::{EncodeError, Frame, Message};
pub use line::{BYTE_TIME, REPLY_BYTE_SPACING, SOLENOID_HOLD_LONGEST, SOLENOID_HOLD_SHORTEST, time_on_line};
pub use s88::{CONTACTS_PER_MODULE, ModuleState, ReplyError, decode_reply};
