//! The frames in `testdata/wire/marklin_can.csv` mean what is written beside them, in both directions and in both forms.

use footplate_wire::marklin_can::{
    AccessoryProtocol, FRAME_BYTES, Frame, LocomotiveProtocol, Message, Uid, hash_of,
};

const VECTORS: &str = include_str!("../../../../testdata/wire/marklin_can.csv");

fn bytes(hexadecimal: &str) -> [u8; FRAME_BYTES] {
    let digits: Vec<u8> = hexadecimal.bytes().collect();
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    digits.chunks(2).map(byte).collect::<Vec<u8>>().try_into().expect("thirteen bytes")
}

#[test]
fn frames_mean_what_is_written_beside_them() {
    let mut reader = csv::Reader::from_reader(VECTORS.as_bytes());
    assert_eq!(reader.headers().unwrap(), vec!["frame", "text", "kind", "meaning", "origin"]);
    let mut count = 0;
    for row in reader.records().map(Result::unwrap) {
        let frame = Frame::decode(bytes(&row[0])).expect(&row[0]);
        assert_eq!(frame.encode(), bytes(&row[0]));
        assert_eq!(frame.to_text(), row[1]);
        assert_eq!(Frame::of_text(&row[1]), Some(frame));
        assert_eq!(frame.is_response, &row[2] == "response", "{}", &row[0]);
        let message = Message::of(&frame);
        assert_eq!(format!("{message:?}"), row[3]);
        assert_eq!(message.frame(frame.is_response, frame.hash), frame);
        count += 1;
    }
    assert!(count >= 30, "{count}");
}

#[test]
fn numbers_are_those_of_the_protocols_ranges() {
    // MM 24, mfx 24, DCC 24 and Motorola accessory 5 as RailControl writes them.
    assert_eq!(LocomotiveProtocol::Motorola.uid(24), Uid(0x0018));
    assert_eq!(LocomotiveProtocol::Mfx.uid(24), Uid(0x4018));
    assert_eq!(LocomotiveProtocol::Dcc.uid(24), Uid(0xC018));
    assert_eq!(AccessoryProtocol::Motorola.uid(5), Uid(0x3004));
    for (protocol, first) in [(AccessoryProtocol::Motorola, 0x3000), (AccessoryProtocol::Dcc, 0x3800)] {
        assert_eq!(protocol.address(Uid(first)), Some(1));
        assert_eq!(protocol.address(Uid(first - 1)), None);
        assert!(protocol.addresses().all(|address| protocol.address(protocol.uid(address)) == Some(address)));
    }
}

#[test]
fn the_hash_is_that_of_two_other_programs() {
    // can2lan's tool and traintastic agree on this one.
    assert_eq!(hash_of(0x6B8B_4567), 0x776C);
}

#[test]
fn what_is_no_frame_is_not_read() {
    let mut frame = bytes("00080300060000c01801f40000");
    frame[0] = 0x20;
    assert_eq!(Frame::decode(frame), None, "more than 29 bits");
    (frame[0], frame[4]) = (0, 9);
    assert_eq!(Frame::decode(frame), None, "more than eight bytes");
    let texts = [
        "",
        "T",
        "T0008030",
        "T000803006",
        "T0008030060000C01801F",
        "T2008030000",
        "T0008030090",
        "t1230",
        "T+0080300000",
    ];
    for text in texts {
        assert_eq!(Frame::of_text(text), None, "{text}");
    }
    // A time stamp may follow.
    assert_eq!(Frame::of_text("T0030471101A2B"), Frame::of_text("T003047110"));
}
