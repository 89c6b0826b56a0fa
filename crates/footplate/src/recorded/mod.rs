//! Recording and replay of a machine: all its inputs and all its decisions.
//!
//! ```text
//! input      inputs of a machine, as rows of the store and back
//! decision   decisions of a machine, as rows of the store
//! listener   a machine that accepts inputs
//! machine    such a machine with a recorder
//! replay     the same inputs given to another machine, and its decisions beside the recorded ones
//! ```

mod decision;
mod input;
mod listener;
mod machine;
mod replay;

pub(crate) use input::Input;
pub(crate) use listener::Listener;
pub(crate) use machine::Recorded;
pub(crate) use replay::{Difference, Ending, Extent, Replay, replay};
