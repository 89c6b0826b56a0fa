//! The most likely course of a train: where its laws take it from one command to the next.
//!
//! Letters: `b` place at which the present segment began (m), `ε` deviation of ln speed of this run, `η` by how much
//! (s) the start was late, `ζ` distance (m) by which the present change differs from its law, `S(t)` distance of the segment by
//! the laws, `r(t)` share of its change that is done. What is the same whenever the train does it again has letters
//! that last, for a train that does the same again and again: by how much (s) changes of speed are later than their law,
//! `τ` upwards and downwards, and what ln speed is off by at each of the steps met of late, `s`. With `Δ` the speed before
//! a change less that after it, the train is at
//!
//! ```text
//! x(t) = b + e^(ε + s) S(t − η) + (ζ + τ Δ) r(t)
//! ```
//!
//! [`MotionFilter`](super::MotionFilter) has the covariance of the letters. A copy answers what further commands would lead to: cheap
//! enough for thousands of alternatives within a millisecond.
#![expect(clippy::indexing_slicing, reason = "arrays of letters, indexed by letters")]

use super::apart::Apart;
use crate::model::MotionModel;
pub(crate) use crate::model::SpeedCommand;
use crate::model::{Pace, Segment};

pub(super) const B: usize = 0;
pub(super) const E: usize = 1;
pub(super) const H: usize = 2;
pub(super) const Z: usize = 3;
/// Upwards, and behind it downwards.
pub(super) const LATER: usize = 4;
/// The first of the steps met.
const STEPS: usize = 6;
/// Who keeps to a pace changes between three steps, each reached from below and from above.
const STEPS_KEPT: usize = 6;
pub(crate) const N: usize = STEPS + STEPS_KEPT;

/// Commands that can wait for their effect one by one. A start takes up to half a second to take effect, in which a quick
/// line carries more: see [`FilterState::tell`].
const MOST_PENDING: usize = 6;
/// A train that comes to rest within this time (s) of a command is at rest when that takes effect (0.16 to 0.26 s on published trains).
const TAKES_EFFECT: f64 = 0.25;

/// A train in motion. Distances in m from an origin that the caller keeps, times in s on the caller's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct FilterState {
    pub(super) segment: Segment,
    /// What the segment is an answer to.
    pub(super) step: u8,
    /// Whether its speed was reached from above.
    is_above: bool,
    /// `b`, `ε`, `η`, `ζ`, `τ` and `s`.
    pub(super) x: [f64; N],
    /// Which steps `s` are of, and whether reached from above; the one that will be replaced next, and the letter of the one
    /// run at.
    met: [(u8, bool); STEPS_KEPT],
    oldest: usize,
    is_repeating: bool,
    pub(super) speed: Option<usize>,
    /// The letter of the present change, and its `Δ` (m/s); none of a start or a stop.
    later: usize,
    slower: f64,
    pending: [Option<SpeedCommand>; MOST_PENDING],
    /// What forecasts keep apart; nothing for a train that is driven.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub(super) apart: Option<Apart>,
}

impl FilterState {
    /// At rest at a place.
    pub(super) fn at_rest(time: f64, place: f64) -> Self {
        Self {
            segment: Segment::steady(time, 0.0),
            step: 0,
            is_above: false,
            x: core::array::from_fn(|letter| if letter == B { place } else { 0.0 }),
            met: [(0, false); STEPS_KEPT],
            oldest: 0,
            is_repeating: false,
            speed: None,
            later: LATER,
            slower: 0.0,
            pending: [None; MOST_PENDING],
            apart: None,
        }
    }

    /// Running steadily at a step for long.
    pub(super) fn running(model: &MotionModel, time: f64, step: u8, place: f64) -> Self {
        let speed = model.answers().speed(usize::from(step), false);
        Self { segment: Segment::steady(time, speed), step, ..Self::at_rest(time, place) }
    }

    /// The step commanded last, whether it has taken effect or not.
    pub(crate) fn step(&self) -> u8 {
        self.pending.iter().flatten().last().map_or(self.step, |commanded| commanded.to)
    }

    /// A command leaves the line; all that took effect before has been taken in.
    pub(crate) fn command(&mut self, sent: f64, step: u8) {
        let from = self.step();
        if from == step {
            return;
        }
        let at_rest =
            from == 0 && self.pending.iter().all(Option::is_none) && self.rests_at(sent + TAKES_EFFECT);
        if let Some(free) = self.pending.iter_mut().find(|slot| slot.is_none()) {
            *free = Some(SpeedCommand { sent, from, to: step, at_rest });
        } else if let Some(last) = self.pending.last_mut() {
            // The decoder obeys the newest command; the one before it, sent moments ago, has no effect of its own.
            *last = last.filter(|last| last.from != step).map(|last| SpeedCommand { sent, to: step, ..last });
        }
    }

    /// Whether a train that was commanded to stop stands by a time.
    pub(crate) fn rests_at(&self, time: f64) -> bool {
        self.step == 0 && time >= self.rest_time()
    }

    /// Whether all that was commanded has taken effect, and has shown.
    pub(super) fn has_shown(&self, time: f64) -> bool {
        self.pending.iter().all(Option::is_none) && self.segment.shown() <= time
    }

    pub(super) fn rest_time(&self) -> f64 {
        if self.segment.from.speed == 0.0 { self.segment.begins } else { self.segment.settled() }
    }

    /// What takes effect next, and when; `None` if nothing waits.
    pub(super) fn next_effect(&self, model: &MotionModel) -> Option<(SpeedCommand, f64)> {
        let commanded = self.pending[0]?;
        Some((commanded, commanded.effect(&model.answers()).max(self.segment.begins)))
    }

    /// Takes all that has taken effect by a time into the state.
    pub(crate) fn settle(&mut self, model: &MotionModel, time: f64) {
        while let Some((commanded, begins)) = self.next_effect(model).filter(|(_, begins)| *begins <= time) {
            let until = if commanded.at_rest { f64::INFINITY } else { begins };
            let (distance, _) = self.place_and_slope(until);
            self.begin(model, commanded, begins, distance);
        }
    }

    /// The next segment begins at a place (m), which becomes its origin. Returns the speed there, and by how much later (s) this
    /// change is for each second by which the last one is later than estimated.
    pub(super) fn begin(
        &mut self,
        model: &MotionModel,
        commanded: SpeedCommand,
        begins: f64,
        distance: f64,
    ) -> (f64, f64) {
        self.pending.rotate_left(1);
        self.pending[MOST_PENDING - 1] = None;
        let pace = if commanded.at_rest { Pace::steady(0.0) } else { self.segment.pace(begins - self.x[H]) };
        self.x[B] = distance;
        let apart = self.apart.map(|apart| apart.next(self, &commanded, begins));
        let (before, late) = (self.segment, begins - self.x[H]);
        self.segment = Segment::of(&commanded, &model.answers(), pace);
        self.segment.begins = begins;
        // Late in a stop, too, a train that set out late was uncertain by 1.2 m and no journey could begin from there.
        let later =
            if commanded.at_rest || commanded.to == 0 { 0.0 } else { self.segment.later_by(&before, late) };
        (self.step, self.is_above) = (commanded.to, commanded.above());
        for letter in [H, Z] {
            self.x[letter] = 0.0;
        }
        if commanded.at_rest {
            self.x[E] = 0.0;
        }
        self.later = LATER + usize::from(commanded.above());
        self.slower = if self.repeats(&commanded) { pace.speed - self.segment.to } else { 0.0 };
        if commanded.to != 0 {
            let is_met = self.repeats(&commanded) || apart.is_some();
            let busy = apart.map_or([0; 2], |apart| apart.letters());
            self.speed = is_met.then(|| self.meet(commanded.to, commanded.above(), busy));
        }
        self.apart = apart;
        self.linearise(model);
        (pace.speed, later)
    }

    /// Whether a command is one of many that are alike.
    const fn repeats(&self, commanded: &SpeedCommand) -> bool {
        self.is_repeating && commanded.to != 0 && !commanded.at_rest
    }

    /// Whether the same commands repeat from now on; what was learnt before is forgotten.
    pub(super) fn repeat(&mut self, is_repeating: bool) {
        self.is_repeating = is_repeating;
        if is_repeating {
            // What it was until now is this run's own.
            (self.x[E], self.x[Z]) = (libm::log(self.grown()), self.displaced());
            self.met = [(0, false); STEPS_KEPT];
            self.x[LATER..].fill(0.0);
            (self.speed, self.slower) = (None, 0.0);
        }
    }

    /// The letter of a step, reached from above or not, if it is kept.
    pub(super) fn kept(&self, step: u8, above: bool) -> Option<usize> {
        let at = self.met.iter().position(|met| *met == (step, above))?;
        Some(STEPS + at)
    }

    /// Runs at a step, of which only the model is known unless its letter is kept. Letters in use are not replaced.
    pub(super) fn meet(&mut self, step: u8, above: bool, busy: [usize; 2]) -> usize {
        self.kept(step, above).unwrap_or_else(|| {
            while busy.contains(&(STEPS + self.oldest)) {
                self.oldest = (self.oldest + 1) % STEPS_KEPT;
            }
            let at = self.oldest;
            self.oldest = (at + 1) % STEPS_KEPT;
            self.met[at] = (step, above);
            self.x[STEPS + at] = 0.0;
            STEPS + at
        })
    }

    /// The letters of steps in use, each with its step and whether that was reached from above.
    pub(super) fn steps_met(&self) -> impl Iterator<Item = (usize, u8, bool)> {
        let met = self.met.into_iter().enumerate().filter(|(_, (step, _))| *step != 0);
        met.map(|(at, (step, above))| (STEPS + at, step, above))
    }

    /// Its speed relative to that of the present segment.
    pub(super) fn grown(&self) -> f64 {
        // Where steps are apart the segment has the speed of its step already.
        let by_step = self.speed.filter(|_| self.apart.is_none()).map_or(0.0, |letter| self.x[letter]);
        libm::exp(self.x[E] + by_step)
    }

    /// It has been running steadily for long: distances count from here.
    pub(super) fn run_on(&mut self, time: f64, distance: f64) {
        self.x[B] = distance;
        self.segment = Segment::steady(time, self.segment.to);
        self.slower = 0.0;
        if let Some(apart) = &mut self.apart {
            apart.run_on(&self.segment);
        }
    }

    /// By how much (m) the present change differs from its law once it is done.
    fn displaced(&self) -> f64 {
        self.x[Z] + self.slower * self.x[self.later]
    }

    /// Slopes of `x(t)` from those of `b`, `ε`, `η` and `ζ`.
    fn slope(&self, own: [f64; 4], time: f64) -> [f64; N] {
        let mut slope = [0.0; N];
        slope[..4].copy_from_slice(&own);
        slope[self.later] = self.slower * own[Z];
        if let Some(apart) = &self.apart {
            apart.add_slopes(self, time, &mut slope);
        } else if let Some(letter) = self.speed {
            slope[letter] = own[E];
        }
        slope
    }

    /// `x(t)` and its slopes; at an infinite time the place of rest.
    pub(super) fn place_and_slope(&self, time: f64) -> (f64, [f64; N]) {
        let grown = self.grown();
        if time.is_infinite() {
            let distance = self.segment.distance_to_rest();
            let place = self.x[B] + grown * distance + self.displaced();
            return (place, self.slope([1.0, grown * distance, 0.0, 1.0], time));
        }
        let late = time - self.x[H];
        let distance =
            if self.is_still() { 0.0 } else { self.segment.distance(late) + self.learnt_since(time) };
        let (speed, share) = (self.segment.speed(late), self.segment.share(time));
        let place = self.x[B] + grown * distance + self.displaced() * share;
        (place, self.slope([1.0, grown * distance, -grown * speed, share], time))
    }

    pub(super) const fn is_still(&self) -> bool {
        self.segment.from.speed == 0.0 && self.segment.to == 0.0
    }

    /// Where it is (m), after all commands that have taken effect by then.
    pub(crate) fn place(&self, time: f64) -> f64 {
        let is_done = self.rests_at(time) && !self.is_still();
        let (grown, displaced) = (self.grown(), self.displaced());
        if is_done {
            return self.x[B] + grown * self.segment.distance_to_rest() + displaced;
        }
        let distance = if self.is_still() {
            0.0
        } else {
            self.segment.distance(time - self.x[H]) + self.learnt_since(time)
        };
        let change = if displaced == 0.0 { 0.0 } else { displaced * self.segment.share(time) };
        self.x[B] + grown * distance + change
    }

    /// The speed (m/s) that the present change has still to make at a time.
    pub(crate) fn unsettled(&self, time: f64) -> f64 {
        (self.segment.to - self.segment.speed(time - self.x[H])).abs()
    }

    /// Its speed (m/s) then.
    pub(crate) fn speed(&self, time: f64) -> f64 {
        self.grown() * self.segment.speed(time - self.x[H])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{SpeedStep, TrainId};
    use crate::linalg::Gaussian;
    use crate::tracking::motion_filter::MotionFilter;

    #[test]
    fn commands_in_quick_succession_all_count() {
        // Given a slider that is pushed from 1 to 9 within the delay of the start, and back to 8,
        let model = MotionModel::unknown(TrainId(24), SpeedStep::new(14).expect("a step"));
        let begins: MotionFilter = MotionFilter::at_rest(0.0, Gaussian { mean: 0.0, variance: 1e-6 });
        let (mut pushed, mut at_once) = (begins, begins);
        for (nth, step) in [1, 2, 3, 4, 5, 6, 7, 8, 9, 8].into_iter().enumerate() {
            pushed.command(&model, 0.02 * nth as f64, step);
        }
        at_once.command(&model, 0.0, 8);
        // the train runs at the last step, as fast as one that was commanded to it at once.
        assert_eq!(pushed.step(), 8);
        let [speed, wanted] =
            [&pushed, &at_once].map(|filter| filter.at(&model, 30.0).speed(&model, 30.0).mean);
        assert!((speed / wanted - 1.0).abs() < 0.01, "{speed} m/s instead of {wanted} m/s");
    }

    #[test]
    fn the_letter_of_the_step_met_longest_ago_is_used_again_and_none_that_is_in_use() {
        let mut filter: MotionFilter = MotionFilter::at_rest(0.0, Gaussian { mean: 0.0, variance: 1e-6 });
        let state = &mut filter.course;
        let nothing = [0; 2];
        let letters: alloc::vec::Vec<usize> = (1..=6).map(|step| state.meet(step, false, nothing)).collect();
        assert!((0..6).all(|one| (0..one).all(|other| letters[one] != letters[other])), "{letters:?}");
        assert_eq!(state.meet(3, false, nothing), letters[2], "it is known");
        assert_eq!(
            state.meet(3, true, nothing),
            letters[0],
            "from above it is another, and the first is the oldest"
        );
        assert_eq!(state.meet(7, false, [letters[1], letters[2]]), letters[3], "two are in use");
        assert_eq!(state.kept(4, false), None);
        assert_eq!((state.kept(7, false), state.kept(2, false)), (Some(letters[3]), Some(letters[1])));
        assert_eq!(state.meet(8, false, nothing), letters[4]);
        assert_eq!(state.steps_met().count(), 6);
    }

    fn model() -> MotionModel {
        MotionModel::unknown(TrainId(24), SpeedStep::new(14).expect("a step"))
    }

    /// Filters in the middle of a start, of a change up and one down, of a stop, and of a steady run, with letters that are not
    /// zero; repeating or not, and with speeds apart.
    fn filters() -> alloc::vec::Vec<(MotionFilter, f64)> {
        let model = model();
        let mut all = alloc::vec::Vec::new();
        for variant in 0..3 {
            for (from, to, seen) in [(0, 8, 1.6), (6, 9, 1.2), (9, 4, 1.2), (9, 0, 1.1), (7, 7, 3.0)] {
                let place = Gaussian { mean: 0.4, variance: 1e-6 };
                let mut filter: MotionFilter = if from == 0 {
                    MotionFilter::at_rest(0.0, place)
                } else {
                    MotionFilter::running(&model, 0.0, from, place)
                };
                if variant == 1 {
                    filter.repeat(true);
                }
                if variant == 2 {
                    filter = filter.keep_apart(&model);
                }
                filter.command(&model, 0.1, to);
                let mut filter = filter.at(&model, seen);
                for letter in 0..N {
                    // Steps that were not met have no letter.
                    if letter < STEPS || Some(letter) == filter.course.speed {
                        filter.course.x[letter] += [0.01, 0.02, 0.015, -0.004, 0.03, -0.02][letter % STEPS];
                    }
                }
                all.push((filter, seen));
            }
        }
        all
    }

    #[test]
    fn slopes_are_how_the_place_changes_with_each_letter() {
        const BY: f64 = 1e-6;
        for (filter, seen) in filters() {
            let course = filter.course;
            let at_rest = if course.step() == 0 { f64::INFINITY } else { seen };
            for time in [seen, seen + 0.3, at_rest] {
                let (place, slope) = course.place_and_slope(time);
                for letter in [B, E, H, Z, LATER, LATER + 1] {
                    // What was learnt of the speed since depends on η a little, too.
                    let moved = |by: f64| {
                        let mut moved = course;
                        moved.x[letter] += by;
                        moved.place_and_slope(time).0
                    };
                    let numerical = (moved(BY) - moved(-BY)) / (2.0 * BY);
                    let within = if letter == H { 1e-2 } else { 1e-5 };
                    assert!(
                        (numerical - slope[letter]).abs() < within,
                        "{letter} at {time}: {numerical} {}",
                        slope[letter]
                    );
                }
                if let Some(letter) = course.speed.filter(|_| course.apart.is_none()) {
                    assert_eq!(slope[letter], slope[E], "both are ln of the speed");
                }
                let Pace { speed: before, .. } = course.segment.from;
                if time.is_finite() && course.apart.is_none() && before > 0.0 && course.step() > 0 {
                    assert!((course.place(time) - place).abs() < 1e-12);
                    let ahead = (course.place(time + BY) - course.place(time - BY)) / (2.0 * BY);
                    let share =
                        (course.segment.share(time + BY) - course.segment.share(time - BY)) / (2.0 * BY);
                    assert!(
                        (ahead - course.speed(time) - course.displaced() * share).abs() < 1e-5,
                        "{ahead}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_detection_is_the_update_of_a_kalman_filter() {
        let model = model();
        // Steadily, so that one look is as good as two; the place is then counted from there.
        let start = Gaussian { mean: 0.4, variance: 4e-4 };
        let mut filter: MotionFilter = MotionFilter::running(&model, 0.0, 7, start);
        let speed = filter.speed(&model, 2.0);
        let predicted = filter.place(&model, 2.0);
        let e = filter.p[E][E];
        // The place is off by its own variance and by 2 s of the speed's.
        assert!((predicted.mean - (0.4 + 2.0 * speed.mean)).abs() < 1e-9, "{predicted:?}");
        let with_speed = 2.0 * speed.mean;
        let begin = filter.place(&model, 0.0).variance;
        // It wanders a little meanwhile.
        assert!(
            (predicted.variance / (begin + with_speed * with_speed * e) - 1.0).abs() < 1e-3,
            "{predicted:?}"
        );
        let place = Gaussian { mean: predicted.mean + 0.001, variance: 1e-6 };
        let time_variance = 1e-4;
        let noise = 1e-6 + speed.mean * speed.mean * time_variance;
        let short = filter.pass(&model, 2.0, time_variance, place);
        assert!(
            (short.mean - 0.001).abs() < 1e-9 && (short.variance - predicted.variance - noise).abs() < 1e-12
        );
        let after = filter.place(&model, 2.0);
        let gain = predicted.variance / (predicted.variance + noise);
        assert!((after.mean - predicted.mean - gain * 0.001).abs() < 1e-6, "{after:?}");
        assert!((after.variance - (1.0 - gain) * predicted.variance).abs() < 1e-9, "{after:?}");
        let faster = with_speed * e / (predicted.variance + noise) * 0.001;
        assert!((filter.course.x[E] - faster).abs() < 1e-5, "{} {faster}", filter.course.x[E]);
        let known = e - with_speed * e * with_speed * e / (predicted.variance + noise);
        assert!((filter.p[E][E] - known).abs() < 1e-2 * known, "{} {known}", filter.p[E][E]);
    }

    #[test]
    fn a_place_that_companions_move_is_reached_when_the_place_is() {
        let model = model();
        let start = Gaussian { mean: 0.0, variance: 1e-4 };
        let mut filter: MotionFilter<{ N + 1 }> = MotionFilter::running(&model, 1.0, 7, start);
        let speed = filter.speed(&model, 1.0);
        let place = Gaussian { mean: 0.6, variance: 1e-6 };
        let (time, deviation) = filter.reaches(&model, place, 1.0).expect("it runs");
        assert!((time - 1.0 - 0.6 / speed.mean).abs() < 1e-6, "{time}");
        // Over the speed: of the place, of where it began, and 0.6 m of what the speed is off by.
        let begin = filter.place(&model, 1.0).variance;
        let off = begin + 1e-6 + 0.36 * filter.p[E][E];
        assert!((deviation / off.sqrt() * speed.mean - 1.0).abs() < 1e-3, "{deviation}");
        filter.keep_beside(0, 9e-4);
        let arrival = filter.arrives(&model, place, &[(0, 2.0)], 1.0).expect("it runs");
        assert!((arrival.time - time).abs() < 1e-6 && (arrival.speed - speed.mean).abs() < 1e-9);
        let variance = (off + 4.0 * 9e-4) / (speed.mean * speed.mean);
        assert!((arrival.variance / variance - 1.0).abs() < 1e-3, "{arrival:?} {variance}");
        // At a place 0.1 m before that moves with half the companion: where it is is as much farther, and as much less known.
        filter.shift_beside(0.1, &[(0, 0.5)]);
        let moved = filter.place(&model, 1.0);
        assert!((moved.mean - 0.1).abs() < 1e-12 && (moved.variance - begin - 0.25 * 9e-4).abs() < 1e-12);
        // What was counted from there too is off by as much: 2 less 0.5 of it.
        let again =
            filter.arrives(&model, Gaussian { mean: 0.7, ..place }, &[(0, 2.0)], 1.0).expect("it runs");
        let variance = (off + 2.25 * 9e-4) / (speed.mean * speed.mean);
        assert!((again.time - time).abs() < 1e-6);
        assert!((again.variance / variance - 1.0).abs() < 1e-3, "{again:?} {variance}");
        // A train that stops before does not arrive; one that stops behind it does.
        filter.command(&model, 1.0, 0);
        let (rest, _, _) = filter.rest(&model).expect("it stops");
        let at = |mean: f64| Gaussian { mean, variance: 1e-6 };
        assert!(filter.reaches(&model, at(rest.mean), 1.0).is_none());
        assert!(filter.reaches(&model, at(rest.mean - 0.01), 1.0).is_some());
        assert!(filter.arrives(&model, at(rest.mean + 0.01), &[], 1.0).is_none());
        assert!(filter.arrives(&model, at(rest.mean - 0.01), &[], 1.0).is_some());
    }
}
