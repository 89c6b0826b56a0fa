//! What two tachometers count while a train runs up and down again: a generator that shares nothing with the
//! estimator.

use core::f64::consts::PI;

use footplate_core::odometry::wheels::{Axle, Count, Period, Vehicle, WheelReading, Wheelset};
use footplate_core::{Acceleration, Length, Speed, TimeSpan, Timestamp};

/// Length of an odometry period (s).
pub const PERIOD_S: f64 = 0.05;

const PERIODS: usize = 2400;
/// The train speeds up in the first third of a round (0.75 m/s²) and slows down in the rest.
const SPEEDING: usize = 800;
/// From the middle of the slowing down on, speeds lie between these (m/s).
const SPEEDS: (f64, f64) = (10.0, 40.0);

const TEETH: u32 = 80;
const DIAMETER_M: f64 = 0.86;

/// A wheelset under wheel-slide protection is let go this often (periods).
const LET_GO_EVERY: usize = 80;
/// At worst a wheelset turns so much more slowly than the train moves.
const DEEPEST_CREEPAGE: f64 = 0.2;

/// What the wheelsets do while the train slows down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Load {
    /// Both roll.
    Rolling,
    /// The second slides.
    OneSlides,
    /// Both slide, as wheel-slide protection lets them, and roll again for a moment.
    BothSlide,
}

/// One round of a train, to be repeated.
#[derive(Debug, Clone)]
pub struct Round {
    periods: Vec<Period>,
}

impl Round {
    /// A round under this load.
    pub fn new(load: Load) -> Self {
        let pitch = PI * DIAMETER_M / f64::from(TEETH);
        let mut phases = [0.25_f64, 0.6];
        let periods = (0..PERIODS)
            .map(|period| {
                let sliding = creepages(load, period);
                let mut pulses = [0; 2];
                for ((pulses, phase), creepage) in pulses.iter_mut().zip(&mut phases).zip(sliding) {
                    *phase += train_speed(period) * (1.0 - creepage) * PERIOD_S / pitch;
                    *pulses = phase.floor() as i64;
                    *phase -= phase.floor();
                }
                let time = Timestamp::ZERO + TimeSpan::from_ms(50 * (period as i64 + 1));
                Period::with_pulses(time, pulses)
            })
            .collect();
        Self { periods }
    }

    /// The train of all these tables.
    ///
    /// # Panics
    /// Never: it is a usual one.
    pub fn vehicle() -> Vehicle {
        let diameter = Length::from_m(DIAMETER_M);
        let wheelset = Wheelset { teeth: TEETH, diameter, diameter_tolerance: 0.012, axle: Axle::Powered };
        Vehicle::new(
            TimeSpan::from_s(PERIOD_S),
            Speed::from_m_per_s(70.0),
            [1.2, 1.4].map(Acceleration::from_m_per_s2),
            [wheelset; 2],
        )
        .expect("a usual vehicle")
    }

    /// Its periods in turn.
    pub fn periods(&self) -> &[Period] {
        &self.periods
    }

    /// How long it takes.
    pub fn duration(&self) -> TimeSpan {
        TimeSpan::from_s(PERIODS as f64 * PERIOD_S)
    }

    /// What the counts of both wheelsets say, as speeds (m/s).
    pub fn speeds(&self) -> Vec<[f64; 2]> {
        let quantum = PI * DIAMETER_M / f64::from(TEETH) / PERIOD_S;
        let speed = |reading: &WheelReading| match reading.count {
            Count::Pulses(pulses) => pulses as f64 * quantum,
            _ => 0.0,
        };
        self.periods.iter().map(|period| [speed(&period.wheels[0]), speed(&period.wheels[1])]).collect()
    }
}

fn train_speed(period: usize) -> f64 {
    let (slowest, fastest) = SPEEDS;
    let part = if period < SPEEDING {
        period as f64 / SPEEDING as f64
    } else {
        (PERIODS - period) as f64 / (PERIODS - SPEEDING) as f64
    };
    slowest + (fastest - slowest) * part
}

/// How much more slowly than the train moves each wheelset turns: up to the deepest and back, again and again.
fn creepages(load: Load, period: usize) -> [f64; 2] {
    let Some(braking) = period.checked_sub(SPEEDING) else { return [0.0; 2] };
    let part = (braking % LET_GO_EVERY) as f64 / LET_GO_EVERY as f64;
    let creepage = DEEPEST_CREEPAGE * (1.0 - (2.0 * part - 1.0).abs());
    match load {
        Load::Rolling => [0.0; 2],
        Load::OneSlides => [0.0, creepage],
        Load::BothSlide => [creepage, creepage],
    }
}
