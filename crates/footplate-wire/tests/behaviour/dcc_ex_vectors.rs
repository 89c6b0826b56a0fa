//! The texts in `testdata/wire/dcc_ex.csv` mean what is written beside them, in both directions.

use footplate_core::{DecoderSteps, SpeedStep};
use footplate_wire::dcc_ex::{Framing, Reply, Request, speed_of};

const VECTORS: &str = include_str!("../../../../testdata/wire/dcc_ex.csv");

/// The text of each row, what stands between its brackets, and what it means.
fn vectors(of_side: &str) -> Vec<(String, String, String)> {
    let mut reader = csv::Reader::from_reader(VECTORS.as_bytes());
    assert_eq!(reader.headers().unwrap(), vec!["side", "text", "meaning", "origin"]);
    let rows = reader.records().map(Result::unwrap).filter(|row| &row[0] == of_side);
    let unwrapped = |row: csv::StringRecord| {
        let mut framing = Framing::default();
        let inner = row[1].bytes().find_map(|byte| framing.push(byte).map(str::to_owned));
        (row[1].to_owned(), inner.expect("a whole message"), row[2].to_owned())
    };
    rows.map(unwrapped).collect()
}

#[test]
fn requests_mean_what_is_written_beside_them() {
    for (text, inner, meaning) in vectors("request") {
        let request = Request::read(&inner).expect(&text);
        assert_eq!(format!("{request:?}"), meaning);
        assert_eq!(request.to_string(), text);
    }
}

#[test]
fn replies_mean_what_is_written_beside_them() {
    for (text, inner, meaning) in vectors("reply") {
        let reply = Reply::read(&inner).expect(&text).expect(&text);
        assert_eq!(format!("{reply:?}"), meaning);
        assert_eq!(reply.to_string(), text);
    }
}

#[test]
fn accessories_are_known_by_decoder_and_output_too() {
    // NMRA S-9.2.1: four outputs a decoder; decoder 7 has the linear addresses 25 to 28.
    assert_eq!(Request::read("a 7 1 1"), Request::read("a 26 1"));
    assert_eq!(Request::read("a 1 0 0"), Request::read("a 1 0"));
    assert_eq!(Request::read("T 7 DCC 7 1"), Some(Request::Define { id: 7, address: 26 }));
    // A servo is described by its pin, positions and speed.
    let servo = Reply::Definition { id: 7, address: None, thrown: true };
    assert_eq!(Reply::read("H 7 SERVO 101 400 200 0 1"), Ok(Some(servo)));
}

#[test]
fn what_the_board_would_refuse_is_not_read() {
    let refused = [
        "",
        "t 24 127 1",
        "t 24 -2 1",
        "t 0 5 1",
        "t 10240 5 1",
        "F 24 69 1",
        "T 7 2",
        "T 7 X 1",
        "T 7 DCC",
        "1 SIDE",
        "s now",
        "D",
    ];
    for text in refused {
        assert_eq!(Request::read(text), None, "{text}");
    }
    for text in ["l 24 0", "l 24 0 300 0", "p2", "H 7 2", "Q", "q 5 22 1", "# many", "l 24 0 191 0 1"] {
        assert!(Reply::read(text).is_err(), "{text}");
    }
    // Display text, names, currents: known to the board's other clients, not used here.
    // Definitions as DCC++ writes them say the same as the line before.
    for text in [
        "H 7 7 1 1",
        "@ 0 3 \"Ready\"",
        "jT 1 C \"Yard\"",
        "= A MAIN",
        "c CurrentMAIN 59 C Milli 0 1497 1 1497",
    ] {
        assert_eq!(Reply::read(text), Ok(None), "{text}");
    }
}

#[test]
fn the_steps_of_the_program_are_spread_over_the_speeds_of_the_board() {
    let speeds = (0..=15).map(|step| speed_of(SpeedStep::new(step).unwrap(), DecoderSteps::Fourteen));
    let expected = (0..=14).map(|step| Some(step * 9)).chain([None]);
    assert!(speeds.eq(expected));
}
