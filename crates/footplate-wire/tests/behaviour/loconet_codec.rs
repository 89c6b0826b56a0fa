//! The bytes in `testdata/wire/loconet.csv` mean what is written beside them, in both directions; any message is read as it was written,
//! wherever the line is cut, and noise is read without a panic.

use footplate_wire::loconet::{
    FunctionGroup, FunctionPacket, LONGEST_LINE, Line, Lines, Malformed, Message, SentReport, SlotData,
    SlotUse,
};
use proptest::prelude::{
    Just, Strategy, TestCaseError, any, prop_assert, prop_assert_eq, prop_oneof, proptest,
};

const VECTORS: &str = include_str!("../../../../testdata/wire/loconet.csv");

#[test]
fn bytes_mean_what_is_written_beside_them() {
    let mut reader = csv::Reader::from_reader(VECTORS.as_bytes());
    assert_eq!(reader.headers().unwrap(), vec!["bytes", "meaning", "origin"]);
    for row in reader.records().map(Result::unwrap) {
        let bytes: Vec<u8> = row[0].split(' ').map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect();
        let message = Message::decode(&bytes).expect(&row[0]);
        assert_eq!(format!("{message:?}"), &row[1], "{}", &row[0]);
        assert_eq!(message.encode(), bytes);
        assert_eq!(Line::Send(message).text(), format!("SEND {}\r\n", &row[0]));
    }
}

#[test]
fn what_cannot_be_right_is_refused_and_what_is_not_used_is_skipped() {
    let refused: [&[u8]; 7] =
        [&[], &[0x83], &[0x83, 0x7D], &[0x03, 0xFC], &[0xA0, 0x80, 0x00, 0xDF], &[0xE7, 0x0E], &[0xE7]];
    for bytes in refused {
        assert_eq!(Message::decode(bytes), Err(Malformed), "{bytes:02x?}");
    }
    // A fast clock, a detector's report of a transponder: sound, and of no use here.
    for bytes in [&[0xE5, 0x04, 0x01, 0x1F][..], &[0xD0, 0x20, 0x00, 0x7D, 0x03, 0x71]] {
        assert_eq!(Message::decode(bytes), Ok(Message::Other { opcode: bytes[0] }));
    }
    for line in ["", "receive 83 7C", "RECEIVE 83", "RECEIVE 8X 7C", "HELLO", "<iDCC-EX>"] {
        assert_eq!(Line::read(line), Err(Malformed), "{line}");
    }
    assert_eq!(Line::read("SENT OK sent"), Ok(Line::Sent(SentReport::Ok)));
    assert_eq!(Line::read("SENT ERROR Did not receive echo"), Ok(Line::Sent(SentReport::Error)));
    assert_eq!(Line::read("VERSION LbServer 0.1a"), Ok(Line::Version("LbServer 0.1a".to_owned())));
    for line in ["TIMESTAMP 1234", "BREAK 2", "ERROR CHECKSUM 83 7D"] {
        assert_eq!(Line::read(line), Ok(Line::Other));
    }
}

fn packets() -> impl Strategy<Value = FunctionPacket> {
    let groups =
        prop_oneof![Just(FunctionGroup::F9To12), Just(FunctionGroup::F13To20), Just(FunctionGroup::F21To28)];
    (1_u16..=9_983, groups, any::<u32>()).prop_map(|(address, group, functions)| FunctionPacket {
        address,
        group,
        functions: functions & group.mask(),
    })
}

fn messages() -> impl Strategy<Value = Message> {
    let operand = || 0_u8..=0x7F;
    let slot = (
        (operand(), operand(), 0_u16..=0x3FFF, operand()),
        (any::<bool>(), 0_u32..=0x1FF, operand(), [operand(), operand(), operand()]),
    );
    let slot = slot.prop_map(|((slot, status, address, speed), (forward, functions, track, rest))| {
        Message::Slot(SlotData { slot, status, address, speed, forward, functions, track, rest })
    });
    prop_oneof![
        Just(Message::Busy),
        Just(Message::PowerOff),
        Just(Message::PowerOn),
        Just(Message::StopAll),
        (operand(), operand()).prop_map(|(slot, speed)| Message::Speed { slot, speed }),
        (operand(), any::<bool>(), 0_u32..=0x1F).prop_map(|(slot, forward, functions)| Message::Direction {
            slot,
            forward,
            functions
        }),
        (operand(), 0_u32..16).prop_map(|(slot, bits)| Message::Sound { slot, functions: bits << 5 }),
        packets().prop_map(Message::Functions),
        (1_u16..=2_048, any::<bool>(), any::<bool>()).prop_map(|(address, closed, on)| Message::Switch {
            address,
            closed,
            on
        }),
        (1_u16..=4_096, any::<bool>())
            .prop_map(|(number, is_occupied)| Message::Input { number, is_occupied }),
        (operand(), operand()).prop_map(|(opcode, code)| Message::LongAck { opcode, code }),
        (operand(), operand()).prop_map(|(from, to)| Message::MoveSlots { from, to }),
        operand().prop_map(|slot| Message::ReadSlot { slot }),
        (0_u16..=0x3FFF).prop_map(|address| Message::Locomotive { address }),
        slot,
    ]
}

#[test]
fn a_slot_says_who_uses_it() {
    let Ok(Message::Slot(slot)) = Message::decode(&[0xE7, 14, 5, 0x33, 24, 63, 16, 7, 0, 0, 0, 0, 0, 0x10])
    else {
        panic!("a slot")
    };
    for slot_use in [SlotUse::Free, SlotUse::Common, SlotUse::Idle, SlotUse::InUse] {
        assert_eq!(slot.used_as(slot_use).slot_use(), slot_use);
    }
    assert!(slot.is_powered());
}

proptest! {
    #[test]
    fn a_message_is_read_as_it_was_written(message in messages()) {
        prop_assert_eq!(Message::decode(&message.encode()), Ok(message));
    }

    #[test]
    fn an_independent_codec_reads_and_writes_the_same_bytes(message in messages()) {
        // It knows no other acknowledgements, and leaves out bits that mean nothing.
        let message = match message {
            Message::LongAck { code, .. } => Message::LongAck { opcode: 0x3F, code },
            Message::Slot(slot) => {
                let status = slot.status & 0x30 | 3;
                Message::Slot(SlotData { status, track: slot.track & 7, rest: [0; 3], ..slot })
            }
            // It loses bits of packets for the rails.
            Message::Functions(_) => return Ok(()),
            other => other,
        };
        let bytes = message.encode();
        let theirs = locodrive::protocol::Message::parse(&bytes).map_err(|error| TestCaseError::fail(format!("{bytes:02x?}: {error:?}")))?;
        prop_assert_eq!(theirs.to_message(), bytes);
    }

    #[test]
    fn lines_are_found_wherever_the_stream_is_cut(messages in proptest::collection::vec(messages(), 1..20), ends in "\r|\n|\r\n") {
        let text: String = messages
            .iter()
            .map(|message| Line::Receive(*message).text().replace("\r\n", &ends))
            .collect();
        let mut lines = Lines::default();
        let read: Vec<Line> =
            text.bytes().filter_map(|byte| lines.push(byte).map(|line| Line::read(line).unwrap())).collect();
        let expected: Vec<Line> = messages.into_iter().map(Line::Receive).collect();
        prop_assert_eq!(read, expected);
        prop_assert_eq!(lines.take_unread(), 0);
    }

    #[test]
    fn noise_is_read_without_a_panic_and_in_bounded_memory(noise in proptest::collection::vec(any::<u8>(), 0..3_000)) {
        let mut lines = Lines::default();
        for byte in &noise {
            if let Some(line) = lines.push(*byte) {
                prop_assert!(line.len() <= LONGEST_LINE);
                let _ = Line::read(line);
            }
        }
        let _ = Message::decode(&noise);
        // The line after the noise is read.
        lines.push(b'\n');
        let after = b"RECEIVE 83 7C\n".iter().filter_map(|byte| lines.push(*byte).map(Line::read)).next();
        prop_assert_eq!(after, Some(Ok(Line::Receive(Message::PowerOn))));
    }
}
