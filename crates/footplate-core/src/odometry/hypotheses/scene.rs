//! One period of both wheelsets and of the command: the observations that each hypothesis explains.

use crate::odometry::wheels::Range;

/// One wheelset in one period, in the direction of travel.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct WheelScene {
    /// Distance that it turned (m), and the part of that not read in the period.
    pub(in super::super) counted: f64,
    pub(in super::super) late: f64,
    /// Its count was read.
    pub(in super::super) read: bool,
    /// Its count is stuck: constant, not zero, for longer than that of a wheel that turns.
    pub(in super::super) stuck: bool,
    /// Tracked speed (m/s) and its standard deviation.
    pub(in super::super) speed: f64,
    pub(in super::super) speed_deviation: f64,
    /// Tracked acceleration (m/s²) and its standard deviation.
    pub(in super::super) acceleration: f64,
    pub(in super::super) acceleration_deviation: f64,
    /// Distance of one pulse (m).
    pub(in super::super) pitch: f64,
    /// The true diameter lies within this part of the assumed one.
    pub(in super::super) tolerance: f64,
    /// It has a brake.
    pub(in super::super) braked: bool,
    /// It has a motor.
    pub(in super::super) driven: bool,
}

/// One period.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Scene {
    pub(in super::super) wheels: [WheelScene; 2],
    /// Possible accelerations of the train (m/s²), with any adhesion, and with enough for brake and traction.
    pub(in super::super) acceleration: Range,
    pub(in super::super) rolling: Range,
    /// The commanded acceleration (m/s²); none if the command is not recorded.
    pub(in super::super) commanded: Option<f64>,
    /// Fractions of the full brake and of full traction that may act, 0 to 1.
    pub(in super::super) brake: f64,
    pub(in super::super) traction: f64,
    /// Slides and slips are possible at all.
    pub(in super::super) slide: bool,
    pub(in super::super) slip: bool,
    /// Acceleration from an inertial sensor (m/s²).
    pub(in super::super) inertial: Option<f64>,
    /// Both wheelsets sliding alike can be ruled out.
    pub(in super::super) independent: bool,
    /// The guaranteed bounds of the speed (m/s).
    pub(in super::super) bounded: Range,
    /// The highest speed of the train (m/s).
    pub(in super::super) top_speed: f64,
}

#[cfg(test)]
impl WheelScene {
    /// A wheel that turns at a speed (m/s), and has turned for 0.05 s.
    pub(super) fn of_test(speed: f64) -> Self {
        Self {
            counted: 0.05 * speed,
            late: 0.0,
            read: true,
            stuck: false,
            speed,
            speed_deviation: 0.05,
            acceleration: 0.0,
            acceleration_deviation: 0.5,
            pitch: 0.03,
            tolerance: 0.002,
            braked: true,
            driven: true,
        }
    }
}

#[cfg(test)]
impl Scene {
    /// Two wheels that turn at these speeds (m/s) under a command (m/s²), of which full is 1 m/s².
    pub(super) fn of_test(speeds: [f64; 2], commanded: Option<f64>) -> Self {
        Self {
            wheels: speeds.map(WheelScene::of_test),
            acceleration: Range { low: -1.5, high: 1.0 },
            rolling: Range { low: -1.4, high: 1.0 },
            commanded,
            brake: commanded.map_or(0.0, |commanded| (-commanded).max(0.0)),
            traction: commanded.map_or(0.0, |commanded| commanded.max(0.0)),
            slide: true,
            slip: true,
            inertial: None,
            independent: false,
            bounded: Range { low: -40.0, high: 40.0 },
            top_speed: 40.0,
        }
    }
}
