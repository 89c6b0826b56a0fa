//! Lines for people on standard error.

pub(crate) use footplate_eval::say;
