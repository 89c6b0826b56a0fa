//! What is written is what is read, wherever the line cuts it, and noise is read without a panic.

use footplate_wire::dcc_ex::{Framing, LONGEST_MESSAGE, Power, Reply, Request, Throttle};
use proptest::prelude::{Just, Strategy, any, prop_assert, prop_assert_eq, prop_oneof, proptest};

fn throttles() -> impl Strategy<Value = Throttle> {
    prop_oneof![Just(Throttle::EmergencyStop), (0_u8..=126).prop_map(Throttle::Speed)]
}

fn requests() -> impl Strategy<Value = Request> {
    let cabs = || 1_u16..=10_239;
    let tracks = prop_oneof![Just(Power::All), Just(Power::Main), Just(Power::Programming)];
    prop_oneof![
        Just(Request::Status),
        Just(Request::Slots),
        Just(Request::StopAll),
        Just(Request::Turnouts),
        Just(Request::SensorStates),
        Just(Request::Sensors),
        (any::<bool>(), tracks).prop_map(|(on, tracks)| Request::Power { on, tracks }),
        (cabs(), throttles(), any::<bool>()).prop_map(|(cab, throttle, forward)| Request::Drive {
            cab,
            throttle,
            forward
        }),
        (any::<u8>(), cabs(), throttles(), any::<bool>()).prop_map(|(register, cab, throttle, forward)| {
            Request::DriveByRegister { register, cab, throttle, forward }
        }),
        cabs().prop_map(|cab| Request::Locomotive { cab }),
        (cabs(), 0_u8..=68, any::<bool>()).prop_map(|(cab, function, on)| Request::Function {
            cab,
            function,
            on
        }),
        proptest::option::of(cabs()).prop_map(|cab| Request::Forget { cab }),
        (any::<u16>(), any::<bool>()).prop_map(|(id, thrown)| Request::Turnout { id, thrown }),
        any::<u16>().prop_map(|id| Request::Examine { id }),
        any::<u16>().prop_map(|id| Request::Undefine { id }),
        (any::<u16>(), any::<u16>()).prop_map(|(id, address)| Request::Define { id, address }),
        (any::<u16>(), any::<bool>()).prop_map(|(address, on)| Request::Accessory { address, on }),
    ]
}

fn replies() -> impl Strategy<Value = Reply> {
    prop_oneof![
        "[A-Z][A-Za-z0-9./ -]{0,60}".prop_map(Reply::Identity),
        (any::<bool>(), "|A|B|MAIN|PROG|JOIN").prop_map(|(on, track)| Reply::Power { on, track }),
        (any::<u16>(), any::<i16>(), throttles(), any::<bool>(), any::<u32>()).prop_map(
            |(cab, register, throttle, forward, functions)| {
                Reply::Locomotive { cab, register, throttle, forward, functions }
            }
        ),
        (any::<u8>(), throttles(), any::<bool>()).prop_map(|(register, throttle, forward)| Reply::Register {
            register,
            throttle,
            forward
        }),
        (any::<u16>(), any::<bool>()).prop_map(|(id, thrown)| Reply::Turnout { id, thrown }),
        (any::<u16>(), proptest::option::of(1_u16..=2_044), any::<bool>())
            .prop_map(|(id, address, thrown)| Reply::Definition { id, address, thrown }),
        (any::<u16>(), any::<bool>()).prop_map(|(id, active)| Reply::Sensor { id, active }),
        (any::<u16>(), any::<u16>(), any::<bool>()).prop_map(|(id, pin, pull_up)| Reply::SensorDefined {
            id,
            pin,
            pull_up
        }),
        any::<u16>().prop_map(Reply::Slots),
        any::<u16>().prop_map(|cab| Reply::Forgotten { cab }),
        Just(Reply::Done),
        Just(Reply::Failed),
    ]
}

/// What may stand between two messages.
fn between() -> impl Strategy<Value = &'static str> {
    prop_oneof![
        Just(""),
        Just("\n"),
        Just("\r\n"),
        Just("boot "),
        Just("<* LCD0: <ok>\n second line *>\n"),
        Just("<@ 0 3 \"Ready\">"),
    ]
}

fn texts(bytes: &[u8]) -> (Vec<String>, usize) {
    let mut framing = Framing::default();
    let texts = bytes.iter().filter_map(|byte| framing.push(*byte).map(str::to_owned)).collect();
    (texts, framing.take_unread())
}

proptest! {
    #[test]
    fn requests_are_read_as_written(written in proptest::collection::vec(requests(), 0..20)) {
        let text: String = written.iter().map(ToString::to_string).collect();
        let read: Vec<Request> = texts(text.as_bytes()).0.iter().map(|text| Request::read(text).unwrap()).collect();
        prop_assert_eq!(read, written);
    }

    #[test]
    fn replies_are_read_through_whatever_stands_between_them(
        written in proptest::collection::vec((replies(), between()), 0..20),
    ) {
        let text: String = written.iter().map(|(reply, between)| format!("{reply}{between}")).collect();
        let read: Vec<Reply> =
            texts(text.as_bytes()).0.iter().filter_map(|text| Reply::read(text).unwrap()).collect();
        let replies: Vec<Reply> = written.into_iter().map(|(reply, _)| reply).collect();
        prop_assert_eq!(read, replies);
    }

    #[test]
    fn noise_is_counted_and_never_kept(bytes in proptest::collection::vec(any::<u8>(), 0..2000)) {
        let (messages, unread) = texts(&bytes);
        let kept: usize = messages.iter().map(String::len).sum();
        prop_assert!(kept + unread <= bytes.len());
        prop_assert!(messages.iter().all(|text| text.len() <= LONGEST_MESSAGE && !text.contains('<')));
        for text in &messages {
            if let Some(request) = Request::read(text) {
                let (again, _) = texts(request.to_string().as_bytes());
                prop_assert_eq!(Request::read(&again[0]), Some(request));
            }
            if let Ok(Some(reply)) = Reply::read(text) {
                let (again, _) = texts(reply.to_string().as_bytes());
                prop_assert_eq!(Reply::read(&again[0]), Ok(Some(reply)));
            }
        }
    }
}
