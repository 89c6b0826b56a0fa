//! The portions in which the stream of a station reaches the host.

use std::collections::VecDeque;

use footplate_core::{TimeSpan, Timestamp};

use crate::draws::Draws;

/// The longest wait of a message for others in the same portion.
const MERGED_EVERY: TimeSpan = TimeSpan::from_ms(20);
/// The delay of the second part of a split message (s).
const SPLIT_S: std::ops::Range<f64> = 0.000_5..0.005;

/// The portions in which messages arrive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Delivery {
    /// Each message separately.
    #[default]
    Each,
    /// All messages of 20 ms together.
    Merged,
    /// Each message in two parts.
    Split,
}

/// Portions that the host will receive, and when.
#[derive(Debug, Clone)]
pub(crate) struct Outgoing {
    delivery: Delivery,
    /// The time between two lines that arrive separately.
    line_time: TimeSpan,
    line_is_free: Timestamp,
    portions: VecDeque<(Timestamp, Vec<u8>)>,
}

impl Outgoing {
    pub(crate) fn new(now: Timestamp, delivery: Delivery, line_time: TimeSpan) -> Self {
        Self { delivery, line_time, line_is_free: now, portions: VecDeque::new() }
    }

    pub(crate) fn clear(&mut self) {
        self.portions.clear();
    }

    /// When the next portion arrives.
    pub(crate) fn due(&self) -> Option<Timestamp> {
        self.portions.front().map(|(at, _)| *at)
    }

    /// The portion that arrives next.
    pub(crate) fn take(&mut self) -> Option<Vec<u8>> {
        let (at, mut bytes) = self.portions.pop_front()?;
        while self.delivery == Delivery::Merged
            && let Some((_, more)) = self.portions.pop_front_if(|(other, _)| *other <= at)
        {
            bytes.extend(more);
        }
        Some(bytes)
    }

    /// Sends lines.
    pub(crate) fn post(&mut self, now: Timestamp, bytes: &[u8], draws: &mut Draws) {
        let last = self.portions.back().map_or(now, |(last, _)| (*last).max(now));
        match self.delivery {
            Delivery::Each => {
                for line in bytes.split_inclusive(|byte| *byte == b'\n') {
                    let due = self.line_is_free.max(now);
                    self.line_is_free = due + self.line_time;
                    self.portions.push_back((due, line.to_vec()));
                }
            }
            Delivery::Merged => {
                let every = MERGED_EVERY.as_ns();
                let due = (last - Timestamp::ZERO).as_ns().div_euclid(every) * every + every;
                let due = Timestamp::ZERO + TimeSpan::from_ns(due);
                let due = self.portions.back().map_or(due, |(last, _)| *last);
                self.portions.push_back((due, bytes.to_vec()));
            }
            Delivery::Split => {
                let (first, second) = bytes.split_at(draws.below(bytes.len() + 1));
                self.portions.push_back((last, first.to_vec()));
                let later = last + TimeSpan::from_s(draws.uniform(SPLIT_S));
                self.portions.push_back((later, second.to_vec()));
            }
        }
    }
}
