//! The last reading of each module and its time: which sensors are newly occupied, and since when at the earliest.

use alloc::vec::Vec;

use footplate_core::{Event, EventKind, Report, SensorId, Timestamp};

use super::s88::ModuleState;

/// The last complete readings of all modules.
///
/// An input is reported once when it closes, not again at every poll that still sees it: it closed once, and only the
/// first reading bounds when. It is reported again when it opens. What the first reading of a module shows may be a memory of before and is not reported.
#[derive(Debug, Clone)]
pub(super) struct Readings {
    modules: Vec<Reading>,
}

#[derive(Debug, Clone, Copy)]
struct Reading {
    state: ModuleState,
    /// When the last bit of the request for it had left; `None` before the first complete reply.
    asked: Option<Timestamp>,
    /// Whether the first two readings are still to come, which tell what is held closed.
    first_two: bool,
}

/// The meaning of one reading of an input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Read {
    /// It closed after the previous reading.
    Closed(Event),
    /// It opened after the previous reading.
    Opened(Event),
    /// It was closed from the start.
    Held(SensorId),
}

impl Readings {
    pub(super) fn new(count: u8) -> Self {
        let reading = |module| Reading { state: ModuleState::all_open(module), asked: None, first_two: true };
        Self { modules: (1..=count).map(reading).collect() }
    }

    /// Whether a state shows an input newly closed.
    pub(super) fn shows_new(&self, state: ModuleState) -> bool {
        self.reading(state.module)
            .is_some_and(|known| known.asked.is_some() && !state.since(known.state).is_open())
    }

    /// Takes the reading of a module that was polled at a time.
    pub(super) fn take(&mut self, asked: Timestamp, state: ModuleState, mut found: impl FnMut(Read)) {
        let Some(at) = usize::from(state.module).checked_sub(1) else { return };
        let Some(known) = self.modules.get_mut(at) else { return };
        if let Some(before) = known.asked {
            if known.first_two {
                known.first_two = false;
                known.state.both(state).closed().for_each(|sensor| found(Read::Held(sensor)));
            }
            let report = |sensor| Report { sensor, poll_interval: Some(asked - before) };
            for sensor in state.since(known.state).closed() {
                found(Read::Closed(Event { time: asked, kind: EventKind::Sensor(report(sensor)) }));
            }
            for sensor in known.state.since(state).closed() {
                found(Read::Opened(Event { time: asked, kind: EventKind::Freed(report(sensor)) }));
            }
        }
        known.asked = Some(asked);
        known.state = state;
    }

    /// The module that was polled longest ago.
    pub(super) fn oldest(&self) -> u8 {
        let oldest = self.modules.iter().min_by_key(|reading| reading.asked);
        oldest.map_or(1, |reading| reading.state.module)
    }

    fn reading(&self, module: u8) -> Option<&Reading> {
        self.modules.get(usize::from(module).checked_sub(1)?)
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::TimeSpan;

    use super::*;

    fn ms(ms: i64) -> Timestamp {
        Timestamp::ZERO + TimeSpan::from_ms(ms)
    }

    fn read(readings: &mut Readings, asked: i64, closed: &[u16]) -> Vec<Read> {
        let state = ModuleState::with_closed(1, closed.iter().map(|input| SensorId(*input)));
        let mut found = Vec::new();
        readings.take(ms(asked), state, |read| found.push(read));
        found
    }

    fn closed(asked: i64, sensor: u16, interval: i64) -> Read {
        let report = Report { sensor: SensorId(sensor), poll_interval: Some(TimeSpan::from_ms(interval)) };
        Read::Closed(Event { time: ms(asked), kind: EventKind::Sensor(report) })
    }

    fn opened(asked: i64, sensor: u16, interval: i64) -> Read {
        let report = Report { sensor: SensorId(sensor), poll_interval: Some(TimeSpan::from_ms(interval)) };
        Read::Opened(Event { time: ms(asked), kind: EventKind::Freed(report) })
    }

    #[test]
    fn an_input_is_reported_once_each_time_it_closes() {
        let mut readings = Readings::new(1);
        assert_eq!(read(&mut readings, 0, &[]), []);
        assert_eq!(read(&mut readings, 60, &[3]), [closed(60, 3, 60)]);
        assert_eq!(read(&mut readings, 120, &[3]), []);
        assert_eq!(read(&mut readings, 180, &[]), [opened(180, 3, 60)]);
        assert_eq!(read(&mut readings, 250, &[3, 4]), [closed(250, 3, 70), closed(250, 4, 70)]);
    }

    #[test]
    fn a_memory_of_before_is_no_report() {
        let mut readings = Readings::new(1);
        assert_eq!(read(&mut readings, 0, &[3, 7]), []);
        assert_eq!(read(&mut readings, 60, &[7]), [Read::Held(SensorId(7)), opened(60, 3, 60)]);
        assert_eq!(read(&mut readings, 120, &[3]), [closed(120, 3, 60), opened(120, 7, 60)]);
        assert_eq!(read(&mut readings, 180, &[3, 7]), [closed(180, 7, 60)]);
    }

    #[test]
    fn a_module_that_is_not_there_is_ignored() {
        let mut readings = Readings::new(1);
        for module in [0, 2, 255] {
            let state = ModuleState::decode(module, [0xff; 2]);
            assert!(!readings.shows_new(state));
            readings.take(ms(0), state, |_| panic!("nothing can have been found"));
        }
    }
}
