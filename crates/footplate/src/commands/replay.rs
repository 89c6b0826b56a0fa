//! `footplate replay`: a session decided once more, from what was written down of it.

mod page;
mod pictures;
mod recorded_blocks;
mod session;

use std::io::Write;
use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use footplate_core::{TimeSpan, Timestamp};
use footplate_store::{RecordingKey, Store, StoredMachine, StoredRecording};

use super::Outcome;
use crate::clock::LATEST;
use crate::recorded::{Ending, Extent};
use crate::session_journal::PROGRAM;
use page::Page;
pub(super) use pictures::pictures;
use session::replay_session;

/// Decide a recorded session of driving or calibrating once more, and compare.
///
/// The machine that decided begins again as it began then and receives the same inputs at the same times. Every decision is
/// compared with the recorded one: commands, what it asked of the line, and its notices. The same
/// program decides the same, to the last bit. The notices of another version are worded otherwise and are not compared.
///
/// With --diff a program that decides otherwise shows all that differs. The railway is not there to follow: behind the
/// first command that differs the inputs are still those of then (but for the clock, which wakes it when it asks), so
/// later differences show what would be decided upon what really happened, not what would have come of it.
///
/// Exit status: 0 all the same, 1 something differs, 2 it cannot be replayed.
#[derive(Args)]
#[command(after_help = "\
Examples:
  footplate replay railway.db --list
  footplate replay railway.db
  footplate replay railway.db --session 7 --diff --until 120")]
pub(crate) struct Arguments {
    /// The store in which the session was written down.
    #[arg(value_name = "RECORDING")]
    store: PathBuf,
    /// Which session: its number in the store (see --list), or `latest`.
    #[arg(long, value_name = "N", default_value = "latest", value_parser = chosen)]
    session: Chosen,
    /// List the sessions that can be replayed instead.
    #[arg(long, conflicts_with_all = ["diff", "until"])]
    list: bool,
    /// Show all that differs, not only where it begins.
    #[arg(long)]
    diff: bool,
    /// Only until this time, in seconds on the clock of the session.
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    until: Option<Timestamp>,
    /// Write JSON.
    #[arg(long)]
    json: bool,
}

/// Which session is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Chosen {
    Latest,
    Recording(RecordingKey),
}

fn chosen(text: &str) -> Result<Chosen, String> {
    if text == "latest" {
        return Ok(Chosen::Latest);
    }
    let number = text.parse().map_err(|_| "write the number of a session, or `latest`")?;
    Ok(Chosen::Recording(RecordingKey(number)))
}

fn seconds(text: &str) -> Result<Timestamp, String> {
    let digits = text.strip_suffix('s').unwrap_or(text).trim();
    let seconds = digits.parse::<f64>().ok().filter(|seconds| seconds.is_finite() && *seconds >= 0.0);
    let seconds = seconds.ok_or("write a time in seconds, such as 120 or 12.5s")?;
    Ok(Timestamp::ZERO + TimeSpan::from_s(seconds))
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let store = Store::open_to_read(&self.store)?;
        let machines = store.machines()?;
        let recordings = store.recordings(LATEST)?;
        let page = Page { is_json: self.json, is_diff: self.diff };
        if self.list {
            page.list(&machines, &recordings, output)?;
            return Ok(Outcome::Done);
        }
        let mut outcome = Outcome::Done;
        for machine in self.choose(&machines, &recordings)? {
            let trace = store.trace(machine.key)?;
            let extent = Extent { until: self.until, all: self.diff, notices: machine.program == PROGRAM };
            let replay = replay_session(machine, trace, extent)?;
            page.write(machine, &replay, output)?;
            let stuck = matches!(replay.ending, Ending::Unreadable { .. } | Ending::Gap { .. });
            if stuck || !replay.differences.is_empty() {
                outcome = Outcome::FallsShort;
            }
        }
        Ok(outcome)
    }

    /// The machines of the session that is meant.
    fn choose<'m>(
        &self,
        machines: &'m [StoredMachine],
        recordings: &[StoredRecording],
    ) -> anyhow::Result<Vec<&'m StoredMachine>> {
        let file = self.store.display();
        let recording = match self.session {
            Chosen::Latest => match machines.last() {
                Some(last) => last.recording,
                None => bail!(
                    "{file} holds no session that can be replayed: `footplate drive` and `footplate calibrate --link` \
                     write one down with `--store {file}`"
                ),
            },
            Chosen::Recording(recording) => recording,
        };
        let found: Vec<&StoredMachine> =
            machines.iter().filter(|machine| machine.recording == recording).collect();
        if found.is_empty() {
            if recordings.iter().any(|known| known.key == recording) {
                bail!(
                    "recording {recording} of {file} has no decisions in it: it was read from a file, or made by a \
                     version that did not keep them"
                );
            }
            bail!(
                "{file} has no recording {recording}; `footplate replay {file} --list` lists those that can be replayed"
            );
        }
        Ok(found)
    }
}
