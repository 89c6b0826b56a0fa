//! One number for all bits of the odometer's estimates of a run, to compare builds for different processors.
//!
//! Both wheelsets roll, slip one at a time, creep alike and lock. `./ci.sh fresh` compares a build for any x86-64 with one that
//! may take four numbers at a time.

use core::error::Error;

use footplate_core::odometry::wheels::{Axle, Period, Vehicle, Wheelset};
use footplate_core::odometry::{MotionEstimate, Odometer, OdometrySettings};
use footplate_core::{Acceleration, Length, Speed, TimeSpan, Timestamp};

const PERIOD_S: f64 = 0.05;
const TEETH: u32 = 100;
const DIAMETER_M: f64 = 0.86;
/// Offset basis and prime of the 64-bit hash FNV-1a (Fowler, Noll and Vo).
const FNV: (u64, u64) = (0xcbf2_9ce4_8422_2325, 0x0100_0000_01b3);
/// Creepage of both wheelsets in the stages of the run, eight seconds each; 1 is locked, below 0 they spin.
const CREEPAGE: [[f64; 2]; 10] = [
    [0.0, 0.0],
    [0.0, 0.12],
    [0.0, 0.0],
    [-0.4, 0.0],
    [0.08, 0.08],
    [0.0, 0.0],
    [1.0, 0.3],
    [1.0, 1.0],
    [0.0, 0.0],
    [0.0, 1.0],
];
const STAGE_S: f64 = 8.0;

fn main() -> Result<(), Box<dyn Error>> {
    let wheelset = Wheelset {
        teeth: TEETH,
        diameter: Length::from_m(DIAMETER_M),
        diameter_tolerance: 0.005,
        axle: Axle::Powered,
    };
    let vehicle = Vehicle::new(
        TimeSpan::from_s(PERIOD_S),
        Speed::from_m_per_s(70.0),
        [1.2, 1.4].map(Acceleration::from_m_per_s2),
        [wheelset; 2],
    )?;
    let mut odometer = Odometer::new(vehicle, OdometrySettings::recommended())?;
    let pitch = core::f64::consts::PI * DIAMETER_M / f64::from(TEETH);
    let (mut speed, mut turned, mut counted) = (0.0_f64, [0.0_f64; 2], [0_i64; 2]);
    let mut hash = FNV.0;
    for cycle in 0..4 {
        for (stage, creepage) in CREEPAGE.into_iter().enumerate() {
            // The first stages accelerate, the last ones brake.
            let effort = if stage < CREEPAGE.len() / 2 { 0.7 } else { -0.7 };
            for period in 0..(STAGE_S / PERIOD_S) as u32 {
                speed = (speed + effort * PERIOD_S).max(0.0);
                let mut pulses = [0; 2];
                for (((turned, counted), pulses), creepage) in
                    turned.iter_mut().zip(&mut counted).zip(&mut pulses).zip(creepage)
                {
                    *turned += speed * (1.0 - creepage) * PERIOD_S / pitch;
                    let now = *turned as i64;
                    *pulses = now - *counted;
                    *counted = now;
                }
                let stages = f64::from(cycle) * CREEPAGE.len() as f64 + stage as f64;
                let time = stages * STAGE_S + f64::from(period + 1) * PERIOD_S;
                let counts = Period::with_pulses(Timestamp::from_s(time), pulses);
                let estimate = odometer.step(&Period { effort: Some(effort), ..counts });
                for byte in bits(&estimate).iter().flat_map(|bits| bits.to_le_bytes()) {
                    hash = (hash ^ u64::from(byte)).wrapping_mul(FNV.1);
                }
            }
        }
    }
    println!("{hash:016x}");
    Ok(())
}

fn bits(estimate: &MotionEstimate) -> [u64; 17] {
    let MotionEstimate { confidence, guaranteed, shares: [first, second, third], .. } = estimate;
    [
        estimate.speed.as_m_per_s(),
        estimate.speed_deviation.as_m_per_s(),
        confidence.speed_low.as_m_per_s(),
        confidence.speed_high.as_m_per_s(),
        guaranteed.speed_low.as_m_per_s(),
        guaranteed.speed_high.as_m_per_s(),
        estimate.acceleration.as_m_per_s2(),
        estimate.distance.as_m(),
        confidence.distance_low.as_m(),
        confidence.distance_high.as_m(),
        guaranteed.distance_low.as_m(),
        guaranteed.distance_high.as_m(),
        estimate.over.as_m(),
        estimate.under.as_m(),
        *first,
        *second,
        *third,
    ]
    .map(f64::to_bits)
}
