//! A living layout: how much faster than real time two trains run, every byte of the line included.
//!
//! The layout is two plain ovals of six sensors, so that the trains never meet.
//! One operation is one second of the layout's time, so 200 µs are 5000 times real time. The host polls five modules
//! without a pause, as programs for real layouts do, and tells one of the trains another step every 10 s.

use footplate_core::track::{Layout, LayoutPlan, Place, RailEnd, Stretch, Survey};
use footplate_core::{Length, SensorId, TimeSpan, TrainId};
use footplate_sim::{FromStation, LivingSwitches, VirtualStation};

use crate::Operation;

const TRAINS: [u16; 2] = [24, 58];
/// Read modules 1 to 5.
const POLL: u8 = 133;
const ANSWER_BYTES: u8 = 10;
/// Between commands, and the steps that trains are commanded in turn: mostly running, now and then standing.
const BETWEEN_COMMANDS_S: u32 = 10;
const STEPS: [u8; 6] = [8, 12, 10, 6, 0, 11];

/// All operations on living layouts.
///
/// # Panics
///
/// When the layout of two ovals is none.
pub fn operations() -> Vec<Operation> {
    vec![
        Operation::with_body("a second of a living layout", "two trains, polled", seconds_of(true)),
        Operation::with_body("a second of a living layout", "two trains, standing", seconds_of(false)),
    ]
}

fn seconds_of(runs: bool) -> impl FnMut(usize) -> f64 {
    let layout = Box::leak(Box::new(two_ovals()));
    let switches = LivingSwitches { turnouts_set: true, ..LivingSwitches::faultless() };
    let Ok(mut station) = VirtualStation::draw(layout, 1, &TRAINS.map(TrainId), &switches) else {
        panic!("an oval is a circuit")
    };
    let mut host = Host { station_is_asked: false, missing: 0, closed: 0, queue: Vec::new() };
    let mut second = 0_u32;
    move |count| {
        for _ in 0..count {
            if runs && second.is_multiple_of(BETWEEN_COMMANDS_S) {
                let nth = (second / BETWEEN_COMMANDS_S) as usize;
                let train = TRAINS[nth % TRAINS.len()];
                host.queue = vec![train as u8, STEPS[(nth / TRAINS.len()) % STEPS.len()]];
            }
            second += 1;
            host.attend(&mut station);
        }
        assert!(station.world.incidents().is_empty(), "{:?}", station.world.incidents());
        f64::from(host.closed)
    }
}

/// Two ovals of six sensors, 60 cm apart.
fn two_ovals() -> Layout {
    let end = |number: u16| RailEnd { node: format!("S{number}"), leg: None };
    let sensor = |number: u16| Place::Sensor {
        names: [format!("S{number}"), format!("R{number}")],
        sensors: [SensorId(2 * number), SensorId(2 * number + 1)],
    };
    let stretch = |number: u16| {
        let next = if number % 6 == 5 { number - 5 } else { number + 1 };
        Stretch { from: end(number), to: end(next), length: Length::from_mm(600.0).into() }
    };
    let plan = LayoutPlan {
        name: "two ovals".to_owned(),
        survey: Survey::taped(Length::from_mm(10.0), "chosen".to_owned()),
        places: (0..12).map(sensor).collect(),
        stretches: (0..12).map(stretch).collect(),
        never_both_curved: Vec::new(),
        zones: Vec::new(),
        blocks: Vec::new(),
    };
    Layout::build(&plan).expect("two ovals are a layout")
}

/// A program that does nothing but poll.
struct Host {
    station_is_asked: bool,
    missing: u8,
    closed: u32,
    /// Bytes to send before the next poll, the last one first.
    queue: Vec<u8>,
}

impl Host {
    /// For one second.
    fn attend(&mut self, station: &mut VirtualStation<'_>) {
        let until = station.now() + TimeSpan::from_ms(1000);
        while station.now() < until {
            if !self.station_is_asked && self.missing == 0 && station.cts() {
                let byte = self.queue.pop();
                station.write(byte.unwrap_or(POLL));
                self.station_is_asked = true;
                self.missing = if byte.is_some() { 0 } else { ANSWER_BYTES };
            }
            match station.advance(until) {
                Some(FromStation::Byte(byte)) => {
                    self.missing -= 1;
                    self.closed += byte.count_ones();
                }
                Some(FromStation::Cts(true)) => self.station_is_asked = false,
                Some(FromStation::Cts(false)) | None => {}
            }
        }
    }
}
