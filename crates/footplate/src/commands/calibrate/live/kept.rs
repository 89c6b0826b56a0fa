//! The session, written into the store as it runs: what is not written down is not measured.

use std::path::Path;

use footplate_core::track::Layout;
use footplate_core::{Timestamp, TrainId};
use footplate_store::{Journal, NewMachine, Store};

use super::beginning::CalibrationBeginning;
use crate::clock::{local, now_after};
use crate::link::Address;
use crate::session_journal::{IfUnkept, PROGRAM, SessionJournal, WhenFull};
use crate::standard_error::say;

/// Begins a session of a train in a store; the line's clock stands at `at`.
///
/// # Errors
/// The store cannot be written.
pub(super) fn begin(
    path: &Path,
    layout: &Layout,
    train: TrainId,
    link: &Address,
    at: Timestamp,
    beginning: &CalibrationBeginning,
) -> anyhow::Result<SessionJournal> {
    let store = Store::open_or_create(path)?;
    let now = now_after(store.newest_stamp()?);
    let began_at = now + (Timestamp::ZERO - at);
    let name = format!("calibration of train {train}, {}", local(now));
    let mut journal = Journal::begin(store, &name, layout.name(), Some(began_at), &[], now)?;
    let body = serde_json::to_string(beginning)?;
    journal
        .begin_machine(NewMachine { kind: CalibrationBeginning::KIND, program: PROGRAM, body: &body }, now)?;
    // A simulated clock stands still for a slow disk; trains on a real track do not.
    let when_full = if link.simulated().is_some() { WhenFull::Wait } else { WhenFull::Lose };
    Ok(SessionJournal::start(journal, Some(began_at), when_full, IfUnkept::Stop)?)
}

/// Writes down what still waits, and says if anything is lost.
pub(super) fn end(journal: SessionJournal) {
    let (kept, _) = journal.finish();
    if let Some(trouble) = kept.trouble {
        say!("the end of the session was not recorded: {trouble}");
    }
}
