//! Which wheelsets slip or slide, which sensors are believed, and what is left for the speed then.

use super::command_watch::Allowed;
use super::distance_bounds::Counted;
use super::odometer::Odometer;
use super::speed_bounds::{Limits, WheelBounds};
use super::wheel_channel::WheelChannel;
use crate::wheels::{Loss, Quality, Range, Shown, Signs, TrainSigns, Vehicle, larger};

/// How closely two wheels have to turn alike to be believed against everything else (m/s, part of the speed) ...
const ALIKE: (f64, f64) = (0.2, 0.006);
/// ... and for how long (s), with nothing holding them back or driving them, and otherwise.
const ALIKE_FREE_S: f64 = 1.0;
const ALIKE_HELD_S: f64 = 8.0;

impl Odometer {
    /// Which wheelsets slip or slide, and which sensors are believed.
    pub(super) fn judge(
        &mut self,
        turns: &[Range; 2],
        possible: Range,
        allowed: &Allowed,
        t: f64,
    ) -> [Option<Loss>; 2] {
        let train = TrainSigns {
            speed: self.train.v,
            acceleration: self.train.a,
            possible: if self.settings.proof { possible } else { Range::ANY },
            slide: allowed.slide,
            slip: allowed.slip,
        };
        let [first, second] = &self.wheels;
        let [first_turns, second_turns] = turns;
        let signs = |wheel: &WheelChannel, range: &Range| Signs {
            speed: wheel.tracker.speed(),
            acceleration: wheel.tracker.acceleration(),
            range: *range,
            acceleration_deviation: wheel.tracker.acceleration_deviation(),
            read: wheel.quality == Quality::Ok && !wheel.watch.doubted(),
            axle: wheel.wheelset.axle,
        };
        let lost = self.slips.judge(&[signs(first, first_turns), signs(second, second_turns)], &train, t);
        self.watch_sensors(turns, possible, allowed, t);
        lost
    }

    /// Which sensors are believed.
    fn watch_sensors(&mut self, turns: &[Range; 2], possible: Range, allowed: &Allowed, t: f64) {
        let [first, second] = &self.wheels;
        let speeds = [first, second].map(|wheel| wheel.is_read().then(|| wheel.tracker.speed()));
        let [first_speed, second_speed] = speeds;
        let beyond = |wheel: &WheelChannel, range: &Range| {
            let (slides, slips) = wheel.may_differ(allowed);
            (range.high < possible.low && !slides) || (range.low > possible.high && !slips)
        };
        let [first_turns, second_turns] = turns;
        let [first_beyond, second_beyond] = [beyond(first, first_turns), beyond(second, second_turns)];
        let [first_sudden, second_sudden] = [first, second].map(|wheel| wheel.quality == Quality::Excluded);
        // What both say at once is no fault of either: the row was read late, or the train is not what it was taken for.
        let both = (first_beyond || first_sudden) && (second_beyond || second_sudden);
        // Bounds take part in judging sensors only where they take part in judging wheels.
        let proof = self.settings.proof;
        let train = self.train.v;
        for (((wheel, other), impossible), too_sudden) in self
            .wheels
            .iter_mut()
            .zip([second_speed, first_speed])
            .zip([first_beyond, second_beyond])
            .zip([first_sudden, second_sudden])
        {
            if wheel.quality == Quality::Missing {
                continue;
            }
            let (slides, slips) = wheel.may_differ(allowed);
            let shown = Shown {
                pulses: wheel.pulses,
                speed: wheel.tracker.speed(),
                other,
                train,
                may_differ: slides || slips,
                impossible: impossible && !both && proof,
                too_sudden: too_sudden && !both,
            };
            wheel.watch.look(&shown, t);
        }
    }

    /// Whether both wheels have turned alike and smoothly for so long that they roll, whatever was thought of them.
    pub(super) fn agreed(&mut self, allowed: &Allowed, t: f64) -> bool {
        let [first, second] = &self.wheels;
        let counted = first.is_counted() && second.is_counted();
        let apart = (first.tracker.speed() - second.tracker.speed()).abs();
        let (noise, part) = ALIKE;
        let alike = apart < noise + part * first.tracker.speed().abs();
        let harder = larger(self.vehicle.max_brake.as_m_per_s2(), self.vehicle.max_traction.as_m_per_s2());
        let smooth = [first, second].iter().all(|wheel| wheel.smooth_acceleration.abs() < harder);
        let turning = first.pulses != 0.0 && second.pulses != 0.0;
        self.alike_for = if counted && alike && smooth && turning { self.alike_for + t } else { 0.0 };
        // Two sensors that are both thought to be wrong are not likely to be.
        let excluded = first.watch.excluded() && second.watch.excluded();
        let held_back = (allowed.slide || allowed.slip) && !excluded;
        self.alike_for > if held_back { ALIKE_HELD_S } else { ALIKE_FREE_S }
            && (self.vehicle.independent || !held_back)
    }

    pub(super) fn narrow(
        &mut self,
        possible: Range,
        turns: &[Range; 2],
        allowed: &Allowed,
        lost: [Option<Loss>; 2],
        t: f64,
    ) -> Range {
        let [first, second] = &self.wheels;
        let [first_turns, second_turns] = *turns;
        let [first_lost, second_lost] = lost;
        let of = |wheel: &WheelChannel, turns: Range, lost| WheelBounds {
            turns: if wheel.watch.excluded() { Range::ANY } else { turns },
            doubted: wheel.watch.doubted(),
            speed: wheel.tracker.speed(),
            axle: wheel.wheelset.axle,
            lost,
        };
        let wheels = [of(first, first_turns, first_lost), of(second, second_turns, second_lost)];
        let Vehicle { thresholds, independent, .. } = self.vehicle;
        self.bounds.narrow(possible, &wheels, allowed, &Limits { thresholds, independent }, t)
    }

    /// What the wheels' counts say about the way of the period.
    pub(super) fn counted(&self, lost: [Option<Loss>; 2], allowed: &Allowed) -> [Counted; 2] {
        let [first, second] = &self.wheels;
        let [first_lost, second_lost] = lost;
        let of = |wheel: &WheelChannel, lost: Option<Loss>| {
            let good = wheel.doubt.is_finite() && !wheel.watch.excluded();
            let (slides, slips) = wheel.may_differ(allowed);
            Counted {
                pulses: wheel.pulses,
                doubt: if good { wheel.doubt } else { 0.0 },
                loosens_low: wheel.watch.doubted() || slips,
                loosens_high: wheel.watch.doubted() || slides,
                pitch: wheel.pitch_range,
                at_least: good && lost != Some(Loss::Spin),
                at_most: good && lost != Some(Loss::Slide),
            }
        };
        [of(first, first_lost), of(second, second_lost)]
    }
}
