//! The true parameters of one train: everything that an estimator has to find out and must not be given.

use footplate_core::{Acceleration, Approach, DecoderSteps, Length, Ratio, Speed, SpeedStep, TimeSpan};

use crate::draws::{Draws, Purpose};
use crate::law::{Law, LawFamily};
use crate::motor::Motor;
use crate::speed_table::{Shape, SpeedTable};
use crate::traits::Traits;

/// The variation of stops from one speed, beyond the effects of run deviation and command jitter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StopScatter {
    /// Standard deviation at [`MID_SPEED`](Self::MID_SPEED); below, it is proportional to speed, because the
    /// repeatability of a stop grows with its length, but never less than [`FLOOR`](Self::FLOOR).
    pub at_mid: Length,
    /// Standard deviation at [`TOP_SPEED`](Self::TOP_SPEED); between and beyond it is interpolated linearly.
    pub at_top: Length,
}

impl StopScatter {
    /// The speed at which repeated stops had a standard deviation of 4 mm in all (train 2 at step 8, measured 2020).
    pub const MID_SPEED: Speed = Speed::from_mm_per_s(390.0);
    /// The speed at which they had 21 mm in all (train 77 at step 14, measured 2020).
    pub const TOP_SPEED: Speed = Speed::from_mm_per_s(612.0);

    /// The effect of play in gears and rods on even the shortest stop (chosen).
    pub const FLOOR: Length = Length::from_mm(0.5);

    /// The standard deviation of the stopping distance from a speed.
    pub fn sd(&self, speed: Speed) -> Length {
        if speed < Self::MID_SPEED {
            let shrunk = self.at_mid * (speed / Self::MID_SPEED).max(0.0);
            return shrunk.max(Self::FLOOR.min(self.at_mid));
        }
        let part = (speed - Self::MID_SPEED) / (Self::TOP_SPEED - Self::MID_SPEED);
        self.at_mid + (self.at_top - self.at_mid) * part
    }
}

/// From the buffers of a carriage to its outermost axle (chosen: two-axle carriages of the gauge).
const AXLE_INSET: Length = Length::from_mm(20.0);

/// A train with all its parameters, each of which a test may set.
#[derive(Debug, Clone, PartialEq)]
pub struct Train {
    /// The shape of its speed table.
    pub shape: Shape,
    /// Its steady speeds, warm, on level straight track, in an average run.
    pub speeds: SpeedTable,
    /// Its law of speed change.
    pub law: Law,
    /// Mean time from the end of a command on the line until the decoder has it.
    pub command_delay: TimeSpan,
    /// Standard deviation of that delay.
    pub command_jitter: TimeSpan,
    /// Mean time from the decoder's receipt of a command until a train at rest starts to move.
    pub start_dead_time: TimeSpan,
    /// The same for a moving train, without variation.
    pub change_dead_time: TimeSpan,
    /// Deceleration by friction alone; effective at step 0, compensated by load control at any other.
    pub friction: Acceleration,
    /// Mean set speed at which wheels at rest start to turn; each start varies (30 %).
    pub breakaway: Speed,
    /// The variation of stops.
    pub stop_scatter: StopScatter,
    /// Standard deviation of the mean speed of a run.
    pub run_deviation: Ratio,
    /// Standard deviation of the slow wander of speed within a run.
    pub wander: Ratio,
    /// Time constant of that wander.
    pub wander_time: TimeSpan,
    /// Relative increase of speed (negative: decrease) from cold to warm.
    pub warm_up: Ratio,
    /// Time constant of warming in motion and cooling at rest.
    pub warm_up_time: TimeSpan,
    /// Sensitivity to curves: 1 is the track's full factor, 0 none.
    pub curve_sensitivity: f64,
    /// Length of the shoe that keeps sensors closed.
    pub shoe: Length,
    /// From the shoe's end at the nose to the nose itself.
    pub nose: Length,
    /// From the shoe's end at the tail to the end of the train.
    pub tail: Length,
    /// Length of the carriages behind the engine, part of `tail`, whose axles detectors of blocks sense.
    pub carriages: Length,
    /// Its special traits; none, unless the world draws from a wider range.
    pub traits: Traits,
}

impl Train {
    /// Gives the same engine a decoder of other steps.
    pub(crate) fn set_decoder(&mut self, decoder: DecoderSteps) {
        if decoder.highest() == self.speeds.highest() {
            return;
        }
        self.speeds = self.speeds.refined(decoder);
        if let Some(engine) = &mut self.traits.engine {
            engine.decoder = decoder;
            self.speeds = engine.speed_table();
        }
    }

    /// A random but plausible train with a law: the same for the same seed.
    pub fn draw(seed: u64, family: LawFamily) -> Self {
        let mut draws = Draws::new(seed, Purpose::Train);
        let shape = if draws.chance(0.5) { Shape::Even } else { Shape::Steep };
        let speeds = SpeedTable::draw(shape, &mut draws);
        let law = Law::draw(family, shape, &mut draws);
        let mut span_ms = |range: core::ops::Range<f64>| TimeSpan::from_s(draws.uniform(range) * 1e-3);
        // Measured: 0.16 to 0.26 s from the stop command to the first slowing of trains 45, 47 and 49; the
        // cut between station and decoder is chosen.
        let command_delay = span_ms(30.0..90.0);
        let command_jitter = span_ms(1.0..8.0);
        let change_dead_time = span_ms(50.0..160.0);
        // Measured: 0.65 to 1.0 s for trains 45, 47 and 49; trains 24 and 58 start at once.
        let start_dead_time = match shape {
            Shape::Even => span_ms(400.0..1000.0),
            Shape::Steep => span_ms(80.0..600.0),
        };
        Self {
            shape,
            speeds,
            law,
            command_delay,
            command_jitter,
            start_dead_time,
            change_dead_time,
            // Chosen: an exponential stop ends within the 3.3 s seen on trains 47 and 49.
            friction: Acceleration::from_mm_per_s2(draws.uniform(8.0..25.0)),
            // Chosen: step 1 (about 9 mm/s) often fails to start, step 3 never.
            breakaway: Speed::from_mm_per_s(draws.uniform(4.0..14.0)),
            stop_scatter: StopScatter {
                at_mid: Length::from_mm(draws.uniform(2.0..4.0)),
                at_top: Length::from_mm(draws.uniform(14.0..24.0)),
            },
            // Measured: repeats of one run differ by 0.3 to 0.8 %; a third of that is assigned to the wander.
            run_deviation: Ratio::from_percent(draws.uniform(0.3..0.7)),
            wander: Ratio::from_percent(draws.uniform(0.1..0.3)),
            // Chosen: between a hop (1 s) and a run (a minute).
            wander_time: TimeSpan::from_s(draws.uniform(4.0..20.0)),
            // Chosen: the full drift is about what tables lose within a day (4 %).
            warm_up: Ratio::from_percent(draws.uniform(-1.0..4.0)),
            warm_up_time: TimeSpan::from_s(draws.uniform(240.0..720.0)),
            curve_sensitivity: draws.uniform(0.5..1.5),
            // Measured: repeated reports in the recordings of trains 1, 24, 74 and 78 fit 25 to 44 mm at every speed
            // if the station latches, and no single length if it does not.
            shoe: Length::from_mm(draws.uniform(25.0..45.0)),
            // Measured: the shoe is 2 cm behind the front of a locomotive in one direction and 9 cm in the other.
            nose: Length::from_mm(draws.uniform(15.0..25.0)),
            tail: Length::from_mm(draws.uniform(80.0..100.0)),
            carriages: Length::ZERO,
            traits: Traits::default(),
        }
    }

    /// Couples carriages to its rear.
    pub(crate) fn couple(&mut self, carriages: Length) {
        self.carriages += carriages;
        self.tail += carriages;
    }

    /// From the shoe's end at the tail to the last axle that a detector senses.
    pub fn last_axle(&self) -> Length {
        if self.carriages > Length::ZERO { self.tail - AXLE_INSET } else { Length::ZERO }
    }

    /// The stopping distance from the decoder's receipt of the command, on level straight track, in an average run
    /// without variation; integrated, not looked up.
    pub fn stopping_distance(&self, step: SpeedStep, approach: Approach) -> Length {
        let mut motor = Motor::running(self, step, approach);
        motor.command_without_scatter(SpeedStep::STAND);
        Length::from_mm(motor.stopping_distance_mm())
    }

    /// The distance within a time since the decoder received a step, of a train at rest or running steadily at
    /// another, on level straight track, in an average run without variation; integrated, not looked up.
    pub fn distance_after(
        &self,
        from: SpeedStep,
        approach: Approach,
        to: SpeedStep,
        within: TimeSpan,
    ) -> Length {
        let mut motor = if from == SpeedStep::STAND {
            let mut motor = Motor::at_rest(self);
            motor.start_without_scatter(to);
            motor
        } else {
            let mut motor = Motor::running(self, from, approach);
            motor.command_without_scatter(to);
            motor
        };
        Length::from_mm(motor.distance_within_mm(within))
    }

    /// The distance of a short move from rest to rest, whose stop reaches the decoder `run` after its start, on level
    /// straight track and without variation; integrated, not looked up.
    pub fn short_move(&self, step: SpeedStep, run: TimeSpan) -> Length {
        let mut motor = Motor::at_rest(self);
        motor.start_without_scatter(step);
        let before = motor.distance_within_mm(run);
        motor.command_without_scatter(SpeedStep::STAND);
        Length::from_mm(before + motor.stopping_distance_mm())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_is_the_same_train() {
        for family in LawFamily::ALL {
            assert_eq!(Train::draw(7, family), Train::draw(7, family));
            assert_ne!(Train::draw(7, family), Train::draw(8, family));
        }
    }

    #[test]
    fn short_stops_repeat_better_than_long_ones() {
        let scatter = StopScatter { at_mid: Length::from_mm(4.0), at_top: Length::from_mm(21.0) };
        let sd = |mm_per_s| scatter.sd(Speed::from_mm_per_s(mm_per_s)).as_mm();
        assert!((sd(390.0) - 4.0).abs() < 1e-9 && (sd(612.0) - 21.0).abs() < 1e-9);
        assert!((sd(195.0) - 2.0).abs() < 1e-9);
        assert!((sd(5.0) - 0.5).abs() < 1e-9, "play remains");
        let none = StopScatter { at_mid: Length::ZERO, at_top: Length::ZERO };
        assert_eq!(none.sd(Speed::from_mm_per_s(5.0)), Length::ZERO);
    }

    #[test]
    fn stopping_distances_are_those_of_real_engines() {
        // Real stopping distances at top step: 817 mm (train 47) to 1588 mm (train 77); emergency stops of 13 trains
        // from 580 to 640 mm.
        for family in LawFamily::ALL {
            for seed in 0..60 {
                let train = Train::draw(seed, family);
                let top = train.stopping_distance(train.speeds.highest(), Approach::Below).as_mm();
                assert!((550.0..1900.0).contains(&top), "{family} {seed}: {top} mm");
                let low = train.stopping_distance(SpeedStep::new(5).unwrap(), Approach::Below).as_mm();
                assert!(low < 0.6 * top, "{family} {seed}: {low} of {top} mm");
            }
        }
    }
}
