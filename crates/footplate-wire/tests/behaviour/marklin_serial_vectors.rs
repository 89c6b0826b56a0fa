//! The bytes in `testdata/wire/marklin_serial.csv` mean what is written beside them, in both directions.

use footplate_core::SensorId;
use footplate_wire::marklin_serial::{EncodeError, Message, ModuleState, decode_reply};

const VECTORS: &str = include_str!("../../../../testdata/wire/marklin_serial.csv");

/// One row of the table: a message, and the reply to it if it has one.
struct Vector {
    bytes: Vec<u8>,
    meaning: String,
    reply: Vec<u8>,
    closed: Vec<SensorId>,
}

fn vectors() -> Vec<Vector> {
    let mut reader = csv::Reader::from_reader(VECTORS.as_bytes());
    assert_eq!(reader.headers().unwrap(), vec!["hex", "meaning", "reply", "closed", "origin"]);
    let read = |row: csv::StringRecord| {
        let hex = |text: &str| {
            text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect::<Vec<_>>()
        };
        // The table counts inputs from 1, as the modules' sockets are printed.
        let input = |number: &str| SensorId(number.parse::<u16>().unwrap() - 1);
        Vector {
            bytes: hex(&row[0]),
            meaning: row[1].into(),
            reply: hex(&row[2]),
            closed: row[3].split_whitespace().map(input).collect(),
        }
    };
    reader.records().map(|row| read(row.unwrap())).collect()
}

#[test]
fn bytes_are_read_as_what_they_mean() {
    for vector in vectors() {
        let (message, rest) = Message::decode(&vector.bytes).expect("the vector should be complete");
        assert_eq!(message.to_string(), vector.meaning);
        assert_eq!(rest, [0; 0], "{}", vector.meaning);
    }
}

#[test]
fn what_is_known_is_said_with_the_same_bytes() {
    for vector in vectors() {
        let (message, _) = Message::decode(&vector.bytes).expect("the vector should be complete");
        match message.encode() {
            Ok(frame) => assert_eq!(frame.as_bytes(), vector.bytes, "{}", vector.meaning),
            Err(e) => assert!(e == EncodeError::Unknown && vector.meaning.starts_with("unknown"), "{e}"),
        }
    }
}

#[test]
fn replies_show_the_inputs_beside_them() {
    for vector in vectors().iter().filter(|vector| !vector.reply.is_empty()) {
        let (request, _) = Message::decode(&vector.bytes).expect("the vector should be complete");
        let states: Vec<ModuleState> = decode_reply(request, &vector.reply).expect(&vector.meaning).collect();
        let closed: Vec<SensorId> = states.iter().flat_map(|state| state.closed()).collect();
        assert_eq!(closed, vector.closed, "{}", vector.meaning);

        let answer: Vec<u8> = request
            .modules_read()
            .flat_map(|module| ModuleState::with_closed(module, vector.closed.iter().copied()).encode())
            .collect();
        assert_eq!(answer, vector.reply, "{}", vector.meaning);
    }
}
