//! What is written of a recording reads back as the same, from CSV and from Parquet, and gives the same estimates.

use std::io::Cursor;
use std::sync::Arc;

use footplate_core::odometry::MotionEstimate;
use footplate_core::odometry::wheels::{Count, Direction, Period, WheelReading};
use footplate_core::{Acceleration, Length, Speed, Timestamp};
use footplate_store::odometry::{OdometryRun, Preset, RunContext};
use footplate_store::{
    TableForm, TachometerError, TachometerReader, TachometerWriter, Truth, WrittenColumns, default_vehicle,
};
use parquet::data_type::{DoubleType, FloatType, Int32Type, Int64Type};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use proptest::prelude::{Just, Strategy, any, prop, prop_assert, prop_assert_eq, prop_oneof, proptest};

use crate::tachometer_recordings::{Whole, example, read_all};

/// Up to here seconds in a double are exact to the nanosecond, there and back: 13 days.
const EXACT_NS: i64 = 1 << 50;

fn read(bytes: Vec<u8>) -> Result<Whole, TachometerError> {
    read_all(TachometerReader::of_stream("run", Box::new(Cursor::new(bytes)))?)
}

fn write(rows: &[(usize, Period, Truth)], form: TableForm, columns: WrittenColumns) -> Vec<u8> {
    let mut writer = TachometerWriter::new(Vec::new(), form, columns).unwrap();
    for (run, period, truth) in rows {
        writer.push(&format!("run {run}"), period, truth).unwrap();
    }
    writer.finish().unwrap()
}

fn everything(counters: [bool; 2]) -> WrittenColumns {
    WrittenColumns {
        counters,
        directions: true,
        edges: true,
        effort: true,
        acceleration: true,
        balise: true,
        balise_deviation: true,
        run_id: true,
        truth: true,
        true_wheels: true,
    }
}

fn finite() -> impl Strategy<Value = Option<f64>> {
    prop_oneof![Just(None), any::<f64>().prop_map(|value| Some(value).filter(|value| value.is_finite()))]
}

fn wheel(counter: bool) -> impl Strategy<Value = WheelReading> {
    let count = prop_oneof![
        1 => Just(Count::Missing),
        3 => (-1000_i64..1000)
            .prop_map(move |count| if counter { Count::Counter(count) } else { Count::Pulses(count) }),
        1 => (i64::MIN + 1..=i64::MAX)
            .prop_map(move |count| if counter { Count::Counter(count) } else { Count::Pulses(count) }),
    ];
    let direction =
        prop_oneof![Just(Direction::Unknown), Just(Direction::Forward), Just(Direction::Backward)];
    let edge = prop::option::of((-EXACT_NS..EXACT_NS).prop_map(Timestamp::from_ns));
    (count, direction, edge).prop_map(|(count, direction, last_edge)| WheelReading {
        count,
        direction,
        last_edge,
    })
}

fn row() -> impl Strategy<Value = (usize, Period, Truth)> {
    let period = (
        -EXACT_NS..EXACT_NS,
        wheel(false),
        wheel(true),
        prop::option::of(-1.0..=1.0_f64),
        finite(),
        finite(),
    )
        .prop_map(|(ns, first, second, effort, acceleration, balise)| Period {
            time: Timestamp::from_ns(ns),
            wheels: [first, second],
            effort,
            acceleration: acceleration.map(Acceleration::from_m_per_s2),
            balise: balise.map(Length::from_m),
            balise_deviation: balise.map(|place| Length::from_m(1.0 + place.abs().min(1e6))),
        });
    let truth = (finite(), finite(), finite(), finite()).prop_map(|(speed, distance, first, second)| Truth {
        speed: speed.map(Speed::from_m_per_s),
        distance: distance.map(Length::from_m),
        wheels: [first, second].map(|wheel| wheel.map(Speed::from_m_per_s)),
    });
    (Just(0), period, truth)
}

/// Rows whose runs are numbered in the order of first appearance.
fn rows() -> impl Strategy<Value = Vec<(usize, Period, Truth)>> {
    prop::collection::vec((row(), any::<bool>()), 1..40).prop_map(|rows| {
        let mut second = false;
        let numbered = rows.into_iter().enumerate().map(|(at, ((_, period, truth), other))| {
            second |= other && at > 0;
            (usize::from(second && other), period, truth)
        });
        numbered.collect()
    })
}

fn estimates(whole: &Whole) -> Vec<MotionEstimate> {
    let vehicle = default_vehicle().unwrap().vehicle;
    let context = RunContext::new(vehicle, Preset::Recommended, false);
    let mut runs: Vec<OdometryRun> = Vec::new();
    let mut all = Vec::new();
    for (run, period, truth) in &whole.rows {
        if runs.len() <= *run {
            runs.push(OdometryRun::new(&context).unwrap());
        }
        all.push(runs[*run].step(period, || *truth));
    }
    all
}

proptest! {
    #[test]
    fn what_is_written_reads_back_as_the_same(rows in rows()) {
        for form in [TableForm::Csv, TableForm::Parquet] {
            let whole = read(write(&rows, form, everything([false, true])));
            // Times at random may look like columns that have changed places.
            if matches!(whole, Err(TachometerError::Swapped { .. })) {
                continue;
            }
            let whole = whole.unwrap();
            prop_assert_eq!(&whole.rows, &rows, "{:?}", form);
            let numbered = whole.runs.iter().enumerate().all(|(at, name)| *name == format!("run {at}"));
            prop_assert!(numbered, "{:?}", whole.runs);
        }
    }

    #[test]
    fn a_damaged_parquet_file_is_an_error_or_other_numbers(
        at in 0.0..1.0_f64,
        bits in 1_u8..=255,
        length in 0.0..=1.0_f64,
    ) {
        let mut rows = read_all(TachometerReader::open(&example("plain.csv")).unwrap()).unwrap().rows;
        rows.truncate(20);
        let whole = write(&rows, TableForm::Parquet, everything([false; 2]));
        let mut flipped = whole.clone();
        flipped[(at * whole.len() as f64) as usize] ^= bits;
        let cut = whole[..(length * whole.len() as f64) as usize].to_vec();
        for damaged in [flipped, cut] {
            let is_whole = damaged == whole;
            match read(damaged) {
                Ok(read) => prop_assert!(is_whole || read.rows.len() <= rows.len()),
                Err(error) => prop_assert!(error.to_string().starts_with("run"), "{}", error),
            }
        }
    }
}

#[test]
fn csv_and_parquet_give_the_same_estimates() {
    for name in ["plain.csv", "runs.csv"] {
        let whole = read_all(TachometerReader::open(&example(name)).unwrap()).unwrap();
        let columns = WrittenColumns {
            counters: [name == "runs.csv"; 2],
            run_id: true,
            truth: true,
            ..WrittenColumns::default()
        };
        let parquet = read(write(&whole.rows, TableForm::Parquet, columns)).unwrap();
        assert_eq!(parquet.rows, whole.rows);
        // To the last bit, signs of zero included.
        assert_eq!(format!("{:?}", estimates(&parquet)), format!("{:?}", estimates(&whole)), "{name}");
    }
}

#[test]
fn a_parquet_file_that_breaks_off_says_so() {
    let whole = read_all(TachometerReader::open(&example("plain.csv")).unwrap()).unwrap();
    let bytes = write(&whole.rows, TableForm::Parquet, WrittenColumns::default());
    for length in [4, 5, bytes.len() / 2, bytes.len() - 1] {
        let error = read(bytes[..length].to_vec()).unwrap_err().to_string();
        assert!(error.starts_with("run: it begins like Parquet and cannot be read as that: "), "{error}");
        assert!(error.ends_with("was it written and copied to its end?"), "{error}");
    }
    // Fewer bytes than tell it from a text.
    assert!(read(bytes[..3].to_vec()).unwrap_err().to_string().contains("missing columns"));
}

/// A Parquet file as other programs write it: any schema, three rows.
fn foreign(
    schema: &str,
    mut column: impl FnMut(usize, &mut parquet::file::writer::SerializedColumnWriter<'_>),
) -> Vec<u8> {
    let schema = Arc::new(parse_message_type(schema).unwrap());
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::default()).unwrap();
    let mut group = writer.next_row_group().unwrap();
    let mut at = 0;
    while let Some(mut writer) = group.next_column().unwrap() {
        column(at, &mut writer);
        writer.close().unwrap();
        at += 1;
    }
    group.close().unwrap();
    writer.into_inner().unwrap()
}

#[test]
fn types_of_other_programs_are_read() {
    let bytes = foreign(
        "message m { REQUIRED INT64 t_s (TIMESTAMP(MICROS,true)); OPTIONAL DOUBLE pulses_1; \
         REQUIRED INT32 counter_2 (INTEGER(32,false)); OPTIONAL FLOAT effort; REQUIRED INT64 run_id; }",
        |at, column| {
            let written = match at {
                0 => {
                    let micros = [1_583_740_245_914_000, 1_583_740_245_964_000, 1_583_740_246_014_000];
                    column.typed::<Int64Type>().write_batch(&micros, None, None)
                }
                1 => column.typed::<DoubleType>().write_batch(&[12.0, f64::NAN], Some(&[1, 0, 1]), None),
                2 => column.typed::<Int32Type>().write_batch(&[-1, 3, 18], None, None),
                3 => column.typed::<FloatType>().write_batch(&[0.5, -0.25], Some(&[1, 1, 0]), None),
                _ => column.typed::<Int64Type>().write_batch(&[7, 7, 7], None, None),
            };
            written.unwrap();
        },
    );
    let whole = read(bytes).unwrap();
    assert_eq!((whole.runs, whole.rows.len()), (vec!["7".to_owned()], 3));
    let periods: Vec<Period> = whole.rows.iter().map(|(_, period, _)| *period).collect();
    assert_eq!(periods[1].time, Timestamp::from_ns(1_583_740_245_964_000_000));
    assert_eq!(
        periods.iter().map(|p| p.wheels[0].count).collect::<Vec<_>>(),
        [Count::Pulses(12), Count::Missing, Count::Missing]
    );
    assert_eq!(periods[0].wheels[1].count, Count::Counter(i64::from(u32::MAX)));
    assert_eq!(periods.iter().map(|p| p.effort).collect::<Vec<_>>(), [Some(0.5), Some(-0.25), None]);
}

#[test]
fn wrong_types_and_values_are_named() {
    let refusal = |time: &str, values: [f64; 3]| {
        let schema =
            format!("message m {{ {time} t_s; REQUIRED DOUBLE pulses_1; REQUIRED INT32 pulses_2; }}");
        let bytes = foreign(&schema, |at, column| {
            let written = match at {
                0 if time.contains("FLOAT") => {
                    column.typed::<FloatType>().write_batch(&[0.0, 0.05, 0.1], None, None)
                }
                0 => column.typed::<DoubleType>().write_batch(&values, None, None),
                1 => column.typed::<DoubleType>().write_batch(&[1.0, 2.0, 2.5], None, None),
                _ => column.typed::<Int32Type>().write_batch(&[1, 2, 3], None, None),
            };
            written.unwrap();
        });
        read(bytes).unwrap_err().to_string()
    };
    assert_eq!(
        refusal("REQUIRED FLOAT", [0.0; 3]),
        "run, column t_s: its type is FLOAT; it should be DOUBLE in seconds, or INT64 as a timestamp"
    );
    assert_eq!(
        refusal("REQUIRED DOUBLE", [0.0, f64::INFINITY, 0.1]),
        "run, row 2, column t_s: `inf` should be a time in seconds"
    );
    assert_eq!(
        refusal("REQUIRED DOUBLE", [0.0, 0.05, 0.1]),
        "run, row 3, column pulses_1: `2.5` should be a whole number, or null where it is missing"
    );
}
