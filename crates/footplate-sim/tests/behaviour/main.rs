//! What the simulator promises: one file for each promise.

mod continuity;
mod line_claims;
mod line_journeys;
mod line_same_seed;
mod line_second_integrator;
mod line_sensors;
mod line_services;
mod line_slides;
mod living_station;
mod living_trains;
mod oval;
mod reports;
mod same_seed;
mod scenarios;
mod speeds;
mod stops;
mod virtual_board;
mod virtual_central_station;
mod virtual_jmri;
mod virtual_loconet;
mod virtual_z21;
mod yard;
