//! When the future is no longer like the past: stop what could meet, find the train again, measure it again, go on.
//!
//! A [`Watchdog`] owns a [`Driver`](super::Driver) and hands everything through, orders down and notices up, while all is
//! well. It raises an [`Alarm`] when a train drifts from its model, is lost, turns up elsewhere or passes contacts unseen
//! time and again, when the station falls silent, and when a stop is not confirmed. Then it does no further harm: the
//! train and all that could meet it are commanded to stop, and the power goes off if a stop is not confirmed in time or not
//! obeyed. After that it starts from the beginning: the train crawls to two contacts that fit each other, is measured at
//! up to three speeds, and its model is scaled by what was found, or learnt anew. Each phase has its time; when that is
//! over a person is asked for.
//!
//! ```text
//! watchdog  notice           the machine; what it says
//! alarm  consistency_monitor what it raises; the tests at every contact
//! danger  meeting  stops     what is stopped and held; what could meet; stops that have to be confirmed
//! line                       the station's line, and power
//! recovery                   where a train is on its way back
//! remeasuring  trials        what is measured with it, and what follows
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
