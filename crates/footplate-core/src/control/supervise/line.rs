//! The link and the track power.

use alloc::vec::Vec;

use crate::control::drive::Order;
use crate::event::Command;
use crate::ids::{FunctionNumber, SensorId, SpeedStep, TrainId};
use crate::time::Timestamp;

use super::alarm::Alarm;
use super::creeping::SILENT_FOR;
use super::noise::Noise;
use super::watchdog::{Power, Watchdog};
use crate::control::Notice;

/// News of the link to the command station.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkNews {
    /// The station has not answered for a while, or accepts no bytes.
    Silent,
    /// The station answers, for the first time or again.
    Answers,
    /// The track has lost its power, or the station has stopped all locomotives: a short circuit, or another throttle.
    PowerLost,
    /// A decoder has reported the speed of its train, in a unit that only its owner knows.
    ReportedSpeed {
        /// The train.
        train: TrainId,
        /// The number.
        number: u16,
    },
    /// Another throttle has changed the speed of a train: where it runs or rests is unknown.
    OtherThrottle {
        /// The train.
        train: TrainId,
    },
    /// It is unknown whether a train has received a command to reverse: its direction is unknown.
    ReverseInDoubt {
        /// The train.
        train: TrainId,
    },
}

impl Watchdog {
    /// Takes news of the link.
    pub fn handle_link(&mut self, now: Timestamp, news: LinkNews) {
        match news {
            LinkNews::ReverseInDoubt { train } => {
                self.undirected.insert(train);
                self.lose(now, train);
            }
            LinkNews::OtherThrottle { train } => self.lose(now, train),
            LinkNews::ReportedSpeed { train, number } => {
                let has_stalled = self.driver.take_reported_speed(now, train, number);
                if has_stalled && self.is_watching() && !self.dangers.contains_key(&train) {
                    self.driver.lose(now, train);
                    self.lost(now, train, Alarm::Stalled);
                }
            }
            _ if !self.is_watching() => {}
            // The station would run every train on at its last step when the power returns.
            LinkNews::PowerLost => self.switch_power(now, false),
            LinkNews::Silent if self.silent.is_none() => {
                self.silent = Some(now);
                self.stop_unheard(now, Alarm::LinkSilent);
            }
            LinkNews::Silent => {}
            LinkNews::Answers => {
                if let Some(since) = self.silent.take() {
                    self.stop_again(now, since);
                }
            }
        }
        self.act(now);
    }

    /// Nothing is heard of trains, or nothing that can be relied on: stops each that may move.
    fn stop_unheard(&mut self, now: Timestamp, alarm: Alarm) {
        self.distrust_last_commands(now);
        // What creeps to be located would pass the sensors that end it without a report.
        let creeping = self.dangers.iter().filter(|(_, recovery)| recovery.is_active());
        let creeping: Vec<TrainId> = creeping.map(|(train, _)| *train).collect();
        self.interrupt_recoveries(now);
        for train in creeping {
            self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
        }
        let trains: Vec<TrainId> = self.driver.trains().collect();
        for train in trains {
            // A station that went off took the power with it: a train that was braking stands short of its stop.
            let rested = self.driver.is_at_rest(train, now - SILENT_FOR)
                || self.has_rested_since(train, now - SILENT_FOR);
            if self.driver.commanded(train) > SpeedStep::STAND || !rested {
                self.raise(now, train, alarm);
            }
        }
    }

    /// Trains are heard again: stop commands since a time may have been lost, so that each train is commanded to stop again.
    fn stop_again(&mut self, now: Timestamp, since: Timestamp) {
        self.driver.forget_turnouts_changed(now, since);
        self.interrupt_recoveries(now);
        let trains: Vec<TrainId> = self.driver.trains().collect();
        for train in trains {
            self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
        }
    }

    /// Takes a detection that no train explains; returns whether it is noise. Trains stop when noise begins.
    pub(super) fn is_noise(&mut self, now: Timestamp, sensor: SensorId) -> bool {
        if self.noise.take(now, self.driver.layout(), sensor) {
            self.notify(Notice::Noise);
            self.stop_unheard(now, Alarm::Noise);
        }
        self.noise.is_on()
    }

    /// Ends noise that is over.
    pub(super) fn end_noise(&mut self, now: Timestamp) {
        if let Some(since) = self.noise.end(now) {
            self.notify(Notice::NoiseOver);
            self.stop_again(now, since);
        }
    }

    /// Switches the track power off or on for an operator. It then stays off until an operator switches it on. An
    /// operator who switches it on has seen that nothing else moves on the track. No train starts by itself then, not even one that is
    /// recovered.
    pub fn switch_power(&mut self, now: Timestamp, on: bool) {
        if on {
            if core::mem::take(&mut self.is_switched_off) {
                // Of trains whose danger showed while the power was off, too.
                self.give_up_recoveries(now);
            }
            self.clear_intruder();
            self.noise = Noise::default();
            if self.is_powered() {
                self.release_held();
                self.command(Command::PowerOn);
            }
        } else {
            self.is_switched_off = true;
            self.cut_power(now);
            self.give_up_recoveries(now);
        }
        self.act(now);
    }

    /// From now on an operator has to see to each train in danger.
    fn give_up_recoveries(&mut self, now: Timestamp) {
        let recovered: Vec<TrainId> = self.dangers.keys().copied().collect();
        for train in recovered {
            self.need_operator(now, train);
        }
    }

    /// Switches a function of a train, such as its light; it does not affect the motion.
    pub fn switch_function(&mut self, train: TrainId, function: FunctionNumber, on: bool) {
        self.command(Command::Function { train, function, on });
    }

    /// Whether the track has power, as commanded.
    pub fn is_powered(&self) -> bool {
        self.power == Power::On
    }

    /// Whether the station is silent, or what it reports is not to be relied on.
    pub(in crate::control) const fn is_silent(&self) -> bool {
        self.silent.is_some() || self.noise.is_on()
    }
}
