//! One period of on-board odometry: all of it, the fusion alone, and the fusion by public crates.
//!
//! The odometer takes counts of two tachometers and gives speed, acceleration and distance with their bounds, the
//! state of each wheelset, amounts of over- and under-reading: pre-processing, detection, virtual sensor, fusion. No
//! public crate does that. What public crates do is stated beside it: three Kalman filters for speed and
//! acceleration and the fusion of their information, with noises that never change.
//!
//! Trains run in endless rounds of two minutes, up for forty seconds and down for eighty; the counts of a round follow
//! from those of the last, so that time and counters go on for ever.

mod adskalman_peer;
mod fusion;
mod nalgebra_peer;
mod rounds;

use footplate_core::TimeSpan;
use footplate_core::odometry::wheels::Period;
use footplate_core::odometry::{MotionEstimate, Odometer, OdometrySettings};

use crate::operation::Operation;
pub use rounds::{Load, PERIOD_S, Round};

const GROUP: &str = "a period of odometry";

/// All of them; the first is all of the odometer while both wheelsets roll.
pub fn operations() -> Vec<Operation> {
    let recommended = OdometrySettings::recommended();
    let rolling = Round::new(Load::Rolling);
    let speeds = rolling.speeds();
    vec![
        whole("all of it, both roll", &rolling, recommended),
        whole("all of it, one slides", &Round::new(Load::OneSlides), recommended),
        whole("all of it, both slide", &Round::new(Load::BothSlide), recommended),
        whole("all of it as published, both roll", &rolling, OdometrySettings::paper()),
        fusion::operation(GROUP, "the fusion alone", speeds.clone()),
        nalgebra_peer::operation(GROUP, "fusion by a textbook in nalgebra 0.35", speeds.clone()),
        adskalman_peer::operation(GROUP, "fusion by adskalman 0.18", speeds),
    ]
}

fn whole(means: &'static str, round: &Round, settings: OdometrySettings) -> Operation {
    let mut run = Run::new(round.clone(), settings);
    Operation::with_body(GROUP, means, move |count| {
        (0..count).map(|_| dependent_on_all_of(&run.step())).sum()
    })
}

fn dependent_on_all_of(estimate: &MotionEstimate) -> f64 {
    let speeds = estimate.speed
        + estimate.guaranteed.speed_low
        + estimate.confidence.speed_high
        + estimate.speed_deviation;
    let distances = estimate.distance + estimate.guaranteed.distance_low + estimate.confidence.distance_high;
    let amounts = estimate.over + estimate.under;
    let shares: f64 = estimate.shares.iter().sum();
    let states = estimate.wheels[0] as u8 + estimate.wheels[1] as u8 + estimate.mode as u8;
    speeds.as_m_per_s()
        + (distances + amounts).as_m()
        + estimate.acceleration.as_m_per_s2()
        + shares
        + f64::from(states)
}

/// A train that runs in rounds, and its odometer.
pub struct Run {
    round: Round,
    odometer: Odometer,
    /// The period that is next, of those of a round.
    next: usize,
    /// How long the rounds took that are over.
    before: TimeSpan,
}

impl Run {
    /// At the beginning of the first round.
    ///
    /// # Panics
    /// When the vehicle of these tables is none.
    pub fn new(round: Round, settings: OdometrySettings) -> Self {
        let odometer = Odometer::new(Round::vehicle(), settings).expect("a usual vehicle");
        Self { round, odometer, next: 0, before: TimeSpan::ZERO }
    }

    /// One period further.
    pub fn step(&mut self) -> MotionEstimate {
        let periods = self.round.periods();
        let period = Period { time: periods[self.next].time + self.before, ..periods[self.next] };
        self.next += 1;
        if self.next == periods.len() {
            self.next = 0;
            self.before += self.round.duration();
        }
        self.odometer.step(&period)
    }
}
