//! The machine of a session made again, with its recorded inputs.

use anyhow::{Context, bail};
use footplate_store::{StoredMachine, Traced};
use serde::de::DeserializeOwned;

use crate::commands::calibrate::CalibrationBeginning;
use crate::commands::demo::TourBeginning;
use crate::commands::drive::DriveBeginning;
use crate::commands::written_layout::WrittenLayout;
use crate::recorded::{Extent, Replay, replay};
use crate::session_journal::PROGRAM;

/// Makes a machine as it began, and compares what it decides now with what it decided then.
///
/// # Errors
/// This program cannot make the machine: what it is made of is damaged, or of another version.
pub(super) fn replay_session(
    stored: &StoredMachine,
    trace: Vec<Traced>,
    extent: Extent,
) -> anyhow::Result<Replay> {
    if !stored.is_whole {
        bail!(
            "how the machine of recording {} began is not what was written down: the store is damaged",
            stored.recording
        );
    }
    match stored.kind.as_str() {
        DriveBeginning::KIND => {
            let beginning: DriveBeginning = read(stored)?;
            Ok(replay(&mut beginning.script_runner()?, trace, extent))
        }
        CalibrationBeginning::KIND => {
            let beginning: CalibrationBeginning = read(stored)?;
            let layout = WrittenLayout::of("the layout of the session", beginning.layout.clone())?.layout;
            Ok(replay(&mut beginning.calibrator(&layout), trace, extent))
        }
        TourBeginning::KIND => {
            let beginning: TourBeginning = read(stored)?;
            let layout = WrittenLayout::of("the layout of the session", beginning.layout.clone())?.layout;
            Ok(replay(&mut beginning.driver(&layout), trace, extent))
        }
        other => bail!(
            "recording {} was decided by a machine of the kind `{other}`, which this version ({}) does not have; it \
             was recorded by version {}",
            stored.recording,
            PROGRAM,
            stored.program
        ),
    }
}

pub(super) fn read<B: DeserializeOwned>(stored: &StoredMachine) -> anyhow::Result<B> {
    serde_json::from_str(&stored.body).with_context(|| {
        format!(
            "the machine of recording {} began as version {} of the program knew it, and this one ({}) misses something",
            stored.recording,
            stored.program,
            PROGRAM
        )
    })
}
