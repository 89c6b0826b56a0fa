//! Dispatching: many trains on one layout, each on track that is reserved for it alone.
//!
//! A [`Dispatcher`] owns a [`Driver`](super::Driver). It finds the quickest path for a train to its destination,
//! reserves all the track of that path at once, sets the turnouts, runs the train from one reversal to the next, and
//! releases the track behind it. No train runs beyond its reservation. Trains at rest that block others step aside.

mod by_hand;
mod deadlock;
mod dispatched_train;
mod dispatcher;
mod granting;
mod interrupted_order;
mod itinerary;
mod movement_authority;
mod notices;
mod path;
mod reservation;
mod route_setting;
mod running;

pub use dispatched_train::Journey;
pub use dispatcher::{Dispatcher, WAIT_LIMIT};
pub use movement_authority::TrainLengths;
pub use reservation::{CLEARANCE, Reservation, Span};
