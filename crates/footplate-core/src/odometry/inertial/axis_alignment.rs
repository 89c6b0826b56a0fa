//! Finds the forward direction of an accelerometer of unknown orientation in a train.
//!
//! A train that leaves a stop accelerates forward and does nothing else: it is too slow for curves and for the track to
//! shake it. So forward is the mean direction of what is read in the first seconds after departures, less what was read
//! while standing.

use libm::sqrt;

use super::acceleration_block::AccelerationBlock;
use super::standstill::{DEPARTING, Standing, StandstillDetector};
use crate::units::Acceleration;

/// How long after a departure is looked at (s). Chosen: a metro is then at 3 m/s, and still in the station.
const LOOKS_FOR_S: f64 = 3.0;
/// Readings while standing are averaged over this time (s).
const STANDING_FOLLOWS_S: f64 = 1.0;

/// Learns the direction. Fixed memory.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AxisAlignment {
    standing: [f64; 3],
    /// What was read since a departure, times seconds, and for how long.
    departing: Option<([f64; 3], f64)>,
    /// The sum over departures.
    forward: [f64; 3],
    departures: u32,
}

impl AxisAlignment {
    /// Takes in what a detector has just been given.
    pub fn take(&mut self, detector: &StandstillDetector) {
        let Some(newest) = detector.blocks().next_back() else { return };
        match (detector.standing(), &mut self.departing) {
            (Standing::Since(_), _) => {
                self.departing = None;
                // What belongs to a departure that is noticed only later is not yet taken for standing.
                let Some(before) = detector.blocks().rev().nth(DEPARTING) else { return };
                let follows = (before.lasted / STANDING_FOLLOWS_S).min(1.0);
                for (standing, axis) in self.standing.iter_mut().zip(before.axes) {
                    *standing += (axis - *standing) * follows;
                }
            }
            (Standing::LeftAt(left), None) if (newest.end - left).as_s() < LOOKS_FOR_S => {
                let mut sum = ([0.0; 3], 0.0);
                for block in detector.blocks().rev().take(DEPARTING) {
                    add(&mut sum, block);
                }
                self.departing = Some(sum);
            }
            (Standing::LeftAt(_), Some(sum)) if sum.1 < LOOKS_FOR_S => {
                add(sum, newest);
                if sum.1 >= LOOKS_FOR_S {
                    let (read, lasted) = *sum;
                    for ((forward, read), standing) in self.forward.iter_mut().zip(read).zip(self.standing) {
                        *forward += read - standing * lasted;
                    }
                    self.departures += 1;
                }
            }
            _ => {}
        }
    }

    /// The direction so far; `None` before the first departure.
    #[must_use]
    pub fn forward(&self) -> Option<ForwardAxis> {
        let length = sqrt(self.forward.iter().map(|axis| axis * axis).sum());
        let direction = self.forward.map(|axis| axis / length);
        (length > 0.0).then_some(ForwardAxis { direction, departures: self.departures })
    }
}

/// The forward direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForwardAxis {
    /// The unit vector.
    pub direction: [f64; 3],
    /// The departures that it rests on.
    pub departures: u32,
}

impl ForwardAxis {
    /// The acceleration along the track in readings of the three axes.
    #[must_use]
    pub fn along(&self, axes: [Acceleration; 3]) -> Acceleration {
        self.direction.iter().zip(axes).map(|(part, axis)| axis * *part).sum()
    }
}

fn add((sum, lasted): &mut ([f64; 3], f64), block: &AccelerationBlock) {
    for (sum, axis) in sum.iter_mut().zip(block.axes) {
        *sum += axis * block.lasted;
    }
    *lasted += block.lasted;
}
