//! What one train does beyond its speed table and its law: nothing in the usual world.

use footplate_core::Ratio;

use crate::draws::Draws;
use crate::electric::ElectricEngine;
use crate::other_law::OtherLaw;

/// Peculiarities of one train; the default is none.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Traits {
    /// Starts that do not begin when they usually do.
    pub sticky: Option<StickyStarts>,
    /// How it changes speed, in place of its law.
    pub other_law: Option<OtherLaw>,
    /// The engine that drives it, in place of table and law.
    pub engine: Option<ElectricEngine>,
    /// What differs from one session to the next.
    pub session: SessionSpread,
    /// Part of a gradient that load control does not make good: speed falls by this for each unit of gradient.
    pub grade_feel: f64,
    /// Standard deviation in mm of where along the rail the shoe closes a contact, over and above the contact's own.
    pub shoe_scatter_mm: f64,
}

/// Starts from rest that come early or late, or not at all until the train is pushed up a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StickyStarts {
    /// How often a start is early or late.
    pub irregular: Ratio,
    /// By how much at most, in s, either side; at least a fifth of it.
    pub by_s: f64,
    /// How often a train sticks until it is commanded a higher step.
    pub stuck: Ratio,
}

impl StickyStarts {
    /// By how much this start is late, in s; negative if early; `None` if the train sticks.
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

/// Standard deviations of what a session has of its own: supply voltage, cleanness, what the train pulls.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SessionSpread {
    /// Of the speed at every step, relative.
    pub speed: f64,
    /// Of the further change of speed at the top, relative; none at rest, with the square of speed in between.
    pub top: f64,
    /// Of how fast it slows down when nothing drives it, relative.
    pub stop: f64,
    /// The heaviest load: masses grow by up to this part.
    pub load: f64,
}

/// What one session has of its own, as factors that are 1 on an average day.
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
    const MOST_SDS: f64 = 2.5;

    pub(crate) fn draw(spread: &SessionSpread, draws: &mut Draws) -> Self {
        let mut about_one = |sd: f64| draws.normal_within(1.0, sd, Self::MOST_SDS);
        Self {
            speed: about_one(spread.speed),
            top: about_one(spread.top) - 1.0,
            stop: about_one(spread.stop),
            mass: 1.0 + draws.uniform(0.0..spread.load.max(f64::MIN_POSITIVE)),
        }
    }
}
