//! What time it is, and dates as people read and write them. Nothing below the program asks a clock.

use std::str::FromStr;
use std::time::{Duration, Instant};

use footplate_core::Timestamp;
use jiff::civil::{Date, DateTime};
use jiff::tz::TimeZone;

use crate::standard_error::say;

/// How long something takes, whatever becomes of the date meanwhile.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stopwatch(Instant);

impl Stopwatch {
    #[expect(clippy::disallowed_methods, reason = "the program's runtime is where time is asked for")]
    pub(crate) fn start() -> Self {
        Self(Instant::now())
    }

    pub(crate) fn elapsed(&self) -> Duration {
        self.0.elapsed()
    }

    /// The same, as a time that counts from the start.
    pub(crate) fn now(&self) -> Timestamp {
        Timestamp::from_ns(i64::try_from(self.elapsed().as_nanos()).unwrap_or(i64::MAX))
    }
}

/// The time now, since the Unix epoch.
pub(crate) fn now() -> Timestamp {
    timestamp(jiff::Timestamp::now())
}

/// The time now, for what is stored next; warns if it is before `newest`, the time of something that was stored before.
pub(crate) fn now_after(newest: Option<Timestamp>) -> Timestamp {
    let now = now();
    if let Some(newest) = newest.filter(|newest| *newest > now) {
        say!(
            "the clock of this computer is behind: it shows {}, and the store has entries of {}; nothing is lost, but set \
             the clock so that --as-of finds this session under its date",
            local(now),
            local(newest)
        );
    }
    now
}

/// The date at which a store has all that is in it: whatever was stored counts, even if this computer's clock is behind.
pub(crate) const LATEST: Timestamp = Timestamp::from_ns(i64::MAX);

/// A moment that a person named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Moment(pub(crate) Timestamp);

impl FromStr for Moment {
    type Err = String;

    /// A day (its end, so that "as of" a day includes it), a day with a time, or RFC 3339.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        moment(text, &TimeZone::system()).map(Self).ok_or_else(|| {
            "write a date such as 2026-11-21, 2026-11-21T14:30 or 2026-11-21T14:30:00Z".to_owned()
        })
    }
}

fn moment(text: &str, zone: &TimeZone) -> Option<Timestamp> {
    /// The length of `2026-11-21`.
    const DAY: usize = 10;
    if let Ok(exact) = text.parse::<jiff::Timestamp>() {
        return Some(timestamp(exact));
    }
    let local = if text.len() == DAY {
        text.parse::<Date>().ok()?.at(23, 59, 59, 999_999_999)
    } else {
        text.parse::<DateTime>().ok()?
    };
    local.to_zoned(zone.clone()).ok().map(|zoned| timestamp(zoned.timestamp()))
}

fn timestamp(time: jiff::Timestamp) -> Timestamp {
    let ns = time.as_nanosecond().clamp(i64::MIN.into(), i64::MAX.into());
    Timestamp::from_ns(i64::try_from(ns).unwrap_or_default())
}

/// A time as people here read it, to the second.
pub(crate) fn local(time: Timestamp) -> String {
    let time = jiff::Timestamp::from_nanosecond(time.as_ns().into()).unwrap_or_default();
    time.to_zoned(TimeZone::system()).strftime("%Y-%m-%d %H:%M:%S").to_string()
}

/// A time as machines read it: RFC 3339, in UTC.
pub(crate) fn rfc3339(time: Timestamp) -> String {
    jiff::Timestamp::from_nanosecond(time.as_ns().into()).unwrap_or_default().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str) -> String {
        moment(text, &TimeZone::UTC).map_or_else(|| "no date".to_owned(), rfc3339)
    }

    #[test]
    fn a_day_means_its_end_and_a_time_means_itself() {
        assert_eq!(at("2026-11-21"), "2026-11-21T23:59:59.999999999Z");
        assert_eq!(at("2026-11-21T14:30"), "2026-11-21T14:30:00Z");
        assert_eq!(at("2026-11-21 14:30:05"), "2026-11-21T14:30:05Z");
        assert_eq!(at("2026-11-21T14:30:00+01:00"), "2026-11-21T13:30:00Z");
        // A committed sensor log began at this time; `date -u -d @1583740245.914` agrees.
        assert_eq!(rfc3339(Timestamp::from_ns(1_583_740_245_914_000_000)), "2020-03-09T07:50:45.914Z");
    }

    #[test]
    fn what_is_no_date_is_answered_with_what_one_is() {
        for text in ["", "yesterday", "21.11.2026", "2026-13-01", "2026-02-30", "10000000000", "ä026-11-2"] {
            assert_eq!(at(text), "no date", "{text}");
            assert!(text.parse::<Moment>().unwrap_err().contains("2026-11-21T14:30"));
        }
        // The ends of what a timestamp can hold.
        assert_eq!(rfc3339(moment("9999-01-01", &TimeZone::UTC).unwrap()), "2262-04-11T23:47:16.854775807Z");
    }
}
