//! The program as a person in a shell sees it: what it prints, and the status it ends with.

mod layout;
mod program;
mod simulate;
mod usage;
