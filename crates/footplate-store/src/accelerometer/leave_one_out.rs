//! Whether thresholds hold on days that they were not chosen by: they are fitted on all days but one and scored on that one.

use footplate_core::odometry::inertial::StandstillThresholds;

use super::recording::AccelerometerRecording;
use super::ride::AccelerometerRide;
use super::standing_score::StandingScore;
use super::stop_marks::StopMarks;

/// What is tried of each threshold, in order: as far to either side of the default as it can make sense.
const QUIET: [f64; 7] = [0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6];
const LOUD: [f64; 3] = [0.6, 0.8, 1.0];
const DEPARTURE: [f64; 4] = [0.12, 0.16, 0.2, 0.25];

/// The score of a recording with thresholds fitted on the others.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOutScore {
    /// The thresholds that the others chose.
    pub thresholds: StandstillThresholds,
    /// What came of them here.
    pub score: StandingScore,
}

/// Thresholds by their places in what is tried.
type Place = [usize; 3];

/// Fits the thresholds on all recordings but one and scores that one, for each of them; empty for fewer than two.
///
/// The thresholds with the fewest errors may lie at the edge of where it goes wrong: on two of three days of a metro they did, and
/// missed the stops of the third. So those are taken whose worst neighbour does best, which is the middle of a plateau.
pub fn leave_one_out(days: &[(AccelerometerRecording, StopMarks)]) -> Vec<LeftOutScore> {
    if days.len() < 2 {
        return Vec::new();
    }
    let tried = places(0, 0);
    let score = |(recording, marks): &(AccelerometerRecording, StopMarks), place: &Place| {
        thresholds(*place)
            .map(|thresholds| StandingScore::of(&AccelerometerRide::walk(recording, thresholds), marks))
    };
    let scores: Vec<Vec<StandingScore>> =
        days.iter().map(|day| tried.iter().filter_map(|place| score(day, place)).collect()).collect();
    let left_out = (0..days.len()).filter_map(|left_out| {
        let wrong: Vec<f64> = (0..tried.len())
            .map(|at| {
                let others = scores.iter().enumerate().filter(|(day, _)| *day != left_out);
                let others = others.filter_map(|(_, scores)| scores.get(at));
                others.map(|score| score.wrong_s + score.wrong_live_s).sum()
            })
            .collect();
        let worst = |place: &Place| {
            let near = tried.iter().zip(&wrong).filter(|(other, _)| are_neighbours(place, other));
            near.map(|(_, wrong)| *wrong).fold(0.0, f64::max)
        };
        let best = places(1, 1).into_iter().min_by(|one, other| worst(one).total_cmp(&worst(other)))?;
        let at = tried.iter().position(|place| *place == best)?;
        Some(LeftOutScore { thresholds: thresholds(best)?, score: scores.get(left_out)?.get(at)?.clone() })
    });
    left_out.collect()
}

/// All places that have so many on either side of them.
fn places(before: usize, after: usize) -> Vec<Place> {
    let mut places = Vec::new();
    for quiet in before..QUIET.len() - after {
        for loud in before..LOUD.len() - after {
            places.extend((before..DEPARTURE.len() - after).map(|departure| [quiet, loud, departure]));
        }
    }
    places
}

fn are_neighbours(one: &Place, other: &Place) -> bool {
    one.iter().zip(other).all(|(one, other)| one.abs_diff(*other) <= 1)
}

fn thresholds([quiet, loud, departure]: Place) -> Option<StandstillThresholds> {
    Some(StandstillThresholds {
        quiet: *QUIET.get(quiet)?,
        loud: *LOUD.get(loud)?,
        departure_m_per_s2: *DEPARTURE.get(departure)?,
    })
}
