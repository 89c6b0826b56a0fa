//! Whether time goes on from row to row, run by run.
//!
//! Nothing is refused for its time: the odometer knows what to do with a period that makes no sense. But whoever
//! recorded it will want to know.

use footplate_core::{TimeSpan, Timestamp};

use super::note::TachometerOddity;

/// No odometry period lasts longer (s): the longest that a vehicle can state.
const LONGEST_PERIOD: TimeSpan = TimeSpan::from_ms(1000);

/// How many rows have a time that makes no period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TimeFaults {
    /// Rows with the time of the row before them.
    pub stood_still: u64,
    /// Rows earlier than the row before them.
    pub went_back: u64,
    /// Rows before which more time passed than any period has.
    pub gaps: u64,
}

/// Follows the time of every run.
#[derive(Debug, Default)]
pub(super) struct TimeWatch {
    last: Vec<Option<Timestamp>>,
    faults: TimeFaults,
}

impl TimeWatch {
    /// Takes in the time of the next row of a run; what is odd about it if it is the first of its kind in the file.
    #[inline]
    pub(super) fn see(&mut self, run: usize, time: Timestamp) -> Option<TachometerOddity> {
        match self.last.get_mut(run) {
            Some(last) => {
                let span = last.map_or(TimeSpan::from_ns(1), |last| time - last);
                *last = Some(time);
                if TimeSpan::ZERO < span && span <= LONGEST_PERIOD {
                    return None;
                }
                self.count(span)
            }
            None => {
                self.last.resize(run, None);
                self.last.push(Some(time));
                None
            }
        }
    }

    #[cold]
    fn count(&mut self, span: TimeSpan) -> Option<TachometerOddity> {
        let (count, oddity) = if span == TimeSpan::ZERO {
            (&mut self.faults.stood_still, TachometerOddity::TimeStoodStill)
        } else if span < TimeSpan::ZERO {
            (&mut self.faults.went_back, TachometerOddity::TimeWentBack { by: -span })
        } else {
            (&mut self.faults.gaps, TachometerOddity::Gap { lasting: span })
        };
        *count += 1;
        (*count == 1).then_some(oddity)
    }

    pub(super) fn faults(&self) -> TimeFaults {
        self.faults
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_run_has_its_own_time_and_each_fault_is_noted_once() {
        let mut watch = TimeWatch::default();
        let mut see = |run, ms| watch.see(run, Timestamp::ZERO + TimeSpan::from_ms(ms));
        assert_eq!(see(0, 50), None);
        assert_eq!(see(1, 0), None, "another run begins earlier");
        assert_eq!(see(0, 100), None);
        assert_eq!(see(0, 100), Some(TachometerOddity::TimeStoodStill));
        assert_eq!(see(0, 100), None);
        assert_eq!(see(1, -10), Some(TachometerOddity::TimeWentBack { by: TimeSpan::from_ms(10) }));
        let hour = TimeSpan::from_s(3600.0);
        assert_eq!(see(1, 3_599_990), Some(TachometerOddity::Gap { lasting: hour }));
        assert_eq!(see(1, 3_600_040), None);
        assert_eq!(watch.faults(), TimeFaults { stood_still: 2, went_back: 1, gaps: 1 });
    }
}
