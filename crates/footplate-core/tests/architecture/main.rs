//! Checks of the architecture: the layers of core, what is absent from core and wire, the shape of every file, and
//! documentation that refers to things that exist.
//!
//! Each test lists every violation with file and line, and what would be right.
#![expect(clippy::expect_used, clippy::panic, reason = "a test may stop at the first surprise")]

mod circles;
mod files;
mod layers;
mod links;
mod project;
mod purity;
mod source;
mod words;
