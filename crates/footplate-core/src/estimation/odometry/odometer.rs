//! One period in, one estimate out.

use super::motion_estimate::{Mode, MotionEstimate, WheelState};
use super::settings::OdometrySettings;
use crate::time::Timestamp;
use crate::units::{Acceleration, Length, Speed};
use crate::wheels::{Count, Period, Vehicle, VehicleError};

/// Follows one train from its first period.
#[derive(Debug, Clone)]
pub struct Odometer {
    vehicle: Vehicle,
    settings: OdometrySettings,
    last: Option<Timestamp>,
    distance: f64,
}

impl Odometer {
    /// An odometer that knows the vehicle and nothing else.
    ///
    /// # Errors
    /// The first value of the vehicle that no railway has.
    pub fn new(vehicle: Vehicle, settings: OdometrySettings) -> Result<Self, VehicleError> {
        vehicle.check()?;
        Ok(Self { vehicle, settings, last: None, distance: 0.0 })
    }

    /// How it works.
    #[must_use]
    pub fn settings(&self) -> OdometrySettings {
        self.settings
    }

    /// Takes in the readings of one period.
    pub fn step(&mut self, period: &Period) -> MotionEstimate {
        let span = self.last.map_or(self.vehicle.period, |last| period.time - last).as_s();
        self.last = Some(period.time);
        let mut ways = 0.0;
        let mut counted = 0.0;
        for (wheel, wheelset) in period.wheels.iter().zip(&self.vehicle.wheelsets) {
            if let Count::Pulses(pulses) = wheel.count {
                ways += pulses as f64 * wheelset.pulse_pitch().as_m();
                counted += 1.0;
            }
        }
        let way = if counted > 0.0 { ways / counted } else { 0.0 };
        self.distance += way;
        let speed = Speed::from_m_per_s(way / span.max(1e-3));
        let distance = Length::from_m(self.distance);
        MotionEstimate {
            time: period.time,
            speed,
            speed_deviation: Speed::ZERO,
            speed_low: speed,
            speed_high: speed,
            acceleration: Acceleration::ZERO,
            distance,
            distance_low: distance,
            distance_high: distance,
            over: Length::ZERO,
            under: Length::ZERO,
            wheels: [WheelState::Rolling; 2],
            mode: Mode::Normal,
            shares: [0.5, 0.5, 0.0],
        }
    }
}
