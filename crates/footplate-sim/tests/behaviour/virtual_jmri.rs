//! The virtual JMRI answers as its sources say, its hardware takes its time, and it stops the trains of a client that has gone.

use footplate_core::track::{Layout, Leg};
use footplate_core::{TimeSpan, Timestamp, TurnoutId};
use footplate_sim::{End, JmriSwitches, VirtualJmri};

use crate::yard::{TRAIN, odometer, one_train, two_loops};

/// JMRI in front of the two loops, with one train 100 mm behind S0 that leads with its nose.
fn jmri(layout: &Layout, switches: JmriSwitches) -> VirtualJmri<'_> {
    VirtualJmri::new(one_train(layout, End::Nose), 7, switches)
}

/// Waits for a time and returns what is heard in it, line by line.
fn hear(jmri: &mut VirtualJmri<'_>, for_ms: i64) -> Vec<String> {
    let until = jmri.now() + TimeSpan::from_ms(for_ms);
    let mut heard = Vec::new();
    while let Some(bytes) = jmri.advance(until) {
        heard.extend(bytes);
    }
    String::from_utf8(heard).unwrap().lines().map(str::to_owned).collect()
}

fn ask(jmri: &mut VirtualJmri<'_>, message: &str) -> Vec<String> {
    jmri.write(format!("{message}\n").as_bytes());
    hear(jmri, 60)
}

const POWER: &str = r#"{"type":"power","method":"post","data":{"state":2}}"#;
const ACQUIRE: &str = r#"{"type":"throttle","data":{"throttle":"any","address":24}}"#;

/// Whether one of the lines has all of these parts.
fn says(lines: &[String], parts: &[&str]) -> bool {
    lines.iter().any(|line| parts.iter().all(|part| line.contains(part)))
}

#[test]
fn requests_are_answered_as_its_sources_say() {
    let layout = two_loops();
    let mut jmri = jmri(&layout, JmriSwitches::default());
    assert!(says(&hear(&mut jmri, 10), &["hello", "simulated by Footplate"]));
    assert_eq!(ask(&mut jmri, r#"{"type":"ping"}"#), [r#"{"type":"pong"}"#]);
    let systems = ask(&mut jmri, r#"{"type":"power","method":"list"}"#);
    assert!(says(&systems, &["[", r#""prefix":"L""#, r#""state":4"#]), "{systems:?}");
    // The answer is that it does not know yet; the hardware has switched it later.
    let power = ask(&mut jmri, POWER);
    assert!(
        power.len() == 2 && power[0].contains(r#""state":0"#) && power[1].contains(r#""state":2"#),
        "{power:?}"
    );
    let whole = ask(&mut jmri, ACQUIRE);
    assert!(
        says(&whole, &[r#""address":24"#, r#""speed":0.0"#, r#""F28":false"#, r#""throttle":"any""#]),
        "{whole:?}"
    );
    let drive = ask(&mut jmri, r#"{"type":"throttle","data":{"throttle":"any","speed":0.5,"forward":true}}"#);
    assert!(
        drive.len() == 1 && says(&drive, &[r#""speed":0.5"#]) && !says(&drive, &["address"]),
        "{drive:?}"
    );
    let before = odometer(&jmri.world);
    hear(&mut jmri, 3_000);
    assert!(odometer(&jmri.world) > before + 200.0, "{}", odometer(&jmri.world));
    let light = ask(&mut jmri, r#"{"type":"throttle","data":{"name":"any","F0":true,"status":null}}"#);
    assert!(says(&light, &[r#""F0":true"#, r#""F1":false"#]), "{light:?}");
    assert_eq!(jmri.functions(TRAIN), 1);
    for (wrong, code) in [
        ("{", 500),
        (r#"{"type":"turnout","method":"post","data":{"name":"LT99","state":4}}"#, 404),
        (r#"{"type":"throttle","data":{"name":"other","speed":0.5}}"#, 400),
    ] {
        assert!(says(&ask(&mut jmri, wrong), &["error", &format!("\"code\":{code}")]), "{wrong}");
    }
}

#[test]
fn sensors_are_reported_to_those_who_asked_within_the_delay_of_the_hardware() {
    let layout = two_loops();
    let mut jmri = jmri(&layout, JmriSwitches::default());
    let list = ask(&mut jmri, r#"{"type":"sensor","method":"list"}"#);
    let count = list.iter().map(|line| line.matches(r#""type":"sensor""#).count()).sum::<usize>();
    assert_eq!(count, layout.sensors().count());
    for message in [POWER, ACQUIRE, r#"{"type":"throttle","data":{"name":"any","speed":1,"forward":true}}"#] {
        ask(&mut jmri, message);
    }
    assert!(!says(&hear(&mut jmri, 20_000), &["sensor"]), "no client has asked");
    for (sensor, _) in layout.sensors() {
        let name = sensor.0 + 1;
        ask(&mut jmri, &format!(r#"{{"type":"sensor","method":"get","data":{{"name":"LS{name}"}}}}"#));
    }
    let mut reports: Vec<Timestamp> = Vec::new();
    let until = jmri.now() + TimeSpan::from_ms(20_000);
    while let Some(bytes) = jmri.advance(until) {
        let text = String::from_utf8(bytes).unwrap();
        reports.extend(text.contains("\"sensor\"").then_some(jmri.now()));
    }
    assert!(reports.len() > 4, "{reports:?}");
}

#[test]
fn the_trains_of_a_client_that_has_gone_are_stopped() {
    let layout = two_loops();
    let mut jmri = jmri(&layout, JmriSwitches::default());
    for message in [POWER, ACQUIRE, r#"{"type":"throttle","data":{"name":"any","speed":0.6,"forward":true}}"#]
    {
        ask(&mut jmri, message);
    }
    hear(&mut jmri, 3_000);
    jmri.disconnect();
    assert!(hear(&mut jmri, 5_000).is_empty(), "to whom?");
    assert!(jmri.world.truth().train(TRAIN).unwrap().at_rest_since.is_some());
    jmri.connect();
    assert!(says(&hear(&mut jmri, 10), &["hello"]));
    // Its throttle has to be asked for again, and turnouts are thrown.
    assert!(says(&ask(&mut jmri, r#"{"type":"throttle","data":{"name":"any","speed":0.6}}"#), &["error"]));
    ask(&mut jmri, r#"{"type":"turnout","method":"post","data":{"name":"LT2","state":4}}"#);
    hear(&mut jmri, 1_000);
    assert_eq!(jmri.world.lies(TurnoutId(2)), Some(Leg::Curved));
}

#[test]
fn quirks_are_what_they_say() {
    let layout = two_loops();
    let switches = JmriSwitches { has_prefix: false, knows_power: false, polls: true, throttles: 1 };
    let mut jmri = jmri(&layout, switches);
    let systems = ask(&mut jmri, r#"{"type":"power","method":"list"}"#);
    assert!(says(&systems, &[r#""state":0"#]) && !says(&systems, &["prefix"]), "{systems:?}");
    assert_eq!(ask(&mut jmri, POWER).len(), 1, "the hardware says nothing");
    assert!(jmri.world.is_powered());
    ask(&mut jmri, ACQUIRE);
    let second = ask(&mut jmri, r#"{"type":"throttle","data":{"name":"second","address":58}}"#);
    assert!(says(&second, &["error", "512"]), "{second:?}");
}
