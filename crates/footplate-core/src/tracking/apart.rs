//! How fast a run is and how fast each of its steps, kept apart: what forecasts of a train hardly known begin with.
//!
//! A [`MotionFilter`](super::MotionFilter) of a train that is driven knows its steps well, and has one letter for what its speed is off by: `ε`.
//! Before a train is known a step may be off by a tenth or by half, which says nothing of the next one, and of a change of
//! speed only what the new speed has made of the distance so far. So each step has a letter of its own, `s`, and a change from
//! one to another goes
//!
//! ```text
//! x(t) = b + e^ε S(t; v₁ e^s₁, v₂ e^s₂) + ζ r(t)
//! ```
//!
//! with `S(t; v₁, v₂)` the distance by the laws of a change from the speed `v₁` to `v₂`. Slopes are those between changes
//! that differ a little in one of the speeds: a ramp to a faster step takes longer and begins alike. A change that is
//! interrupted leaves a speed that depends on both steps; the two on which it depends most are kept.
#![expect(clippy::indexing_slicing, reason = "arrays of letters, indexed by letters")]

use super::filter_state::{E, FilterState, H, N};
use crate::model::MotionModel;
use crate::model::{Pace, Segment, SpeedCommand};

/// By so much, as ln, speeds differ between which slopes are taken.
const STEP: f64 = 1e-3;
/// When a step is reached again its ln speed differs by so much: repeats of one run differ by 0.3 to 0.8 %. Only forecasts
/// count it, which are held to their intervals; who drives learns such differences (`MotionFilter::repeat`).
pub(super) const STEP_AGAIN: f64 = 0.006;
/// Bounds of what a run, or a step, may differ from what is known, as ln: beyond, the model is wrong.
const FARTHEST_DEVIATION: f64 = 1.5;
/// What there is no letter for.
const NONE: (usize, f64) = (0, 0.0);

/// The present change, as it would be from or to a speed that differs a little.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Apart {
    /// What the change is an answer to; `None` once its law is no longer asked.
    #[cfg_attr(feature = "serde", serde(rename = "told"))]
    commanded: Option<SpeedCommand>,
    from: Pace,
    /// The letters on which the speed before depends, and by how much.
    before: [(usize, f64); 2],
    /// The values of the letters with which the segment was made: of the step run at, and of those before.
    at: [f64; 3],
    /// To a speed a little faster.
    toward: Segment,
    /// From a speed a little faster.
    away: Segment,
}

impl Apart {
    /// Of a train at rest or running steadily.
    fn steady(segment: &Segment) -> Self {
        let faster = Segment::steady(segment.begins, segment.to * libm::exp(STEP));
        Self {
            commanded: None,
            from: segment.from,
            before: [NONE; 2],
            at: [0.0; 3],
            toward: faster,
            away: *segment,
        }
    }

    /// The letters in use besides that of the step run at.
    pub(super) const fn letters(&self) -> [usize; 2] {
        [self.before[0].0, self.before[1].0]
    }

    /// A command takes effect on a train: what the speed it has then depends on.
    pub(super) fn next(&self, course: &FilterState, commanded: &SpeedCommand, begins: f64) -> Self {
        let late = begins - course.x[H];
        let pace = if commanded.at_rest { Pace::steady(0.0) } else { course.segment.pace(late) };
        let mut before = [NONE; 3];
        if pace.speed > 0.0 {
            let part = |segment: &Segment| (segment.speed(late) - pace.speed) / (STEP * pace.speed);
            let [(one, by_one), (other, by_other)] = self.before;
            let away = part(&self.away);
            let letters = [
                course.speed.map_or(NONE, |letter| (letter, part(&self.toward))),
                (one, away * by_one),
                (other, away * by_other),
            ];
            for (letter, by) in letters {
                let known = before.iter().position(|(of, by)| *of == letter && *by != 0.0);
                let free = known.or_else(|| before.iter().position(|(_, by)| *by == 0.0));
                if let Some(place) = free {
                    before[place] = (letter, before[place].1 + by);
                }
            }
            before.sort_by(|one, other| other.1.abs().total_cmp(&one.1.abs()));
        }
        let before = [before[0], before[1]];
        let at = [0.0, course.x[before[0].0], course.x[before[1].0]];
        Self { commanded: Some(*commanded), from: pace, before, at, ..*self }
    }

    /// It runs on steadily.
    pub(super) fn run_on(&mut self, segment: &Segment) {
        *self = Self { at: [self.at[0], 0.0, 0.0], ..Self::steady(segment) };
    }

    /// Adds how the place of a train changes with the letters of its steps.
    pub(super) fn add_slopes(&self, course: &FilterState, time: f64, slope: &mut [f64; N]) {
        let distance = |segment: &Segment| {
            if time.is_infinite() { segment.distance_to_rest() } else { segment.distance(time - course.x[H]) }
        };
        let grown = libm::exp(course.x[E]) / STEP;
        let here = distance(&course.segment);
        if let Some(letter) = course.speed {
            slope[letter] += grown * (distance(&self.toward) - here);
        }
        for (letter, by) in self.before {
            slope[letter] += grown * by * (distance(&self.away) - here);
        }
    }
}

impl FilterState {
    /// Limits by how much a run and its step may differ.
    pub(super) fn hold_deviations(&mut self) {
        for letter in [Some(E), self.speed].into_iter().flatten() {
            self.x[letter] = self.x[letter].clamp(-FARTHEST_DEVIATION, FARTHEST_DEVIATION);
        }
    }

    /// From now on steps are kept apart. Returns the letter of the step run at.
    pub(super) fn keep_apart(&mut self) -> Option<usize> {
        self.apart = Some(Apart::steady(&self.segment));
        self.speed = (self.step != 0).then(|| self.meet(self.step, false, [0; 2]));
        self.speed
    }

    /// Makes the present segment anew with what is known of the speeds of steps by now.
    pub(super) fn linearise(&mut self, model: &MotionModel) {
        let Some(mut apart) = self.apart else { return };
        let letter = self.speed.filter(|_| self.step != 0);
        let step = letter.map_or(0.0, |letter| self.x[letter]);
        let Some(commanded) = apart.commanded else {
            if self.segment.is_steady() {
                let to = self.segment.to * libm::exp(step - apart.at[0]);
                self.segment = Segment::steady(self.segment.begins, to);
                apart.at[0] = step;
                apart.run_on(&self.segment);
                self.apart = Some(apart);
            }
            return;
        };
        let mut faster = 0.0;
        for (place, (letter, by)) in apart.before.into_iter().enumerate() {
            faster += by * (self.x[letter] - apart.at[1 + place]);
            apart.at[1 + place] = self.x[letter];
        }
        apart.at[0] = step;
        apart.from = apart.from.faster(faster);
        let answers = model.answers();
        let to = answers.speed(usize::from(commanded.to), commanded.above()) * libm::exp(step);
        let begins = self.segment.begins;
        let change = |from: Pace, to: f64| {
            let mut segment = Segment::toward(&commanded, &answers, from, to);
            segment.begins = begins;
            segment
        };
        apart.toward = change(apart.from, to * libm::exp(STEP));
        apart.away = change(apart.from.faster(STEP), to);
        self.segment = change(apart.from, to);
        self.apart = Some(apart);
    }

    /// The model was exchanged: the letters of steps say now by how much each is faster than by the new one. The train
    /// goes on as it does.
    pub(super) fn exchange_apart(&mut self, before: &MotionModel, after: &MotionModel) {
        let mut moved = [0.0; N];
        for (letter, step, above) in self.steps_met() {
            let speed = |model: &MotionModel| model.answers().speed(usize::from(step), above);
            let (before, after) = (speed(before), speed(after));
            if before > 0.0 && after > 0.0 {
                moved[letter] = libm::log(after / before);
            }
        }
        for (value, by) in self.x.iter_mut().zip(moved) {
            *value -= by;
        }
        if let Some(apart) = &mut self.apart {
            let (one, other) = (apart.before[0].0, apart.before[1].0);
            let own = self.speed.map_or(0.0, |letter| moved[letter]);
            for (value, by) in apart.at.iter_mut().zip([own, moved[one], moved[other]]) {
                *value -= by;
            }
            apart.commanded = None;
        }
    }

    /// Distance over what the segment says (m), for what was learnt of steps since it was made.
    pub(super) fn learnt_since(&self, time: f64) -> f64 {
        let Some(apart) = &self.apart else { return 0.0 };
        let [(one, _), (other, _)] = apart.before;
        let own = self.speed.filter(|_| self.step != 0).map_or(0.0, |letter| self.x[letter]);
        let learnt: [f64; 3] = [own - apart.at[0], self.x[one] - apart.at[1], self.x[other] - apart.at[2]];
        if learnt == [0.0; 3] {
            return 0.0;
        }
        let distance = |segment: &Segment| segment.distance(time - self.x[H]);
        let here = distance(&self.segment);
        let before = apart.before[0].1 * learnt[1] + apart.before[1].1 * learnt[2];
        ((distance(&apart.toward) - here) * learnt[0] + (distance(&apart.away) - here) * before) / STEP
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;
    use crate::ids::{SpeedStep, TrainId};
    use crate::linalg::Gaussian;
    use crate::tracking::motion_filter::MotionFilter;

    #[test]
    fn no_run_and_no_step_differs_by_more_than_a_factor_of_4_5() {
        let model = MotionModel::unknown(TrainId(24), SpeedStep::new(14).expect("a step"));
        let place = Gaussian { mean: 0.0, variance: 1e-6 };
        let mut course = MotionFilter::<N>::running(&model, 0.0, 14, place).keep_apart(&model).course;
        let letter = course.speed.expect("a letter");
        for (off, held) in [(1.6, 1.5), (1.4, 1.4), (-1.6, -1.5)] {
            (course.x[E], course.x[letter], course.x[H]) = (off, off, off);
            course.hold_deviations();
            assert_eq!([course.x[E], course.x[letter], course.x[H]], [held, held, off]);
        }
    }

    #[test]
    fn what_is_learnt_of_steps_moves_a_change_as_making_it_anew_does() {
        // Given a train that slows down from step 14 to step 9,
        let model = MotionModel::unknown(TrainId(24), SpeedStep::new(14).expect("a step"));
        let place = Gaussian { mean: 0.0, variance: 1e-6 };
        let mut train = MotionFilter::<N>::running(&model, 0.0, 14, place).keep_apart(&model);
        let before = train.course.speed.expect("a letter");
        train.command(&model, 1.0, 9);
        let course = train.at(&model, 4.0).course;
        let own = course.speed.expect("a letter");
        assert_ne!(own, before);
        for (letter, time) in [(own, 3.0), (own, 6.0), (before, 3.0), (before, 6.0)] {
            // when one of both steps is found to be 1 % faster,
            let mut anew = course;
            anew.x[letter] += 0.01;
            let learnt = anew.learnt_since(time);
            let slope = {
                let mut slope = [0.0; N];
                course.apart.expect("steps apart").add_slopes(&course, time, &mut slope);
                0.01 * slope[letter]
            };
            // then its place differs by as much as that of the change made anew, to a few per cent.
            let distance = |course: &FilterState| course.segment.distance(time - course.x[H]);
            anew.linearise(&model);
            let moved = distance(&anew) - distance(&course);
            assert!(moved > 1e-4, "{letter} {time} {moved}");
            assert!((learnt - moved).abs() < 0.03 * moved, "{letter} {time} {learnt} {moved}");
            assert!((slope - moved).abs() < 0.03 * moved, "{letter} {time} {slope} {moved}");
            assert_eq!(anew.learnt_since(time), 0.0, "it is in the change now");
        }
    }

    #[test]
    fn what_a_step_is_off_by_is_not_taken_along_to_the_next() {
        // Given a train of which nothing is known, and which runs 13 % faster at step 9 than such trains do,
        let model = MotionModel::unknown(TrainId(24), SpeedStep::new(14).expect("a step"));
        let exact = |mean: f64| Gaussian { mean, variance: 1e-6 };
        let running = || MotionFilter::<N>::running(&model, 0.0, 14, exact(0.0)).keep_apart(&model);
        let (mut train, mut estimated) = (running(), running());
        // when it is seen every second at step 14, at 9 and at 14 again,
        let mut found = Vec::new();
        for second in 1..30_u8 {
            let now = f64::from(second);
            if let Some(step) =
                [(5, 9), (20, 14)].into_iter().find_map(|(at, step)| (at == second).then_some(step))
            {
                train.command(&model, now, step);
                estimated.command(&model, now, step);
            }
            train = train.at(&model, now);
            if let Some(letter) = train.course.speed.filter(|_| train.course.step == 9) {
                train.course.x[letter] = 0.13;
                train.course.linearise(&model);
            }
            estimated.pass(&model, now, 0.0, exact(train.place(&model, now).mean));
            found.push(estimated.settled_speed().mean / train.settled_speed().mean);
        }
        // then it is found out how fast it is at 9, and that has nothing to do with 14.
        let at = |second: usize| (found[second - 1] - 1.0).abs();
        assert!(at(4) < 0.01 && at(19) < 0.01, "{} {}", at(4), at(19));
        assert!(at(21) < 0.02 && at(22) < 0.02, "{} {}", at(21), at(22));
    }
}
