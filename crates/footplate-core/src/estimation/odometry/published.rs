//! The published filter as the carrier of the estimate: counts per period through three local filters and a master.

use super::federated_filter::{FederatedFilter, Fusion};
use super::local_filter::MeasuredSpeed;
use super::manoeuvre::{Manoeuvre, ManoeuvreSettings};
use super::sharing::Sharing;

/// Variance of a count at a random phase, and of the jitter of its pulses, in squared pulses.
const COUNT_VARIANCE: f64 = 1.0 / 6.0 + 0.05;

/// What one wheel counted in a period.
#[derive(Debug, Clone, Copy)]
pub(super) struct PeriodCount {
    /// Speed by the count (m/s); nothing if there is none.
    pub(super) speed: Option<f64>,
    /// Pitch over period (m/s a pulse).
    pub(super) quantum: f64,
    /// It neither slips nor slides.
    pub(super) rolls: bool,
}

/// What came out of a period.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fused {
    pub(super) speed: f64,
    pub(super) acceleration: f64,
    pub(super) variance: f64,
    pub(super) shares: [f64; 3],
}

/// Follows the train as published.
#[derive(Debug, Clone)]
pub(super) struct Published {
    fusion: Fusion,
    manoeuvre: Manoeuvre,
    filter: Option<FederatedFilter>,
}

impl Published {
    pub(super) fn new(fusion: Fusion, settings: ManoeuvreSettings) -> Self {
        Self { fusion, manoeuvre: Manoeuvre::new(settings), filter: None }
    }

    /// Takes in `t` seconds of counts, and the speed of the virtual sensor (m/s) if neither wheel is believed.
    pub(super) fn next(
        &mut self,
        wheels: [PeriodCount; 2],
        stand_in: Option<f64>,
        before: f64,
        t: f64,
    ) -> Fused {
        let [first, second] = wheels;
        let measured = |wheel: PeriodCount| {
            let variance = COUNT_VARIANCE * wheel.quantum * wheel.quantum;
            wheel.speed.map_or(MeasuredSpeed::MISSING, |speed| MeasuredSpeed { speed, variance })
        };
        let quantum = first.quantum.max(second.quantum);
        let of_stand_in = stand_in.map_or(MeasuredSpeed::MISSING, |speed| MeasuredSpeed {
            speed,
            variance: COUNT_VARIANCE * quantum * quantum,
        });
        let filter = self.filter.get_or_insert_with(|| {
            let variance = COUNT_VARIANCE * quantum * quantum;
            FederatedFilter::starting_at(self.fusion, MeasuredSpeed { speed: before, variance })
        });
        let speeds = [first.speed, second.speed, stand_in].map(|speed| speed.unwrap_or(0.0));
        let believed = [first.rolls && first.speed.is_some(), second.rolls && second.speed.is_some()];
        let shares = Sharing::PAPER.shares(speeds, believed);
        let step = self.manoeuvre.next_step(t);
        filter.step(&step, [measured(first), measured(second), of_stand_in], shares);
        let master = filter.master();
        let [speed, acceleration] = master.state;
        self.manoeuvre.learn(acceleration, first.rolls && second.rolls);
        Fused { speed, acceleration, variance: master.covariance.speed, shares }
    }

    /// The train has turned round: begins again at the next period.
    pub(super) fn restart(&mut self) {
        self.filter = None;
    }
}
