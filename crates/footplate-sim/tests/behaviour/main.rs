//! What the simulated world promises, a file a promise.

mod continuity;
mod line_journeys;
mod oval;
mod reports;
mod same_seed;
mod scenarios;
mod speeds;
mod stops;
