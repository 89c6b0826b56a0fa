//! Several trains running at once: how many of their contacts are laid to the train that closed them.

use footplate_core::control::{Notice, Order};
use footplate_core::{Approach, Length, NodeId, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_sim::Cause;

use crate::rehearsal::{Rehearsal, Way};

/// About how fast all of them run (mm/s).
const RUN_AT: f64 = 260.0;
/// How long (s).
const RUN_FOR: f64 = 70.0;

/// What became of contacts that closed.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Attributed {
    /// Laid to the train that closed them.
    pub(super) right: usize,
    /// Laid to another train.
    pub(super) wrong: usize,
    /// Laid to nobody, although a train closed them.
    pub(super) rejected: usize,
    /// Closed by themselves, and laid to a train.
    pub(super) taken: usize,
    /// Closed by themselves, and laid to nobody.
    pub(super) spurious: usize,
}

impl Attributed {
    pub(super) const fn add(&mut self, other: Self) {
        self.right += other.right;
        self.wrong += other.wrong;
        self.rejected += other.rejected;
        self.taken += other.taken;
        self.spurious += other.spurious;
    }
}

/// Lets trains run round a way, spread over it, and compares what the driver made of their contacts with the truth.
pub(super) fn attributed(stage: &Rehearsal<'_>, way: &Way, trains: &[TrainId]) -> anyhow::Result<Attributed> {
    let mut stage = stage.clone();
    for (nth, train) in trains.iter().enumerate() {
        let place = way.nodes.get(nth * way.nodes.len() / trains.len()).copied().unwrap_or(NodeId(0));
        stage.put(*train, place, Length::from_mm(60.0))?;
    }
    let mut driver = stage.driver();
    for train in trains {
        let step = stage.models.get(train).map_or(SpeedStep::STAND, |model| {
            let off =
                |step: &SpeedStep| (model.speed(*step, Approach::Below).value.as_mm_per_s() - RUN_AT).abs();
            let all = (1..=model.highest().get()).filter_map(SpeedStep::new);
            all.min_by(|one, other| off(one).total_cmp(&off(other))).unwrap_or(SpeedStep::STAND)
        });
        let _ = driver.order(stage.line.now(), Order::Speed { train: *train, step });
    }
    let began = stage.line.now();
    let until = began + TimeSpan::from_s(RUN_FOR);
    let mut laid: Vec<(SensorId, Timestamp, Timestamp, TrainId)> = Vec::new();
    while stage.line.now() < until {
        if let Some(Notice::Passed { train, passed, .. }) = stage.line.drive(&mut driver, until) {
            laid.push((passed.sensor, passed.window.after, passed.window.until, train));
        }
    }
    let mut counted = Attributed::default();
    // What closed just now nobody has read yet.
    let last = until - TimeSpan::from_ms(500);
    let truth = stage.world().truth();
    for pass in truth.passes().iter().filter(|pass| pass.closed && pass.at >= began && pass.at < last) {
        let slack = TimeSpan::from_ms(30);
        let within = |from: Timestamp, to: Timestamp| pass.at >= from - slack && pass.at <= to + slack;
        let found = laid.iter().find(|(sensor, from, to, _)| *sensor == pass.sensor && within(*from, *to));
        match (pass.cause, pass.train, found) {
            (Cause::Train, Some(train), Some((.., who))) if *who == train => counted.right += 1,
            (Cause::Train, Some(_), Some(_)) => counted.wrong += 1,
            (Cause::Train, Some(_), None) => counted.rejected += 1,
            (_, _, Some(_)) => counted.taken += 1,
            (_, _, None) => counted.spurious += 1,
        }
    }
    Ok(counted)
}
