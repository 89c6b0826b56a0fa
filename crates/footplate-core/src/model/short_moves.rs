//! Short moves by the motion model: "go, wait, stop", with the stop commanded before the speed is reached.

use super::change_deviations::OTHER_SHAPES;
use super::expected_information::{start_to, time_of};
use super::motion_model::MotionModel;
use super::parameters::Answers;
use super::segment::{Segment, SpeedCommand};
use crate::ids::SpeedStep;
use crate::time::TimeSpan;
use crate::units::Length;

/// Longest time between the two commands: a train that takes longer runs steadily, and a stop is planned for it.
const LONGEST_S: f64 = 60.0;

/// Keeps the time that a stop takes from standstill finite (m/s).
const LEAST_SPEED: f64 = 1e-3;

/// How far a train gets on a short move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShortMoveForecast {
    /// From rest to rest.
    pub distance: Length,
    /// One standard deviation of what is not known of it.
    pub uncertainty: Length,
    /// One standard deviation of single moves about it.
    pub scatter: Length,
}

impl ShortMoveForecast {
    /// One standard deviation of where a single move ends.
    pub fn deviation(&self) -> Length {
        Length::from_m(libm::hypot(self.uncertainty.as_m(), self.scatter.as_m()))
    }
}

/// The distance of a short move (m): a start, and a stop commanded some seconds later.
pub(super) fn move_distance(answers: &Answers<'_>, step: u8, run: f64) -> f64 {
    let start = start_to(answers, step);
    let mut commanded = SpeedCommand { sent: run, from: step, to: 0, at_rest: false };
    let effect = commanded.effect(answers);
    if effect <= start.begins {
        return 0.0;
    }
    commanded.sent = 0.0;
    start.distance(effect) + Segment::of(&commanded, answers, start.pace(effect)).distance_to_rest()
}

/// Standard deviation (m) of where a short move ends, by dry friction and gears. The error that stops and starts share with
/// opposite signs (`end_of_stop`) is not in it: a move is the sum of both.
const END_OF_MOVE: f64 = 0.0035;

impl MotionModel {
    /// How far the train gets if it is commanded to a step and, after `run`, to stop.
    pub fn short_move(&self, step: SpeedStep, run: TimeSpan) -> ShortMoveForecast {
        let run = run.as_s().clamp(0.0, LONGEST_S);
        let answers = self.answers();
        let start = start_to(&answers, step.get());
        let reached = start.speed(run);
        let unknown = self.deviation_with_scale(|answers| move_distance(answers, step.get(), run));
        let distance = move_distance(&answers, step.get(), run).max(0.0);
        let commanded = SpeedCommand { sent: run, from: step.get(), to: 0, at_rest: false };
        let effect = commanded.effect(&answers);
        // The stop begins in the middle of the start, where its law is least known; it goes on for as long as the speed there
        // says, so that both errors have the same sign.
        let stop = Segment::of(&commanded, &answers, start.pace(effect));
        let stop_lasts = stop.distance_to_rest() / start.speed(effect).max(LEAST_SPEED);
        let shape = OTHER_SHAPES * (start.shape_error(effect) + stop_lasts * start.shape_speed_error(effect));
        ShortMoveForecast {
            distance: Length::from_m(distance),
            uncertainty: Length::from_m(libm::hypot(libm::hypot(unknown, shape), END_OF_MOVE)),
            // A short move is the sum of a start and a stop itself.
            scatter: Length::from_m(libm::hypot(
                self.scatter.of_stop(reached),
                reached * self.start_scatter(),
            )),
        }
    }

    /// The time between the commands of a short move of this distance; `None` if it takes longer than a minute or is not
    /// ahead.
    pub fn short_move_time(&self, step: SpeedStep, distance: Length) -> Option<TimeSpan> {
        let answers = self.answers();
        let wanted = distance.as_m();
        let distance = |run| move_distance(&answers, step.get(), run);
        let is_reached = wanted > 0.0 && wanted <= distance(LONGEST_S);
        is_reached.then(|| TimeSpan::from_s(time_of(wanted, distance)))
    }
}
