//! What is written is what is read, wherever the line cuts it, and noise is read without a panic.

use footplate_wire::marklin_can::{
    Direction, Frame, Framing, InputChange, Message, Payload, Transport, Uid, read_list,
};
use proptest::prelude::{Just, Strategy, any, prop_assert, prop_assert_eq, prop_oneof, proptest};

fn uids() -> impl Strategy<Value = Uid> {
    any::<u32>().prop_map(Uid)
}

fn changes() -> impl Strategy<Value = InputChange> {
    (any::<bool>(), any::<bool>(), any::<Option<u16>>())
        .prop_map(|(was_occupied, is_occupied, lasted)| InputChange { was_occupied, is_occupied, lasted })
}

fn directions() -> impl Strategy<Value = Direction> {
    prop_oneof![
        Just(Direction::Kept),
        Just(Direction::Forward),
        Just(Direction::Backward),
        Just(Direction::Toggled)
    ]
}

fn messages() -> impl Strategy<Value = Message> {
    let of_all = prop_oneof![
        uids().prop_map(Message::Stop),
        uids().prop_map(Message::Go),
        uids().prop_map(Message::Halt),
        uids().prop_map(Message::EmergencyStop),
        uids().prop_map(Message::Forget),
        uids().prop_map(Message::Start),
        Just(Message::Ping),
        (uids(), any::<u8>()).prop_map(|(uid, channel)| Message::Overload { uid, channel }),
        (uids(), any::<(u8, u8)>(), any::<u16>()).prop_map(|(uid, version, kind)| Message::Participant {
            uid,
            version,
            kind
        }),
        any::<[u8; 8]>().prop_map(Message::File),
        any::<(u32, u16)>().prop_map(|(length, check)| Message::StreamBegins { length, check }),
        any::<[u8; 8]>().prop_map(Message::StreamGoesOn),
    ];
    let of_one = prop_oneof![
        (uids(), any::<Option<u16>>()).prop_map(|(uid, speed)| Message::Speed { uid, speed }),
        (uids(), proptest::option::of(directions()))
            .prop_map(|(uid, direction)| Message::Direction { uid, direction }),
        (uids(), any::<u8>(), any::<Option<u8>>()).prop_map(|(uid, function, value)| Message::Function {
            uid,
            function,
            value
        }),
        (uids(), any::<(u8, u8, Option<u16>)>())
            .prop_map(|(uid, (position, current, time))| Message::Accessory { uid, position, current, time }),
        (uids(), any::<u8>()).prop_map(|(uid, modules)| Message::ModulePoll { uid, modules }),
        (uids(), any::<(u8, u16)>()).prop_map(|(uid, (module, inputs))| Message::ModuleState {
            uid,
            module,
            inputs
        }),
        (any::<(u16, u16)>(), proptest::option::of(changes()))
            .prop_map(|((device, input), change)| Message::Input { device, input, change }),
    ];
    prop_oneof![of_all, of_one]
}

fn frames() -> impl Strategy<Value = Frame> {
    (0_u8..16, any::<(u8, bool, u16)>(), proptest::collection::vec(any::<u8>(), 0..=8)).prop_map(
        |(priority, (command, is_response, hash), data)| {
            let data = Payload::of(&data).unwrap();
            Frame { priority, command, is_response, hash, data }
        },
    )
}

fn read(transport: Transport, bytes: &[u8]) -> (Vec<Frame>, usize) {
    let mut framing = Framing::new(transport);
    let frames = bytes.iter().filter_map(|byte| framing.push(*byte)).collect();
    (frames, framing.take_unread())
}

proptest! {
    #[test]
    fn messages_are_read_as_written(message in messages(), is_response: bool, hash: u16) {
        let frame = message.frame(is_response, hash);
        prop_assert_eq!(Message::of(&frame), message);
        prop_assert_eq!((frame.is_response, frame.hash), (is_response, hash));
    }

    #[test]
    fn frames_are_read_as_written_in_both_forms(written in proptest::collection::vec(frames(), 0..20)) {
        let network: Vec<u8> = written.iter().flat_map(Frame::encode).collect();
        prop_assert_eq!(read(Transport::Network, &network), (written.clone(), 0));
        let adapter: String = written.iter().map(|frame| frame.to_text() + "\r").collect();
        prop_assert_eq!(read(Transport::Adapter, adapter.as_bytes()), (written, 0));
    }

    #[test]
    fn noise_is_counted_and_never_kept(bytes in proptest::collection::vec(any::<u8>(), 0..2000)) {
        for transport in [Transport::Network, Transport::Adapter] {
            let (frames, unread) = read(transport, &bytes);
            prop_assert!(13 * frames.len() + unread <= bytes.len() || transport == Transport::Adapter);
            prop_assert!(unread <= bytes.len());
            for frame in frames {
                let message = Message::of(&frame);
                let again = message.frame(frame.is_response, frame.hash);
                prop_assert_eq!(Message::of(&again), message);
            }
        }
        // No list of locomotives either.
        prop_assert_eq!(read_list(&bytes), None);
    }
}
