//! What happens while trains are driven, written down in the store before anybody acts on it.

use std::path::Path;

use footplate_core::Event;
use footplate_core::track::Layout;
use footplate_store::{Journal, Store};

use crate::clock::{now, rfc3339};
use crate::runtime::Recorder;

/// A session in the store.
pub(super) struct Written(Journal);

impl Written {
    /// # Errors
    /// The store cannot be written.
    pub(super) fn begin(store: &Path, layout: &Layout) -> anyhow::Result<Self> {
        let at = now();
        let name = format!("drive {}", rfc3339(at));
        Ok(Self(Journal::begin(Store::open_or_create(store)?, &name, layout.name(), Some(at), &[], at)?))
    }
}

impl Recorder for Written {
    fn record(&mut self, events: &[Event]) -> anyhow::Result<()> {
        self.0.append(events, now())?;
        Ok(())
    }
}
