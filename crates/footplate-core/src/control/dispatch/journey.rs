//! Journeys: where a train is sent.

use crate::control::drive::Aim;
use crate::track::Landmark;
use crate::units::Length;

/// A destination, by any path and with any number of reversals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Journey {
    /// The place for the leading end of the pickup.
    pub target: Landmark,
    /// Which part of the distribution of the last stop is to be there.
    pub aim: Aim,
    /// Whether the train has to face as the landmark does. Otherwise it comes from whichever side is quicker.
    pub faces: bool,
}

impl Journey {
    /// The median of the stop at a place, from whichever side.
    #[must_use]
    pub const fn to(target: Landmark) -> Self {
        Self { target, aim: Aim::Median, faces: false }
    }
}

/// The lengths of a train along the track, which reservations cover.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainLengths {
    /// From the pickup to the farther end of the train.
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
