//! Learns how much later than its bytes need a reply arrives.

use footplate_core::TimeSpan;

use super::exchange::REPLY_ALLOWANCE;

/// Nothing that is known of any interface is later than this: between 10 and 100 ms were met, and half as much more.
const LATEST: TimeSpan = TimeSpan::from_ms(150);
/// Replies vary from one to the next by about 5 ms (R. Elder, report on a train controller, Waterloo CS 452); three
/// times that is left for them.
const MARGIN: TimeSpan = TimeSpan::from_ms(15);
/// A late reply is forgotten over so many others.
const FADES_OVER: i64 = 64;

/// The lateness of replies.
#[derive(Debug, Clone)]
pub(super) struct ReplyTime {
    /// What is allowed at least.
    least: TimeSpan,
    /// The latest of late; `None` before the first reply.
    latest: Option<TimeSpan>,
}

impl ReplyTime {
    pub(super) const fn new(least: TimeSpan) -> Self {
        Self { least, latest: None }
    }

    /// A reply came whole, so much later than its bytes take.
    pub(super) fn answered(&mut self, late: TimeSpan) {
        let faded =
            self.latest.map(|latest| latest - TimeSpan::from_ns((latest - late).as_ns() / FADES_OVER));
        self.latest = Some(faded.map_or(late, |faded| faded.max(late)));
    }

    /// A byte came so late that its reply had been given up.
    pub(super) fn missed(&mut self, late: TimeSpan) {
        self.latest = self.latest.map(|latest| latest.max(late.min(LATEST)));
    }

    /// Forgets what was learnt: the station may be another one.
    pub(super) fn forget(&mut self) {
        self.latest = None;
    }

    /// How late replies usually are; `None` before the first.
    pub(super) const fn usual(&self) -> Option<TimeSpan> {
        self.latest
    }

    /// How late a reply may be before it is lost.
    pub(super) fn allowance(&self) -> TimeSpan {
        self.foreseen().max(self.least)
    }

    /// How late a reply is to be expected at the worst, with what the line to this computer adds left out.
    pub(super) fn foreseen(&self) -> TimeSpan {
        self.latest.map_or(LATEST, |latest| latest + MARGIN).max(REPLY_ALLOWANCE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_allowed_follows_the_latest_replies_up_and_slowly_down() {
        let ms = TimeSpan::from_ms;
        let mut time = ReplyTime::new(ms(20));
        assert_eq!(time.allowance(), ms(150), "nothing is known: an interface of 100 ms is waited for");
        time.answered(ms(2));
        assert_eq!(time.allowance(), ms(20));
        time.answered(ms(60));
        assert_eq!(time.allowance(), ms(75));
        for _ in 0..1_000 {
            time.answered(ms(2));
        }
        assert_eq!(time.allowance(), ms(20));
        time.missed(ms(5_000));
        assert_eq!(time.allowance(), ms(165), "noise is no reply");
    }
}
