//! Trackside sensors as a station reads them: closed by a shoe, missed, stuck, or spurious.

use std::collections::{BTreeMap, VecDeque};

use footplate_core::{Ratio, SensorId, TimeSpan};

use crate::draws::Draws;

/// How long a spurious actuation lasts (chosen: a bounce, shorter than any poll).
const SPURIOUS_S: f64 = 0.02;
/// How long a stuck sensor stays closed after the shoe has left it (chosen).
const STUCK_S: core::ops::Range<f64> = 1.0..15.0;

/// Largest rate of spurious actuations (chosen: all sensors of a large layout at once).
const MAX_SPURIOUS_PER_S: f64 = 100.0;

/// The faults of sensors, and their rates.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Faults {
    /// Probability that a sensor misses a shoe.
    pub missed: Ratio,
    /// Sensors with a higher probability of a miss.
    pub poor: BTreeMap<SensorId, Ratio>,
    /// Probability that a sensor stays closed after the shoe has left it.
    pub stuck: Ratio,
    /// Spurious actuations per minute over the whole layout, at most 6000.
    pub spurious_per_minute: f64,
    /// Probability that a train's dirty wheels interrupt the current that the detector of a block senses.
    pub flicker: Ratio,
}

impl Faults {
    /// How long a spurious actuation lasts.
    pub(crate) const SPURIOUS: TimeSpan = TimeSpan::from_ms((1000.0 * SPURIOUS_S) as i64);

    /// Draws whether a sensor misses this passage.
    pub(crate) fn misses(&self, sensor: SensorId, draws: &mut Draws) -> bool {
        draws.chance(self.poor.get(&sensor).map_or(self.missed, |poor| *poor).as_parts())
    }

    /// Draws how long a sensor stays closed after this passage, in s; mostly 0.
    pub(crate) fn sticks_for_s(&self, draws: &mut Draws) -> f64 {
        if draws.chance(self.stuck.as_parts()) { draws.uniform(STUCK_S) } else { 0.0 }
    }

    /// Spurious actuations per second.
    pub(crate) fn spurious_per_s(&self) -> f64 {
        (self.spurious_per_minute / 60.0).min(MAX_SPURIOUS_PER_S)
    }
}

/// Why a sensor was closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Cause {
    /// The train's shoe is or was on it.
    Train,
    /// The train closed it before the run began; the station still remembers it.
    Stale,
    /// The train left it, but it is stuck.
    Stuck,
    /// No train: spurious.
    Spurious,
}

/// A sensor that was closed for a while.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Actuation {
    /// The sensor.
    pub(crate) sensor: SensorId,
    /// When it closed, in s.
    pub(crate) closed: f64,
    /// When the shoe left it, in s; infinite until then.
    pub(crate) left: f64,
    /// When it opened, in s; infinite until then.
    pub(crate) opened: f64,
    cause: Cause,
}

impl Actuation {
    /// The cause, as seen by a reading that follows one at `before`.
    pub(crate) fn cause_at(&self, before: f64) -> Cause {
        if self.cause == Cause::Train && before > self.left { Cause::Stuck } else { self.cause }
    }
}

/// All sensors of a layout during a run.
#[derive(Debug)]
pub(crate) struct Sensors<'faults> {
    faults: &'faults Faults,
    draws: Draws,
    /// The sensors from which spurious actuations are drawn.
    sensors: Vec<SensorId>,
    /// Actuations that a later reading may still see, in the order in which they began.
    actuations: VecDeque<Actuation>,
    /// Actuations from before the run that no reading has seen yet.
    before_run: Vec<Actuation>,
    next_spurious: f64,
}

impl<'faults> Sensors<'faults> {
    /// All open.
    pub(crate) fn new(faults: &'faults Faults, sensors: Vec<SensorId>, mut draws: Draws) -> Self {
        let next_spurious = draws.waiting(faults.spurious_per_s());
        Self { faults, draws, sensors, actuations: VecDeque::new(), before_run: Vec::new(), next_spurious }
    }

    /// A sensor was closed before the run, and is still closed or only remembered by the station until its first
    /// answer.
    pub(crate) fn remember(&mut self, sensor: SensorId, closed: f64, is_closed: bool) {
        let opened = if is_closed { f64::INFINITY } else { 0.0 };
        self.before_run.push(Actuation { sensor, closed, left: opened, opened, cause: Cause::Stale });
    }

    /// The shoe reaches a sensor.
    pub(crate) fn close(&mut self, sensor: SensorId, at: f64) {
        if self.faults.misses(sensor, &mut self.draws) {
            return;
        }
        let (left, opened) = (f64::INFINITY, f64::INFINITY);
        self.actuations.push_back(Actuation { sensor, closed: at, left, opened, cause: Cause::Train });
    }

    /// The shoe leaves a sensor.
    pub(crate) fn leave(&mut self, sensor: SensorId, at: f64) {
        let for_s = self.faults.sticks_for_s(&mut self.draws);
        let actuations = self.before_run.iter_mut().chain(&mut self.actuations);
        for actuation in actuations.filter(|one| one.sensor == sensor && one.left.is_infinite()) {
            actuation.left = at;
            actuation.opened = at + for_s;
        }
    }

    /// What a reading sees after the one at `before`: the first actuation of each closed sensor, in the order of the
    /// station's modules.
    pub(crate) fn read(&mut self, before: f64, reading: f64, latched: bool) -> Vec<Actuation> {
        while self.next_spurious <= reading {
            let at = self.next_spurious;
            self.next_spurious += self.draws.waiting(self.faults.spurious_per_s());
            let Some(&sensor) = self.sensors.get(self.draws.below(self.sensors.len())) else { continue };
            let opened = at + SPURIOUS_S;
            self.actuations.push_back(Actuation {
                sensor,
                closed: at,
                left: opened,
                opened,
                cause: Cause::Spurious,
            });
        }
        self.actuations.retain(|actuation| actuation.opened > before);
        if latched {
            self.actuations.extend(self.before_run.drain(..));
        } else {
            self.actuations.extend(self.before_run.extract_if(.., |actuation| actuation.left.is_infinite()));
        }
        let mut seen: Vec<Actuation> = self
            .actuations
            .iter()
            .filter(|actuation| actuation.closed <= reading && (latched || actuation.opened > reading))
            .copied()
            .collect();
        seen.sort_by(|a, b| a.sensor.cmp(&b.sensor).then(a.closed.total_cmp(&b.closed)));
        seen.dedup_by_key(|actuation| actuation.sensor);
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Purpose;

    const HERE: SensorId = SensorId(4);
    const THERE: SensorId = SensorId(2);

    fn sensors(faults: &Faults) -> Sensors<'_> {
        Sensors::new(faults, vec![HERE, THERE], Draws::new(5, Purpose::Faults))
    }

    #[test]
    fn a_closed_sensor_is_seen_by_every_reading_until_it_opens() {
        let faults = Faults::default();
        let mut sensors = sensors(&faults);
        sensors.close(HERE, 1.01);
        assert!(sensors.read(0.9, 1.0, true).is_empty());
        assert_eq!(sensors.read(1.0, 1.1, true)[0].closed, 1.01);
        sensors.leave(HERE, 1.15);
        assert_eq!(sensors.read(1.1, 1.2, true).len(), 1, "the station remembers what opened before it read");
        assert!(sensors.read(1.2, 1.3, true).is_empty());
    }

    #[test]
    fn without_latching_a_sensor_that_opened_again_is_missed() {
        let faults = Faults::default();
        let mut sensors = sensors(&faults);
        sensors.close(HERE, 1.01);
        sensors.leave(HERE, 1.05);
        sensors.close(THERE, 1.06);
        let seen = sensors.read(1.0, 1.1, false);
        assert_eq!(seen.iter().map(|actuation| actuation.sensor).collect::<Vec<_>>(), [THERE]);
    }

    #[test]
    fn a_stuck_sensor_is_distinguished_from_one_under_a_shoe() {
        let faults = Faults { stuck: Ratio::from_percent(100.0), ..Faults::default() };
        let mut sensors = sensors(&faults);
        sensors.close(HERE, 1.01);
        sensors.leave(HERE, 1.05);
        assert_eq!(sensors.read(1.0, 1.1, true)[0].cause_at(1.0), Cause::Train);
        assert_eq!(sensors.read(1.1, 1.2, true)[0].cause_at(1.1), Cause::Stuck);
    }

    #[test]
    fn sensors_miss_trains_at_the_given_rate() {
        let poor = BTreeMap::from([(THERE, Ratio::from_percent(50.0))]);
        let faults = Faults { missed: Ratio::from_percent(2.0), poor, ..Faults::default() };
        let mut sensors = sensors(&faults);
        let mut seen = [0, 0];
        for second in 0..10_000 {
            let at = f64::from(second);
            for sensor in [HERE, THERE] {
                sensors.close(sensor, at + 0.1);
                sensors.leave(sensor, at + 0.2);
            }
            for actuation in sensors.read(at - 0.5, at + 0.5, true) {
                seen[usize::from(actuation.sensor == THERE)] += 1;
            }
        }
        // 9800 and 5000 expected, within four standard deviations.
        assert!((9744..=9856).contains(&seen[0]) && (4800..=5200).contains(&seen[1]), "{seen:?}");
    }

    #[test]
    fn spurious_actuations_have_the_given_rate() {
        let faults = Faults { spurious_per_minute: 3.0, ..Faults::default() };
        let mut sensors = sensors(&faults);
        let read = |second| sensors.read(f64::from(second), f64::from(second) + 1.0, true).len();
        // 500 expected in 10,000 s (a few fall into one second), within four standard deviations.
        let seen: usize = (0..10_000).map(read).sum();
        assert!((400..=590).contains(&seen), "{seen}");
    }
}
