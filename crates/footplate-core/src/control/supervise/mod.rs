//! Supervision: if a train does not run as modelled, stops the trains that it could meet, locates it and measures it
//! again.
//!
//! A [`Watchdog`] owns a [`Driver`](super::Driver) and passes orders and notices on while trains run as modelled. It
//! raises an [`Alarm`] if a train drifts from its model, is lost, is detected elsewhere or is missed by several
//! sensors, if the station is silent, and if a stop is not confirmed. First it stops the train and all trains that it
//! could meet, and switches the power off if a stop is not confirmed in time or not obeyed. Then it recovers the
//! train: the train creeps to two consistent sensors and is measured at up to three speeds; its model is scaled or
//! learnt from the start. Each phase has a time limit, after which an operator is needed.
//!
//! ```text
//! watchdog             the machine
//! alarm                alarms, and the tests at every sensor that raise them
//! danger  stops        trains that are stopped and held; stops that have to be confirmed
//! creeping  unheard    where a train in recovery may go; how far it can have run
//! intruder  noise      movements that no session drives; detections at random
//! strayed  facing      trains that are not where they were estimated, or in another direction
//! line  orders         the link and the track power; which orders are carried out now
//! recovery             the recovery of one train, in phases (recovery_phase)
//! remeasuring  trials  its measurements, and the conclusions from them
//! ```

mod alarm;
mod creeping;
mod danger;
mod facing;
mod intruder;
mod line;
mod noise;
mod orders;
mod recovery;
mod recovery_phase;
mod remeasuring;
mod stops;
mod strayed;
mod trials;
mod unheard;
mod watchdog;

pub use alarm::Alarm;
pub use line::LinkNews;
pub use trials::Remeasured;
pub use watchdog::Watchdog;
