//! When to tell the trains what: state machines that turn reports into commands.
//!
//! - [`Machine`] is what all of them have in common: entries of the recording in, [`Output`]s out, and a time to be
//!   asked again. None of them knows a clock or a cable.

mod machine;

pub use machine::{Machine, Output};
