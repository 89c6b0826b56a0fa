//! Dispatching: many trains on one layout, each with the track that it needs and nobody else on it.
//!
//! A [`Dispatcher`] owns a [`Driver`](super::Driver). It finds the soonest way for a train to its destination, grants it
//! all the track of that way at once, throws the turnouts, runs it from one reversal to the next, and frees what is
//! behind it. No train is let beyond what it holds; trains at rest in the way of others step aside.

mod blocks;
mod by_hand;
mod danger;
mod deadlock;
mod dispatched_train;
mod dispatcher;
mod granting;
mod hearing;
mod holders;
mod itinerary;
mod journey;
mod movement_authority;
mod obstacles;
mod occupied_path;
mod parking;
mod path;
mod reservation;
mod route_setting;
mod running;
mod turnout_command;

pub use dispatcher::Dispatcher;
pub use journey::{Journey, TrainLengths};
pub use reservation::{CLEARANCE, Reservation, Span};
