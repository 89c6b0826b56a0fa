//! Trackside contacts as a station reads them: closed by a shoe, held, missed, stuck, or closed by nothing.

use std::collections::{BTreeMap, VecDeque};

use footplate_core::{Ratio, SensorId, TimeSpan};

use crate::draws::Draws;

/// How long a contact that nobody touched stays closed (chosen: a bounce, shorter than any poll).
const SPURIOUS_S: f64 = 0.02;
/// How long a contact that sticks stays closed after the shoe has left it (chosen).
const STUCK_S: core::ops::Range<f64> = 1.0..15.0;

/// No more contacts close by themselves within a second (chosen: all of a large layout at once).
const MOST_SPURIOUS_PER_S: f64 = 100.0;

/// What goes wrong with contacts, and how often.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Faults {
    /// How often any contact fails to close under a shoe.
    pub missed: Ratio,
    /// Contacts that fail more often than the others.
    pub poor: BTreeMap<SensorId, Ratio>,
    /// How often a contact stays closed after the shoe has left it.
    pub stuck: Ratio,
    /// How many contacts close by themselves within a minute, over the whole layout; at most 6000 do.
    pub spurious_per_minute: f64,
}

impl Faults {
    /// How long a contact that nobody touched stays closed.
    pub(crate) const SPURIOUS: TimeSpan = TimeSpan::from_ms((1000.0 * SPURIOUS_S) as i64);

    /// Whether a contact fails to close this time.
    pub(crate) fn misses(&self, sensor: SensorId, draws: &mut Draws) -> bool {
        draws.chance(self.poor.get(&sensor).map_or(self.missed, |poor| *poor).as_parts())
    }

    /// How long a contact stays closed this time after the shoe has left it, in s; mostly 0.
    pub(crate) fn sticks_for_s(&self, draws: &mut Draws) -> f64 {
        if draws.chance(self.stuck.as_parts()) { draws.uniform(STUCK_S) } else { 0.0 }
    }

    /// How many contacts close by themselves in a second.
    pub(crate) fn spurious_per_s(&self) -> f64 {
        (self.spurious_per_minute / 60.0).min(MOST_SPURIOUS_PER_S)
    }
}

/// Why a contact was closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Cause {
    /// The train's shoe is or was on it.
    Train,
    /// The train closed it before the run began, and the station still remembers it.
    Stale,
    /// The train left it, but it sticks.
    Stuck,
    /// Nothing.
    Spurious,
}

/// A contact that was closed for a while.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Closure {
    /// The contact.
    pub(crate) sensor: SensorId,
    /// When it closed, in s.
    pub(crate) closed: f64,
    /// When the shoe left it, in s; infinite until then.
    pub(crate) left: f64,
    /// When it opened, in s; infinite until then.
    pub(crate) opened: f64,
    cause: Cause,
}

impl Closure {
    /// Why a reading at a time saw it closed.
    pub(crate) fn cause_at(&self, before: f64) -> Cause {
        if self.cause == Cause::Train && before > self.left { Cause::Stuck } else { self.cause }
    }
}

/// All contacts of a layout during a run.
#[derive(Debug)]
pub(crate) struct Contacts<'faults> {
    faults: &'faults Faults,
    draws: Draws,
    /// Contacts that exist, to draw spurious ones from.
    sensors: Vec<SensorId>,
    /// Closures that a later reading may still see, in the order in which they closed.
    closures: VecDeque<Closure>,
    /// Closures from before the run that no reading has seen yet.
    before_run: Vec<Closure>,
    next_spurious: f64,
}

impl<'faults> Contacts<'faults> {
    /// All open.
    pub(crate) fn new(faults: &'faults Faults, sensors: Vec<SensorId>, mut draws: Draws) -> Self {
        let next_spurious = draws.waiting(faults.spurious_per_s());
        Self { faults, draws, sensors, closures: VecDeque::new(), before_run: Vec::new(), next_spurious }
    }

    /// A contact closed before the run, and is still held or only remembered by the station, until its
    /// first answer.
    pub(crate) fn remember(&mut self, sensor: SensorId, closed: f64, held: bool) {
        let opened = if held { f64::INFINITY } else { 0.0 };
        self.before_run.push(Closure { sensor, closed, left: opened, opened, cause: Cause::Stale });
    }

    /// The shoe comes onto a contact.
    pub(crate) fn close(&mut self, sensor: SensorId, at: f64) {
        if self.faults.misses(sensor, &mut self.draws) {
            return;
        }
        let (left, opened) = (f64::INFINITY, f64::INFINITY);
        self.closures.push_back(Closure { sensor, closed: at, left, opened, cause: Cause::Train });
    }

    /// The shoe leaves a contact.
    pub(crate) fn leave(&mut self, sensor: SensorId, at: f64) {
        let for_s = self.faults.sticks_for_s(&mut self.draws);
        let closures = self.before_run.iter_mut().chain(&mut self.closures);
        for held in closures.filter(|held| held.sensor == sensor && held.left.is_infinite()) {
            held.left = at;
            held.opened = at + for_s;
        }
    }

    /// What a reading sees that comes after the reading before: the first closure of each closed contact, in
    /// the order of the station's modules.
    pub(crate) fn read(&mut self, before: f64, reading: f64, latched: bool) -> Vec<Closure> {
        while self.next_spurious <= reading {
            let at = self.next_spurious;
            self.next_spurious += self.draws.waiting(self.faults.spurious_per_s());
            let Some(&sensor) = self.sensors.get(self.draws.below(self.sensors.len())) else { continue };
            let opened = at + SPURIOUS_S;
            self.closures.push_back(Closure {
                sensor,
                closed: at,
                left: opened,
                opened,
                cause: Cause::Spurious,
            });
        }
        self.closures.retain(|closure| closure.opened > before);
        if latched {
            self.closures.extend(self.before_run.drain(..));
        } else {
            self.closures.extend(self.before_run.extract_if(.., |closure| closure.left.is_infinite()));
        }
        let mut seen: Vec<Closure> = self
            .closures
            .iter()
            .filter(|closure| closure.closed <= reading && (latched || closure.opened > reading))
            .copied()
            .collect();
        seen.sort_by(|a, b| a.sensor.cmp(&b.sensor).then(a.closed.total_cmp(&b.closed)));
        seen.dedup_by_key(|closure| closure.sensor);
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Purpose;

    const HERE: SensorId = SensorId(4);
    const THERE: SensorId = SensorId(2);

    fn contacts(faults: &Faults) -> Contacts<'_> {
        Contacts::new(faults, vec![HERE, THERE], Draws::new(5, Purpose::Faults))
    }

    #[test]
    fn a_held_contact_is_seen_by_every_reading_until_it_opens() {
        let faults = Faults::default();
        let mut contacts = contacts(&faults);
        contacts.close(HERE, 1.01);
        assert!(contacts.read(0.9, 1.0, true).is_empty());
        assert_eq!(contacts.read(1.0, 1.1, true)[0].closed, 1.01);
        contacts.leave(HERE, 1.15);
        assert_eq!(
            contacts.read(1.1, 1.2, true).len(),
            1,
            "the station remembers what opened before it read"
        );
        assert!(contacts.read(1.2, 1.3, true).is_empty());
    }

    #[test]
    fn without_a_memory_a_contact_that_opened_again_is_lost() {
        let faults = Faults::default();
        let mut contacts = contacts(&faults);
        contacts.close(HERE, 1.01);
        contacts.leave(HERE, 1.05);
        contacts.close(THERE, 1.06);
        let seen = contacts.read(1.0, 1.1, false);
        assert_eq!(seen.iter().map(|closure| closure.sensor).collect::<Vec<_>>(), [THERE]);
    }

    #[test]
    fn a_stuck_contact_is_told_apart_from_one_the_shoe_holds() {
        let faults = Faults { stuck: Ratio::from_percent(100.0), ..Faults::default() };
        let mut contacts = contacts(&faults);
        contacts.close(HERE, 1.01);
        contacts.leave(HERE, 1.05);
        assert_eq!(contacts.read(1.0, 1.1, true)[0].cause_at(1.0), Cause::Train);
        assert_eq!(contacts.read(1.1, 1.2, true)[0].cause_at(1.1), Cause::Stuck);
    }

    #[test]
    fn contacts_are_missed_as_often_as_asked() {
        let poor = BTreeMap::from([(THERE, Ratio::from_percent(50.0))]);
        let faults = Faults { missed: Ratio::from_percent(2.0), poor, ..Faults::default() };
        let mut contacts = contacts(&faults);
        let mut seen = [0, 0];
        for second in 0..10_000 {
            let at = f64::from(second);
            for sensor in [HERE, THERE] {
                contacts.close(sensor, at + 0.1);
                contacts.leave(sensor, at + 0.2);
            }
            for closure in contacts.read(at - 0.5, at + 0.5, true) {
                seen[usize::from(closure.sensor == THERE)] += 1;
            }
        }
        // 9800 and 5000 expected, within four standard deviations.
        assert!((9744..=9856).contains(&seen[0]) && (4800..=5200).contains(&seen[1]), "{seen:?}");
    }

    #[test]
    fn contacts_close_by_themselves_as_often_as_asked() {
        let faults = Faults { spurious_per_minute: 3.0, ..Faults::default() };
        let mut contacts = contacts(&faults);
        let read = |second| contacts.read(f64::from(second), f64::from(second) + 1.0, true).len();
        // 500 expected in 10,000 s (a few fall into one second), within four standard deviations.
        let seen: usize = (0..10_000).map(read).sum();
        assert!((400..=590).contains(&seen), "{seen}");
    }
}
