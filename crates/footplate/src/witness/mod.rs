//! Everything that goes into a machine that decides, and everything that comes out, so that it can be had again.
//!
//! ```text
//! input      what a machine can be told, as a row of the store and back
//! decision   what a machine can answer, as a row of the store
//! listener   a machine that takes inputs
//! witnessed  such a machine with somebody who writes down
//! rehearing  the same inputs told to another one, and its decisions beside those of then
//! ```

mod decision;
mod input;
mod listener;
mod rehearing;
mod witnessed;

pub(crate) use input::Input;
pub(crate) use listener::Listener;
pub(crate) use rehearing::{Difference, Ending, Extent, Rehearing, rehear};
pub(crate) use witnessed::Witnessed;
