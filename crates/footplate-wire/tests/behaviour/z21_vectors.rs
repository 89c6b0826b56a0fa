//! The datagrams in `testdata/wire/z21.csv` mean what is written beside them, in both directions.

use footplate_wire::z21::{Datasets, Reply, Request};

const VECTORS: &str = include_str!("../../../../testdata/wire/z21.csv");

/// The bytes of each row and what they mean.
fn vectors(of_side: &str) -> Vec<(Vec<u8>, String)> {
    let mut reader = csv::Reader::from_reader(VECTORS.as_bytes());
    assert_eq!(reader.headers().unwrap(), vec!["side", "bytes", "meaning", "origin"]);
    let rows = reader.records().map(Result::unwrap).filter(|row| &row[0] == of_side);
    rows.map(|row| (bytes(&row[1]), row[2].to_owned())).collect()
}

fn bytes(text: &str) -> Vec<u8> {
    text.split(' ').map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

#[test]
fn requests_mean_what_is_written_beside_them() {
    for (bytes, meaning) in vectors("request") {
        let mut datasets = Datasets::of(&bytes);
        let request = Request::read(&datasets.next().unwrap()).expect(&meaning);
        assert_eq!((format!("{request:?}"), datasets.unread()), (meaning, 0));
        let mut written = Vec::new();
        request.write(&mut written);
        assert_eq!(written, bytes, "{request:?}");
    }
}

#[test]
fn replies_mean_what_is_written_beside_them() {
    for (bytes, meaning) in vectors("reply") {
        let mut datasets = Datasets::of(&bytes);
        let dataset = datasets.next().unwrap();
        let reply = Reply::read(&dataset).expect(&meaning).expect(&meaning);
        assert_eq!((format!("{reply:?}"), datasets.unread()), (meaning, 0));
        let mut written = Vec::new();
        reply.write(&mut written);
        assert_eq!(written, bytes, "{reply:?}");
        assert!(dataset.is_sound());
    }
}

#[test]
fn a_wrong_xor_is_read_all_the_same() {
    // RailControl switches the power on with a1 in the place of a0.
    let power = bytes("07 00 40 00 21 81 a1");
    let dataset = Datasets::of(&power).next().unwrap();
    assert_eq!(Request::read(&dataset), Some(Request::Power { on: true }));
    assert!(!dataset.is_sound());
}

#[test]
fn a_locomotive_is_read_as_far_as_its_message_is_known() {
    // Firmware 1.42: one byte more, for F29 to F31; and one that may come some day.
    let state = |text| match Reply::read(&Datasets::of(&bytes(text)).next().unwrap()) {
        Ok(Some(Reply::Locomotive(state))) => state,
        other => panic!("{other:?}"),
    };
    let newer = state("0f 00 40 00 ef 00 18 04 bf 10 00 00 00 01 5d");
    assert_eq!(newer.functions, 1 << 29 | 1);
    assert_eq!(state("10 00 40 00 ef 00 18 04 bf 10 00 00 00 01 ff a2"), newer);
    let older = "0e 00 40 00 ef 00 18 04 bf 10 00 00 00 5c";
    assert_eq!(state(older).functions, 1);
    let mut written = Vec::new();
    Reply::Locomotive(state(older)).write_as(false, &mut written);
    assert_eq!(written, bytes(older));
    // Without functions at all, as a small clone says it.
    assert_eq!(state("0a 00 40 00 ef 00 18 04 bf 4c").functions, 0);
}

#[test]
fn what_makes_no_sense_is_refused_and_what_is_not_used_is_skipped() {
    for malformed in [
        "07 00 40 00 ef 00 ef",
        "0a 00 40 00 ef 00 18 07 bf 4f",
        "05 00 18 00 09",
        "06 00 10 00 a2 43",
        "05 00 80 00 00",
        "04 00 40 00",
        "07 00 40 00 81 05 84",
    ] {
        let bytes = bytes(malformed);
        assert!(Reply::read(&Datasets::of(&bytes).next().unwrap()).is_err(), "{malformed}");
    }
    // A fast clock, a programming result, LocoNet that passes by: known to other clients.
    for unused in ["06 00 cd 00 00 00", "0a 00 40 00 64 14 00 00 05 75", "08 00 a0 00 b2 08 50 15"] {
        let bytes = bytes(unused);
        assert_eq!(Reply::read(&Datasets::of(&bytes).next().unwrap()), Ok(None), "{unused}");
    }
}

#[test]
fn a_datagram_is_read_up_to_a_length_that_cannot_be_true() {
    let two = bytes("07 00 40 00 61 01 60 08 00 10 00 a2 43 01 00");
    assert_eq!(Datasets::of(&two).count(), 2);
    for (text, whole, unread) in [
        ("07 00 40 00 61 01 60 03 00 10 00", 1, 4),
        ("08 00 10 00 a2", 0, 5),
        ("07", 0, 1),
        ("ff ff 40 00", 0, 4),
    ] {
        let bytes = bytes(text);
        let mut datasets = Datasets::of(&bytes);
        assert_eq!((datasets.by_ref().count(), datasets.unread()), (whole, unread), "{text}");
    }
}
