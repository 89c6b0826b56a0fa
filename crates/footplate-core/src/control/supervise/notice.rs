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
    /// A train is not as it was. It has been commanded to stop, and so have the others.
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
    /// The track has power again; all trains have been commanded to stop.
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
                write!(f, "train {train} stopped: {why}")?;
                if let Some((first, more)) = stopped.split_first() {
                    write!(f, "; also stopped, because they could meet it: train {first}")?;
                    more.iter().try_for_each(|train| write!(f, ", {train}"))?;
                }
                Ok(())
            }
            Self::PowerOff { train } => {
                write!(f, "track power off: train {train} may not have stopped")
            }
            Self::PowerOn => f.write_str("track power on; all trains are commanded to stop"),
            Self::AsksToCrawl { train } => write!(f, "train {train} is waiting for clearance to creep"),
            Self::Crawls { train, step } => {
                write!(f, "train {train} creeps at step {step} until two sensors confirm its position")
            }
            Self::Found { train } => write!(f, "train {train} is located again"),
            Self::Measured { train, step, ratio, deviation } => write!(
                f,
                "train {train} runs at {:.1} % (± {:.1} %) of its calibrated speed at step {step}",
                100.0 * ratio,
                200.0 * deviation
            ),
            Self::StopChecked { train, beyond, deviation } => write!(
                f,
                "train {train} came to rest {:.0} mm beyond the prediction (standard deviation {:.0} \
                 mm)",
                beyond.as_mm(),
                2.0 * deviation.as_mm()
            ),
            Self::Recovered { train, outcome, took } => {
                write!(f, "recovery took {:.0} s; train {train} is back in service: ", took.as_s())?;
                match outcome {
                    Outcome::AsBefore => f.write_str("its model is unchanged"),
                    Outcome::Rescaled { ratio } => write!(
                        f,
                        "it runs at {:.0} % of its calibrated \
                                                              speeds",
                        100.0 * ratio
                    ),
                    Outcome::LearntAnew => f.write_str("it is another engine, and was calibrated anew"),
                }
            }
            Self::Resumed { train, .. } => write!(f, "train {train} resumes its command"),
            Self::Dropped { train, .. } => {
                write!(f, "the command of train {train} was cancelled; send it again")
            }
            Self::NeedsPerson { train, while_it } => write!(
                f,
                "position of train {train} lost: recovery failed {while_it}; check the train, then \
                 enter `place {train} at ...`, or run it over a sensor if no other train is near"
            ),
        }
    }
}
