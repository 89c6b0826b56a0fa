//! How lively the train is, learnt from the accelerations that the filter itself estimates.
//!
//! Acceleration is taken as a first-order Markov sequence, a_k = β a_{k−1} + w_k with β = e^−αT. With the powers
//! r₀ = E\[a_k²\] and r₁ = E\[a_k a_{k−1}\] the equations of Yule and Walker give β = r₁/r₀ and the variance
//! σ² = (r₀ − β r₁)/(1 − β²), which is r₀ itself. What the model needs of β is tanh(αT/2) = (r₀ − r₁)/(r₀ + r₁).
//!
//! Because r₀ − r₁ is half the mean square of a_k − a_{k−1}, the noise that follows is the mean square step of the
//! filter's own estimate: a closed loop of gain one, which any noise satisfies. With too large a measurement noise it
//! ends at zero gain; with too small a one it takes its own noise for manoeuvres and rises without end. Four
//! things keep it in between: a window instead of the mean over everything that ever was, a floor and an upper bound
//! for the jerk, and a covariance in which an error of acceleration does not decay with e^−αT, because the mean is
//! made of the state's own accelerations. What it costs to leave them out is shown by
//! `tests/behaviour/motion_models.rs`.
//!
//! The recipe is that of Jin and others ("Closed-loop estimation for randomly sampled measurements", 2014), whose
//! published code adapts after some samples, only while β > 0, and bounds 2ασ².

use core::f64::consts::PI;

use super::current_statistical::{CurrentStatistical, half_tangent};
use super::motion_step::MotionStep;
use crate::odometry::sound::{sound, sound_period};

/// Below this power (m²/s⁴) there is nothing to learn a correlation from: 1 µm/s² all the time.
const LEAST_POWER: f64 = 1e-12;

/// Manoeuvre frequency (1/s) and variance of acceleration (m²/s⁴) before anything is learnt: manoeuvres of 20 s with
/// 0.5 m/s².
const AT_FIRST: (f64, f64) = (0.05, 0.25);

/// No acceleration of a train or of a wheelset is larger (m/s²); what is, is no estimate.
const LARGEST_ACCELERATION: f64 = 1e3;

/// What decides how lively the train is taken to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Liveliness {
    /// The accelerations of so many seconds past (Yule and Walker), or of all of them if it is infinite.
    Learnt {
        /// How long an acceleration counts.
        window: f64,
    },
    /// How much is left between the mean acceleration and what the train can do at most (Zhou).
    RoomToLimits {
        /// The most it accelerates (m/s²), positive.
        traction: f64,
        /// The most it decelerates (m/s²), positive.
        brake: f64,
    },
    /// Nothing: it is what it was at first.
    Fixed,
}

/// How an error of acceleration goes on in the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorGrowth {
    /// It stays: constant acceleration.
    Stays,
    /// It decays with e^−αT as in Singer's model, whose mean is known.
    Decays,
}

/// How the motion model adapts to the train.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ManoeuvreSettings {
    /// What decides how lively the train is taken to be.
    pub liveliness: Liveliness,
    /// How an error of acceleration goes on.
    pub errors: ErrorGrowth,
    /// The manoeuvre frequency lies between these (1/s).
    pub frequency: (f64, f64),
    /// The variance of the acceleration lies between these (m²/s⁴).
    pub variance: (f64, f64),
    /// How much variance acceleration gains in a second at least and at most (m²/s⁵).
    pub jerk: (f64, f64),
    /// Accelerations that are only looked at before adaptation begins.
    pub looked_at: u32,
}

impl ManoeuvreSettings {
    /// The published recipe: the mean over everything, Singer's covariance, no floor. Its bounds only keep numbers
    /// finite. Worse than raw counts when a train begins to accelerate.
    #[must_use]
    pub const fn literal() -> Self {
        Self {
            liveliness: Liveliness::Learnt { window: f64::INFINITY },
            errors: ErrorGrowth::Decays,
            frequency: (1e-9, 1e3),
            variance: (0.0, 1e3),
            jerk: (0.0, f64::INFINITY),
            looked_at: 4,
        }
    }

    /// The same recipe with everything that keeps it awake.
    ///
    /// A window of 5 s is the length of a change of acceleration. Manoeuvres last from 0.2 to 1000 s. Trains wander
    /// by 10 mm/s² to 2 m/s². The floor of the jerk, 0.14 m/s² in a second, is what a driver's hand does to a
    /// cruising train; at its upper bound, 0.22 m/s², the first second of an emergency brake is followed within
    /// 0.3 m/s, and a loop that excites itself stays within a fifth of the errors of a fixed model.
    #[must_use]
    pub const fn recommended() -> Self {
        Self {
            liveliness: Liveliness::Learnt { window: 5.0 },
            errors: ErrorGrowth::Stays,
            frequency: (1e-3, 5.0),
            variance: (1e-4, 4.0),
            jerk: (0.02, 0.05),
            looked_at: 4,
        }
    }
}

/// The motion model of one train, with what it has learnt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Manoeuvre {
    settings: ManoeuvreSettings,
    /// r₀ and r₁.
    power: f64,
    lagged: f64,
    /// tanh(αT/2) that the last powers gave, and the period (s) it belongs to.
    s: f64,
    period: f64,
    /// The bounds of `s` at that period.
    bounds: (f64, f64),
    /// What the newest acceleration counts at least at that period.
    least_gain: f64,
    /// Accelerations that were learnt from.
    learnt: u32,
    /// The last two accelerations, the newest first, and whether the newest may be learnt from.
    last: [f64; 2],
    trusted: bool,
}

impl Manoeuvre {
    /// A train of which nothing is known, at rest or at a steady speed.
    #[must_use]
    pub fn new(settings: ManoeuvreSettings) -> Self {
        let (_, power) = AT_FIRST;
        Self {
            settings,
            power,
            lagged: power,
            s: 0.0,
            period: 0.0,
            bounds: (0.0, 0.0),
            least_gain: 0.0,
            learnt: 0,
            last: [0.0; 2],
            trusted: false,
        }
    }

    /// The mean of the last two accelerations, about which the next is expected (m/s²).
    #[must_use]
    pub fn mean(&self) -> f64 {
        let [newest, before] = self.last;
        0.5 * (newest + before)
    }

    /// The model as it is now.
    #[must_use]
    pub fn model(&self) -> CurrentStatistical {
        CurrentStatistical::from_half_tangent(self.s, self.variance(), self.period)
    }

    fn variance(&self) -> f64 {
        let (least, most) = self.settings.variance;
        match self.settings.liveliness {
            Liveliness::Learnt { .. } => sound(self.power, least, most),
            Liveliness::RoomToLimits { traction, brake } => {
                let mean = self.mean();
                let room = if mean >= 0.0 { traction - mean } else { brake + mean };
                sound((4.0 - PI) / PI * (room * room), least, most)
            }
            Liveliness::Fixed => {
                let (_, variance) = AT_FIRST;
                variance
            }
        }
    }

    /// What the next period, of so many seconds, does to the state.
    pub fn next_step(&mut self, period: f64) -> MotionStep {
        let period = sound_period(period);
        if period != self.period {
            self.change_period(period);
        }
        let model = self.model();
        let of_error = match self.settings.errors {
            ErrorGrowth::Stays => [period, 1.0],
            ErrorGrowth::Decays => model.of_acceleration(),
        };
        let (least, most) = self.settings.jerk;
        MotionStep::about_mean(&model, self.mean(), of_error, period, (least * period, most * period))
    }

    /// Takes in the acceleration that the filter came to, and learns from it if it is the train's.
    ///
    /// An acceleration that a slipping or sliding wheelset had a part in is none: `trusted` is false then.
    pub fn learn(&mut self, acceleration: f64, trusted: bool) {
        if acceleration.is_nan() || acceleration.abs() > LARGEST_ACCELERATION {
            self.trusted = false;
            return;
        }
        let [before, _] = self.last;
        self.last = [acceleration, before];
        let pair = trusted && self.trusted;
        self.trusted = trusted;
        if pair && matches!(self.settings.liveliness, Liveliness::Learnt { .. }) {
            self.average(acceleration, before);
        }
    }

    fn average(&mut self, acceleration: f64, before: f64) {
        self.learnt = self.learnt.saturating_add(1);
        let gain = (1.0 / f64::from(self.learnt)).max(self.least_gain);
        self.power += gain * (acceleration * acceleration - self.power);
        self.lagged += gain * (acceleration * before - self.lagged);
        // At β ≤ 0 there is no manoeuvre frequency.
        let tells = self.learnt >= self.settings.looked_at && self.power > LEAST_POWER && self.lagged > 0.0;
        if tells {
            let (least, most) = self.bounds;
            self.s = sound((self.power - self.lagged) / (self.power + self.lagged), least, most);
        }
    }

    /// The same frequency and the same bounds at another period.
    fn change_period(&mut self, period: f64) {
        let known = if self.period > 0.0 { self.model().frequency() } else { AT_FIRST.0 };
        let (slowest, quickest) = self.settings.frequency;
        self.bounds = (half_tangent(slowest * period), half_tangent(quickest * period).min(LARGEST_S));
        self.s = sound(half_tangent(known * period), self.bounds.0, self.bounds.1);
        self.least_gain = match self.settings.liveliness {
            Liveliness::Learnt { window } => sound(period / window, 0.0, 1.0),
            Liveliness::RoomToLimits { .. } | Liveliness::Fixed => 0.0,
        };
        self.period = period;
    }
}

/// tanh(αT/2) of αT = 30: the largest whose frequency a number of 53 bits still tells.
const LARGEST_S: f64 = 1.0 - 1.9e-13;

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 0.05;

    /// A Markov sequence of this β with uniform steps, from a small linear congruential generator.
    fn markov(beta: f64, count: usize) -> impl Iterator<Item = f64> {
        let mut seed = 7_u64;
        let mut acceleration = 0.0;
        (0..count).map(move |_| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let even = (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
            acceleration = beta * acceleration + 0.2 * even;
            acceleration
        })
    }

    fn taught(settings: ManoeuvreSettings, accelerations: impl Iterator<Item = f64>) -> Manoeuvre {
        let mut manoeuvre = Manoeuvre::new(settings);
        for acceleration in accelerations {
            manoeuvre.next_step(PERIOD);
            manoeuvre.learn(acceleration, true);
        }
        manoeuvre
    }

    #[test]
    fn the_frequency_of_a_markov_sequence_is_found() {
        let beta = 0.96;
        let manoeuvre = taught(ManoeuvreSettings::literal(), markov(beta, 200_000));
        let alpha = -libm::log(beta) / PERIOD;
        assert!(
            (manoeuvre.model().frequency() / alpha - 1.0).abs() < 0.05,
            "{}",
            manoeuvre.model().frequency()
        );
        // A uniform step of width 0.2 has the variance 0.2²/12; the sequence 1/(1 − β²) times as much.
        let variance = 0.04 / 12.0 / (1.0 - beta * beta);
        assert!((manoeuvre.model().variance() / variance - 1.0).abs() < 0.05);
    }

    #[test]
    fn a_mean_over_everything_forgets_to_adapt_and_a_window_does_not() {
        let quiet_then_lively = || markov(0.9, 8000).map(|a| 0.01 * a).chain(markov(0.9, 400));
        let whole = taught(ManoeuvreSettings::literal(), quiet_then_lively()).model().variance();
        let window = taught(ManoeuvreSettings::recommended(), quiet_then_lively()).model().variance();
        let true_variance = 0.04 / 12.0 / (1.0 - 0.81);
        assert!((window / true_variance - 1.0).abs() < 0.5, "{window}");
        assert!(whole < 0.1 * true_variance, "{whole}");
    }

    #[test]
    fn a_sliding_wheelset_teaches_nothing() {
        let before = taught(ManoeuvreSettings::recommended(), markov(0.9, 300));
        let mut after = before;
        for _ in 0..100 {
            after.learn(-12.0, false);
        }
        // The first that is trusted again has no trusted one before it.
        after.learn(-0.5, true);
        assert_eq!((after.power, after.lagged, after.s), (before.power, before.lagged, before.s));
        assert_eq!(after.mean(), -6.25);
    }

    #[test]
    fn frequency_and_variance_stay_within_their_bounds() {
        let settings = ManoeuvreSettings::recommended();
        let alternating = (0..500).map(|k| if k % 2 == 0 { 9.0 } else { 8.9 });
        let wild = taught(settings, alternating).model();
        assert_eq!(wild.variance(), settings.variance.1);
        assert!(wild.frequency() >= settings.frequency.0 * (1.0 - 1e-12));
        let still = taught(settings, (0..500).map(|_| 1e-3)).model();
        assert!((still.frequency() / settings.frequency.0 - 1.0).abs() < 1e-9);
        assert_eq!(still.variance(), settings.variance.0);
        let trembling = taught(settings, (0..500).map(|k| 0.1 + 0.2 * f64::from(k % 2))).model();
        assert!((trembling.frequency() / settings.frequency.1 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_no_acceleration_is_passed_over() {
        let before = taught(ManoeuvreSettings::recommended(), markov(0.9, 300));
        for absurd in [f64::NAN, f64::INFINITY, -1e9] {
            let mut after = before;
            after.learn(absurd, true);
            assert_eq!(
                (after.power, after.lagged, after.mean()),
                (before.power, before.lagged, before.mean())
            );
        }
        // An anticorrelated sequence has no frequency: the last one stays.
        let mut after = before;
        for k in 0..40 {
            after.learn(if k % 2 == 0 { 0.5 } else { -0.5 }, true);
        }
        assert!(after.lagged < 0.0 && after.s.is_finite());
    }

    #[test]
    fn another_period_keeps_the_frequency() {
        let mut manoeuvre = taught(ManoeuvreSettings::recommended(), markov(0.95, 300));
        let frequency = manoeuvre.model().frequency();
        manoeuvre.next_step(0.1);
        assert!((manoeuvre.model().frequency() / frequency - 1.0).abs() < 1e-9);
    }

    #[test]
    fn zhou_takes_the_room_to_the_limits() {
        let mut settings = ManoeuvreSettings::recommended();
        settings.liveliness = Liveliness::RoomToLimits { traction: 1.2, brake: 1.4 };
        let mut manoeuvre = Manoeuvre::new(settings);
        for (mean, room) in [(0.2, 1.0), (-0.4, 1.0), (1.0, 0.2)] {
            manoeuvre.learn(mean, true);
            manoeuvre.learn(mean, true);
            // (4 − π)/π = 0.273 24.
            assert!((manoeuvre.model().variance() - 0.273_24 * room * room).abs() < 1e-5);
        }
    }

    #[test]
    fn at_first_it_is_the_model_of_twenty_seconds() {
        let mut manoeuvre = Manoeuvre::new(ManoeuvreSettings::recommended());
        let step = manoeuvre.next_step(PERIOD);
        // 2 α σ² T = 1.25e-3 but for the decay within a period.
        assert!((step.noise().acceleration / 1.25e-3 - 1.0).abs() < 3e-3);
    }
}
