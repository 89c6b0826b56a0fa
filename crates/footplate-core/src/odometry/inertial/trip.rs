//! Trips from stop to stop, from an accelerometer alone: when, how far, and how far that may be off.
//!
//! Everything that is needed of a trip is a sum, so that nothing is kept but the sums.

use super::acceleration_block::AccelerationBlock;
use super::standstill::{
    DEPARTING, DriftLimits, Standing, StandstillDetector, StandstillThresholds, WATCHED,
};
use super::trip_ends::{BiasWalk, TripEnds};
use crate::time::{TimeSpan, Timestamp};
use crate::units::{Acceleration, Length, Speed};

/// A trip between two stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trip {
    /// When the train left.
    pub departure: Timestamp,
    /// When it came to rest.
    pub arrival: Timestamp,
    /// How far it went.
    pub length: Length,
    /// One standard deviation of that, by how much the speeds of all trips so far were off at their ends.
    pub length_deviation: Length,
    /// Takes the drift out of what the readings of this trip added up to.
    pub ends: TripEnds,
}

/// What the readings of a trip add up to so far, less what was read while standing before it; drift included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunningTrip {
    /// When the train left.
    pub departure: Timestamp,
    /// How long ago.
    pub since: TimeSpan,
    /// The sum of the readings.
    pub speed: Speed,
    /// The sum of those speeds.
    pub distance: Length,
    /// What was read while standing before.
    standing: Acceleration,
}

impl RunningTrip {
    fn add(&mut self, block: &AccelerationBlock) {
        let lasted = TimeSpan::from_s(block.lasted);
        let gained = (Acceleration::from_m_per_s2(block.along) - self.standing) * lasted;
        self.distance += (self.speed + gained * 0.5) * lasted;
        self.speed += gained;
        self.since += lasted;
    }
}

/// Finds the trips. Fixed memory.
#[derive(Debug, Clone)]
pub struct TripRecorder {
    detector: StandstillDetector,
    running: Option<RunningTrip>,
    /// Blocks since the stop was noticed.
    settling: usize,
    walk: BiasWalk,
}

impl TripRecorder {
    /// Has seen nothing yet.
    #[must_use]
    pub fn new(drift: DriftLimits) -> Self {
        Self::with_thresholds(drift, StandstillThresholds::default())
    }

    /// The same with thresholds of its own.
    #[must_use]
    pub fn with_thresholds(drift: DriftLimits, thresholds: StandstillThresholds) -> Self {
        Self {
            detector: StandstillDetector::with_thresholds(drift, thresholds),
            running: None,
            settling: 0,
            walk: BiasWalk::default(),
        }
    }

    /// Takes in a block; gives the trip that ended with the stop that the train has now made for a while. A trip whose
    /// departure was not seen is not reported.
    pub fn take(&mut self, block: AccelerationBlock) -> Option<Trip> {
        // What the standing train read, before the departure that this block may tell of.
        let stood_with = self.detector.offset();
        let was = self.detector.standing();
        let standing = self.detector.take(block);
        if let Some(running) = &mut self.running {
            running.add(&block);
        }
        match (was, standing) {
            (Standing::Since(arrival), Standing::LeftAt(departure)) => {
                let short_stop = self.running.take().map(|running| self.close(&running, arrival, stood_with));
                self.depart(departure, stood_with);
                short_stop
            }
            (Standing::LeftAt(_), Standing::Since(_)) => {
                self.settling = 0;
                None
            }
            (Standing::Since(arrival), Standing::Since(_)) => {
                self.settling = self.settling.saturating_add(1);
                if self.settling < WATCHED {
                    return None;
                }
                // Only by now all blocks that are watched are from after the stop, and none from its jerk.
                let running = self.running.take()?;
                let blocks = self.detector.blocks();
                let offset = blocks.map(|block| block.along).sum::<f64>() / WATCHED as f64;
                Some(self.close(&running, arrival, offset))
            }
            _ => None,
        }
    }

    /// The current trip.
    #[must_use]
    pub fn running(&self) -> Option<RunningTrip> {
        self.running
    }

    /// Whether the train is at rest, and the evidence.
    #[must_use]
    pub fn detector(&self) -> &StandstillDetector {
        &self.detector
    }

    fn depart(&mut self, departure: Timestamp, stood_with: f64) {
        let mut running = RunningTrip {
            departure,
            since: TimeSpan::ZERO,
            speed: Speed::ZERO,
            distance: Length::ZERO,
            standing: Acceleration::from_m_per_s2(stood_with),
        };
        let before = self.detector.blocks().count().saturating_sub(DEPARTING);
        for block in self.detector.blocks().skip(before) {
            running.add(block);
        }
        self.running = Some(running);
    }

    fn close(&mut self, running: &RunningTrip, arrival: Timestamp, stands_with: f64) -> Trip {
        // What was read before the departure is already taken out.
        let standing = [Acceleration::ZERO, Acceleration::from_m_per_s2(stands_with) - running.standing];
        let ends = TripEnds::new(running.since, standing, running.speed);
        self.walk.take(&ends);
        Trip {
            departure: running.departure,
            arrival,
            length: ends.distance(running.since, running.distance),
            length_deviation: self.walk.length_deviation(running.since),
            ends,
        }
    }
}
