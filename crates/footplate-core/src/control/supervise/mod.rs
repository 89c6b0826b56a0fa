//! Supervision: if a train does not run as its model says, stop what it could meet, locate it, measure it again.
//!
//! A [`Watchdog`] owns a [`Driver`](super::Driver) and passes everything on, orders down and notices up, while all is
//! well. It raises an [`Alarm`] when a train drifts from its model, is lost, is detected elsewhere or is missed by sensors
//! again and again, when the station is silent, and when a stop is not confirmed. First it does no further harm: the
//! train and all that could meet it are commanded to stop, and the power goes off if a stop is not confirmed in time or not
//! obeyed. Then it recovers the train, which creeps to two sensors that fit each other, is measured at
//! up to three speeds, and has its model scaled accordingly or learnt anew. Each phase has a time limit, after which a
//! person is needed.
//!
//! ```text
//! watchdog  notice           the machine; what it says
//! alarm  consistency_monitor what it raises; the tests at every sensor
//! danger  meeting  stops     what is stopped and held; what could meet; stops that have to be confirmed
//! line                       the link and the track power
//! recovery                   the recovery of one train
//! remeasuring  trials        its measurements, and what follows from them
//! ```

mod alarm;
mod consistency_monitor;
mod danger;
mod line;
mod meeting;
mod recovery;
mod remeasuring;
mod stops;
mod trials;
mod watchdog;

pub use alarm::Alarm;
pub use line::LinkNews;
pub use watchdog::Watchdog;
