//! A queue of what is due later.

use footplate_core::{TimeSpan, Timestamp};

/// Reports of one sensor are at least this far apart, so that they stay in order.
const REPORTS_APART: TimeSpan = TimeSpan::from_us(100);

/// Items that are due at a time; of those due at one time, the one that was added first comes first.
#[derive(Debug, Clone)]
pub(crate) struct DueQueue<T>(Vec<(Timestamp, T)>);

impl<T> DueQueue<T> {
    pub(crate) const fn new() -> Self {
        Self(Vec::new())
    }

    pub(crate) fn add(&mut self, due: Timestamp, item: T) {
        self.0.push((due, item));
    }

    /// Adds an item, due after all items of the same sensor.
    pub(crate) fn add_report(&mut self, due: Timestamp, item: T, is_same_sensor: impl Fn(&T) -> bool) {
        let last = self.0.iter().filter(|(_, other)| is_same_sensor(other)).map(|(due, _)| *due).max();
        self.add(last.map_or(due, |last| due.max(last + REPORTS_APART)), item);
    }

    /// When the first item is due.
    pub(crate) fn due(&self) -> Option<Timestamp> {
        self.0.iter().map(|(due, _)| *due).min()
    }

    /// Takes the first item.
    pub(crate) fn take(&mut self) -> Option<T> {
        let first = self.0.iter().enumerate().min_by_key(|(_, (due, _))| *due)?.0;
        Some(self.0.remove(first).1)
    }

    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }
}
