//! What is said is what is heard, wherever the line cuts it, and noise is read without a panic.

use footplate_core::{SensorId, SpeedStep, TrainId, TurnoutId};
use footplate_wire::marklin_serial::{EncodeError, Message, ModuleState, decode_reply};
use proptest::prelude::{Strategy, any, prop_assert, prop_assert_eq, prop_oneof, proptest};
use proptest::strategy::Just;

fn step(step: u8) -> SpeedStep {
    SpeedStep::new(step).expect("the step should be on the throttle")
}

/// Every message that the interface understands.
fn messages() -> impl Strategy<Value = Message> {
    let trains = || (1_u16..=80).prop_map(TrainId);
    prop_oneof![
        (trains(), 0_u8..=14, any::<bool>()).prop_map(|(train, at, light)| Message::Drive {
            train,
            step: step(at),
            light
        }),
        (trains(), any::<bool>()).prop_map(|(train, light)| Message::Reverse { train, light }),
        (trains(), any::<[bool; 4]>()).prop_map(|(train, on)| Message::Functions { train, on }),
        (1_u16..=256, any::<bool>())
            .prop_map(|(number, curved)| Message::Turnout { turnout: TurnoutId(number), curved }),
        Just(Message::SolenoidOff),
        Just(Message::Go),
        Just(Message::Stop),
        any::<bool>().prop_map(|on| Message::ResetMode { on }),
        (1_u8..=31).prop_map(|count| Message::ReadModules { count }),
        (1_u8..=31).prop_map(|module| Message::ReadModule { module }),
    ]
}

/// Reads as many messages as the bytes hold, and says how many bytes are left over.
fn decode_all(mut bytes: &[u8]) -> (Vec<Message>, usize) {
    let mut messages = Vec::new();
    while let Some((message, rest)) = Message::decode(bytes) {
        messages.push(message);
        bytes = rest;
    }
    (messages, bytes.len())
}

proptest! {
    #[test]
    fn a_stream_of_messages_is_heard_as_said(said in proptest::collection::vec(messages(), 0..20)) {
        let frames = said.iter().map(|message| message.encode().unwrap());
        let bytes: Vec<u8> = frames.flat_map(|frame| frame.as_bytes().to_vec()).collect();
        prop_assert_eq!(decode_all(&bytes), (said, 0));
    }

    #[test]
    fn bytes_that_come_one_by_one_mean_the_same(bytes in proptest::collection::vec(any::<u8>(), 0..40)) {
        let (at_once, left) = decode_all(&bytes);
        let mut waiting = Vec::new();
        let mut one_by_one = Vec::new();
        for byte in &bytes {
            waiting.push(*byte);
            if let Some((message, rest)) = Message::decode(&waiting) {
                prop_assert!(rest.is_empty());
                one_by_one.push(message);
                waiting.clear();
            }
        }
        prop_assert_eq!((one_by_one, waiting.len()), (at_once, left));
    }

    #[test]
    fn noise_is_either_unknown_or_said_again_as_it_came(first in any::<u8>(), second in any::<u8>()) {
        let bytes = [first, second];
        let (message, rest) = Message::decode(&bytes).unwrap();
        match message.encode() {
            Ok(frame) => prop_assert_eq!([frame.as_bytes(), rest].concat(), bytes),
            Err(e) => prop_assert_eq!(e, EncodeError::Unknown),
        }
    }

    #[test]
    fn any_reply_of_the_right_length_is_read_and_written_back(
        count in 1_u8..=31,
        reply in proptest::collection::vec(any::<u8>(), 62),
    ) {
        let reply = &reply[..usize::from(count) * 2];
        let states = decode_reply(Message::ReadModules { count }, reply).unwrap();
        let written: Vec<u8> = states
            .flat_map(|state| ModuleState::with_closed(state.module, state.closed()).encode())
            .collect();
        prop_assert_eq!(written, reply);
    }

    #[test]
    fn an_input_is_heard_under_its_own_number(sensor in 0_u16..496) {
        let module = u8::try_from(sensor / 16 + 1).unwrap();
        let reply = ModuleState::with_closed(module, [SensorId(sensor)]).encode();
        let mut heard = decode_reply(Message::ReadModule { module }, &reply).unwrap().flat_map(|s| s.closed().collect::<Vec<_>>());
        prop_assert_eq!((heard.next(), heard.next()), (Some(SensorId(sensor)), None));
    }
}

#[test]
fn numbers_the_interface_does_not_know_are_refused() {
    let drive = |train, at| Message::Drive { train: TrainId(train), step: step(at), light: false }.encode();
    let turnout = |number| Message::Turnout { turnout: TurnoutId(number), curved: false }.encode();
    let refusals = [
        (drive(0, 5), "train 0 has no address here; addresses are 1 to 80"),
        (drive(81, 5), "train 81 has no address here; addresses are 1 to 80"),
        (drive(24, 15), "step 15 is beyond the decoder; steps are 0 to 14"),
        (turnout(0), "turnout 0 has no address here; addresses are 1 to 256"),
        (turnout(257), "turnout 257 has no address here; addresses are 1 to 256"),
        (Message::ReadModules { count: 0 }.encode(), "0 sensor modules; the bus has 1 to 31"),
        (Message::ReadModule { module: 32 }.encode(), "32 sensor modules; the bus has 1 to 31"),
    ];
    for (refused, reason) in refusals {
        assert_eq!(refused.unwrap_err().to_string(), reason);
    }
}
