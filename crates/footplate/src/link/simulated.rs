//! A virtual station in this process: on a clock of its own, or paced at a multiple of real time.

use std::collections::VecDeque;
use std::time::Duration;

use footplate_core::{TimeSpan, Timestamp};

use super::address::Speed;
use super::line::PERSON_MS;
use super::simulated_station::{FromSimulated, SimulatedStation};
use super::{Heard, Link, Lost};
use crate::clock::Stopwatch;

/// A virtual clock that is not paced makes steps of this size at most, so that orders are looked for.
const VIRTUAL_PATIENCE: TimeSpan = TimeSpan::from_ms(1_000);

/// A link into a simulated world.
pub(crate) struct SimulatedLink<'l> {
    station: SimulatedStation<'l>,
    /// Bytes of the last portion that were not handed over yet.
    heard: VecDeque<u8>,
    speed: Speed,
    began: Timestamp,
    stopwatch: Stopwatch,
}

impl<'l> SimulatedLink<'l> {
    pub(crate) fn new(station: impl Into<SimulatedStation<'l>>, speed: Speed) -> Self {
        let station = station.into();
        let began = station.now();
        Self { station, heard: VecDeque::new(), speed, began, stopwatch: Stopwatch::start() }
    }

    /// The station and the world behind it: for operator intervention and for scorers.
    pub(crate) fn station(&self) -> &SimulatedStation<'l> {
        &self.station
    }

    /// The same, to change the world with.
    pub(crate) fn station_mut(&mut self) -> &mut SimulatedStation<'l> {
        &mut self.station
    }

    /// Waits until real time catches up with the station's.
    fn keep_pace(&self) {
        if let Speed::Times(times) = self.speed {
            let due = Duration::from_secs_f64(((self.station.now() - self.began).as_s() / times).max(0.0));
            if let Some(ahead) = due.checked_sub(self.stopwatch.elapsed()) {
                std::thread::sleep(ahead);
            }
        }
    }
}

impl Link for SimulatedLink<'_> {
    fn now(&self) -> Timestamp {
        self.station.now()
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Lost> {
        self.station.write(bytes);
        Ok(())
    }

    fn wait(&mut self, until: Timestamp) -> Heard {
        if let Some(byte) = self.heard.pop_front() {
            return Heard::Byte(byte);
        }
        let heard = self.station.advance(until);
        self.keep_pace();
        match heard {
            Some(FromSimulated::Bytes(bytes)) => {
                self.heard = bytes;
                self.heard.pop_front().map_or(Heard::Nothing, Heard::Byte)
            }
            Some(FromSimulated::Datagram(_, datagram)) => Heard::Datagram(datagram),
            Some(FromSimulated::Cts(up)) => Heard::Cts(up),
            None => Heard::Nothing,
        }
    }

    fn cts(&self) -> Option<bool> {
        self.station.cts()
    }

    fn patience(&self) -> TimeSpan {
        match self.speed {
            Speed::Unpaced => VIRTUAL_PATIENCE,
            Speed::Times(times) => TimeSpan::from_s(PERSON_MS * 1e-3 * times),
        }
    }

    fn real_time(&self) -> Duration {
        self.stopwatch.elapsed()
    }

    fn reopen(&mut self) -> Result<(), Lost> {
        self.station.connect();
        Ok(())
    }
}
