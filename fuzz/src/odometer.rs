//! Any tachometer recording through the odometer: what comes out is finite, and lies within its own bounds.

use footplate_core::Length;
use footplate_core::odometry::{MotionBounds, Odometer, OdometrySettings};
use footplate_store::{TachometerBlock, TachometerReader, parse_vehicle};

/// The vehicle of the design's example.
pub(crate) const VEHICLE: &str = r#"
name = "two measured wheelsets"
period_s = 0.05
max_speed_m_s = 70.0
max_traction_m_s2 = 1.2
max_brake_m_s2 = 1.4
[[wheelset]]
teeth = 80
diameter_m = 0.86
diameter_tolerance = 0.012
axle = "powered"
[[wheelset]]
teeth = 80
diameter_m = 0.86
diameter_tolerance = 0.012
axle = "trailing"
"#;

pub(crate) fn fuzz(bytes: &[u8]) {
    let vehicle = parse_vehicle("train.toml", VEHICLE.as_bytes()).expect("the design's example").vehicle;
    let input = std::io::Cursor::new(bytes.to_vec());
    let Ok(mut reader) = TachometerReader::of_stream("run.csv", Box::new(input)) else { return };
    let mut odometer = Odometer::new(vehicle, OdometrySettings::recommended()).expect("a usual vehicle");
    let mut block = TachometerBlock::default();
    let (mut over, mut under) = (Length::ZERO, Length::ZERO);
    while reader.read_block(&mut block).unwrap_or(false) {
        for row in 0..block.len() {
            let estimate = odometer.step(&block.period(row));
            let MotionBounds { speed_low, speed_high, distance_low, distance_high } = estimate.guaranteed;
            assert!(speed_low <= speed_high && distance_low <= distance_high, "{estimate:?}");
            assert!(
                estimate.speed.as_m_per_s().is_finite() && estimate.distance.as_m().is_finite(),
                "{estimate:?}"
            );
            assert!(estimate.over >= over && estimate.under >= under, "{estimate:?}");
            (over, under) = (estimate.over, estimate.under);
        }
    }
}
