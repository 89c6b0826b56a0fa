//! The station's line and the power on the track, as far as a watchdog hears of them and has a say in them.

use alloc::vec::Vec;

use crate::control::drive::Order;
use crate::event::Command;
use crate::ids::{SpeedStep, TrainId};
use crate::time::Timestamp;

use super::alarm::Alarm;
use super::watchdog::{Power, Watchdog};

/// What is heard of the station's line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkNews {
    /// Nothing that was asked has been answered for a while, or nothing may be written.
    Silent,
    /// It answers, for the first time or again.
    Answers,
    /// A train was commanded to reverse, and nobody knows whether it heard: it may face either way.
    ReverseInDoubt {
        /// The train.
        train: TrainId,
    },
}

impl Watchdog {
    /// What is heard of the station's line.
    pub fn handle_link(&mut self, now: Timestamp, news: LinkNews) {
        match news {
            LinkNews::ReverseInDoubt { train } => self.lose(now, train),
            _ if !self.is_watching() => {}
            LinkNews::Silent if self.silent.is_none() => {
                self.silent = Some(now);
                let trains: Vec<TrainId> = self.driver.trains().collect();
                for train in trains {
                    if self.driver.commanded(train) > SpeedStep::STAND || !self.driver.is_at_rest(train, now)
                    {
                        self.raise(now, train, Alarm::LinkSilent);
                    }
                }
            }
            LinkNews::Silent => {}
            LinkNews::Answers => {
                if self.silent.take().is_some() {
                    // Who knows what of it has been heard: everything stands, and is told so once more.
                    let trains: Vec<TrainId> = self.driver.trains().collect();
                    for train in trains {
                        self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
                    }
                }
            }
        }
        self.act(now);
    }

    /// A person takes the power from the track, or gives it back. What they took comes back when they say so.
    pub fn switch_power(&mut self, now: Timestamp, on: bool) {
        if on {
            self.is_switched_off = false;
            if self.is_powered() {
                self.command(Command::PowerOn);
            }
        } else {
            self.is_switched_off = true;
            self.cut_power(now);
        }
        self.act(now);
    }

    /// Whether the track has power, as far as this machine has a say in it.
    #[must_use]
    pub fn is_powered(&self) -> bool {
        self.power == Power::On
    }

    pub(super) const fn is_silent(&self) -> bool {
        self.silent.is_some()
    }
}
