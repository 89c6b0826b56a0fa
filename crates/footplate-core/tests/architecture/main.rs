//! What the folders promise, checked: the layers of core, what is absent from core and wire, the shape of every
//! file, and documentation that points at things that exist.
//!
//! Each test lists everything that breaks its promise, with file and line, and says what would be right.
#![expect(clippy::expect_used, clippy::panic, reason = "a test may stop at the first surprise")]

mod circles;
mod files;
mod layers;
mod links;
mod project;
mod purity;
mod source;
