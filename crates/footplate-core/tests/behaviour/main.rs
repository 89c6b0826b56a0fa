//! What core promises, a file a promise.

mod arriving;
mod attribution;
mod counted_run;
mod dispatching;
mod dispatching_many_seeds;
mod draw;
mod driving;
mod driving_any_orders;
mod federated_filters;
mod following;
mod inertial;
mod motion_checks;
mod motion_models;
mod odometer;
mod pacing;
mod profiles;
mod short_moves;
mod speed_change_laws;
mod stopping;
mod toy_body;
mod toy_railway;
mod trains_fitted;
mod two_sensors;
mod watching;
mod ways_on_tracks;
mod wheel_diameters;
