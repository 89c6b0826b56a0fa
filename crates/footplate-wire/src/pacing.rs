//! The pace of requests: stations silently drop what they have no room for.

use footplate_core::{TimeSpan, Timestamp};

/// When the next request may go.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pacing {
    /// Mean time between requests.
    every: TimeSpan,
    /// Number of requests that may go at once after a pause.
    at_once: i64,
    /// A stop waits at most this long after the request before it.
    urgent_after: TimeSpan,
    /// The time up to which the average is used up.
    used_until: Timestamp,
    last: Option<Timestamp>,
}

impl Pacing {
    /// Creates a pace from the mean time between requests, the number that may go at once, and how long a stop waits at most.
    pub(crate) const fn new(every: TimeSpan, at_once: i64, urgent_after: TimeSpan) -> Self {
        Self { every, at_once, urgent_after, used_until: Timestamp::ZERO, last: None }
    }

    /// Returns when a request may go that is not urgent.
    pub(crate) fn usual_at(&self) -> Timestamp {
        self.used_until - TimeSpan::from_ns(self.every.as_ns() * (self.at_once - 1))
    }

    /// Returns when a request may go that stops something.
    pub(crate) fn urgent_at(&self) -> Timestamp {
        let after_last = self.last.map_or(self.usual_at(), |last| last + self.urgent_after);
        self.usual_at().min(after_last)
    }

    pub(crate) fn sent(&mut self, now: Timestamp) {
        self.used_until = self.used_until.max(now) + self.every;
        self.last = Some(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_go_at_once_then_twenty_a_second() {
        let mut pacing = Pacing::new(TimeSpan::from_ms(50), 3, TimeSpan::from_ms(10));
        let (mut now, mut sent) = (Timestamp::from_s(1.0), 0);
        let end = Timestamp::from_s(3.0);
        while now < end {
            if now >= pacing.usual_at() {
                pacing.sent(now);
                sent += 1;
            }
            now += TimeSpan::from_ms(1);
        }
        assert_eq!(sent, 42, "three at once, then one each 50 ms");
        assert!(pacing.urgent_at() <= pacing.last.unwrap() + TimeSpan::from_ms(10));
    }
}
