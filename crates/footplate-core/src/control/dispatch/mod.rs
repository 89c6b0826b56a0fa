//! Dispatching: many trains on one layout, each on track that is reserved for it alone.
//!
//! A [`Dispatcher`] owns a [`Driver`](super::Driver). It finds the quickest path for a train to its destination, reserves
//! all the track of that path at once, sets the turnouts, runs the train from one reversal to the next, and releases the
//! track behind it. No train runs beyond its reservation; trains at rest that block others step aside.

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
