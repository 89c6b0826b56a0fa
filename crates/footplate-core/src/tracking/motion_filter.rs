//! Kalman filter of a train in motion: its position by the laws of each command, with the uncertainty that each command adds.
//!
//! The letters of its [`FilterState`] are the state. A new command begins a new segment: its `b` is the `x` at which the command
//! takes effect, and the uncertainty of this change alone goes into `ε` and `ζ`. What changes have in common, how late they are
//! and how fast each step is, stays in `τ` and `s`.
#![expect(clippy::indexing_slicing, reason = "arrays of letters, indexed by letters")]

use super::apart::STEP_AGAIN;
use super::filter_state::{B, E, FilterState, H, LATER, N, Z};
use crate::linalg::Gaussian;
use crate::model::MotionModel;
use crate::model::{OTHER_SHAPES, SpeedCommand, StopEffect};
use crate::model::{WANDER, change_error, run_variance};

/// Over this time (s) a run's speed wanders by [`WANDER`].
const WANDERS_IN: f64 = 4.0;
/// Iterations of an update: while little is known, the distance is not linear in the speed.
const LOOKS: usize = 3;
/// Share of a change from which on it explains a large innovation: earlier, a small innovation would mean many times that at the
/// end of the change.
const BEGUN: f64 = 0.3;
/// A steady run is counted anew after this long (s): before, the law of its start and its speed are still distinguished.
const LONG_RUN: f64 = 20.0;
/// With a larger standard deviation of ln speed a steady run is counted anew at every sensor: the distance so far bends with the
/// speed, and a line through it would be off by half the square, 2 %.
const UNSURE_SPEED: f64 = 0.2;
/// Share of a change from which on the run is steady: what is left is less than a millimetre.
pub(super) const STEADY: f64 = 0.995;
/// A change that begins during another differs from the sum of both by the speed that was still missing times this time (s): an eased
/// decoder begins again at rate zero, a counter continues at its own rate.
pub(crate) const INTERRUPTED: f64 = 0.2;
/// By how much (s) all changes of a train in one direction are later or earlier than its law has them: of what single ones
/// differ from it, 5 % of 0.8 s, about as much as is left once this is taken away.
const LATER_CHANGE: f64 = 0.03;
/// Process noise of that, and of ln of the speed of a step, from one change to the next: no law is exact, and what was learnt
/// in one state of a train fades over some dozens of changes (chosen by how well speeds are held).
const LATER_WALK: f64 = 0.004;
const STEP_WALK: f64 = 0.0005;
/// A train in motion. Distances in m from an origin that the caller keeps, times in s on the caller's clock.
///
/// `L` letters: those of its [`FilterState`], and behind them any number of companions, which are other numbers correlated with them
/// ([`pass_beside`](Self::pass_beside)). The caller keeps the companions' means.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct MotionFilter<const L: usize = N> {
    pub(super) course: FilterState,
    #[cfg_attr(feature = "serde", serde(with = "super::square"))]
    pub(super) p: [[f64; L]; L],
    /// Until when wander is in the variance of `ε`.
    wandered: f64,
    /// The part of the variance of ln of a speed that is not learnt for each moment.
    local: f64,
    /// By how much (m) a stop that has not begun is longer because of the track ahead, as far as its owner knows.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    stop_offset: Option<Gaussian>,
}

impl<const L: usize> MotionFilter<L> {
    /// At rest at a place.
    pub(crate) fn at_rest(time: f64, place: Gaussian) -> Self {
        let mut p = [[0.0; L]; L];
        p[B][B] = place.variance;
        Self {
            course: FilterState::at_rest(time, place.mean),
            p,
            wandered: time,
            local: 0.0,
            stop_offset: None,
        }
    }

    /// Running steadily at a step for long.
    pub(crate) fn running(model: &MotionModel, time: f64, step: u8, place: Gaussian) -> Self {
        let mut following = Self::at_rest(time, place);
        following.course = FilterState::running(model, time, step, place.mean);
        let variance = model.ln_speed_variance(step, false);
        following.p[E][E] = run_variance(variance) + variance;
        following
    }

    /// The most likely motion from here, without uncertainty.
    pub(crate) const fn course(&self) -> FilterState {
        self.course
    }

    /// The step commanded last, whether it has taken effect or not.
    pub(crate) fn step(&self) -> u8 {
        self.course.step()
    }

    /// A command has left the line.
    pub(crate) fn command(&mut self, model: &MotionModel, sent: f64, step: u8) {
        if self.step() == step {
            return;
        }
        self.settle(model, sent);
        self.course.command(sent, step);
    }

    /// A stop that has not begun yet is longer by so much (m).
    pub(crate) const fn offset_stop(&mut self, by: Option<Gaussian>) {
        self.stop_offset = by;
    }

    /// Whether a train that was commanded to stop stands by a time.
    pub(crate) fn rests_at(&self, time: f64) -> bool {
        self.course.rests_at(time)
    }

    /// Whether the change commanded last has shown by a time: see [`Segment::shown`](crate::model::Segment::shown).
    pub(crate) fn has_shown(&self, model: &MotionModel, time: f64) -> bool {
        self.at(model, time).course.has_shown(time)
    }

    /// Takes all that has taken effect by a time into the state.
    fn settle(&mut self, model: &MotionModel, time: f64) {
        while let Some((commanded, begins)) =
            self.course.next_effect(model).filter(|(_, begins)| *begins <= time)
        {
            self.begin(model, commanded, begins);
        }
        let since = time - self.wandered;
        if since > 0.0 && self.course.step != 0 {
            self.p[E][E] += WANDER * WANDER * since / WANDERS_IN;
        }
        self.wandered = self.wandered.max(time);
    }

    /// The next segment begins: the distance so far becomes its origin.
    fn begin(&mut self, model: &MotionModel, commanded: SpeedCommand, begins: f64) {
        let from_rest = commanded.at_rest;
        // A train at rest has run its whole stopping distance, whenever the next step is commanded.
        let time = if from_rest { f64::INFINITY } else { begins };
        let (place, slope) = self.place_and_slopes(time);
        let unshaped = if from_rest { 0.0 } else { self.course.segment.shape_speed_error(begins) };
        let unsettled = self.course.unsettled(begins);
        self.transform(slope);
        let kept = self.course.kept(commanded.to, commanded.above());
        let anew = self.course.started_anew(model, &commanded);
        let (speed, later) = self.course.begin(model, commanded, begins, place);
        self.stay_late(later, anew, speed * self.course.grown());
        self.forget(Z);
        if from_rest {
            self.forget(E);
            self.p[E][E] = run_variance(model.ln_speed_variance(commanded.to, false));
            self.p[H][H] = model.start_variance();
        }
        if commanded.to != 0 {
            self.widen_step(model.ln_speed_variance(commanded.to, commanded.above()), kept.is_some());
        }
        let to = self.course.segment.to;
        let deviation = if commanded.to == 0 {
            model.stop_deviation(speed)
        } else if from_rest {
            model.start_deviation(to)
        } else {
            model.change_deviation(speed, to)
        };
        let error = if commanded.to == 0 || from_rest {
            0.0
        } else {
            let part = if self.course.apart.is_some() { OTHER_SHAPES } else { 1.0 };
            part * libm::hypot(change_error(to - speed), INTERRUPTED * unsettled)
        };
        // A train that begins faster than estimated is farther by so much once the change is done.
        let carried = unshaped * self.course.segment.delay();
        self.p[Z][Z] = deviation * deviation + error * error + carried * carried;
        if commanded.to == 0 {
            let speed = speed * self.course.grown();
            let scatter = model.forecast_scatter(speed);
            let offset = self.stop_offset.unwrap_or_else(|| model.stop_offset(core::iter::empty(), speed));
            self.p[Z][Z] += scatter * scatter + offset.variance;
            self.course.x[Z] = offset.mean;
        }
    }

    /// A step was commanded whose ln speed the model knows to a variance, and which the train may have run at before.
    fn widen_step(&mut self, variance: f64, is_kept: bool) {
        let Some(letter) = self.course.speed else {
            self.p[E][E] += variance;
            self.local = 0.0;
            return;
        };
        if !is_kept {
            self.forget(letter);
            self.p[letter][letter] = variance;
        }
        if self.course.apart.is_some() {
            self.p[letter][letter] += STEP_AGAIN * STEP_AGAIN;
            return;
        }
        self.local = variance;
        self.p[letter][letter] += STEP_WALK * STEP_WALK;
        for letter in [LATER, LATER + 1] {
            self.p[letter][letter] += LATER_WALK * LATER_WALK;
        }
    }

    /// Whether the same commands repeat from now on, so that what its changes have in common is learnt.
    pub(crate) fn repeat(&mut self, is_repeating: bool) {
        if is_repeating {
            self.p[E][E] = self.ln_speed_variance();
        }
        self.course.repeat(is_repeating);
        if is_repeating {
            for letter in LATER..N {
                self.forget(letter);
            }
            for letter in [LATER, LATER + 1] {
                self.p[letter][letter] = LATER_CHANGE * LATER_CHANGE;
            }
        }
    }

    /// Moves the origin along a slope: `b` takes all of its variance.
    pub(super) fn transform(&mut self, slope: [f64; L]) {
        let with = self.covariance_along(&slope);
        let own: f64 = (0..L).map(|j| slope[j] * with[j]).sum();
        for (i, covariance) in with.into_iter().enumerate() {
            self.p[B][i] = covariance;
            self.p[i][B] = covariance;
        }
        self.p[B][B] = own;
    }

    pub(super) const fn forget(&mut self, letter: usize) {
        let mut other = 0;
        while other < L {
            self.p[letter][other] = 0.0;
            self.p[other][letter] = 0.0;
            other += 1;
        }
    }

    /// The state at a time that is not before the last detection.
    pub(crate) fn at(&self, model: &MotionModel, time: f64) -> Self {
        let mut later = *self;
        later.settle(model, time);
        later
    }

    /// Where it is (m) at a time.
    pub(crate) fn place(&self, model: &MotionModel, time: f64) -> Gaussian {
        let later = self.at(model, time);
        let is_done = later.rests_at(time) && !later.course.is_still();
        let (mean, slope) = later.place_and_slopes(if is_done { f64::INFINITY } else { time });
        let shape = later.course.segment.shape_error(time);
        Gaussian { mean, variance: later.variance_along(slope) + shape * shape }
    }

    /// Its speed (m/s) at a time.
    pub(crate) fn speed(&self, model: &MotionModel, time: f64) -> Gaussian {
        let later = self.at(model, time);
        let speed = later.course.speed(time);
        Gaussian { mean: speed, variance: speed * speed * later.ln_speed_variance() }
    }

    /// Once all commands have taken effect.
    pub(crate) fn after_all(&self, model: &MotionModel) -> Self {
        let mut later = *self;
        while let Some((_, begins)) = later.course.next_effect(model) {
            later.settle(model, begins);
        }
        later
    }

    /// Its speed (m/s) at a time, with the uncertainty of the shape of a change and of the time of a start.
    pub(crate) fn changing_speed(&self, model: &MotionModel, time: f64) -> Gaussian {
        let speed = self.speed(model, time);
        let later = self.at(model, time);
        let shape = later.course.segment.shape_speed_error(time);
        let lateness = libm::sqrt(later.p[H][H]);
        let late = time - later.course.x[H];
        let [before, after] = [late - lateness, late + lateness].map(|late| later.course.segment.speed(late));
        let start = 0.5 * (after - before);
        Gaussian { variance: speed.variance + shape * shape + start * start, ..speed }
    }

    /// The speed (m/s) to which the present change leads.
    pub(crate) fn settled_speed(&self) -> Gaussian {
        let mean = self.course.grown() * self.course.segment.to;
        Gaussian { mean, variance: mean * mean * self.ln_speed_variance() }
    }

    /// Variance of ln of its speed over what the model says.
    pub(super) fn ln_speed_variance(&self) -> f64 {
        let Some(step) = self.course.speed else { return self.p[E][E] };
        self.p[E][E] + self.p[step][step] + 2.0 * self.p[E][step] + self.local
    }

    /// Where it comes to rest (m) without the scatter of stops, the variance of that scatter, and when (s). `None` for a
    /// train that was commanded to run.
    pub(crate) fn rest(&self, model: &MotionModel) -> Option<(Gaussian, f64, f64)> {
        let later = self.after_all(model);
        if later.course.step != 0 {
            return None;
        }
        let (mean, slope) = later.place_and_slopes(f64::INFINITY);
        let speed = later.course.segment.from.speed * later.course.grown();
        let scatter = if speed > 0.0 { model.forecast_scatter(speed) } else { 0.0 };
        let scatter = scatter * scatter;
        let variance = (later.variance_along(slope) - scatter).max(0.0);
        Some((Gaussian { mean, variance }, scatter, later.course.rest_time()))
    }

    /// Where a train that was commanded to stop comes to rest (m) without what the track adds, and how it stops.
    pub(super) fn stop(&self, model: &MotionModel) -> Option<(f64, StopEffect)> {
        let later = self.after_all(model);
        let (segment, grown) = (later.course.segment, later.course.grown());
        let effect =
            StopEffect { speed: grown * segment.from.speed, distance: grown * segment.distance_to_rest() };
        (later.course.step == 0).then(|| (later.place_and_slopes(f64::INFINITY).0, effect))
    }

    /// Where it is at a time, with the slopes of that.
    pub(super) fn place_and_slopes(&self, time: f64) -> (f64, [f64; L]) {
        let (place, own) = self.course.place_and_slope(time);
        let mut slope = [0.0; L];
        slope[..N].copy_from_slice(&own);
        (place, slope)
    }

    /// Covariance with each letter of the sum of letters times slopes.
    pub(super) fn covariance_along(&self, slope: &[f64; L]) -> [f64; L] {
        let mut with = [0.0; L];
        for (line, slope) in self.p.iter().zip(slope).filter(|(_, slope)| **slope != 0.0) {
            for (sum, covariance) in with.iter_mut().zip(line) {
                *sum += slope * covariance;
            }
        }
        with
    }

    pub(super) fn variance_along(&self, slope: [f64; L]) -> f64 {
        let with = self.covariance_along(&slope);
        slope.iter().zip(&with).map(|(slope, covariance)| slope * covariance).sum::<f64>().max(0.0)
    }

    /// The train passed a place (m, with the variance of what is known of it) at a mean time (s, with its variance).
    /// Returns by how much (m) it was short of the place, and the variance of that.
    pub(crate) fn pass(&mut self, model: &MotionModel, at: f64, variance: f64, place: Gaussian) -> Gaussian {
        self.pass_beside(model, at, variance, place, &[], &mut [])
    }

    /// The same where the place depends on companions: it is `place` as they are now, and moves with them by `slopes`
    /// (companion, slope). What is learnt of them goes into their means, `beside`.
    pub(crate) fn pass_beside(
        &mut self,
        model: &MotionModel,
        time: f64,
        time_variance: f64,
        place: Gaussian,
        slopes: &[(usize, f64)],
        beside: &mut [f64],
    ) -> Gaussian {
        self.settle(model, time);
        let speed = self.course.speed(time);
        let shape = self.course.segment.shape_error(time);
        let noise = place.variance + speed * speed * time_variance + shape * shape;
        let (mean, before) = (self.course.x, *self);
        let (first, slope) = self.place_and_slopes(time);
        let (mut seen, mut slope) = (first, Self::past(slope, slopes));
        let short = Gaussian { mean: place.mean - first, variance: self.variance_along(slope) + noise };
        for look in 1..=LOOKS {
            let with = before.covariance_along(&slope);
            let s = (0..L).map(|j| slope[j] * with[j]).sum::<f64>() + noise;
            let back: f64 = (0..N).map(|j| slope[j] * (mean[j] - self.course.x[j])).sum();
            let off = place.mean - seen - back;
            for i in 0..N {
                self.course.x[i] = mean[i] + with[i] / s * off;
            }
            self.course.hold_deviations();
            self.course.linearise(model);
            if look == LOOKS {
                for i in 0..L {
                    for j in 0..L {
                        self.p[i][j] = before.p[i][j] - with[i] * with[j] / s;
                    }
                }
                for (mean, with) in beside.iter_mut().zip(with.iter().skip(N)) {
                    *mean += with / s * off;
                }
            } else {
                let (place, motion) = self.course.place_and_slope(time);
                seen = place;
                slope[..N].copy_from_slice(&motion);
            }
        }
        self.count_from(time);
        short
    }

    /// Counts the distance of a steady run anew: its speed from here on says nothing of the distance so far. Counted from
    /// where the run began, wander of some tenths of a per cent would widen the place by that part of the whole distance.
    fn count_from(&mut self, time: f64) {
        let segment = self.course.segment;
        // The covariance with companions separates what they share with the distance so far.
        let is_unsure = self.p[E][E] > UNSURE_SPEED * UNSURE_SPEED;
        let long = if self.course.apart.is_some() || is_unsure { 0.0 } else { LONG_RUN };
        let is_steady = segment.share(time) >= STEADY && time - segment.begins > long;
        if self.course.step == 0 || !is_steady {
            return;
        }
        let (place, slope) = self.place_and_slopes(time);
        self.transform(slope);
        self.course.run_on(time, place);
        for letter in [H, Z] {
            self.forget(letter);
            self.course.x[letter] = 0.0;
        }
    }

    /// Its place is unknown from now on, to a variance (m²).
    pub(crate) const fn widen_place(&mut self, variance: f64) {
        self.forget(B);
        self.p[B][B] = variance;
    }

    /// Its innovation (m) is larger than its uncertainty allows. During a change of speed the rest of the change is uncertain, too: a
    /// start that is late, or a change of another shape. Whether a change is not complete.
    pub(crate) fn widen_change(&mut self, model: &MotionModel, time: f64, off: f64) -> bool {
        self.settle(model, time);
        let share = self.course.segment.share(time);
        if !(BEGUN..STEADY).contains(&share) {
            return false;
        }
        let (_, slope) = self.course.place_and_slope(time);
        let letter = if self.course.segment.from.speed == 0.0 { H } else { Z };
        let wide = off / slope[letter];
        self.forget(letter);
        self.p[letter][letter] = wide * wide;
        wide.is_finite()
    }

    /// Moves the origin of all distances by so much (m), with its variance.
    pub(crate) fn shift(&mut self, by: f64, variance: f64) {
        self.course.x[B] += by;
        self.p[B][B] += variance;
    }
}

impl<const L: usize> MotionFilter<L> {
    /// From now on the deviation of its run and those of each step's speed are separate: for forecasts of a train that is hardly
    /// known.
    pub(crate) fn keep_apart(mut self, model: &MotionModel) -> Self {
        if let Some(letter) = self.course.keep_apart() {
            let variance = model.ln_speed_variance(self.course.step, false);
            self.p[E][E] = run_variance(variance);
            self.p[letter][letter] = variance;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{SpeedStep, TrainId};

    #[test]
    fn what_all_changes_of_a_trip_have_in_common_is_learnt_and_predicted() {
        // Given a train that answers every command but its start 60 ms later than its model says,
        let model = MotionModel::unknown(TrainId(24), SpeedStep::new(14).expect("a step"));
        let mut begins: MotionFilter = MotionFilter::at_rest(0.0, Gaussian { mean: 0.0, variance: 1e-6 });
        begins.repeat(true);
        let (mut train, mut estimated) = (begins, begins);
        let mut missed = [0.0; 2];
        for nth in 0..80_u8 {
            // when one step up and one down are commanded again and again, and it is detected every two seconds,
            let (sent, step) = (2.0 * f64::from(nth), 8 + nth % 2);
            train.command(&model, sent + if nth == 0 { 0.0 } else { 0.06 }, step);
            estimated.command(&model, sent, step);
            let seen = sent + 1.9;
            train = train.at(&model, seen);
            let place = Gaussian { mean: train.place(&model, seen).mean, variance: 1e-6 };
            let short = estimated.pass(&model, seen, 0.0, place).mean;
            missed[usize::from(nth >= 40)] += short * short;
        }
        // then its predictions improve: half of the error is a quarter of the squares.
        let [before, after] = missed;
        assert!(after < 0.25 * before, "{after} after {before} m²");
    }
}
