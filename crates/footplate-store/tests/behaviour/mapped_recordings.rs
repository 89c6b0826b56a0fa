//! Recordings of other programs are read by a mapping of their columns, and refused with what would be right.

use footplate_core::odometry::wheels::{Count, Direction, Vehicle};
use footplate_core::{Length, Speed};
use footplate_store::{
    ColumnMapping, TachometerBlock, TachometerError, TachometerOddity, TachometerReader, default_vehicle,
};
use proptest::prelude::{Strategy, any, prop, prop_oneof, proptest};

use crate::tachometer_recordings::{Whole, read_all};

fn vehicle() -> Vehicle {
    default_vehicle().unwrap().vehicle
}

fn read(text: impl AsRef<[u8]>, pairs: &[&str]) -> Result<Whole, TachometerError> {
    let mut mapping = ColumnMapping::default();
    for pair in pairs {
        mapping.take_pair(pair).unwrap();
    }
    let input = Box::new(std::io::Cursor::new(text.as_ref().to_vec()));
    read_all(TachometerReader::mapped_stream("drive.csv", input, &mapping, &vehicle())?)
}

fn refusal(text: &str, pairs: &[&str]) -> String {
    read(text, pairs).expect_err("it is wrong").to_string()
}

/// How far the first wheelset turned, by its pulses (m).
fn path_m(whole: &Whole, wheel: usize) -> f64 {
    let pulses = whole.rows.iter().map(|(_, period, _)| match period.wheels[wheel].count {
        Count::Pulses(pulses) => pulses,
        other => panic!("{other:?} should be pulses"),
    });
    // 80 teeth on 0.86 m.
    pulses.sum::<i64>() as f64 * std::f64::consts::PI * 0.86 / 80.0
}

/// A train that speeds up by 1 m/s² for 20 s, runs on for 20 s: 200 + 400 m. One row in a tenth of a second.
fn ride(separator: char, decimal: char, row: impl Fn(usize, f64) -> [String; 3]) -> String {
    let mut text = ["time", "v front", "v rear"].join(&separator.to_string()) + "\n";
    for n in 0..=400 {
        let speed = (n as f64 * 0.1).min(20.0);
        let fields = row(n, speed).map(|field| field.replace('.', &decimal.to_string()));
        text += &(fields.join(&separator.to_string()) + "\n");
    }
    text
}

#[test]
fn every_unit_comes_to_the_same_path() {
    let time = |n: usize| format!("{:.1}", n as f64 * 0.1);
    let km_h = ride(';', ',', |n, v| [time(n), format!("{:.3}", v * 3.6), format!("{:.3}", v * 3.6)]);
    let m_s = ride(',', '.', |n, v| [time(n), format!("{v:.3}"), format!("{v:.3}")]);
    let mph = ride('\t', '.', |n, v| [time(n), format!("{:.4}", v / 0.44704), format!("{:.4}", v / 0.44704)]);
    let turns = |v: f64| format!("{:.4}", v * 60.0 / (std::f64::consts::PI * 0.86));
    let rpm = ride('|', '.', |n, v| [time(n), turns(v), turns(v)]);
    for (text, unit) in [(km_h, "speed_N_km_h"), (m_s, "speed_N_m_s"), (mph, "speed_N_mph"), (rpm, "rpm_N")] {
        let [first, second] =
            ["1=v front", "2=v rear"].map(|of| unit.replace('N', of.split('=').next().unwrap()) + &of[1..]);
        let whole = read(&text, &["t_s=time", &first, &second]).unwrap();
        assert_eq!(whole.rows.len(), 401);
        assert_eq!(whole.rows[400].1.time.as_s(), 40.0);
        for wheel in 0..2 {
            assert!((path_m(&whole, wheel) - 600.0).abs() < 0.1, "{unit}: {}", path_m(&whole, wheel));
        }
        assert_eq!(whole.notes.len(), 1, "that speeds are added up");
        assert_eq!(whole.notes[0].oddity, TachometerOddity::SpeedsAddedUp);
    }
}

#[test]
fn times_are_milliseconds_counters_or_dates() {
    let speed = |v: f64| format!("{v:.3}");
    let date = |n: usize| {
        let tenths = 237_900 + n;
        format!(
            "2014-04-01 {:02}:{:02}:{:02}.{}",
            tenths / 36000,
            tenths / 600 % 60,
            tenths / 10 % 60,
            tenths % 10
        )
    };
    for (pairs, text) in [
        (vec!["t_ms=time"], ride(',', '.', |n, v| [(n * 100).to_string(), speed(v), speed(v)])),
        (
            vec!["sample=time", "period_s=0.1"],
            ride(',', '.', |n, v| [(n + 7).to_string(), speed(v), speed(v)]),
        ),
        (vec!["date_time=time"], ride(',', '.', |n, v| [date(n), speed(v), speed(v)])),
    ] {
        let pairs: Vec<&str> =
            pairs.into_iter().chain(["speed_1_m_s=v front", "speed_2_m_s=v rear"]).collect();
        let whole = read(&text, &pairs).unwrap();
        assert_eq!(whole.rows[400].1.time.as_s() - whole.rows[0].1.time.as_s(), 40.0, "{pairs:?}");
        assert!((path_m(&whole, 0) - 600.0).abs() < 0.1);
    }
}

#[test]
fn own_columns_need_no_mapping_and_truth_may_be_in_km_h() {
    let text = "zeit;pulses_1;v2;wahr;balise_m;wind\n0,0;3;10,8;36;;x\n0,05;4;;36;12,5;x\n";
    let whole = read(text, &["t_s=zeit", "speed_2_km_h=v2", "true_speed_km_h=wahr"]).unwrap();
    let (_, period, truth) = whole.rows[1];
    assert_eq!(period.wheels.map(|wheel| wheel.count), [Count::Pulses(4), Count::Missing]);
    assert_eq!(period.balise, Some(Length::from_m(12.5)));
    assert!((truth.speed.unwrap_or(Speed::ZERO).as_m_per_s() - 10.0).abs() < 1e-12);
    let unused = TachometerOddity::UnknownColumns(vec!["wind".to_owned()]);
    assert_eq!(whole.notes[0].oddity, unused);
}

#[test]
fn a_wheelset_that_turns_backwards_says_so() {
    let text = "t,v\n0,0\n0.1,-5\n0.2,-5\n0.3,5\n0.4,5\n";
    let whole = read(text, &["t_s=t", "speed_1_m_s=v"]).unwrap();
    let directions: Vec<Direction> =
        whole.rows.iter().map(|(_, period, _)| period.wheels[0].direction).collect();
    let (unknown, back, on) = (Direction::Unknown, Direction::Backward, Direction::Forward);
    assert_eq!(directions, [unknown, back, back, unknown, on]);
    assert!(whole.rows.iter().all(|(_, period, _)| period.wheels[1].count == Count::Missing));
}

#[test]
fn what_is_wrong_is_named_with_its_place_and_what_would_be_right() {
    let v = ["t_s=t", "speed_1_km_h=v"];
    for (text, pairs, says) in [
        ("t,v\n0,x\n", &v[..], "drive.csv, line 2, column 2 (speed_1_km_h): `x` should be a finite number"),
        (
            "t,v\n0,1\nx,1\n",
            &v,
            "drive.csv, line 3, column 1 (t_s): `x` should be a time in seconds, such as 12.05",
        ),
        (
            "t;v\n0;1.000,5\n",
            &v,
            "line 2, column 2 (speed_1_km_h): `1.000,5` should be a number without separators",
        ),
        (
            "t;v\n0;1.5\n",
            &["t_s=t", "speed_1_km_h=v", "decimal=,"],
            "a number with a decimal comma, as `decimal` says",
        ),
        ("t,v\n0,1,5\n", &v, "drive.csv, line 2: 3 fields where the header names 2 columns"),
        (
            "time,v\n0,1\n",
            &v,
            "drive.csv: t_s is mapped to `t`, which the header does not name; it names time, v",
        ),
        ("t,v\n0,1\n", &["t_s=t"], "drive.csv: no column is mapped to a wheelset (speed_1_km_h,"),
        ("x,v\n0,1\n", &["speed_1_km_h=v"], "drive.csv: no column is mapped to a time (t_s,"),
        (
            "t,v\n0,1\n",
            &["t_s=t", "speed_1_km_h=v", "speed_2_km_h=v"],
            "one sensor is one wheelset: leave the other one out",
        ),
        ("t,v,w\n0,1,1\n", &["t_s=t", "speed_1_km_h=v", "rpm_1=w"], "speed_1_km_h and rpm_1 say the same"),
        ("t,v\n", &v, "no rows below the header"),
        ("", &v, "the file is empty"),
        ("t,v\n0,inf\n", &v, "`inf` should be a finite number"),
    ] {
        let message = refusal(text, pairs);
        assert!(message.contains(says), "{message}");
    }
}

#[test]
fn units_that_cannot_be_are_refused_with_their_cure() {
    let km_h = ride(',', '.', |n, v| {
        [format!("{:.1}", n as f64 * 0.1), format!("{:.1}", v * 18.0), format!("{:.1}", v * 18.0)]
    });
    // 360 km/h read as m/s on a train of 70 m/s, and 100 m/s, which it would be, is too fast as well.
    let message = refusal(&km_h, &["t_s=time", "speed_1_m_s=v front", "speed_2_m_s=v rear"]);
    assert!(
        message.starts_with("drive.csv, line 6") && message.contains("faster than the 70 m/s of the vehicle"),
        "{message}"
    );
    assert!(message.contains("map it as speed_1_km_h or speed_1_mph"), "{message}");
    let ms = ride(',', '.', |n, v| [(n * 100).to_string(), format!("{v}"), format!("{v}")]);
    let message = refusal(&ms, &["t_s=time", "speed_1_m_s=v front"]);
    assert!(
        message.contains("the times rise by 100 s from row to row")
            && message.contains("map the column as t_ms"),
        "{message}"
    );
    // One wheelset that spins is no unit.
    let spin = ride(',', '.', |n, v| [format!("{:.1}", n as f64 * 0.1), "200".to_owned(), format!("{v}")]);
    assert!(read(&spin, &["t_s=time", "speed_1_m_s=v front", "speed_2_m_s=v rear"]).is_ok());
}

#[test]
fn a_last_line_that_breaks_off_is_left_out_and_said() {
    let whole = read("t,v\n0,1\n0.1,", &["t_s=t", "speed_1_m_s=v"]).unwrap();
    assert_eq!(whole.rows.len(), 2, "an empty field is a missing one");
    let whole = read("t,v\n0,1\n0.", &["t_s=t", "speed_1_m_s=v"]).unwrap();
    assert_eq!(whole.rows.len(), 1);
    assert_eq!(whole.notes.last().unwrap().oddity, TachometerOddity::LineCutOff);
}

#[test]
fn parquet_is_not_mapped() {
    assert!(
        refusal("PAR1xxxx", &["t_s=t"]).contains("cannot be mapped; rename them where the file is written")
    );
}

/// Bytes that are nearly a recording, with what breaks tables in them.
fn nearly_a_recording() -> impl Strategy<Value = Vec<u8>> {
    let piece = prop_oneof![
        prop::sample::select(vec![
            "t",
            "v",
            "w",
            ",",
            ";",
            "\t",
            "\n",
            "\"",
            "0",
            "1",
            "-",
            ".",
            "e",
            "9999999999999999999",
            "nan",
            "inf",
            "2014-04-01",
            "23:59:59",
            "-0",
            "1e308"
        ])
        .prop_map(|text| text.as_bytes().to_vec()),
        any::<u8>().prop_map(|byte| vec![byte]),
    ];
    prop::collection::vec(piece, 0..80).prop_map(|pieces| {
        let mut text = b"t,v,w\n0,1,2\n0.1,1,2\n".to_vec();
        text.extend(pieces.concat());
        text
    })
}

proptest! {
    /// Any bytes are read or refused, under every mapping; none makes us panic, and none goes on for ever.
    #[test]
    fn no_input_makes_us_panic(
        text in nearly_a_recording(),
        cut in 0..24_usize,
        time in prop::sample::select(vec!["t_s=t", "t_ms=t", "t_us=t", "sample=t", "date_time=t", "time_of_day=t", "date=t"]),
        wheel in prop::sample::select(vec!["speed_1_km_h=v", "rpm_1=v", "counter_1=v", "pulses_2=v"]),
        other in prop::sample::select(vec!["speed_2_m_s=w", "direction_1=w", "edge_1_s=w", "run_id=w", "effort=w", "time_of_day=w"]),
        style in prop::sample::select(vec!["decimal=.", "decimal=,", "separator=,", "separator=;", "period_s=1"]),
    ) {
        let mut mapping = ColumnMapping::default();
        for pair in [time, wheel, other, style] {
            mapping.take_pair(pair).unwrap();
        }
        let text = text.get(cut.min(text.len())..).unwrap_or_default().to_vec();
        let reader = TachometerReader::mapped_stream("any", Box::new(std::io::Cursor::new(text)), &mapping, &vehicle());
        if let Ok(mut reader) = reader {
            let mut block = TachometerBlock::default();
            for _ in 0..200 {
                match reader.read_block(&mut block) {
                    Ok(true) => (0..block.len()).for_each(|row| { let _ = (block.period(row), block.truth(row)); }),
                    _ => break,
                }
            }
        }
    }

    /// No pair and no file of pairs makes us panic.
    #[test]
    fn no_mapping_makes_us_panic(pair in ".{0,40}", file in prop::collection::vec(any::<u8>(), 0..200)) {
        let mut mapping = ColumnMapping::default();
        let _ = mapping.take_pair(&pair);
        let _ = mapping.take_bytes("any", &file);
    }
}
