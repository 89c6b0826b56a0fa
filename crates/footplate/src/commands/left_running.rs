//! Before a session begins: stops trains that an earlier session left running.
//!
//! After a crash a station repeats its last commands, and trains keep running. The store knows such a session: it has no
//! end.

use footplate_core::track::Layout;
use footplate_core::{Command, SpeedStep, TrainId};
use footplate_store::{Store, UnfinishedSession};
use footplate_wire::{Closing, Session};

use crate::link::{Address, Link, Speed, StationSession, open, open_session};
use crate::runtime::Runtime;
use crate::standard_error::say;

/// Opens the link and stops all trains if the newest session of the store has no end. Returns the link for the session that
/// begins; `None` if there is nothing to stop. A simulated railway is new each time.
///
/// # Errors
/// The store cannot be read, or the link cannot be opened.
pub(crate) fn stop_left_running<'l>(
    address: &Address,
    layout: &'l Layout,
    store: &Store,
    pace: Speed,
) -> anyhow::Result<Option<Box<dyn Link + 'l>>> {
    let Some(unfinished) = store.unfinished_session()?.filter(|_| address.simulated().is_none()) else {
        return Ok(None);
    };
    say!("{}", said(&unfinished));
    let mut link = open(address, layout, pace)?;
    let mut session = open_session(address, &link, layout)?;
    recall_directions(&mut session, store)?;
    say!("{}", stop_all(&mut link, session, unfinished.trains));
    say!("{CHECK_TURNOUTS}");
    Ok(Some(link))
}

/// What only a person can see: a computer that lost its power releases no coil, and a train that ran on went over turnouts from
/// the side.
const CHECK_TURNOUTS: &str = "before trains run again, check the turnouts: a train may stand across one that lies for the \
     other track, and a coil that stayed under power may have burnt";

/// Tells a session in which direction the trains of a store were commanded last. Not for a simulated railway, which is new each
/// time.
///
/// # Errors
/// The store cannot be read.
pub(crate) fn recall_directions(session: &mut StationSession, store: &Store) -> anyhow::Result<()> {
    for (train, forward) in store.directions()? {
        session.set_direction(train, forward);
    }
    Ok(())
}

/// Stops trains and switches the power off over a line that has just been opened.
pub(crate) fn stop_all(
    link: &mut dyn Link,
    mut session: StationSession,
    trains: impl IntoIterator<Item = TrainId>,
) -> Closing {
    for train in trains {
        let stop = Command::Speed { train, step: SpeedStep::STAND };
        // Power off stops a train, too, that this station has no address for.
        if let Err(error) = session.handle_command(link.now(), stop) {
            say!("train {train}: {error}");
        }
    }
    Runtime::new(link, session, None, None).close()
}

fn said(unfinished: &UnfinishedSession) -> String {
    let UnfinishedSession { name, trains } = unfinished;
    let trains = trains.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let which = if trains.is_empty() { String::new() } else { format!(": {trains}") };
    format!(
        "the session `{name}` has not ended: every known train may be running and is stopped first{which}"
    )
}
