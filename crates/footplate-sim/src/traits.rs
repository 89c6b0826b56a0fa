//! Special traits of one train beyond its speed table and its law; none in the usual world.

use footplate_core::Ratio;

use crate::draws::Draws;
use crate::electric::ElectricEngine;
use crate::other_law::OtherLaw;

/// The traits of one train; the default is none.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Traits {
    /// Starts at unusual times.
    pub sticky: Option<StickyStarts>,
    /// An unusual law, in place of its own.
    pub other_law: Option<OtherLaw>,
    /// A second motor model, in place of table and law.
    pub engine: Option<ElectricEngine>,
    /// The variation from one session to the next.
    pub session: SessionSpread,
    /// The part of a gradient that load control does not compensate: speed falls by this per unit of gradient.
    pub grade_sensitivity: f64,
    /// Standard deviation in mm of the place where the shoe closes a sensor, in addition to the sensor's own.
    pub shoe_scatter_mm: f64,
}

/// Starts from rest that are early or late, or fail until a higher step is commanded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StickyStarts {
    /// Probability that a start is early or late.
    pub irregular: Ratio,
    /// The largest deviation, in s, in either direction; the smallest is a fifth of it.
    pub by_s: f64,
    /// Probability that a train sticks until a higher step is commanded.
    pub stuck: Ratio,
}

impl StickyStarts {
    /// The delay of this start, in s; negative if early; `None` if the train sticks.
    pub(crate) fn draw(&self, draws: &mut Draws) -> Option<f64> {
        if draws.chance(self.stuck.as_parts()) {
            return None;
        }
        if !draws.chance(self.irregular.as_parts()) {
            return Some(0.0);
        }
        let by = draws.uniform(0.2 * self.by_s..self.by_s);
        Some(if draws.chance(0.5) { by } else { -by })
    }
}

/// Standard deviations of a session's factors: supply voltage, cleanness, load.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SessionSpread {
    /// Of the speed at every step, relative.
    pub speed: f64,
    /// Of the additional change of speed at the top, relative; proportional to the square of speed below.
    pub top: f64,
    /// Of the deceleration without drive, relative.
    pub stop: f64,
    /// The heaviest load, as a part of the mass.
    pub load: f64,
}

/// The factors of one session; 1 on an average day.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Session {
    pub(crate) speed: f64,
    pub(crate) top: f64,
    pub(crate) stop: f64,
    pub(crate) mass: f64,
}

impl Session {
    pub(crate) const AVERAGE: Self = Self { speed: 1.0, top: 0.0, stop: 1.0, mass: 1.0 };

    /// Deviations beyond this many standard deviations are drawn again.
    const MAX_SDS: f64 = 2.5;

    pub(crate) fn draw(spread: &SessionSpread, draws: &mut Draws) -> Self {
        let mut about_one = |sd: f64| draws.normal_within(1.0, sd, Self::MAX_SDS);
        Self {
            speed: about_one(spread.speed),
            top: about_one(spread.top) - 1.0,
            stop: about_one(spread.stop),
            mass: 1.0 + draws.uniform(0.0..spread.load.max(f64::MIN_POSITIVE)),
        }
    }
}
