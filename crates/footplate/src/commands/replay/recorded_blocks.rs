//! Which blocks were occupied in a recorded session, from its reports.
//!
//! A recording holds the entries at which trains came in, and when blocks became free. So a block that became free without a
//! train coming in was occupied before: from the start, or because its detector only flickered.

use std::collections::BTreeMap;
use std::iter::Peekable;
use std::vec;

use footplate_core::track::Layout;
use footplate_core::{EventKind, SensorId, Timestamp};
use footplate_store::{Side, Traced};

use crate::recorded::Input;

/// A change of a block: when, its detector, and whether it is occupied from then on.
type Change = (Timestamp, SensorId, bool);

/// The blocks of a recorded session as time goes on.
pub(super) struct RecordedBlocks {
    changes: Peekable<vec::IntoIter<Change>>,
    /// The blocks whose state is known.
    states: BTreeMap<SensorId, bool>,
}

impl RecordedBlocks {
    pub(super) fn of(layout: &Layout, trace: &[Traced]) -> Self {
        let reports = trace.iter().filter(|row| row.side == Side::Input).filter_map(|row| {
            let Ok(Input::Event(event)) = Input::read(&row.kind, &row.text) else { return None };
            match event.kind {
                EventKind::Sensor(report) => {
                    Some((row.time, layout.block_of_entry(report.sensor)?.detector, true))
                }
                EventKind::Freed(report) => Some((row.time, report.sensor, false)),
                _ => None,
            }
        });
        Self::from_reports(reports.collect())
    }

    fn from_reports(mut changes: Vec<Change>) -> Self {
        // Backwards, the change that follows in each block is known.
        let mut next = BTreeMap::new();
        changes.reverse();
        changes.retain(|(_, detector, is_occupied)| {
            next.insert(*detector, *is_occupied) != Some(false) || *is_occupied
        });
        changes.reverse();
        // What a block was before its first change.
        let states = next.into_iter().map(|(detector, is_occupied)| (detector, !is_occupied)).collect();
        Self { changes: changes.into_iter().peekable(), states }
    }

    /// Whether each block is occupied at a time, not before that of an earlier call; without those that never reported.
    pub(super) fn at(&mut self, now: Timestamp) -> impl Iterator<Item = (SensorId, bool)> {
        while let Some((_, detector, is_occupied)) = self.changes.next_if(|(time, ..)| *time <= now) {
            self.states.insert(detector, is_occupied);
        }
        self.states.iter().map(|(detector, is_occupied)| (*detector, *is_occupied))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_that_became_free_first_was_occupied_before() {
        let [left, right] = [SensorId(4), SensorId(5)];
        let at = |seconds: f64| Timestamp::ZERO + footplate_core::TimeSpan::from_s(seconds);
        // By hand: a train runs from the left block into the right one; there the detector flickers at 5 s.
        let reports = vec![
            (at(1.0), right, true),
            (at(2.0), left, false),
            (at(5.0), right, false),
            (at(9.0), right, false),
        ];
        let mut blocks = RecordedBlocks::from_reports(reports);
        let mut occupied = |seconds| -> Vec<SensorId> {
            blocks
                .at(at(seconds))
                .filter(|(_, is_occupied)| *is_occupied)
                .map(|(detector, _)| detector)
                .collect()
        };
        assert_eq!(occupied(0.0), [left]);
        assert_eq!(occupied(1.5), [left, right]);
        assert_eq!(occupied(2.0), [right]);
        assert_eq!(occupied(6.0), [right]);
        assert_eq!(occupied(9.0), []);
        assert_eq!(blocks.at(at(9.0)).count(), 2, "blocks that never reported are not known");
    }
}
