//! Delays between the track, the station and this program.
//!
//! A station loads all inputs into the S88 bus at once, a cycle apart, shifts out one after the other and reports what has changed
//! since the cycle before. A report says for how
//! long the input was in the state before, in units of 10 ms by the station's clock. So the times at which the station saw two
//! changes of one input are known to lie so far apart, whatever the network did to the reports: where the delay of one is uncertain,
//! the other one narrows it.

use footplate_core::link::{TimeModel, UsualLine};
use footplate_core::{TimeSpan, Timestamp};

use super::outstanding::REPEATED_AFTER;

/// Inputs of an S88 module.
pub const INPUTS_PER_MODULE: u16 = 16;

/// How often a station loads its inputs, unless its owner has set another cycle (10 to 1000 ms on a Link S88).
pub const SCAN_EVERY: TimeSpan = TimeSpan::from_ms(100);

/// What shifting out one input takes (Link S88, unless its owner has set another).
pub const BIT_TIME: TimeSpan = TimeSpan::from_us(167);

/// The shortest time from the station seeing a change until the host has the report: a frame with eight bytes has about 130 bits,
/// at 250 kbit/s.
pub const NETWORK_SHORTEST: TimeSpan = TimeSpan::from_us(520);

/// The longest, on a cable or an idle wireless network (chosen; what a network really does is in the doctor's figures).
pub const NETWORK_LONGEST: TimeSpan = TimeSpan::from_ms(20);

/// The times for planners. A command counts as sent when its frame is written; frames go 10 ms apart at the most crowded, and
/// a tenth more is allowed. A report comes behind a cycle, the bits of thirty modules and the network: 200 ms.
pub const TIME_MODEL: TimeModel = TimeModel {
    command: TimeSpan::ZERO,
    usual_wait: TimeSpan::ZERO,
    soonest: TimeSpan::from_ms(11),
    reaction: TimeSpan::from_ms(200),
    report_window: SCAN_EVERY,
};

/// The line that these times hold for: a command and its answer each take what a network takes at the longest.
pub const USUAL_LINE: UsualLine = UsualLine {
    answers_within: TimeSpan::from_ns(2 * NETWORK_LONGEST.as_ns()),
    repeated_after: REPEATED_AFTER,
};

/// The unit of the time that a report carries.
pub const TICK: TimeSpan = TimeSpan::from_ms(10);

/// The longest time that a report can carry; it means that long or longer.
const SATURATED: u16 = u16::MAX;

/// By how much two clocks may drift apart: crystals are good for 50 parts in a million each.
const DRIFT_PPM: i64 = 100;

/// What an entry may not come before, and what it may not come after.
#[derive(Debug, Clone, Copy)]
pub(super) struct Order {
    pub(super) not_before: Timestamp,
    pub(super) now: Timestamp,
}

/// A time that lies between two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) earliest: Timestamp,
    pub(super) latest: Timestamp,
}

impl Span {
    /// When the station saw what is reported now, by the delays of a network alone.
    pub(super) fn of_report(heard: Timestamp) -> Self {
        Self { earliest: heard - NETWORK_LONGEST, latest: heard - NETWORK_SHORTEST }
    }

    /// When it saw what came so many ticks later than this; `None` if the number of ticks says nothing.
    pub(super) fn later_by(self, ticks: u16) -> Option<Self> {
        self.moved(ticks, 1)
    }

    /// When it saw what came so many ticks before this.
    pub(super) fn earlier_by(self, ticks: u16) -> Option<Self> {
        self.moved(ticks, -1)
    }

    fn moved(self, ticks: u16, sign: i64) -> Option<Self> {
        if ticks == SATURATED {
            return None;
        }
        let lasted_ns = i64::from(ticks) * TICK.as_ns();
        let slack = TICK + TimeSpan::from_ns(lasted_ns / 1_000_000 * DRIFT_PPM);
        let lasted = TimeSpan::from_ns(sign * lasted_ns);
        Some(Self { earliest: self.earliest + lasted - slack, latest: self.latest + lasted + slack })
    }

    /// What lies in both; `None` if they contradict each other.
    pub(super) fn and(self, other: Self) -> Option<Self> {
        let (earliest, latest) = (self.earliest.max(other.earliest), self.latest.min(other.latest));
        (earliest <= latest).then_some(Self { earliest, latest })
    }

    /// The end of an entry in the recording and the width of the span before it: entries stay in order, and an input became
    /// occupied up to one cycle before it was loaded, which was before it was shifted out.
    pub(super) fn entry(self, input: u16, scan: TimeSpan, order: Order) -> (Timestamp, TimeSpan) {
        let shifted = TimeSpan::from_ns(BIT_TIME.as_ns() * i64::from(input));
        let latest = (self.latest - shifted).max(order.not_before).min(order.now);
        (latest, (latest - (self.earliest - shifted - scan)).max(TimeSpan::ZERO))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_reports_narrow_each_other() {
        // The first came at once (10.000 s), the second was held up by 15 ms; by the station's clock they are 2.00 s apart.
        let first = Span::of_report(Timestamp::from_s(10.0));
        let second = Span::of_report(Timestamp::from_s(12.015));
        let narrowed = first.later_by(200).and_then(|expected| expected.and(second));
        let narrowed = narrowed.expect("they agree");
        // At the latest 10 ms and 0.2 ms of drift after 12 s.
        let latest = Timestamp::from_s(11.999_48) + TimeSpan::from_us(10_200);
        assert_eq!(narrowed.latest, latest.min(second.latest));
        assert_eq!(narrowed.earliest, second.earliest);
        assert!(first.later_by(100).and_then(|expected| expected.and(second)).is_none(), "a contradiction");
        assert_eq!(first.later_by(u16::MAX), None, "that long or longer says nothing");
    }

    #[test]
    fn an_entry_reaches_back_over_the_scan_and_stays_in_order() {
        let (now, scan) = (Timestamp::from_s(10.0), TimeSpan::from_ms(100));
        let span = Span::of_report(now);
        let (latest, width) = span.entry(12, scan, Order { not_before: Timestamp::ZERO, now });
        // The twelfth input is shifted out 12 × 0.167 = 2.004 ms after it was loaded.
        assert_eq!(now - latest, TimeSpan::from_us(2_524));
        assert_eq!(width, TimeSpan::from_us(119_480));
        let (latest, width) = span.entry(12, scan, Order { not_before: now, now });
        assert_eq!((now - latest, width), (TimeSpan::ZERO, TimeSpan::from_us(122_004)));
    }
}
