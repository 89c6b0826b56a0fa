//! What really happens on a living layout: for scorers, and for nobody else.

use footplate_core::track::Position;
use footplate_core::{EdgeId, Length, SensorId, Speed, Timestamp, TrainId};

use crate::contacts::Cause;
use crate::living::body::Body;
use crate::living::live_train::{End, LiveTrain};
use crate::living::world::LivingLayout;
use crate::track::TrueTrack;
use crate::train::Train;

/// The truth about a living layout.
#[derive(Debug, Clone, Copy)]
pub struct Truth<'w, 'l> {
    pub(crate) world: &'w LivingLayout<'l>,
}

/// Where a train really is, and how fast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainTruth {
    /// The leading end of its shoe, in true lengths; nothing while it is lifted.
    pub position: Option<Position>,
    /// How fast it runs.
    pub speed: Speed,
    /// Since when it has been standing, while it stands.
    pub at_rest_since: Option<Timestamp>,
    /// All the way it has gone by itself.
    pub odometer: Length,
    /// Which of its ends is in front.
    pub leads: End,
    /// How warm it is, from 0, cold, to 1; of a standing train, how warm it was when it stopped.
    pub warmth: f64,
    /// The speed of this run over that of an average one.
    pub run_factor: f64,
    /// Whether it has to be put on the rails by hand again.
    pub is_wrecked: bool,
}

/// A train stood still.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestTruth {
    /// The train.
    pub train: TrainId,
    /// The leading end of its shoe, in true lengths.
    pub position: Position,
    /// When it came to rest.
    pub since: Timestamp,
    /// When it moved again; nothing while it stands.
    pub until: Option<Timestamp>,
    /// All the way it had gone by itself.
    pub odometer: Length,
}

impl RestTruth {
    pub(crate) fn new(train: TrainId, place: (EdgeId, f64), since: Timestamp, odometer_mm: f64) -> Self {
        let (edge, offset_mm) = place;
        let position = Position { edge, offset: Length::from_mm(offset_mm) };
        Self { train, position, since, until: None, odometer: Length::from_mm(odometer_mm) }
    }
}

/// A contact had reason to close.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassTruth {
    /// The contact.
    pub sensor: SensorId,
    /// When.
    pub at: Timestamp,
    /// The train whose shoe came to it; nothing if it closed by itself.
    pub train: Option<TrainId>,
    /// Why.
    pub cause: Cause,
    /// Whether it closed; `false` for a contact that missed its train.
    pub closed: bool,
    /// What the train's odometer showed, in mm.
    pub odometer_mm: f64,
}

impl<'w, 'l> Truth<'w, 'l> {
    /// A train now.
    #[must_use]
    pub fn train(&self, train: TrainId) -> Option<TrainTruth> {
        let found = self.found(train)?;
        let place = found.body.as_ref().and_then(Body::place);
        Some(TrainTruth {
            position: place.map(|(edge, offset)| Position { edge, offset: Length::from_mm(offset) }),
            speed: Speed::from_mm_per_s(found.speed),
            at_rest_since: found.stands_since,
            odometer: Length::from_mm(found.odometer),
            leads: found.leads,
            warmth: found.load.warmth(),
            run_factor: found.load.run(),
            is_wrecked: found.is_wrecked,
        })
    }

    /// A train as it was drawn.
    #[must_use]
    pub fn engine(&self, train: TrainId) -> Option<&'w Train> {
        Some(&*self.found(train)?.train)
    }

    /// The rails as they are.
    #[must_use]
    pub fn track(&self) -> &'w TrueTrack {
        &self.world.rails.track
    }

    /// Every standstill so far, in the order in which they began.
    #[must_use]
    pub fn rests(&self) -> &'w [RestTruth] {
        &self.world.rests
    }

    /// Every contact that a train came to so far; those that closed by themselves are among them once the
    /// station has looked.
    #[must_use]
    pub fn passes(&self) -> &'w [PassTruth] {
        &self.world.s88.passes
    }

    fn found(&self, train: TrainId) -> Option<&'w LiveTrain> {
        self.world.trains.iter().find(|found| found.id == train)
    }
}
