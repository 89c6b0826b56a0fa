//! Measures a train again after it was located: speeds first, then a stop, and everything if it is another train.

use alloc::boxed::Box;
use alloc::vec::Vec;

use crate::control::drive::{Order, StopOrder};
use crate::event::Approach;
use crate::ids::{SpeedStep, TrainId};
use crate::model::{MeasuredRatio, Rescaling};
use crate::time::Timestamp;
use crate::track::Landmark;
use crate::tracking::PassedSensor;
use crate::units::Length;

use super::alarm::Alarm;
use super::recovery::{MEASURED_WITHIN, Recovery, STOPPED_WITHIN};
use super::recovery_phase::RecoveryPhase;
use super::trials::{Remeasured, SpeedTrial, Steps, is_same};
use super::watchdog::Watchdog;
use crate::control::{Notice, Outcome};

/// Ratios that differ by more than this factor belong to another train (those of one train differ by up to 1.2 where gradients
/// change low speeds more than high ones; those of two trains on simulated layouts by 1.4 to 2.4).
const ANOTHER: f64 = 1.25;
/// With speeds that are not its usual ones, a stop this many standard deviations from its prediction belongs to another train,
/// too; with its usual speeds it is one stop of the same train that ended elsewhere.
const OTHER_STOP: f64 = 2.5;
/// The checked stop ends this far before a sensor.
const SHORT_OF: Length = Length::from_mm(120.0);
/// The number of hops ahead in which a long enough one is searched for.
const HOPS_TO_STOP: usize = 8;

impl Watchdog {
    /// Concludes the recovery: sets the model and stops the train.
    pub(super) fn end(&mut self, now: Timestamp, train: TrainId, outcome: Outcome) {
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        self.remeasured.remove(&train);
        let model = match outcome {
            Outcome::AsBefore => recovery.base.clone(),
            Outcome::Rescaled { .. } => {
                // A small difference is within what the fit allows for.
                if recovery.change.has_other_speeds() || recovery.change.has_other_stops() {
                    let numbers = recovery.base.changed_numbers(&recovery.change);
                    self.remeasured.insert(train, Remeasured::Changed(numbers));
                }
                recovery.base.rescaled(&recovery.change)
            }
            Outcome::LearntAnew => {
                self.driver.refit(&mut recovery.fit);
                self.remeasured.insert(train, Remeasured::Another(Box::new(recovery.fit.clone())));
                recovery.fit.model().clone()
            }
        };
        self.driver.set_model(model);
        self.set_phase(train, RecoveryPhase::Ending { outcome }, now + STOPPED_WITHIN);
        self.issue(now, Order::Speed { train, step: SpeedStep::STAND });
    }

    /// Begins to measure the next speed, or concludes from the measured ones.
    pub(super) fn measure(&mut self, now: Timestamp, train: TrainId) {
        let commanded = self.driver.commanded(train);
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        let Steps { middle, low, high, .. } = recovery.steps;
        let all_same = !recovery.ratios.is_empty() && recovery.ratios.iter().all(is_same);
        // An alarm for drift needs all speeds to be refuted; other alarms need one.
        let is_enough = all_same && !matches!(recovery.why, Alarm::Drift(_));
        // Upwards: a step reached from above is faster, by an amount that is less well known.
        let plan = [low, middle, high];
        let next = plan.iter().find(|step| recovery.ratios.iter().all(|one| one.step != **step));
        if let Some(step) = next.filter(|_| !is_enough) {
            let trial = SpeedTrial::new(*step, commanded);
            self.set_phase(train, RecoveryPhase::Measuring { trial, from: commanded }, now + MEASURED_WITHIN);
            if commanded == *step {
                let base = self.dangers.get(&train).map(|recovery| recovery.base.clone());
                if let (Some(base), Some(Recovery { phase: RecoveryPhase::Measuring { trial, .. }, .. })) =
                    (base, self.dangers.get_mut(&train))
                {
                    trial.commanded(&base, commanded, now);
                }
            } else {
                self.issue(now, Order::Speed { train, step: *step });
            }
            return;
        }
        if is_enough {
            return self.end(now, train, Outcome::AsBefore);
        }
        if all_same {
            // Another locomotive may be as fast: a stop will distinguish them.
            recovery.change = Rescaling::of(Vec::new());
            let base = recovery.base.clone();
            self.driver.set_model(base);
            return self.stop_short(now, train);
        }
        let measured = recovery.ratios.iter().filter(|one| one.deviation.is_finite()).copied().collect();
        recovery.change = Rescaling::of(measured);
        let changed = recovery.base.rescaled(&recovery.change);
        if recovery.change.measured.is_empty() {
            return self.need_operator(now, train);
        }
        if recovery.change.disagreement() > ANOTHER {
            return self.learn_next(now, train);
        }
        self.driver.set_model(changed);
        self.stop_short(now, train);
    }

    /// Skips a step at which no sensor reported the train.
    pub(super) fn skip(&mut self, now: Timestamp, train: TrainId, step: SpeedStep) {
        if let Some(recovery) = self.dangers.get_mut(&train) {
            recovery.ratios.push(MeasuredRatio { step, ratio: 1.0, deviation: f64::INFINITY });
        }
        self.measure(now, train);
    }

    /// Stops the train shortly before a sensor.
    pub(super) fn stop_short(&mut self, now: Timestamp, train: TrainId) {
        let Some(recovery) = self.dangers.get(&train) else { return };
        let step = recovery.steps.middle;
        let target = self.target_short_of_sensor(now, train);
        let distance = self.driver.model(train).map(|model| model.stop_distance(step, Approach::Below));
        let ordered = target.zip(distance).and_then(|(target, distance)| {
            let stop = StopOrder { step: Some(step), ..StopOrder::at(train, target) };
            Some((self.issue(now, Order::Stop(stop))?, distance))
        });
        match ordered {
            Some((order, distance)) => {
                self.set_phase(
                    train,
                    RecoveryPhase::StoppingShort { order, distance },
                    now + MEASURED_WITHIN,
                );
            }
            // If no stop can be checked, the uncertainty of stops remains large.
            None => self.end_rescaled(now, train),
        }
    }

    /// A place shortly before a sensor, beyond the second one ahead.
    fn target_short_of_sensor(&self, now: Timestamp, train: TrainId) -> Option<Landmark> {
        let context = self.driver.context();
        let from = self.driver.locate(train, now)?.at.node;
        let hops = context.hops_ahead(from).skip(2).take(HOPS_TO_STOP);
        let mut hops = hops.filter(|hop| hop.sensor.is_some() && hop.length > 2.0 * SHORT_OF);
        hops.next().map(|hop| Landmark { node: hop.from, offset: hop.length + -SHORT_OF })
    }

    /// Compares a stop with its prediction, from the time of the next detection.
    pub(super) fn check_stop(
        &mut self,
        now: Timestamp,
        train: TrainId,
        distance: Length,
        passed: &PassedSensor,
    ) {
        let speed = self.driver.locate(train, now).map(|located| located.speed);
        let seen = passed.short.zip(passed.late).zip(speed).filter(|_| passed.missed == 0);
        let Some(((short, [_, uncertain]), speed)) = seen else { return self.end_rescaled(now, train) };
        let deviation = (speed * uncertain).max(Length::from_mm(1.0));
        self.notify(Notice::StopChecked { train, beyond: short, deviation });
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        let is_elsewhere = short.abs() > deviation * OTHER_STOP;
        if is_elsewhere && recovery.change.has_other_speeds() {
            return self.learn_next(now, train);
        }
        // The deviation includes the uncertainty of the stop: only the rest of it is the measurement's.
        let known = distance * recovery.change.stops_deviation;
        let measured = Length::from_m(libm::sqrt(
            (deviation.as_m() * deviation.as_m() - known.as_m() * known.as_m()).max(1e-5),
        ));
        if distance > Length::ZERO {
            if is_elsewhere {
                recovery.change.widen_stops(short / distance);
            }
            recovery.change.take_stop(short / distance, measured / distance);
        }
        self.end_rescaled(now, train);
    }

    pub(super) fn end_rescaled(&mut self, now: Timestamp, train: TrainId) {
        let Some(recovery) = self.dangers.get(&train) else { return };
        let ratio = recovery.change.ratio;
        let is_same = recovery.change.measured.is_empty() && !recovery.change.has_other_stops();
        self.end(now, train, if is_same { Outcome::AsBefore } else { Outcome::Rescaled { ratio } });
    }

    /// Another locomotive: learns one more speed and the stop from it.
    pub(super) fn learn_next(&mut self, now: Timestamp, train: TrainId) {
        let commanded = self.driver.commanded(train);
        let Some(recovery) = self.dangers.get_mut(&train) else { return };
        let Some(step) = recovery.lessons().get(recovery.lessons_taken).copied() else {
            return self.end(now, train, Outcome::LearntAnew);
        };
        recovery.lessons_taken += 1;
        let trial = SpeedTrial::new(step, commanded);
        self.set_phase(train, RecoveryPhase::LearningSpeed { trial, from: commanded }, now + MEASURED_WITHIN);
        if commanded == step {
            if let Some(Recovery { phase: RecoveryPhase::LearningSpeed { trial, .. }, base, .. }) =
                self.dangers.get_mut(&train)
            {
                trial.commanded(base, commanded, now);
            }
        } else {
            self.issue(now, Order::Speed { train, step });
        }
    }
}
