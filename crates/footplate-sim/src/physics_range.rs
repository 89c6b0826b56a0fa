//! Named ranges of physics outside the assumptions of every estimator.

use footplate_core::{Ratio, TimeSpan};

use crate::draws::{Draws, Purpose};
use crate::electric::ElectricEngine;
use crate::law::{COUNTS_PER_STEP, Law};
use crate::other_law::OtherLaw;
use crate::train::Train;
use crate::traits::{SessionSpread, StickyStarts};

/// What a world draws from a wider range than usual.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum PhysicsRange {
    /// Nothing: the world of all other scorers.
    Usual,
    /// Sensors far from their nodes, by direction, with a spread of 1 to 15 mm from pass to pass.
    AsymmetricSensors,
    /// Gradients up to 2 %, and loads that add up to half of a train's mass, by session.
    LoadAndGradient,
    /// Starts 0.1 to 0.5 s early or late, or only once a higher step is commanded.
    StickyStarts,
    /// A decoder with strong momentum (CV 3 and 4 up to 9).
    DecoderMomentum,
    /// Cold starts, and 5 % of drift within an hour.
    WarmUp,
    /// Voltage and cleanness that differ by session: speeds by 3 %, 4 % more at the top, stops by 5 %.
    Sessions,
    /// Laws of speed change outside the usual families: see [`OtherLaw`].
    OtherLaws,
    /// Interfaces that do not latch, answer late, lose replies or support only the dump of all modules.
    Interface,
    /// A second train model with other equations: see [`ElectricEngine`].
    SecondModel,
    /// All of these but the momentum of decoders, which is a law of its own; every other world has the second train model.
    All,
}

/// Largest gradient in either direction (chosen: the usual maximum of clubs on open line).
const STEEPEST: f64 = 0.02;

impl PhysicsRange {
    /// Every range, beginning with the usual one.
    pub const EVERY: [Self; 11] = [
        Self::Usual,
        Self::AsymmetricSensors,
        Self::LoadAndGradient,
        Self::StickyStarts,
        Self::DecoderMomentum,
        Self::WarmUp,
        Self::Sessions,
        Self::OtherLaws,
        Self::Interface,
        Self::SecondModel,
        Self::All,
    ];

    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Usual => "usual",
            Self::AsymmetricSensors => "asymmetric-sensors",
            Self::LoadAndGradient => "load-and-gradient",
            Self::StickyStarts => "sticky-starts",
            Self::DecoderMomentum => "decoder-momentum",
            Self::WarmUp => "warm-up",
            Self::Sessions => "sessions",
            Self::OtherLaws => "other-laws",
            Self::Interface => "interface",
            Self::SecondModel => "second-model",
            Self::All => "all",
        }
    }

    /// The range with a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::EVERY.into_iter().find(|range| range.name() == name)
    }

    /// Whether this range includes another.
    #[must_use]
    pub fn includes(self, other: Self) -> bool {
        self == other || self == Self::All
    }

    /// The stream for everything unusual of a world or a train.
    pub(crate) fn draws(seed: u64) -> Draws {
        Draws::new(seed, Purpose::Physics)
    }

    /// Applies the range to a train; the same for the same seed.
    pub(crate) fn shape(self, seed: u64, train: &mut Train) {
        let mut draws = Self::draws(seed);
        // Everything is drawn in any case, so that a range alone is the same as among all.
        let (irregular, stuck) = (draws.uniform(5.0..20.0), draws.uniform(0.0..3.0));
        let momentum = [draws.uniform(2.0..9.0), draws.uniform(2.0..9.0)].map(f64::round);
        let (drift, warm_up_s) = (draws.uniform(4.0..6.0), draws.uniform(900.0..1500.0));
        let drift = if draws.chance(0.25) { -drift } else { drift };
        let other_law = OtherLaw::draw(&mut draws);
        let (grade_sensitivity, load) = (draws.uniform(0.2..1.5), draws.uniform(0.1..0.5));
        let shoe_scatter_mm = draws.uniform(0.0..3.0);
        let is_second = draws.chance(0.5) || self == Self::SecondModel;
        let engine = ElectricEngine::draw(&mut draws);
        let traits = &mut train.traits;
        if self.includes(Self::StickyStarts) {
            let (irregular, stuck) = (Ratio::from_percent(irregular), Ratio::from_percent(stuck));
            traits.sticky = Some(StickyStarts { irregular, by_s: 0.5, stuck });
        }
        if self.includes(Self::Sessions) {
            traits.session = SessionSpread { speed: 0.03, top: 0.04, stop: 0.05, ..traits.session };
        }
        if self.includes(Self::LoadAndGradient) {
            traits.session.load = load;
            traits.grade_sensitivity = grade_sensitivity;
        }
        if self.includes(Self::AsymmetricSensors) {
            traits.shoe_scatter_mm = shoe_scatter_mm;
        }
        if self.includes(Self::WarmUp) {
            train.warm_up = Ratio::from_percent(drift);
            train.warm_up_time = TimeSpan::from_s(warm_up_s);
        }
        if self == Self::DecoderMomentum {
            let [up_per_count, down_per_count] =
                momentum.map(|cv| TimeSpan::from_s(cv * 0.896 / (14.0 * f64::from(COUNTS_PER_STEP))));
            train.law = Law::Momentum { up_per_count, down_per_count };
        }
        if self.includes(Self::OtherLaws) {
            traits.other_law = Some(other_law);
        }
        if self.includes(Self::SecondModel) && is_second {
            train.speeds = engine.speed_table();
            train.traits.engine = Some(engine);
        }
    }

    /// A random gradient of a stretch.
    pub(crate) fn grade(self, draws: &mut Draws) -> f64 {
        if self.includes(Self::LoadAndGradient) { draws.uniform(-STEEPEST..STEEPEST) } else { 0.0 }
    }

    /// The shift of a sensor for one direction from its usual place, and the standard deviation of its position from
    /// pass to pass, both in mm.
    pub(crate) fn sensor_offset_and_scatter(self, draws: &mut Draws) -> (f64, f64) {
        if !self.includes(Self::AsymmetricSensors) {
            return (0.0, 0.0);
        }
        // Measured: some sensors repeat within 2 mm, others within 15 mm.
        let scatter = libm::exp(draws.uniform(0.0..libm::log(15.0)));
        (draws.normal_within(0.0, 15.0, 2.5), scatter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::LawFamily;

    fn shaped(range: PhysicsRange, seed: u64) -> Train {
        let mut train = Train::draw(seed, LawFamily::Lag);
        range.shape(seed, &mut train);
        train
    }

    #[test]
    fn the_usual_range_changes_nothing_and_every_other_train_of_all_has_the_second_model() {
        for seed in 0..40 {
            assert_eq!(shaped(PhysicsRange::Usual, seed), Train::draw(seed, LawFamily::Lag));
            assert!(shaped(PhysicsRange::SecondModel, seed).traits.engine.is_some());
        }
        let second = (0..40).filter(|seed| shaped(PhysicsRange::All, *seed).traits.engine.is_some()).count();
        assert!((8..=32).contains(&second), "{second} of 40");
    }

    #[test]
    fn a_range_is_the_same_alone_and_among_all() {
        for seed in 0..10 {
            let all = shaped(PhysicsRange::All, seed);
            assert_eq!(all.traits.sticky, shaped(PhysicsRange::StickyStarts, seed).traits.sticky);
            assert_eq!(all.traits.other_law, shaped(PhysicsRange::OtherLaws, seed).traits.other_law);
            assert_eq!(all.warm_up, shaped(PhysicsRange::WarmUp, seed).warm_up);
        }
    }

    #[test]
    fn every_range_is_found_by_its_name() {
        for range in PhysicsRange::EVERY {
            assert_eq!(PhysicsRange::named(range.name()), Some(range));
        }
        assert_eq!(PhysicsRange::named("mars"), None);
    }
}
