//! What core promises, a file a promise.

mod draw;
mod motion_checks;
mod profiles;
mod speed_change_laws;
mod stopping;
mod ways_on_tracks;
