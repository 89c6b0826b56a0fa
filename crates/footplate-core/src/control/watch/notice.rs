//! What a watchdog has to say, in plain sentences.

use alloc::vec::Vec;
use core::fmt;

use crate::control::drive::{DriveNotice, Order, OrderId};
use crate::ids::{SpeedStep, TrainId};
use crate::time::TimeSpan;
use crate::units::Length;

use super::alarm::Alarm;

/// What happened, and what is done about it.
#[derive(Debug, Clone, PartialEq)]
pub enum WatchdogNotice {
    /// What the driver has to say.
    Drive(DriveNotice),
    /// A train is not as it was. It has been told to stand, and so have the others.
    Danger {
        /// The train.
        train: TrainId,
        /// Why.
        why: Alarm,
        /// Others that could meet it.
        stopped: Vec<TrainId>,
        /// What it was busy with.
        interrupted: Option<Order>,
    },
    /// The power was taken from the track.
    PowerOff {
        /// The train that could not be stopped otherwise.
        train: TrainId,
    },
    /// The track has power again; all trains have been told to stand.
    PowerOn,
    /// A train would crawl to the next contacts now, if it is permitted to.
    AsksToCrawl {
        /// The train.
        train: TrainId,
    },
    /// A train crawls until two contacts say where it is.
    Crawls {
        /// The train.
        train: TrainId,
        /// At which step.
        step: SpeedStep,
    },
    /// Two contacts that fit each other have reported the train.
    Found {
        /// The train.
        train: TrainId,
    },
    /// The speed at a step was measured again.
    Measured {
        /// The train.
        train: TrainId,
        /// The step.
        step: SpeedStep,
        /// Its speed over what it was.
        ratio: f64,
        /// One standard deviation of that, as a part of it.
        deviation: f64,
    },
    /// A stop was compared with its forecast.
    StopChecked {
        /// The train.
        train: TrainId,
        /// How far beyond its forecast the train came to rest.
        beyond: Length,
        /// One standard deviation of what was expected of that.
        deviation: Length,
    },
    /// The train is known again.
    Recovered {
        /// The train.
        train: TrainId,
        /// As what.
        outcome: Outcome,
        /// How long that took.
        took: TimeSpan,
    },
    /// An order that was interrupted is carried out again.
    Resumed {
        /// The train.
        train: TrainId,
        /// The number of the order that was interrupted.
        interrupted: Option<OrderId>,
        /// Its number now.
        order: OrderId,
    },
    /// An order that was interrupted cannot be gone on with.
    Dropped {
        /// The train.
        train: TrainId,
        /// The order.
        order: Order,
    },
    /// The train could not be brought back. It stands, and what could meet it: a person has to see to it.
    NeedsPerson {
        /// The train.
        train: TrainId,
        /// What was tried last.
        while_it: &'static str,
    },
}

/// What a train was found to be.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Outcome {
    /// As it was.
    AsBefore,
    /// The same, but faster or slower by a factor.
    Rescaled {
        /// New speed over old.
        ratio: f64,
    },
    /// Another train: it has been learnt anew.
    LearntAnew,
}

impl fmt::Display for WatchdogNotice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Drive(notice) => write!(f, "{notice:?}"),
            Self::Danger { train, why, stopped, .. } => {
                write!(f, "train {train} is told to stand: {why}")?;
                if let Some((first, more)) = stopped.split_first() {
                    write!(f, "; so is what could meet it: train {first}")?;
                    more.iter().try_for_each(|train| write!(f, ", {train}"))?;
                }
                Ok(())
            }
            Self::PowerOff { train } => {
                write!(f, "power off: nothing says that train {train} has stopped")
            }
            Self::PowerOn => f.write_str("power on again; every train has been told to stand"),
            Self::AsksToCrawl { train } => write!(f, "train {train} waits to be permitted to crawl"),
            Self::Crawls { train, step } => {
                write!(f, "train {train} crawls at step {step} until two contacts say where it is")
            }
            Self::Found { train } => write!(f, "train {train} has been found"),
            Self::Measured { train, step, ratio, deviation } => write!(
                f,
                "train {train} runs {:.1} % (within {:.1} %) of its speed at step {step}",
                100.0 * ratio,
                200.0 * deviation
            ),
            Self::StopChecked { train, beyond, deviation } => write!(
                f,
                "train {train} came to rest {:.0} mm beyond its forecast, which was good for {:.0} mm",
                beyond.as_mm(),
                2.0 * deviation.as_mm()
            ),
            Self::Recovered { train, outcome, took } => {
                write!(f, "after {:.0} s train {train} is known again: ", took.as_s())?;
                match outcome {
                    Outcome::AsBefore => f.write_str("it is as it was"),
                    Outcome::Rescaled { ratio } => write!(f, "it runs {:.0} % of its speeds", 100.0 * ratio),
                    Outcome::LearntAnew => f.write_str("it is another one, and was learnt anew"),
                }
            }
            Self::Resumed { train, .. } => write!(f, "train {train} goes on with what it was doing"),
            Self::Dropped { train, .. } => {
                write!(f, "what train {train} was doing cannot be gone on with: order it again")
            }
            Self::NeedsPerson { train, while_it } => write!(
                f,
                "train {train} could not be brought back {while_it}: see to it, put it on the track and say where; \
                 if no other train is there, let it run over a contact"
            ),
        }
    }
}
