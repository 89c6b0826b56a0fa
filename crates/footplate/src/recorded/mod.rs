//! Recording and replay of a machine: all its inputs and all its decisions.
//!
//! ```text
//! input      inputs of a machine, as rows of the store and back
//! decision   decisions of a machine, as rows of the store
//! machine    a machine that accepts inputs, and one with a recorder
//! replay     the same inputs given to another machine, and its decisions beside the recorded ones
//! ```

mod decision;
mod input;
mod machine;
mod replay;

pub(crate) use input::Input;
pub(crate) use machine::Listener;
pub(crate) use machine::Recorded;
pub(crate) use replay::{Difference, Ending, Extent, Replay, replay};
