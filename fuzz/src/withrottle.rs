//! Any lines of a phone: nothing panics, each answer is one line, and a phone drives nothing that it was not given.

use footplate_core::track::Leg;
use footplate_core::{SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};
use footplate_wire::withrottle::{
    LONGEST_LINE, Phone, PhoneOrder, PhoneOutput, Railway, RosterTrain, ThrottleKey, TrainState,
};

/// Between two lines.
const STEP: TimeSpan = TimeSpan::from_ms(100);
const TRAINS: [TrainId; 2] = [TrainId(24), TrainId(3850)];

fn roster() -> Vec<RosterTrain> {
    let train = |train: TrainId| RosterTrain {
        key: ThrottleKey { is_long: train.0 > 127, train },
        name: format!("train {train}"),
        speeds: (0..15).map(f64::from).collect(),
    };
    TRAINS.map(train).into()
}

fn railway(power: bool, step: u8) -> Railway {
    let state = |train| TrainState {
        train,
        step: SpeedStep::new(step % 15).unwrap_or_default(),
        forward: step < 128,
        functions: u32::from(step),
    };
    let turnouts = vec![(TurnoutId(1), None), (TurnoutId(2), Some(Leg::Curved))];
    Railway { power: Some(power), trains: TRAINS.map(state).into(), turnouts }
}

pub(crate) fn fuzz(bytes: &[u8]) {
    let mut now = Timestamp::ZERO;
    let mut phone = Phone::connected(now, roster(), railway(true, 0));
    take(&mut phone);
    for line in bytes.split(|byte| matches!(byte, b'\n' | b'\r')).filter(|line| line.len() <= LONGEST_LINE) {
        now += STEP;
        phone.handle_line(now, &String::from_utf8_lossy(line));
        take(&mut phone);
        match line {
            [.., b'!', byte] => phone.handle_railway(now, railway(byte % 2 == 0, *byte)),
            [.., b'?'] => phone.handle_refusal(now, &String::from_utf8_lossy(line)),
            _ => {}
        }
        take(&mut phone);
        if let Some(limit) = phone.next_timeout().filter(|_| line.len() % 5 == 0) {
            assert!(limit > now, "a phone that was just heard is silent");
            phone.handle_timeout(limit);
            take(&mut phone);
            assert!(phone.driven().next().is_none(), "a silent phone keeps no train");
            now = limit;
        }
    }
    let driven: Vec<TrainId> = phone.driven().collect();
    phone.handle_closed();
    let mut stopped = Vec::new();
    while let Some(output) = phone.poll_output() {
        if let PhoneOutput::Order(PhoneOrder::Speed { train, step: SpeedStep::STAND }) = output {
            stopped.push(train);
        }
    }
    assert!(
        driven.iter().all(|train| stopped.contains(train)),
        "{driven:?} were driven, {stopped:?} stopped"
    );
}

fn take(phone: &mut Phone) {
    while let Some(output) = phone.poll_output() {
        match output {
            PhoneOutput::Line(line) => {
                let text = line.to_string();
                assert!(!text.contains(['\n', '\r']), "two lines in one: {text:?}");
            }
            PhoneOutput::Order(PhoneOrder::Speed { train, .. }) => {
                assert!(TRAINS.contains(&train), "train {train} is not on the roster");
            }
            _ => {}
        }
    }
}
