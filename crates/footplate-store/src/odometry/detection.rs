//! How long a slip or slide goes unnoticed.
//!
//! The truth is the speed of the wheel, where the recording has it; otherwise what the wheel counted, over enough
//! periods for a pulse to weigh little, against how fast the train really ran.

use footplate_core::odometry::WheelState;
use footplate_core::{Length, Speed, TimeSpan, Timestamp};

use super::counted_distances::CountedDistances;
use crate::tachometer::Truth;

/// A wheel whose creepage is beyond this really slips or slides: past the peak of adhesion on any rail.
const CREEPAGE: f64 = 0.05;
/// At low speed its speed has to be off by at least this (m/s).
const LEAST_DIFFERENCE: Speed = Speed::from_m_per_s(0.3);
/// Over how many periods counts are summed up where the speed of the wheel is not recorded.
const PERIODS: usize = 5;

/// Waits for the first real slip or slide of a run, and then for the flag of each odometer.
#[derive(Debug, Clone)]
pub(super) struct SlipWatch {
    pitches: [Length; 2],
    /// Distances, time and true distance of the last periods.
    recent: [Recent; PERIODS],
    next: usize,
    first: Option<FirstSlip>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Recent {
    distances: [Option<Length>; 2],
    span: TimeSpan,
    true_distance: Length,
}

/// The first real slip or slide of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FirstSlip {
    wheel: usize,
    since: Timestamp,
}

impl SlipWatch {
    pub(super) fn new(pitches: [Length; 2]) -> Self {
        Self { pitches, recent: [Recent::default(); PERIODS], next: 0, first: None }
    }

    /// Takes in a period; the first slip or slide of the run, if there has been any up to now.
    pub(super) fn see(
        &mut self,
        time: Timestamp,
        counted: &CountedDistances,
        truth: &Truth,
    ) -> Option<FirstSlip> {
        let Some(train) = truth.speed.filter(|_| self.first.is_none()) else { return self.first };
        let span = counted.span.unwrap_or(TimeSpan::ZERO);
        self.recent[self.next] = Recent { distances: counted.distances, span, true_distance: train * span };
        self.next = (self.next + 1) % PERIODS;
        let slips = |wheel: &usize| match truth.wheels[*wheel] {
            Some(speed) => is_slip(speed, train, Speed::ZERO),
            None => self.counts_otherwise(*wheel),
        };
        let wheel = [0, 1].into_iter().find(slips)?;
        self.first = Some(FirstSlip { wheel, since: time });
        self.first
    }

    /// Whether a wheel counted something else than the train ran over the last periods.
    fn counts_otherwise(&self, wheel: usize) -> bool {
        let (mut distance, mut true_distance, mut span) = (Length::ZERO, Length::ZERO, TimeSpan::ZERO);
        for period in &self.recent {
            let (Some(counted), true) = (period.distances[wheel], period.span > TimeSpan::ZERO) else {
                return false;
            };
            distance += counted;
            true_distance += period.true_distance;
            span += period.span;
        }
        let per_span = |distance: Length| Speed::from_m_per_s(distance.as_m() / span.as_s());
        is_slip(per_span(distance), per_span(true_distance), per_span(self.pitches[wheel]))
    }
}

fn is_slip(wheel: Speed, train: Speed, resolution: Speed) -> bool {
    (wheel - train).abs() > (train.abs() * CREEPAGE).max(LEAST_DIFFERENCE) + resolution
}

/// Waits for the flag of one odometer.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FlagWatch {
    delay_s: Option<f64>,
}

impl FlagWatch {
    pub(super) fn see(&mut self, time: Timestamp, first: Option<FirstSlip>, wheels: [WheelState; 2]) {
        if let (Some(slip), None) = (first, self.delay_s)
            && wheels[slip.wheel] != WheelState::Rolling
        {
            self.delay_s = Some((time - slip.since).as_s());
        }
    }

    pub(super) fn delay_s(&self) -> Option<f64> {
        self.delay_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(period: i64) -> Timestamp {
        Timestamp::ZERO + TimeSpan::from_ms(50 * period)
    }

    /// The first period in which a slide shows, of a train at 10 m/s whose second wheel locks with period 20.
    fn first_slip(wheel_recorded: bool) -> Option<(Timestamp, usize)> {
        let pitch = Length::from_mm(33.772);
        let mut watch = SlipWatch::new([pitch; 2]);
        let mut first = None;
        for period in 0..40 {
            let locked = period >= 20;
            let wheel = Speed::from_m_per_s(if locked { 0.0 } else { 10.0 });
            let rolled = Length::from_m(0.5);
            let counted = CountedDistances {
                distances: [Some(rolled), Some(if locked { Length::ZERO } else { rolled })],
                span: (period > 0).then(|| TimeSpan::from_ms(50)),
            };
            let speed = Some(Speed::from_m_per_s(10.0));
            let wheels = if wheel_recorded { [speed, Some(wheel)] } else { [None; 2] };
            first = watch.see(at(period), &counted, &Truth { speed, distance: None, wheels });
        }
        first.map(|first| (first.since, first.wheel))
    }

    #[test]
    fn a_slide_is_seen_at_once_in_the_speed_of_the_wheel_and_soon_in_its_counts() {
        assert_eq!(first_slip(true), Some((at(20), 1)));
        // One locked period in five makes 2 m/s of difference, more than 0.5 m/s and a pulse (0.14 m/s).
        assert_eq!(first_slip(false), Some((at(20), 1)));
    }

    #[test]
    fn the_delay_is_that_of_the_same_wheelset() {
        let slip = Some(FirstSlip { wheel: 1, since: at(20) });
        let mut flags = FlagWatch::default();
        flags.see(at(19), None, [WheelState::Slide; 2]);
        flags.see(at(20), slip, [WheelState::Slide, WheelState::Rolling]);
        assert_eq!(flags.delay_s(), None);
        flags.see(at(22), slip, [WheelState::Rolling, WheelState::Slide]);
        flags.see(at(23), slip, [WheelState::Rolling, WheelState::Slide]);
        assert_eq!(flags.delay_s(), Some(0.1));
    }
}
