//! `footplate drive`: trains told what to do, line by line, and what comes of it.
#![allow(dead_code)]

mod conductor;
mod instruction;
mod parse;
mod script;
mod spoken;
mod told;
mod words;
