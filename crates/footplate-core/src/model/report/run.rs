//! The passages of one run, and the stretches of it in which the train ran at a settled speed.

use alloc::vec::Vec;

use crate::event::{Event, EventKind};
use crate::ids::{SensorId, SpeedStep, TrainId};
use crate::link::PollTimingEstimator;
use crate::model::passage::{Drive, Passage, PassageTracker, Sighting};
use crate::time::{TimeSpan, Timestamp};
use crate::track::Layout;
use crate::units::Length;

/// Where a train came to rest in a run, measured by hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredStop {
    /// When the command to stand was sent.
    pub commanded: Timestamp,
    /// The step before it.
    pub from: SpeedStep,
    /// When a person saw the train stand, or read the tape.
    pub seen: Timestamp,
    /// The sensor from which the tape was laid, and how far past it the train stood.
    pub landmark: SensorId,
    /// See `landmark`.
    pub offset: Length,
    /// The entry of the run that says so.
    pub entry: usize,
}

/// What a run of one train tells, in order.
#[derive(Debug, Clone, PartialEq)]
pub struct RunPassages {
    /// The train.
    pub train: TrainId,
    /// The run's place among those given to a calibration.
    pub run: usize,
    /// Its passages.
    pub passages: Vec<Passage>,
    /// Where it was measured to stand; of a place that was measured twice, the later reading.
    pub stops: Vec<MeasuredStop>,
}

impl RunPassages {
    /// Reads the entries of a run of `train`, which begins at `step`. `excluded` entries are passed over as if
    /// they had not been reported. The rhythm of the link must have been learnt before: a first walk over all
    /// runs does that.
    pub fn read<'e>(
        layout: &Layout,
        train: TrainId,
        step: SpeedStep,
        run: usize,
        events: impl Iterator<Item = (&'e Event, bool)>,
        timing: &PollTimingEstimator,
    ) -> Self {
        let mut timing = timing.clone();
        timing.restart();
        let mut tracker = PassageTracker::new(train, step, timing);
        let mut read = Self { train, run, passages: Vec::new(), stops: Vec::new() };
        let mut standing: Option<(Timestamp, SpeedStep)> = None;
        let mut is_first = true;
        for (entry, (event, excluded)) in events.enumerate() {
            if excluded {
                tracker.skip();
                continue;
            }
            if let Some(Sighting::Passage(passage)) = tracker.take(layout, event) {
                // The first answer of a station reports all that closed since its last one, be that minutes ago.
                let is_remembered = core::mem::take(&mut is_first) && passage.drive.commanded.is_none();
                if !is_remembered {
                    read.passages.push(passage);
                }
            }
            match event.kind {
                EventKind::Speed { train: commanded, step } if commanded == train => {
                    // Who ends a session tells trains that stand to stand: the stop was the first time.
                    standing = standing
                        .or_else(|| Some((event.time, tracker.drive().from)))
                        .filter(|_| step == SpeedStep::STAND);
                }
                EventKind::Stopped { train: measured, landmark, offset } if measured == train => {
                    if let Some((commanded, from)) = standing {
                        read.stops.retain(|stop| stop.commanded != commanded);
                        let seen = event.time;
                        read.stops.push(MeasuredStop { commanded, from, seen, landmark, offset, entry });
                    }
                }
                _ => {}
            }
        }
        read
    }

    /// The stretches in which the train ran settled: each a chain of passages linked by known paths, at one
    /// step, after the change to it was over.
    pub fn settled_stretches<'r>(
        &'r self,
        settle: &'r dyn Fn(Drive) -> TimeSpan,
    ) -> impl Iterator<Item = &'r [Passage]> {
        let settled = move |passage: &Passage| {
            passage.drive.step != SpeedStep::STAND
                && passage
                    .drive
                    .commanded
                    .is_none_or(|commanded| passage.window.after - commanded > settle(passage.drive))
        };
        self.passages
            .chunk_by(move |one, next| {
                settled(one) && settled(next) && one.drive == next.drive && next.path.is_some()
            })
            .filter(|chain| chain.len() > 1)
    }
}
