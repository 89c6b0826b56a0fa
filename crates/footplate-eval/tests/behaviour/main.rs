//! What Footplate achieves in simulated worlds, by their truth.

mod blocks;
mod reported_speeds;
mod same_seed;
mod undirected_sensors;
