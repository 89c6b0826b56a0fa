//! The rhythm of the link of a recording, found in all its reports.

use footplate_core::link::PollTimingEstimator;
use footplate_core::{Event, EventKind, Timestamp};

/// Learns the rhythm in which a link was polled from the runs of its recording.
pub(crate) fn poll_rhythm<'e, R>(runs: impl Iterator<Item = R>) -> PollTimingEstimator
where
    R: Iterator<Item = &'e Event>,
{
    let mut timing = PollTimingEstimator::default();
    let mut last = Timestamp::ZERO;
    for run in runs {
        timing.restart();
        for event in run {
            match event.kind {
                EventKind::Sensor(_) => timing.report(event.time),
                EventKind::Freed(_) | EventKind::Stopped { .. } => {}
                EventKind::Speed { .. } | EventKind::Reverse { .. } | EventKind::Turnout { .. } => {
                    timing.command_sent();
                }
            }
            last = event.time;
        }
    }
    timing.fit(last);
    timing
}
