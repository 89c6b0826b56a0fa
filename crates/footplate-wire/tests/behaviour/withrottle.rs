//! A conversation with a phone. Lines are those of the WiThrottle protocol as JMRI documents it, and as Engine Driver sends them.

use footplate_core::track::Leg;
use footplate_core::{FunctionNumber, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};
use footplate_wire::withrottle::{
    ClientLine, FULL_SPEED, Phone, PhoneOrder, PhoneOutput, Railway, RosterTrain, ThrottleKey, TrainState,
};
use proptest::prelude::{any, prop, prop_assert, proptest};

const TRAIN: TrainId = TrainId(24);

fn step(step: u8) -> SpeedStep {
    SpeedStep::new(step).expect("a step")
}

fn at(seconds: f64) -> Timestamp {
    Timestamp::ZERO + TimeSpan::from_s(seconds)
}

/// A train that is slow at low steps: 10, 20, 40, … 640 at steps 1 to 7.
fn roster() -> Vec<RosterTrain> {
    let speeds = std::iter::once(0.0).chain((0..7).map(|doubled| f64::from(10 << doubled))).collect();
    vec![RosterTrain { key: ThrottleKey { is_long: false, train: TRAIN }, name: "V 60 {red}".into(), speeds }]
}

fn railway(of_step: u8, forward: bool) -> Railway {
    Railway {
        power: Some(true),
        trains: vec![TrainState { train: TRAIN, step: step(of_step), forward, functions: 0 }],
        turnouts: vec![(TurnoutId(11), Some(Leg::Straight)), (TurnoutId(12), None)],
    }
}

/// Lines as they are sent, orders in words.
fn outputs(phone: &mut Phone) -> Vec<String> {
    let text = |output| match output {
        PhoneOutput::Line(line) => format!("{line}"),
        PhoneOutput::Order(PhoneOrder::Speed { train, step }) => format!("> speed {train} {step}"),
        PhoneOutput::Order(order) => format!("> {order:?}"),
        PhoneOutput::Close => "> close".to_owned(),
    };
    std::iter::from_fn(|| phone.poll_output()).map(text).collect()
}

fn driving() -> Phone {
    let mut phone = Phone::connected(at(0.0), roster(), railway(0, true));
    outputs(&mut phone);
    phone.handle_line(at(0.1), "MT+S24<;>S24");
    outputs(&mut phone);
    phone
}

#[test]
fn a_phone_learns_what_there_is() {
    let mut phone = Phone::connected(at(0.0), roster(), railway(0, true));
    assert_eq!(
        outputs(&mut phone),
        [
            "VN2.0",
            "RL1]\\[V 60  red }|{24}|{S",
            "PPA1",
            "PTT]\\[Turnouts}|{Turnout]\\[Straight}|{2]\\[Curved}|{4]\\[Unknown}|{1",
            "PTL]\\[FT11}|{turnout 11}|{2]\\[FT12}|{turnout 12}|{1",
            "*10",
        ]
    );
    phone.handle_line(at(0.1), "NMy phone");
    assert_eq!((outputs(&mut phone), phone.name()), (vec!["*10".to_owned()], "My phone"));
    phone.handle_line(at(0.2), "HU0123456789");
    phone.handle_line(at(0.2), "MT+S24<;>S24");
    assert_eq!(outputs(&mut phone)[0], "MT+S24<;>");
    phone.handle_line(at(0.3), "MT+S99<;>S99");
    assert_eq!(outputs(&mut phone), ["HM99 is not a train of this session: choose one of 24"]);
}

#[test]
fn half_of_the_slider_is_half_of_the_speed() {
    let mut phone = driving();
    // Half of 640 is the speed of step 6 of 7, not of step 3 or 4.
    phone.handle_line(at(1.0), "MTAS24<;>V63");
    assert_eq!(outputs(&mut phone), ["> speed 24 6"]);
    // The same step again: nothing to command.
    phone.handle_line(at(1.1), "MTA*<;>V64");
    assert_eq!(outputs(&mut phone), Vec::<String>::new());
    phone.handle_railway(at(1.2), railway(6, true));
    assert_eq!(outputs(&mut phone), Vec::<String>::new(), "the slider stays where the finger put it");
    phone.handle_line(at(1.3), "MTAS24<;>V1");
    assert_eq!(outputs(&mut phone), ["> speed 24 1"], "the least speed is a speed");
    phone.handle_line(at(1.4), "MTAS24<;>V0");
    assert_eq!(outputs(&mut phone), ["> speed 24 0"]);
}

#[test]
fn a_stop_is_ordered_even_if_the_train_is_at_rest_for_a_moment() {
    let mut phone = driving();
    phone.handle_line(at(1.0), "MTAS24<;>V63");
    assert_eq!(outputs(&mut phone), ["> speed 24 6"]);
    // It stands within the command: it reverses, or waits for track.
    phone.handle_railway(at(9.0), railway(0, true));
    outputs(&mut phone);
    phone.handle_line(at(9.1), "MTAS24<;>V0");
    assert_eq!(outputs(&mut phone), ["> speed 24 0"]);
}

#[test]
fn the_phone_shows_what_the_train_does_by_itself() {
    let mut phone = driving();
    phone.handle_line(at(1.0), "MTAS24<;>V126");
    assert_eq!(outputs(&mut phone), ["> speed 24 7"]);
    phone.handle_railway(at(1.2), railway(0, true));
    assert_eq!(outputs(&mut phone), Vec::<String>::new(), "the command was not carried out yet");
    phone.handle_railway(at(1.4), railway(7, true));
    // The end of the movement authority stops the train.
    phone.handle_railway(at(9.0), railway(0, true));
    assert_eq!(outputs(&mut phone), ["MTAS24<;>V0"]);
    // A browser throws a turnout and reverses the train; the power goes.
    let mut other = railway(0, false);
    (other.power, other.turnouts[1].1) = (Some(false), Some(Leg::Curved));
    phone.handle_railway(at(10.0), other);
    assert_eq!(outputs(&mut phone), ["PPA0", "PTA4FT12", "MTAS24<;>R0"]);
    phone.handle_line(at(11.0), "MTAS24<;>qV");
    phone.handle_line(at(11.0), "MTAS24<;>qR");
    assert_eq!(outputs(&mut phone), ["MTAS24<;>V0", "MTAS24<;>R0"]);
}

#[test]
fn a_direction_is_commanded_once_however_often_it_is_sent() {
    let mut phone = driving();
    for _ in 0..3 {
        phone.handle_line(at(1.0), "MTAS24<;>R0");
    }
    assert_eq!(outputs(&mut phone), ["> Reverse { train: TrainId(24) }"]);
    phone.handle_railway(at(2.0), railway(0, true));
    assert_eq!(outputs(&mut phone), Vec::<String>::new(), "it stops first");
    phone.handle_railway(at(3.0), railway(0, false));
    assert_eq!(outputs(&mut phone), Vec::<String>::new());
}

#[test]
fn a_refused_order_is_shown_with_its_reason_and_the_true_state() {
    let mut phone = driving();
    phone.handle_line(at(1.0), "MTAS24<;>V126");
    outputs(&mut phone);
    phone.handle_refusal(at(1.1), "the track ahead is reserved for train 58");
    phone.handle_railway(at(1.2), railway(0, true));
    assert_eq!(outputs(&mut phone), ["HMthe track ahead is reserved for train 58", "MTAS24<;>V0"]);
}

#[test]
fn no_train_runs_on_when_its_phone_is_silent_leaves_or_dies() {
    let mut phone = driving();
    assert_eq!(phone.next_timeout(), None, "it did not ask to be watched");
    phone.handle_line(at(1.0), "*+");
    phone.handle_line(at(5.0), "*");
    assert_eq!(phone.next_timeout(), Some(at(17.0)));
    phone.handle_timeout(at(16.9));
    assert_eq!(outputs(&mut phone), Vec::<String>::new());
    phone.handle_timeout(at(17.0));
    let stopped = ["HMno sign of life for 12 s: your trains were stopped", "MT-S24<;>r", "> speed 24 0"];
    assert_eq!(outputs(&mut phone), stopped);
    assert_eq!(phone.next_timeout(), None, "it drives nothing now");

    let mut phone = driving();
    phone.handle_line(at(1.0), "Q");
    assert_eq!(outputs(&mut phone), ["MT-S24<;>r", "> speed 24 0", "> close"]);

    let mut phone = driving();
    phone.handle_closed();
    assert_eq!(outputs(&mut phone), ["MT-S24<;>r", "> speed 24 0"]);

    let mut phone = driving();
    phone.handle_line(at(1.0), "MT-*<;>r");
    assert_eq!(outputs(&mut phone), ["> speed 24 0", "MT-S24<;>r"]);
}

#[test]
fn power_turnouts_functions_and_the_emergency_stop_are_orders() {
    let mut phone = driving();
    for line in ["PPA1", "PTA2FT11", "PTA2FT12", "PTACLT7", "PTAT7", "MTAS24<;>F10", "MTAS24<;>F00"] {
        phone.handle_line(at(1.0), line);
    }
    for line in ["MTAS24<;>F12", "MTAS24<;>F02", "MTAS24<;>f15", "MTAS24<;>X", "MTAS24<;>V-1", "PPA0"] {
        phone.handle_line(at(1.0), line);
    }
    let turnout = |number, leg| format!("> {:?}", PhoneOrder::Turnout { turnout: TurnoutId(number), leg });
    let function = |number, on| {
        let function = FunctionNumber::new(number).unwrap();
        format!("> {:?}", PhoneOrder::Function { train: TRAIN, function, on })
    };
    assert_eq!(
        outputs(&mut phone),
        [
            "> PowerOn".to_owned(),
            turnout(11, Leg::Curved),
            turnout(12, Leg::Straight),
            turnout(7, Leg::Straight),
            turnout(7, Leg::Curved),
            function(0, true),
            function(2, true),
            function(2, false),
            function(5, true),
            "> EmergencyStop".to_owned(),
            "MTAS24<;>V-1".to_owned(),
            "> EmergencyStop".to_owned(),
            "MTAS24<;>V-1".to_owned(),
            "> EmergencyStop".to_owned(),
        ]
    );
}

proptest! {
    #[test]
    fn no_line_panics_and_only_its_own_trains_get_orders(
        lines in prop::collection::vec("(M[TS0][+A-](\\*|[SL][0-9]{1,5})<;>[VXIRFfqr]-?[0-9VR]{0,4}|\\PC{0,40}|[*NPQ].{0,20})", 0..40),
        pace in 0_u32..20,
        of_step in 0_u8..=7,
        forward in any::<bool>(),
    ) {
        let mut phone = Phone::connected(at(0.0), roster(), railway(0, true));
        for (nth, line) in lines.iter().enumerate() {
            let now = at(nth as f64 * f64::from(pace));
            phone.handle_timeout(now);
            phone.handle_line(now, line);
            phone.handle_railway(now, railway(of_step, forward));
            while let Some(output) = phone.poll_output() {
                if let PhoneOutput::Order(PhoneOrder::Speed { train, step }) = output {
                    prop_assert!(train == TRAIN && step.get() <= 7);
                }
            }
        }
        let _ = ClientLine::read(&lines.concat());
        prop_assert!(FULL_SPEED == 126);
    }
}
