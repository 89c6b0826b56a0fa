//! Before a session begins: stops trains that an earlier session left running.
//!
//! After a crash a station repeats its last commands, and trains keep running. The store knows such a session: it has no
//! end. A store that cannot be read does not tell, so it counts as one with such a session. Nothing that can fail comes
//! before the stops: no layout, model or script is needed for them.

use std::path::Path;

use anyhow::Context;
use footplate_core::{Command, SpeedStep, TrainId};
use footplate_store::{Store, UnfinishedSession};
use footplate_wire::{Closing, Session};

use crate::link::{Address, Link, OpenSession, open_cable, open_session_to_stop};
use crate::runtime::Runtime;
use crate::standard_error::say;

/// Stops all trains over a link if the newest session of the store has no end, or if the store is damaged or cannot be
/// opened. `trains` are those of the command line. Returns the link for the session that begins; `None` if there was
/// nothing to stop. A simulated railway is new each time.
///
/// # Errors
/// The store is damaged or cannot be opened: nothing may be written to it, which could overwrite what can still be salvaged.
/// Or trains are to be stopped, and the link cannot be opened.
pub(crate) fn stop_left_running(
    address: &Address,
    path: Option<&Path>,
    trains: &[TrainId],
) -> anyhow::Result<Option<Box<dyn Link>>> {
    let Some(path) = path.filter(|path| path.try_exists().unwrap_or(true)) else { return Ok(None) };
    let opened = Store::open(path);
    if address.simulated().is_some() {
        opened?.check()?;
        return Ok(None);
    }
    let store = opened.inspect_err(|_| stop_without_store(address, None, trains))?;
    // What only the check finds may be the end of a session, or the whole session.
    let found = store.unfinished_session().and_then(|unfinished| match unfinished {
        Some(unfinished) => Ok(Some(unfinished)),
        None => store.check().map(|()| None),
    });
    let Some(unfinished) = found.inspect_err(|_| stop_without_store(address, Some(&store), trains))? else {
        return Ok(None);
    };
    say!("{}", said(&unfinished));
    let known = unfinished.trains.iter().chain(trains).copied();
    let link = stop_over(address, Some(&store), false, known)
        .context("no train could be stopped: stop all trains by hand")?;
    store.check()?;
    Ok(Some(link))
}

/// Says that trains may be running if the newest session of a store has no end, where no link is known to stop them over.
///
/// # Errors
/// The store is damaged or cannot be opened.
pub(crate) fn warn_of_left_running(path: &Path) -> anyhow::Result<()> {
    if !path.try_exists().unwrap_or(true) {
        return Ok(());
    }
    let store = Store::open(path).inspect_err(|_| say!("{CANNOT_TELL}; {NO_LINK}"))?;
    let unfinished = store.unfinished_session().inspect_err(|_| say!("{CANNOT_TELL}; {NO_LINK}"))?;
    if let Some(UnfinishedSession { name, .. }) = unfinished {
        say!("the session `{name}` has not ended: every known train may be running; {NO_LINK}");
    }
    Ok(())
}

/// A store of which nothing is known.
const CANNOT_TELL: &str =
    "the store cannot tell whether its last session has ended: every train may be running";
/// What a person does where no link is known.
const NO_LINK: &str = "no link is set up to stop trains over: stop them by hand, or start with `--link`";

/// Stops all trains if a store cannot be read. Its own error is reported afterwards, whatever becomes of the stops.
fn stop_without_store(address: &Address, store: Option<&Store>, trains: &[TrainId]) {
    say!("{CANNOT_TELL}, and all are stopped first");
    let known = store.map(Store::known_trains).unwrap_or_default().into_iter().chain(trains.iter().copied());
    if let Err(error) = stop_over(address, store, true, known) {
        say!("no train could be stopped: {error:#}; stop all trains by hand");
    }
}

/// Opens the link, stops trains and switches the power off. `all`: also trains of unknown number, where the station can.
fn stop_over(
    address: &Address,
    store: Option<&Store>,
    all: bool,
    trains: impl IntoIterator<Item = TrainId>,
) -> anyhow::Result<Box<dyn Link>> {
    let cable = address.cable().context("a simulated railway has no line")?;
    let mut link = open_cable(cable)?;
    let mut opened = open_session_to_stop(address, &link)?;
    // A train of unknown direction is stopped together with all others.
    let _ = store.map(|store| recall_directions(opened.session.as_mut(), store, []));
    if all {
        opened.session.stop_all();
    }
    say!("{}", stop_all(&mut link, opened, trains));
    say!("{CHECK_TURNOUTS}");
    Ok(link)
}

/// What only a person can see: a computer that lost its power releases no coil, and a train that ran on went over turnouts from
/// the side.
const CHECK_TURNOUTS: &str = "before trains run again, check the turnouts: a train may stand across one that lies for the \
     other track, and a coil that stayed under power may have burnt";

/// Tells a session in which direction the trains of a store were commanded last. If the newest session there has no end, the station is
/// asked, too, how `trains` run: a reversal, or all of them, may not have been written down. Not for a simulated railway, which is
/// new each time.
///
/// # Errors
/// The store cannot be read.
pub(crate) fn recall_directions(
    session: &mut dyn Session,
    store: &Store,
    trains: impl IntoIterator<Item = TrainId>,
) -> anyhow::Result<()> {
    for (train, forward) in store.directions()? {
        session.set_direction(train, forward);
    }
    if store.unfinished_session()?.is_some() {
        trains.into_iter().for_each(|train| session.check_direction(train));
    }
    Ok(())
}

/// Stops trains and switches the power off over a line that has just been opened.
pub(crate) fn stop_all(
    link: &mut dyn Link,
    mut opened: OpenSession,
    trains: impl IntoIterator<Item = TrainId>,
) -> Closing {
    for train in trains {
        // The session that begins next compares it, too: what the station says must not be overwritten now.
        opened.session.check_direction(train);
        let stop = Command::Speed { train, step: SpeedStep::STAND };
        // Power off stops a train, too, that this station has no address for.
        if let Err(error) = opened.session.handle_command(link.now(), stop) {
            say!("train {train}: {error}");
        }
    }
    Runtime::new(link, opened, None, None).close()
}

fn said(unfinished: &UnfinishedSession) -> String {
    let UnfinishedSession { name, trains } = unfinished;
    let trains = trains.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let which = if trains.is_empty() { String::new() } else { format!(": {trains}") };
    format!(
        "the session `{name}` has not ended: every known train may be running and is stopped first{which}"
    )
}
