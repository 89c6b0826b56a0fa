//! References that know part of the truth.
//!
//! The *oracle* knows which wheelset turns with the train, and when, and which sensor reports that: a Kalman filter of speed and
//! acceleration takes the true counts of the wheelsets that roll, and predicts where there is none. *Hindsight* bounds what can be
//! known while both slip.

use footplate_core::{Length, Speed};
use footplate_sim::line::{LineRun, WheelTruth};

use super::counted_distances::CountedDistances;
use super::score::Claim;

/// Random walk of the acceleration of a train (m/s² per square root of a second).
const WANDERS: f64 = 0.4;
/// Initial variances of speed and acceleration (m²/s², m²/s⁴).
const UNKNOWN: [f64; 2] = [1e4, 1.0];
/// The count of a rolling wheel is wrong if it differs from the motion of the train by more than one pulse, by teeth that are not quite
/// even, ...
const WRONG_PULSES: f64 = 1.1;
/// ... and by more than this part of it (a rolling wheel creeps by up to 1 %, and diameters are known to 0.6 %) or this (m/s): a slow
/// wheel rolls within it.
const WRONG_PART: f64 = 0.02;
const WRONG_M_PER_S: f64 = 0.1;

/// The odometer that knows which wheelset rolls.
#[derive(Debug, Clone)]
pub(super) struct Oracle {
    pitches: [f64; 2],
    speed: f64,
    acceleration: f64,
    /// Variance of the speed, covariance, variance of the acceleration.
    covariance: [f64; 3],
    distance: f64,
}

impl Oracle {
    pub(super) fn new(pitches: [Length; 2]) -> Self {
        let [of_speed, of_acceleration] = UNKNOWN;
        Self {
            pitches: pitches.map(Length::as_m),
            speed: 0.0,
            acceleration: 0.0,
            covariance: [of_speed, 0.0, of_acceleration],
            distance: 0.0,
        }
    }

    /// Takes in a period: its counts, which wheelsets roll and have a sensor that is alive, and how far the train really moved.
    pub(super) fn step(&mut self, counted: &CountedDistances, rolls: [bool; 2], moved: Length) -> Claim {
        let t = counted.span.map_or(0.0, footplate_core::TimeSpan::as_s);
        if t > 0.0 {
            self.predict(t);
            for ((distance, rolls), pitch) in counted.distances.into_iter().zip(rolls).zip(self.pitches) {
                let is_true = |distance: &Length| {
                    let wrong_by = (*distance - moved).abs().as_m() - WRONG_PULSES * pitch;
                    rolls && wrong_by <= (WRONG_PART * moved.abs().as_m()).max(WRONG_M_PER_S * t)
                };
                if let Some(distance) = distance.filter(is_true) {
                    self.take(distance.as_m(), pitch, t);
                }
            }
            self.distance += self.speed * t;
        }
        Claim::plain(Speed::from_m_per_s(self.speed), Length::from_m(self.distance))
    }

    fn predict(&mut self, t: f64) {
        let [vv, va, aa] = self.covariance;
        let wanders = WANDERS * WANDERS;
        self.speed += self.acceleration * t;
        self.covariance = [
            vv + 2.0 * t * va + t * t * aa + wanders * t * t * t / 3.0,
            va + t * aa + wanders * t * t / 2.0,
            aa + wanders * t,
        ];
    }

    /// The mean speed of a period, half a period old.
    fn take(&mut self, distance: f64, pitch: f64, t: f64) {
        let [vv, va, aa] = self.covariance;
        // Two edges of a window, each anywhere within a pulse.
        let noise = pitch * pitch / (6.0 * t * t);
        let back = -0.5 * t;
        let [pv, pa] = [vv + back * va, va + back * aa];
        let variance = pv + back * pa + noise;
        let surprise = distance / t - (self.speed + back * self.acceleration);
        let [kv, ka] = [pv / variance, pa / variance];
        self.speed += kv * surprise;
        self.acceleration += ka * surprise;
        self.covariance = [vv - kv * pv, va - kv * pa, aa - ka * pa];
    }
}

/// Speeds (m/s) of an odometer that knows the true speed except while both wheelsets slip. Then it goes on from the speed at which
/// the slip began with the mean acceleration of the whole stretch, known in hindsight. Without a further sensor, no odometer
/// that is off the wheels knows more.
pub(super) fn hindsight(run: &LineRun) -> Vec<f64> {
    let slips = |at: usize| run.truth[at].wheels.iter().all(|does| *does != WheelTruth::Rolling);
    let speed = |at: usize| run.truth[at].speed.as_m_per_s();
    let mut speeds: Vec<f64> = (0..run.truth.len()).map(speed).collect();
    let mut at = 1;
    while at < speeds.len() {
        if !slips(at) {
            at += 1;
            continue;
        }
        let begin = at - 1;
        let end = (at..speeds.len()).find(|at| !slips(*at)).unwrap_or(speeds.len());
        let since = |at: usize| (run.samples[at].time - run.samples[begin].time).as_s();
        let (products, squares) = (at..end).fold((0.0, 0.0), |(products, squares), at| {
            (products + since(at) * (speed(at) - speed(begin)), squares + since(at) * since(at))
        });
        for (at, known) in speeds.iter_mut().enumerate().take(end).skip(at) {
            *known = speed(begin) + since(at) * products / squares;
        }
        at = end;
    }
    speeds
}

#[cfg(test)]
mod tests {
    use footplate_core::TimeSpan;
    use footplate_sim::line::{LineConditions, LineScenario};

    use super::*;

    #[test]
    fn hindsight_knows_the_speed_but_while_both_slip_and_then_its_mean() {
        let run = LineScenario::by_name("S2").unwrap().run(3, LineConditions::default());
        let known = hindsight(&run);
        let (mut slipped, mut worst) = (0, 0.0_f64);
        for (known, truth) in known.iter().zip(&run.truth) {
            let error = (known - truth.speed.as_m_per_s()).abs();
            if truth.wheels.iter().all(|does| *does != WheelTruth::Rolling) {
                slipped += 1;
                worst = worst.max(error);
            } else {
                assert!(error < 1e-12);
            }
        }
        // Both slide for 14 s on a rail whose friction wanders by 15 %.
        assert!(slipped > 200 && worst > 0.001 && worst < 1.0, "{slipped} {worst}");
    }

    #[test]
    fn it_follows_the_wheel_that_rolls_and_goes_on_without_one() {
        let pitch = Length::from_mm(27.0);
        let mut oracle = Oracle::new([pitch; 2]);
        let mut last = [0.0; 2];
        for period in 0..400 {
            let time = 0.05 * f64::from(period);
            // From 20 m/s with -0.5 m/s²: the first wheel locks at 8 s, both from 16 s on.
            let train = (20.0 - 0.5 * time) * 0.05;
            let locked = if time > 8.0 { 0.0 } else { train };
            let counted = CountedDistances {
                distances: [
                    Some(Length::from_m(locked)),
                    Some(Length::from_m(if time > 16.0 { 0.0 } else { train })),
                ],
                span: (period > 0).then(|| TimeSpan::from_ms(50)),
            };
            let claim = oracle.step(&counted, [time <= 8.0, time <= 16.0], Length::from_m(train));
            last = [claim.speed.as_m_per_s(), 20.0 - 0.5 * time];
        }
        assert!((last[0] - last[1]).abs() < 0.3, "{last:?}");
    }

    #[test]
    fn a_sensor_that_does_not_report_how_its_wheel_rolls_is_left_out() {
        // At 20 m/s; the only sensor that is left reports the other direction, or a hundred pulses more at times.
        let faults: [fn(u32) -> f64; 2] = [|_| -1.0, |period| if period % 40 == 39 { 3.7 } else { 1.0 }];
        for wrong in faults {
            let mut oracle = Oracle::new([Length::from_mm(27.0); 2]);
            for period in 0..400 {
                let count = if period < 200 { 1.0 } else { wrong(period) };
                let counted = CountedDistances {
                    distances: [None, Some(Length::from_m(count))],
                    span: (period > 0).then(|| TimeSpan::from_ms(50)),
                };
                let claim = oracle.step(&counted, [false, true], Length::from_m(1.0));
                let speed = claim.speed.as_m_per_s();
                assert!(period < 20 || (speed - 20.0).abs() < 0.01, "{period}: {speed}");
            }
        }
    }
}
