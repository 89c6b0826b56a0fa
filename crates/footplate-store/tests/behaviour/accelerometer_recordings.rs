//! Recordings of an accelerometer alone: read or refused with what would be right, and standstills told from running.

use std::path::PathBuf;

use footplate_core::odometry::inertial::StandstillThresholds;
use footplate_store::accelerometer::{
    AccelerometerRecording, AccelerometerRide, SensorForm, StandingScore, StopMarks, leave_one_out,
};
use proptest::prelude::{any, prop, proptest};

/// What was asked for: right for this part of the time (per cent).
const RIGHT_PCT: f64 = 97.0;

fn read(text: &str) -> Result<AccelerometerRecording, String> {
    AccelerometerRecording::parse("trip.csv", text.as_bytes()).map_err(|error| error.to_string())
}

fn marks(text: &str) -> Result<StopMarks, String> {
    StopMarks::parse("trip_stops.csv", text.as_bytes()).map_err(|error| error.to_string())
}

#[test]
fn real_trips_are_right_also_with_thresholds_of_other_days() {
    let Some(data) = std::env::var_os("FOOTPLATE_DATA") else {
        eprintln!(
            "LEFT OUT: FOOTPLATE_DATA names no folder with the accelerometer recordings of the Paris metro"
        );
        return;
    };
    let folder = PathBuf::from(data).join("paris-metro-accel");
    let days: Vec<(AccelerometerRecording, StopMarks)> = ["2024-02-02", "2024-03-29", "2024-04-16"]
        .map(|day| {
            let file = folder.join(format!("line4_{day}_accel.csv"));
            (
                AccelerometerRecording::read(&file).unwrap(),
                StopMarks::read(&StopMarks::beside(&file)).unwrap(),
            )
        })
        .into();
    for (recording, marks) in &days {
        assert_eq!(recording.form(), SensorForm::WithoutGravity);
        let ride = AccelerometerRide::walk(recording, StandstillThresholds::default());
        let score = StandingScore::of(&ride, marks);
        assert!(score.right_pct() >= RIGHT_PCT, "{score:?}");
        let [hops, found, others] = score.hops;
        assert!(found == hops && others <= 1 && score.off_s.len() == score.marks, "{score:?}");
    }
    for left_out in leave_one_out(&days) {
        assert!(left_out.score.right_pct() >= RIGHT_PCT, "{left_out:?}");
    }
}

#[test]
fn what_is_wrong_is_named_with_its_place_and_what_would_be_right() {
    for (text, says) in [
        ("t_s,lat\n0,1\n", "trip.csv: missing columns: t_s with ax_m_s2, ay_m_s2, az_m_s2"),
        ("t_s,accel_m_s2\n", "trip.csv: no rows below the header"),
        (
            "t_s,accel_m_s2\n0,x\n",
            "trip.csv, line 2, column 2 (accel_m_s2): `x` should be an acceleration in m/s²",
        ),
        ("t_s,accel_m_s2\nx,0\n", "line 2, column 1 (t_s): `x` should be a time in seconds"),
        ("t_s,accel_m_s2\n0,nan\n", "`nan` should be an acceleration"),
    ] {
        let message = read(text).unwrap_err();
        assert!(message.contains(says), "{message}");
    }
    for (text, says) in [
        ("t_s,what\n1,stop\n", "trip_stops.csv: missing columns: t_s, event"),
        (
            "t_s,event\n1,stop\n2,stop\n",
            "line 3, column 2 (event): `stop` should be `stop` (came to rest) and `start`",
        ),
        (
            "t_s,event\n2,stop\n1,start\n",
            "line 3, column 1 (t_s): `1` should be later than the mark before it",
        ),
        ("t_s,event\n2,stop\n", "no rows below the header"),
    ] {
        let message = marks(text).unwrap_err();
        assert!(message.contains(says), "{message}");
    }
}

#[test]
fn a_recording_without_any_stop_is_walked_all_the_same() {
    let mut text = "t_s,ax_m_s2,ay_m_s2,az_m_s2\n".to_owned();
    for n in 0..1000 {
        let shaking = f64::from(n * 7919 % 101) / 50.0 - 1.0;
        text += &format!("{},{shaking},{},{}\n", f64::from(n) * 0.02, -shaking, 9.8 + shaking);
    }
    // A row that goes back is left out.
    text += "3,0,0,9.8\n";
    let recording = read(&text).unwrap();
    assert_eq!((recording.form(), recording.rows()), (SensorForm::WithGravity, [1000, 1]));
    let ride = AccelerometerRide::walk(&recording, StandstillThresholds::default());
    assert!(ride.standing.is_empty() && ride.hops.is_empty() && ride.forward.is_none());
    let score = StandingScore::of(&ride, &marks("t_s,event\n2,stop\n8,start\n9,stop\n12,start\n").unwrap());
    // It stood for 9 of the 10 s that are marked, and was said to run.
    assert!((score.right_pct() - 10.0).abs() < 1e-9 && score.hops == [1, 0, 0] && score.off_s.is_empty());
}

proptest! {
    /// Any text, and any readings, are read or refused; none makes us panic.
    #[test]
    fn no_input_makes_us_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..200),
        rows in prop::collection::vec((-10.0..1e4_f64, -1e3..1e3_f64, -20.0..20.0_f64, any::<f64>()), 0..200),
    ) {
        let _ = AccelerometerRecording::parse("any", bytes.as_slice());
        let _ = StopMarks::parse("any", bytes.as_slice());
        let mut text = "t_s,ax_m_s2,ay_m_s2,az_m_s2\n".to_owned();
        for (time, x, y, z) in rows {
            text += &format!("{time},{x},{y},{}\n", if z.abs() < 1e3 { z } else { 0.0 });
        }
        if let Ok(recording) = read(&text) {
            let _ = AccelerometerRide::walk(&recording, StandstillThresholds::default());
        }
    }
}
