//! What core promises, a file a promise.

mod draw;
mod motion_checks;
mod speed_change_laws;
mod stopping;
