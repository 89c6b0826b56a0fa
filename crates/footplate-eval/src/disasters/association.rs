//! Data association with several running trains: the share of detections that are associated with the train that caused
//! them.

use footplate_core::control::{Notice, Order};
use footplate_core::{Length, NodeId, SensorId, TimeSpan, Timestamp, TrainId};
use footplate_sim::Cause;

use crate::testbed::{LongestCircuit, PreparedTrains};

/// The approximate speed of all trains (mm/s).
const SPEED: f64 = 260.0;
/// The duration of a run (s).
const DURATION: f64 = 70.0;

/// Counts of associated detections.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct AssociationCounts {
    /// Associated with the train that caused them.
    pub(super) right: usize,
    /// Associated with another train.
    pub(super) wrong: usize,
    /// Rejected, although a train caused them.
    pub(super) rejected: usize,
    /// Spurious, but associated with a train.
    pub(super) taken: usize,
    /// Spurious and rejected.
    pub(super) spurious: usize,
}

impl AssociationCounts {
    pub(super) const fn add(&mut self, other: Self) {
        self.right += other.right;
        self.wrong += other.wrong;
        self.rejected += other.rejected;
        self.taken += other.taken;
        self.spurious += other.spurious;
    }
}

/// Runs trains round a circuit, evenly spaced, and compares the driver's data association with the truth.
pub(super) fn associations(
    prepared: &PreparedTrains<'_>,
    circuit: &LongestCircuit,
    trains: &[TrainId],
) -> anyhow::Result<AssociationCounts> {
    let mut prepared = prepared.clone();
    for (nth, train) in trains.iter().enumerate() {
        let place = circuit.nodes.get(nth * circuit.nodes.len() / trains.len()).copied().unwrap_or(NodeId(0));
        prepared.put(*train, place, Length::from_mm(60.0))?;
    }
    let mut driver = prepared.driver();
    for train in trains {
        let step = prepared.nearest_step(*train, SPEED);
        let _ = driver.order(prepared.line.now(), Order::Speed { train: *train, step });
    }
    let began = prepared.line.now();
    let until = began + TimeSpan::from_s(DURATION);
    let mut associated: Vec<(SensorId, Timestamp, Timestamp, TrainId)> = Vec::new();
    while prepared.line.now() < until {
        if let Some(Notice::Passed { train, passed, .. }) = prepared.line.drive(&mut driver, until) {
            associated.push((passed.sensor, passed.window.after, passed.window.until, train));
        }
    }
    let mut counted = AssociationCounts::default();
    // The last detections have not been polled yet.
    let last = until - TimeSpan::from_ms(500);
    let truth = prepared.world().truth();
    for pass in truth.passes().iter().filter(|pass| pass.closed && pass.at >= began && pass.at < last) {
        let slack = TimeSpan::from_ms(30);
        let within = |from: Timestamp, to: Timestamp| pass.at >= from - slack && pass.at <= to + slack;
        let found =
            associated.iter().find(|(sensor, from, to, _)| *sensor == pass.sensor && within(*from, *to));
        match (pass.cause, pass.train, found) {
            (Cause::Train, Some(train), Some((.., associated_train))) if *associated_train == train => {
                counted.right += 1;
            }
            (Cause::Train, Some(_), Some(_)) => counted.wrong += 1,
            (Cause::Train, Some(_), None) => counted.rejected += 1,
            (_, _, Some(_)) => counted.taken += 1,
            (_, _, None) => counted.spurious += 1,
        }
    }
    Ok(counted)
}
