//! A wheelset with a tachometer: how far the train goes while its counter moves on by one.

use core::f64::consts::PI;

use crate::units::Length;

/// What can make a wheelset turn otherwise than the train moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum Axle {
    /// Driven and braked: it may slip and slide.
    Powered,
    /// Braked only: it may slide.
    Trailing,
    /// Neither: it always rolls.
    Unbraked,
}

impl Axle {
    /// Traction can make it turn faster than the train moves.
    #[must_use]
    pub const fn may_slip(self) -> bool {
        matches!(self, Self::Powered)
    }

    /// Braking can make it turn slower than the train moves.
    #[must_use]
    pub const fn may_slide(self) -> bool {
        !matches!(self, Self::Unbraked)
    }
}

/// What a wheelset was seen to do other than roll.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Loss {
    /// Traction turns it faster than the train moves.
    Spin,
    /// It slides: the brake turns it slower than the train.
    Slide,
}

/// A wheelset whose revolutions are counted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wheelset {
    /// Pulses per revolution.
    pub teeth: u32,
    /// Its assumed diameter.
    pub diameter: Length,
    /// The true diameter lies within this part of the assumed one.
    pub diameter_tolerance: f64,
    /// What can make it slip or slide.
    pub axle: Axle,
}

impl Wheelset {
    /// How far the train goes from one pulse to the next if the wheel rolls: π D / M.
    #[must_use]
    pub fn pulse_pitch(&self) -> Length {
        Length::from_m(PI * self.diameter.as_m() / f64::from(self.teeth))
    }
}
