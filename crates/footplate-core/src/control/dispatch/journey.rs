//! What a train is asked for that shall go somewhere.

use crate::control::drive::Aim;
use crate::track::Landmark;
use crate::units::Length;

/// Go to a place, by whatever way, and with as many reversals as that takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Journey {
    /// The place, where the leading end of the pickup shall be.
    pub target: Landmark,
    /// Which part of all rests that may come of the last stop shall be there.
    pub aim: Aim,
    /// Whether the train has to face as the landmark does. Otherwise it comes from whichever side is sooner.
    pub faces: bool,
}

impl Journey {
    /// The middle of all rests at a place, from whichever side.
    #[must_use]
    pub const fn to(target: Landmark) -> Self {
        Self { target, aim: Aim::Median, faces: false }
    }
}

/// The parts of a train along the track, so that nobody comes too near.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainLengths {
    /// From the pickup to the end of the train, at that end where it is further.
    pub overhang: Length,
    /// The pickup itself.
    pub pickup: Length,
}

impl TrainLengths {
    /// A long locomotive of the gauge (250 mm over buffers, as Märklin's longest without a tender) with its pickup
    /// anywhere under it.
    pub const LONG_LOCOMOTIVE: Self =
        Self { overhang: Length::from_mm(215.0), pickup: Length::from_mm(45.0) };

    /// From the leading end of the pickup to the front of the train, whichever end leads.
    #[must_use]
    pub const fn ahead(self) -> Length {
        self.overhang
    }

    /// From the leading end of the pickup to the rear of the train.
    #[must_use]
    pub fn behind(self) -> Length {
        self.overhang + self.pickup
    }
}
