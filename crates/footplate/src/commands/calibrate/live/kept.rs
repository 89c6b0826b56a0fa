//! The session on its way into the store: what is not written down is not measured.

use std::path::Path;

use footplate_core::track::Layout;
use footplate_core::{Event, TrainId};
use footplate_store::{Journal, Store};

use crate::clock::{local, now};
use crate::runtime::Recorder;

/// A journal as the loop's recorder.
pub(super) struct Written(Journal);

impl Written {
    /// Begins a session of a train in a store.
    ///
    /// # Errors
    /// The store cannot be written.
    pub(super) fn begin(path: &Path, layout: &Layout, train: TrainId) -> anyhow::Result<Self> {
        let at = now();
        let name = format!("calibration of train {train}, {}", local(at));
        let store = Store::open_or_create(path)?;
        Ok(Self(Journal::begin(store, &name, layout.name(), Some(at), &[], at)?))
    }

    pub(super) fn end(self) {
        drop(self.0.end());
    }
}

impl Recorder for Written {
    fn record(&mut self, events: &[Event]) -> anyhow::Result<()> {
        self.0.append(events, now())?;
        Ok(())
    }
}
