//! The slow line to a command station whose sensors must be polled.
//!
//! One exchange at a time: a poll, or a command that waited for the answer of the poll before. A poll reads all
//! sensors at one moment; the answer, stamped when complete, comes some time later. A report therefore means that its
//! sensor closed between the previous reading and this one, and a command delays every later reading by its time on
//! the line.
//!
//! Times are in seconds since the start of the run.

use std::collections::VecDeque;

use footplate_core::TimeSpan;

use crate::draws::{Draws, Purpose};

/// The settings of one line between host and station.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Time from one poll to the next while nothing else is sent.
    pub period: TimeSpan,
    /// Standard deviation of the duration of a poll.
    pub jitter: TimeSpan,
    /// Time from the reading of the sensors to the stamp of their report.
    pub reading_to_stamp: TimeSpan,
    /// Time of one command on the line.
    pub command_time: TimeSpan,
    /// Whether the station remembers a sensor that closed and opened again between two readings.
    pub latched: bool,
    /// Whether the host records a sensor at every poll that sees it closed, or only at the first.
    pub repeats: bool,
    /// Whether the host records with each report the time since the answer of the previous poll.
    pub intervals: bool,
}

impl Link {
    /// A 6051 on its 2400-baud line with five sensor modules, read by a program that does nothing else.
    ///
    /// Period and jitter measured on 1451 repeated reports; a command is two bytes of 11 bits.
    pub const fn every_report() -> Self {
        Self {
            period: TimeSpan::from_us(65_350),
            jitter: TimeSpan::from_us(50),
            // Measured: sensors are read within the first 18 ms of a poll that takes 65 ms.
            reading_to_stamp: TimeSpan::from_us(49_000),
            command_time: TimeSpan::from_us(9_167),
            latched: true,
            repeats: true,
            intervals: false,
        }
    }

    /// The same line read by a program that records a sensor once per passage (period measured).
    pub const fn first_reports() -> Self {
        Self { period: TimeSpan::from_us(69_640), repeats: false, ..Self::every_report() }
    }

    /// Another line of the same kind, with 60 to 100 ms per poll as courses report; the same for the same seed.
    pub fn draw(seed: u64) -> Self {
        let mut draws = Draws::new(seed, Purpose::Line);
        let period = draws.uniform(60.0..100.0);
        let ms = |ms: f64| TimeSpan::from_s(ms * 1e-3);
        Self {
            period: ms(period),
            // Chosen: from the measured busy loop to a program on a desktop computer.
            jitter: ms(draws.uniform(0.05..1.5)),
            reading_to_stamp: ms(period * draws.uniform(0.4..0.8)),
            repeats: draws.chance(0.5),
            intervals: draws.chance(0.5),
            ..Self::every_report()
        }
    }
}

/// Shortest poll (chosen: a thousand a second is more than any line carries).
const SHORTEST_POLL_S: f64 = 1e-3;

/// A completed exchange on the line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Exchange<C> {
    /// A command was sent.
    Sent { command: C, began: f64, ended: f64 },
    /// A poll was answered.
    Answered { poll: Poll },
}

/// The times of a poll.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Poll {
    /// When the sensors were read by the previous poll.
    pub(crate) before: f64,
    /// When the sensors were read.
    pub(crate) reading: f64,
    /// When the previous answer was complete.
    pub(crate) stamp_before: f64,
    /// When the answer was complete.
    pub(crate) stamp: f64,
}

/// The line in operation; `C` is the user's type of a command.
#[derive(Debug)]
pub(crate) struct Line<C> {
    link: Link,
    draws: Draws,
    waiting: VecDeque<(f64, C)>,
    asked: Option<Poll>,
    last: Poll,
    free_at: f64,
}

impl<C> Line<C> {
    /// A line on which polling started long before the run; its phase is random.
    pub(crate) fn new(link: &Link, mut draws: Draws) -> Self {
        let period = link.period.as_s().max(SHORTEST_POLL_S);
        let free_at = draws.uniform(0.0..period);
        let reading = free_at - link.reading_to_stamp.as_s();
        let last = Poll { before: reading - period, reading, stamp_before: free_at - period, stamp: free_at };
        Self { link: link.clone(), draws, waiting: VecDeque::new(), asked: None, last, free_at }
    }

    /// Queues a command to be sent when the line is free at or after a time.
    pub(crate) fn send(&mut self, ready: f64, command: C) {
        self.waiting.push_back((ready, command));
    }

    /// The next exchange that was complete by a time; call until `None`.
    pub(crate) fn poll_exchange(&mut self, by: f64) -> Option<Exchange<C>> {
        if self.asked.is_none() {
            if self.free_at > by {
                return None;
            }
            if self.waiting.front().is_some_and(|(ready, _)| *ready <= self.free_at) {
                let (_, command) = self.waiting.pop_front()?;
                let began = self.free_at;
                self.free_at += self.link.command_time.as_s();
                return Some(Exchange::Sent { command, began, ended: self.free_at });
            }
            self.asked = Some(self.ask());
        }
        let poll = self.asked.take_if(|poll| poll.stamp <= by)?;
        self.last = poll;
        self.free_at = poll.stamp;
        Some(Exchange::Answered { poll })
    }

    fn ask(&mut self) -> Poll {
        let period = self.link.period.as_s();
        // No poll is answered before it is sent, nor read before the previous one.
        let takes = self.draws.normal(period, self.link.jitter.as_s()).max(0.5 * period).max(SHORTEST_POLL_S);
        let stamp = self.free_at + takes;
        let reading = stamp - self.link.reading_to_stamp.as_s();
        Poll { before: self.last.reading, reading, stamp_before: self.last.stamp, stamp }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(link: &Link) -> Line<u8> {
        Line::new(link, Draws::new(3, Purpose::Line))
    }

    #[test]
    fn polls_follow_each_other_and_readings_lead_stamps_by_a_constant() {
        let link = Link::every_report();
        let mut line = line(&link);
        let mut last: Option<Poll> = None;
        let mut count = 0;
        while let Some(Exchange::Answered { poll }) = line.poll_exchange(60.0) {
            assert!((poll.stamp - poll.reading - 0.049).abs() < 1e-9);
            if let Some(last) = last {
                assert_eq!(poll.before, last.reading);
                assert!((poll.reading - poll.before - 0.065_35).abs() < 0.000_35);
            }
            last = Some(poll);
            count += 1;
        }
        assert!((916..=919).contains(&count), "{count} polls in a minute of 65.35 ms each");
    }

    #[test]
    fn a_command_goes_before_the_next_poll_and_shifts_it() {
        let link = Link { jitter: TimeSpan::ZERO, ..Link::every_report() };
        let mut line = line(&link);
        line.send(0.5, 9);
        let (mut sent, mut shifted) = (None, None);
        while let Some(exchange) = line.poll_exchange(1.0) {
            match exchange {
                Exchange::Sent { command, began, ended } => {
                    assert_eq!(command, 9);
                    assert!((0.5..0.5 + 0.065_35).contains(&began));
                    assert!((ended - began - 0.009_167).abs() < 1e-9);
                    sent = Some(began);
                }
                Exchange::Answered { poll } if sent.is_some() && shifted.is_none() => {
                    shifted = Some(poll.reading - poll.before);
                }
                Exchange::Answered { .. } => {}
            }
        }
        assert!((shifted.unwrap() - 0.065_35 - 0.009_167).abs() < 1e-9);
    }
}
