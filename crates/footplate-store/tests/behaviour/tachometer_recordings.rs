//! Tachometer recordings are read in every form that the documentation describes, to the last digit.

use std::io::{self, Read};
use std::path::{Path, PathBuf};

use footplate_core::odometry::wheels::{Count, Direction, Period, WheelReading};
use footplate_core::{Acceleration, Length, Speed, Timestamp};
use footplate_store::{
    RowPlace, TachometerBlock, TachometerError, TachometerNote, TachometerOddity, TachometerReader, Truth,
};

/// A whole recording, row by row.
#[derive(Debug, PartialEq, Default)]
pub(crate) struct Whole {
    pub(crate) rows: Vec<(usize, Period, Truth)>,
    pub(crate) runs: Vec<String>,
    pub(crate) notes: Vec<TachometerNote>,
}

pub(crate) fn read_all(mut reader: TachometerReader) -> Result<Whole, TachometerError> {
    let mut whole = Whole::default();
    let mut block = TachometerBlock::default();
    while reader.read_block(&mut block)? {
        whole.runs.append(&mut block.new_runs);
        whole.notes.append(&mut block.notes);
        whole.rows.extend((0..block.len()).map(|row| (block.run(row), block.period(row), block.truth(row))));
    }
    Ok(whole)
}

/// Reads a text that comes in pieces of so many bytes.
pub(crate) fn read_in_pieces(text: &[u8], piece: usize) -> Result<Whole, TachometerError> {
    read_all(TachometerReader::of_stream("run.csv", Box::new(Pieces { text: text.to_vec(), at: 0, piece }))?)
}

pub(crate) fn read_text(text: impl AsRef<[u8]>) -> Result<Whole, TachometerError> {
    read_in_pieces(text.as_ref(), usize::MAX)
}

struct Pieces {
    text: Vec<u8>,
    at: usize,
    piece: usize,
}

impl Read for Pieces {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let rest = &self.text[self.at..];
        let count = rest.len().min(self.piece).min(buffer.len());
        buffer[..count].copy_from_slice(&rest[..count]);
        self.at += count;
        Ok(count)
    }
}

pub(crate) fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/tachometer").join(name)
}

fn read_example(name: &str) -> Whole {
    read_all(TachometerReader::open(&example(name)).unwrap()).unwrap()
}

fn ms(ms: i64) -> Timestamp {
    Timestamp::from_ns(ms * 1_000_000)
}

#[test]
fn a_plain_recording_is_pulses_and_truth() {
    let whole = read_example("plain.csv");
    assert_eq!((whole.rows.len(), whole.notes.len(), whole.runs.len()), (40, 0, 0));
    let (run, period, truth) = whole.rows[39];
    assert_eq!((run, period), (0, Period::with_pulses(ms(1950), [15, 15])));
    let (speed, distance) = (Some(Speed::from_m_per_s(10.0)), Some(Length::from_m(19.5)));
    assert_eq!(truth, Truth { speed, distance, wheels: [None; 2] });
    // 39 periods of half a metre are 577.4 pulses of 33.772 mm.
    let pulses = whole.rows.iter().map(|(_, period, _)| match period.wheels[0].count {
        Count::Pulses(pulses) => pulses,
        other => panic!("{other:?} should be pulses"),
    });
    assert_eq!(pulses.sum::<i64>(), 577);
}

#[test]
fn runs_in_turn_are_told_apart() {
    let whole = read_example("runs.csv");
    assert_eq!(whole.runs, ["a", "b"]);
    assert_eq!((whole.rows.len(), whole.notes.len()), (80, 0), "each run has its own time");
    for (at, (run, period, _)) in whole.rows.iter().enumerate() {
        assert_eq!(*run, at % 2);
        assert!(matches!(period.wheels[1].count, Count::Counter(0..256)));
    }
}

#[test]
fn every_column_finds_its_place() {
    let whole = read_example("everything.csv");
    assert_eq!((whole.runs, whole.notes), (vec!["first, wet".to_owned()], vec![]));
    let reading = |pulses, direction, edge_ns: Option<i64>| WheelReading {
        count: Count::Pulses(pulses),
        direction,
        last_edge: edge_ns.map(Timestamp::from_ns),
    };
    let expected = Period {
        time: ms(50),
        wheels: [
            reading(14, Direction::Forward, Some(48_100_000)),
            reading(15, Direction::Unknown, Some(49_000_000)),
        ],
        effort: Some(-0.5),
        acceleration: Some(Acceleration::from_m_per_s2(-0.4)),
        balise: Some(Length::from_m(1250.5)),
        balise_deviation: None,
    };
    assert_eq!(whole.rows[0].1, expected);
    assert_eq!(whole.rows[0].2.wheels, [10.0, 9.5].map(|speed| Some(Speed::from_m_per_s(speed))));
    let nothing = Period {
        wheels: [
            WheelReading { direction: Direction::Backward, ..WheelReading::MISSING },
            WheelReading::MISSING,
        ],
        ..Period::empty(ms(100))
    };
    assert_eq!((whole.rows[1].1, whole.rows[1].2), (nothing, Truth::default()));
    let quoted = Period {
        wheels: [reading(12, Direction::Unknown, Some(148_000_001)), reading(13, Direction::Forward, None)],
        effort: Some(1.0),
        acceleration: Some(Acceleration::from_m_per_s2(0.25)),
        ..Period::empty(ms(150))
    };
    assert_eq!(whole.rows[2].1, quoted);
    assert_eq!(whole.rows.len(), 3);
}

#[test]
fn it_does_not_matter_in_which_pieces_a_recording_comes() {
    for name in ["plain.csv", "runs.csv", "everything.csv"] {
        let text = std::fs::read(example(name)).unwrap();
        let whole = read_text(&text).unwrap();
        for piece in [1, 2, 3, 7, 64] {
            assert_eq!(read_in_pieces(&text, piece).unwrap(), whole, "{name} in pieces of {piece}");
        }
    }
}

#[test]
fn rows_are_there_as_soon_as_their_line_is_complete() {
    let mut reader = TachometerReader::of_stream(
        "live",
        Box::new(Pieces { text: b"t_s,pulses_1,pulses_2\n0,1,2\n0.05,1,2\n".to_vec(), at: 0, piece: 28 }),
    )
    .unwrap();
    let mut block = TachometerBlock::default();
    assert!(reader.read_block(&mut block).unwrap());
    assert_eq!((block.len(), block.period(0)), (1, Period::with_pulses(ms(0), [1, 2])));
    assert!(reader.read_block(&mut block).unwrap());
    assert_eq!((block.len(), block.period(0)), (1, Period::with_pulses(ms(50), [1, 2])));
    assert!(!reader.read_block(&mut block).unwrap());
}

#[test]
fn time_that_does_not_go_on_is_told_once_and_left_to_the_odometer() {
    let text = "t_s,pulses_1,pulses_2\n0,1,1\n0,1,1\n0.05,1,1\n3600.05,1,1\n0.1,1,1\n0.1,1,1\n0.15,1,1\n";
    let whole = read_text(text).unwrap();
    assert_eq!(whole.rows.len(), 7);
    let said: Vec<String> = whole.notes.iter().map(ToString::to_string).collect();
    assert_eq!(
        said,
        [
            "line 3: t_s is that of the row before it",
            "line 5: 3600 s have passed since the row before it",
            "line 6: t_s goes back by 3599.95 s",
        ]
    );
}

#[test]
fn a_last_line_without_an_end_is_read_if_it_is_whole() {
    let note = |line, oddity| [TachometerNote { place: Some(RowPlace::Line(line)), oddity }];
    let whole = read_text("t_s,pulses_1,pulses_2\n0,1,1\n0.05,1,17").unwrap();
    assert_eq!((whole.rows.len(), &whole.notes[..]), (2, &note(3, TachometerOddity::LineNotEnded)[..]));
    for cut in ["0.05,1", "0.05,1,x", "0.05,1,\"1"] {
        let whole = read_text(format!("t_s,pulses_1,pulses_2\n0,1,1\n{cut}")).unwrap();
        assert_eq!((whole.rows.len(), &whole.notes[..]), (1, &note(3, TachometerOddity::LineCutOff)[..]));
    }
}
