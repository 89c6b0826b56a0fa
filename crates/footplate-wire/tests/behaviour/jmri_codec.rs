//! The texts in `testdata/wire/jmri.csv` mean what is written beside them; any message is read as it was written, and noise is read
//! without a panic.

use footplate_core::FunctionNumber;
use footplate_wire::ReportedFunctions;
use footplate_wire::dcc_ex::Throttle;
use footplate_wire::jmri::{Lines, Malformed, Reply, Request, System, ThrottleMessage};
use proptest::prelude::{Just, Strategy, any, prop_assert, prop_assert_eq, prop_oneof, proptest};

const VECTORS: &str = include_str!("../../../../testdata/wire/jmri.csv");

/// The text of each row, and what it means.
fn vectors(of_side: &str) -> Vec<(String, String)> {
    let mut reader = csv::Reader::from_reader(VECTORS.as_bytes());
    assert_eq!(reader.headers().unwrap(), vec!["side", "text", "meaning", "origin"]);
    let rows = reader.records().map(Result::unwrap).filter(|row| &row[0] == of_side);
    rows.map(|row| (row[1].to_owned(), row[2].to_owned())).collect()
}

#[test]
fn requests_mean_what_is_written_beside_them() {
    for (text, meaning) in vectors("request") {
        let request = Request::read(&text).expect(&text).expect(&text);
        assert_eq!(format!("{request:?}"), meaning);
        assert_eq!(Request::read(&request.text()), Ok(Some(request)));
    }
}

#[test]
fn replies_mean_what_is_written_beside_them() {
    for (text, meaning) in vectors("reply") {
        let reply = Reply::read(&text).expect(&text).expect(&text);
        assert_eq!(format!("{reply:?}"), meaning);
        assert_eq!(Reply::read(&reply.text()), Ok(Some(reply)));
    }
}

#[test]
fn what_cannot_be_right_is_refused_and_what_is_not_used_is_skipped() {
    for text in [
        "",
        "{",
        "HTTP/1.1 400 Bad Request",
        r#"{"type":"sensor","data":{"state":2}}"#,
        r#"{"type":"sensor","data":{"name":"LS1","state":"active"}}"#,
        r#"{"type":"throttle","data":{"address":24}}"#,
        r#"{"type":"throttle","data":{"name":"24","address":70000}}"#,
        r#"{"type":"throttle","data":{"name":"24","speed":"fast"}}"#,
        r#"{"type":"error","data":{}}"#,
        r#"[{"type":"power","data":{}}]"#,
    ] {
        assert_eq!(Reply::read(text), Err(Malformed), "{text}");
    }
    for text in ["{}", "7", "[]", r#"{"type":"memory","data":{"name":"IM1","value":"x"}}"#] {
        assert!(matches!(Reply::read(text), Ok(None | Some(Reply::List(_)))), "{text}");
    }
}

#[test]
fn names_have_the_prefix_of_their_system_and_a_number() {
    let system = System { name: None, prefix: "L2".to_owned() };
    assert_eq!((system.sensor(17), system.turnout(5)), ("L2S17".to_owned(), "L2T5".to_owned()));
    for (name, number) in
        [("L2S17", Some(17)), ("LS17", None), ("L2T17", None), ("L2SYARD", None), ("ISCLOCKRUNNING", None)]
    {
        assert_eq!(system.number_of_sensor(name), number, "{name}");
    }
}

fn names() -> impl Strategy<Value = String> {
    "[A-Za-z0-9 \"\\\\ä;:+-]{1,12}"
}

fn throttles() -> impl Strategy<Value = ThrottleMessage> {
    let speeds = prop_oneof![Just(Throttle::EmergencyStop), (0_u8..=126).prop_map(Throttle::Speed)];
    let every = (1_u32 << (FunctionNumber::HIGHEST + 1)) - 1;
    let functions = (any::<u32>(), any::<u32>())
        .prop_map(move |(known, on)| ReportedFunctions { known: known & every, on: on & known & every });
    let options = (any::<Option<u16>>(), proptest::option::of(speeds), any::<Option<bool>>());
    (names(), options, functions, any::<(bool, bool)>()).prop_map(
        |(name, (address, throttle, forward), functions, (asks, is_released))| ThrottleMessage {
            name,
            address,
            throttle,
            forward,
            functions,
            asks,
            is_released,
        },
    )
}

fn requests() -> impl Strategy<Value = Request> {
    prop_oneof![
        Just(Request::Ping),
        Just(Request::Powers),
        Just(Request::Sensors),
        (proptest::option::of(names()), any::<bool>()).prop_map(|(system, on)| Request::Power { system, on }),
        names().prop_map(|name| Request::Sensor { name }),
        (names(), any::<bool>()).prop_map(|(name, thrown)| Request::Turnout { name, thrown }),
        throttles().prop_map(Request::Throttle),
    ]
}

fn replies() -> impl Strategy<Value = Reply> {
    let one = prop_oneof![
        (names(), names()).prop_map(|(version, railroad)| Reply::Hello { version, railroad }),
        Just(Reply::Pong),
        Just(Reply::Goodbye),
        (names(), proptest::option::of(names()), any::<bool>(), any::<Option<bool>>())
            .prop_map(|(system, prefix, is_default, on)| Reply::Power { system, prefix, is_default, on }),
        (names(), any::<Option<bool>>()).prop_map(|(name, active)| Reply::Sensor { name, active }),
        (names(), any::<Option<bool>>()).prop_map(|(name, thrown)| Reply::Turnout { name, thrown }),
        throttles().prop_map(Reply::Throttle),
        (any::<u16>(), names()).prop_map(|(code, message)| Reply::Error { code, message }),
    ];
    let one = std::sync::Arc::new(one);
    prop_oneof![one.clone(), proptest::collection::vec(one, 0..5).prop_map(Reply::List)]
}

fn lines(bytes: &[u8]) -> Vec<String> {
    let mut lines = Lines::default();
    bytes.iter().filter_map(|byte| lines.push(*byte).map(str::to_owned)).collect()
}

proptest! {
    #[test]
    fn requests_are_read_as_written(written in proptest::collection::vec(requests(), 0..10)) {
        let text: String = written.iter().map(Request::text).collect();
        let read: Vec<Request> =
            lines(text.as_bytes()).iter().map(|line| Request::read(line).unwrap().unwrap()).collect();
        prop_assert_eq!(read, written);
    }

    #[test]
    fn replies_are_read_as_written(written in proptest::collection::vec(replies(), 0..10)) {
        let text: String = written.iter().map(Reply::text).collect();
        let read: Vec<Reply> =
            lines(text.as_bytes()).iter().map(|line| Reply::read(line).unwrap().unwrap()).collect();
        prop_assert_eq!(read, written);
    }

    #[test]
    fn noise_is_no_message(bytes in proptest::collection::vec(any::<u8>(), 0..2000)) {
        for line in lines(&bytes) {
            let is_message = matches!(Reply::read(&line), Ok(Some(Reply::Throttle(_) | Reply::Sensor { .. })));
            prop_assert!(!is_message, "{line}");
        }
    }
}
