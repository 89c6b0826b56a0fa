//! The time of a row, however it is written, in nanoseconds.

use jiff::civil::{DateTime, Time};
use jiff::tz::TimeZone;

use super::number_style::NumberStyle;
use super::target::TimeForm;
use crate::decimal::scaled;

const NS_A_SECOND: f64 = 1e9;
const NS_A_DAY: i64 = 86_400_000_000_000;
/// A date as it is written where the day comes first; with slashes nothing says which it is.
const DAY_FIRST: &str = "%d.%m.%YT%H:%M:%S%.f";

/// Reads times. What is no plain number counts from the first row.
#[derive(Debug, Clone)]
pub(super) struct Clock {
    form: TimeForm,
    /// A day stands in a column of its own.
    dated: bool,
    period_ns: i64,
    first: Option<i64>,
    /// Of times of day without a date: the latest, and the days that have passed.
    latest: i64,
    days: i64,
}

impl Clock {
    pub(super) fn new(form: TimeForm, dated: bool, period_s: f64) -> Self {
        let period_ns = (period_s * NS_A_SECOND).round() as i64;
        Self { form, dated, period_ns, first: None, latest: i64::MIN, days: 0 }
    }

    /// The time of a row in nanoseconds, or what would be right.
    pub(super) fn read(&mut self, text: &str, date: &str, style: NumberStyle) -> Result<i64, String> {
        let ns = match self.form {
            TimeForm::Number { decimals } => {
                let unit = match decimals {
                    9 => "a time in seconds, such as 12.05",
                    6 => "a time in milliseconds, such as 12050",
                    _ => "a time in microseconds, such as 12050000",
                };
                return scaled(&style.point(text)?, decimals).ok_or_else(|| unit.to_owned());
            }
            TimeForm::Sample => {
                let number = text.parse::<i64>().ok().and_then(|number| {
                    let first = *self.first.get_or_insert(number);
                    number.checked_sub(first)?.checked_mul(self.period_ns)
                });
                return number.ok_or_else(|| "the number of the period, a whole number".to_owned());
            }
            TimeForm::DateTime => moment(text),
            TimeForm::TimeOfDay if self.dated => moment(&format!("{date}T{text}")),
            TimeForm::TimeOfDay | TimeForm::Date => self.time_of_day(text),
        };
        let elapsed = ns.and_then(|ns| ns.checked_sub(*self.first.get_or_insert(ns)));
        elapsed.ok_or_else(|| match (self.form, self.dated) {
            (TimeForm::DateTime, _) => "a day with a time, such as 2014-04-01T21:42:30.25".to_owned(),
            (_, true) => format!("a time such as 21:42:30.25 beside a day such as 2014-04-01, not `{date}`"),
            _ => "a time of day, such as 21:42:30.25".to_owned(),
        })
    }

    fn time_of_day(&mut self, text: &str) -> Option<i64> {
        let time = text.replace(',', ".").parse::<Time>().ok()?;
        let midnight = Time::midnight();
        let ns = i64::try_from(time.duration_since(midnight).as_nanos()).ok()?;
        // Half a day back is the next day; less is a clock that was set.
        self.days += i64::from(ns < self.latest.saturating_sub(NS_A_DAY / 2));
        // Half a day on is a row of the day before that was written late.
        self.days -= i64::from(self.days > 0 && ns > self.latest.saturating_add(NS_A_DAY / 2));
        self.latest = ns;
        self.days.checked_mul(NS_A_DAY)?.checked_add(ns)
    }
}

/// Nanoseconds of a day with a time; without a zone they are taken for those of UTC, so that only differences count.
fn moment(text: &str) -> Option<i64> {
    let text = text.trim().replace(',', ".").replacen(' ', "T", 1);
    let exact = text.parse::<jiff::Timestamp>().ok().or_else(|| {
        let civil = text.parse::<DateTime>().ok().filter(|_| text.contains('T'));
        let civil = civil.or_else(|| DateTime::strptime(DAY_FIRST, &text).ok())?;
        civil.to_zoned(TimeZone::UTC).ok().map(|zoned| zoned.timestamp())
    })?;
    i64::try_from(exact.as_nanosecond()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const STYLE: NumberStyle = NumberStyle { separator: b';', decimal: None };

    fn seconds(form: TimeForm, rows: &[&str]) -> Vec<f64> {
        let mut clock = Clock::new(form, false, 0.05);
        rows.iter().map(|row| clock.read(row, "", STYLE).unwrap() as f64 / NS_A_SECOND).collect()
    }

    #[test]
    fn every_form_comes_to_seconds() {
        assert_eq!(seconds(TimeForm::Number { decimals: 9 }, &["12,05"]), [12.05]);
        assert_eq!(seconds(TimeForm::Number { decimals: 6 }, &["12050"]), [12.05]);
        assert_eq!(seconds(TimeForm::Number { decimals: 3 }, &["12050000"]), [12.05]);
        assert_eq!(seconds(TimeForm::Sample, &["1000", "1001", "1003"]), [0.0, 0.05, 0.15]);
        assert_eq!(
            seconds(
                TimeForm::DateTime,
                &["2014-04-01 21:42:30", "2014-04-01T21:42:30.5", "01.04.2014 21:42:31,5"]
            ),
            [0.0, 0.5, 1.5]
        );
        assert_eq!(seconds(TimeForm::TimeOfDay, &["23:59:59.5", "00:00:00.5"]), [0.0, 1.0]);
        let late = ["23:59:59.5", "00:00:00.5", "23:59:59.8", "00:00:01.5"];
        assert_eq!(seconds(TimeForm::TimeOfDay, &late), [0.0, 1.0, 0.3, 2.0], "a row that is late");
        let mut dated = Clock::new(TimeForm::TimeOfDay, true, 0.05);
        assert_eq!(dated.read("23:59:59", "2014-04-01", STYLE), Ok(0));
        assert_eq!(dated.read("00:00:01", "2014-04-02", STYLE), Ok(2_000_000_000));
    }

    #[test]
    fn what_is_no_time_is_answered_with_one() {
        for (form, text, says) in [
            (TimeForm::Number { decimals: 6 }, "x", "milliseconds"),
            (TimeForm::Sample, "1.5", "whole number"),
            (TimeForm::DateTime, "04/01/2014 21:42", "2014-04-01T21:42:30.25"),
            (TimeForm::DateTime, "2014-04-01", "a day with a time"),
            (TimeForm::TimeOfDay, "25:00:00", "time of day"),
        ] {
            let said = Clock::new(form, false, 0.05).read(text, "", STYLE).unwrap_err();
            assert!(said.contains(says), "{said}");
        }
        let mut far = Clock::new(TimeForm::Sample, false, 0.05);
        assert!(far.read("-9223372036854775808", "", STYLE).is_ok());
        assert!(far.read("9223372036854775807", "", STYLE).is_err());
    }
}
