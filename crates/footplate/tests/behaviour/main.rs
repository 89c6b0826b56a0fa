//! The program as a person in a shell sees it, what it prints and the status it ends with, and what its numbers
//! promise, checked against trains whose truth is known.

mod board;
mod calibrate;
mod calibrations_are_true;
mod central_station;
mod compare;
mod demo;
#[path = "../../../footplate-store/tests/behaviour/drawn_moments.rs"]
mod drawn_moments;
mod drive;
mod emergency_stop;
mod forecasts_hold;
mod guardian;
mod guardian_datagrams;
mod inertial_slides;
mod killed;
mod layout;
mod left_running;
mod loconet;
mod measure;
mod odometer_on_scenarios;
mod odometry;
mod odometry_report;
mod other_layouts;
mod placed_rides;
mod plot;
mod position_series;
mod predict;
mod program;
mod replay;
mod report;
mod seeds_that_failed;
mod short_moves;
mod simulate;
mod simulate_driving;
mod simulate_line;
mod simulate_pacing;
mod simulate_zones;
mod simulated;
mod station;
mod store;
mod two_sensor;
mod uploads;
mod usage;
mod wheel_scales;
mod z21;
