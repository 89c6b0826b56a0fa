//! Blocks as the driver sees them: at which boundary a train came in, who left, and where no report can come.

use crate::event::Report;
use crate::ids::SensorId;
use crate::model::BlockRelease;
use crate::time::Timestamp;

use super::driven_train::DrivenTrain;
use super::driver::Driver;
use super::hypotheses::{Detection, Explanation, hypotheses};

/// By how much likelier another entry of a block must be than the one that the session found by the occupied blocks.
const SESSION_IS_RIGHT: f64 = 10.0;

impl Driver {
    /// Whether a block is found occupied while the trains, none of them located yet, are at rest: detectors report that when the
    /// track gets power, or when a train is put down. No train has come to a boundary.
    pub(super) fn is_found_occupied(&mut self, detection: &Detection) -> bool {
        let Some(block) = self.track.context().layout.block_of_entry(detection.sensor) else { return false };
        let stands = |train: &DrivenTrain| {
            !train.locator.is_located() && train.locator.is_at_rest(&train.model, detection.window.until)
        };
        let is_found = self.trains.values().all(stands);
        if is_found {
            self.occupied.insert(block.detector);
        }
        is_found
    }

    /// The sensor of a report. A detector does not say at which end of its block a train came in, and the session only knows
    /// which blocks were occupied; where trains are decides.
    pub(super) fn likeliest_entry(&mut self, now: Timestamp, detection: Detection) -> Detection {
        let context = self.track.context();
        let Some(block) = context.layout.block_of_entry(detection.sensor) else { return detection };
        self.occupied.insert(block.detector);
        let likelihood = |sensor: SensorId| -> f64 {
            let found = hypotheses(&self.trains, context, now, Detection { sensor, ..detection });
            let explained = found.iter().filter(|one| matches!(one.explanation, Explanation::Train(_)));
            explained.map(|one| libm::exp(one.log_density)).sum()
        };
        let reported = likelihood(detection.sensor) * SESSION_IS_RIGHT;
        let others = block.entries.iter().copied().filter(|entry| *entry != detection.sensor);
        let best = others.map(|entry| (entry, likelihood(entry))).max_by(|(_, a), (_, b)| a.total_cmp(b));
        match best {
            Some((sensor, likelihood)) if likelihood > reported => Detection { sensor, ..detection },
            _ => detection,
        }
    }

    /// A block is free: the train that left it last is as long as it is ahead of the block.
    pub(super) fn freed(&mut self, time: Timestamp, report: Report) {
        self.occupied.remove(&report.sensor);
        let Detection { window, .. } = self.detection(time, report);
        let context = self.track.context();
        let releases = self.trains.iter().filter_map(|(id, train)| {
            Some((*id, train.locator.release_of(context, &train.model, report.sensor, window)?))
        });
        let nearest =
            releases.min_by(|(_, one), (_, other)| one.beyond[0].as_m().total_cmp(&other.beyond[0].as_m()));
        if let Some((id, release)) = nearest
            && let Some(train) = self.trains.get_mut(&id)
        {
            train.take_release(&release);
        }
    }

    /// A train that follows into a block which is still occupied is not reported there: the boundary behind it is due.
    pub(super) fn expect_beyond_occupied_blocks(&mut self, now: Timestamp) {
        let context = self.track.context();
        for train in self.trains.values_mut() {
            let silent = train.due().map(|(sensor, _)| sensor).filter(|sensor| {
                let block = context.layout.block_of_entry(*sensor);
                block.is_some_and(|block| self.occupied.contains(&block.detector))
            });
            if silent.is_some_and(|sensor| train.is_overdue_at(sensor, now)) {
                train.expect_beyond(context, now);
            }
        }
    }
}

impl DrivenTrain {
    /// Learns its length from a release, if its speed was steady since it left the block.
    fn take_release(&mut self, release: &BlockRelease) {
        let left = release.window.after - self.model.train_length().longest_delay();
        if left >= self.steady_at {
            self.model.take_release(release);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Machine as _;
    use crate::event::{Event, EventKind};
    use crate::ids::{SpeedStep, TrainId};
    use crate::model::MotionModel;
    use crate::time::TimeSpan;
    use crate::track::TurnoutStates;
    use crate::track::example::oval_of_blocks;
    use crate::tracking::Locator;

    #[test]
    fn a_block_that_is_found_occupied_does_not_locate_a_train_at_rest() {
        let layout = oval_of_blocks();
        let sensor = layout.blocks()[0].entries[0];
        let train = TrainId(24);
        let step = |number| SpeedStep::new(number).unwrap();
        let mut driver = Driver::new(layout, TurnoutStates::unknown());
        driver.add_located(MotionModel::unknown(train, step(14)), Locator::new(train));
        let mut hear = |seconds, kind| {
            let time = Timestamp::from_s(seconds);
            driver.handle_event(time, &Event { time, kind });
            driver.locate(train, time).is_some()
        };
        let report = EventKind::Sensor(Report { sensor, poll_interval: Some(TimeSpan::from_ms(20)) });
        assert!(!hear(1.0, report));
        // Once the train runs, the same report shows where it is.
        hear(10.0, EventKind::Speed { train, step: step(9) });
        assert!(hear(20.0, report));
    }
}
