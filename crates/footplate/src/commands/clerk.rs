//! `footplate clerk`: one answer to a browser, worked out from files within limits of memory and time.
//!
//! The dashboard starts it (`dashboard_routes/answer_queue.rs`). It reads a question, a line of JSON, and what belongs to it, and writes the
//! answer. A recording that was made to be large ends this program and nothing else.

use std::io::{BufRead, Read, Write};
use std::path::PathBuf;
use std::process::ExitStatus;

use clap::Args;
use footplate_store::Store;
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::Outcome;
use super::dashboard_routes::{AnswerForm, DrawnLayout, StoreQuery};
use super::odometry::uploaded_page;
use super::written_layout::WrittenLayout;

/// What it is called.
pub(super) const CLERK: &str = "clerk";

/// Memory that an answer may take: an hour of two tachometers takes a sixth of it.
const MEMORY: u64 = 256 << 20;
/// Processor time that an answer may take (s).
const PROCESSOR_S: u64 = 30;
/// How much it stands back behind the program that drives trains, of 19.
#[cfg(unix)]
const NICE: i32 = 10;
/// The longest answer: charts of a long recording take some megabytes.
pub(super) const LONGEST_ANSWER: u64 = 64 << 20;
/// The longest question, a layout among it.
const LONGEST_QUESTION: u64 = 4 << 20;

/// Answers one question of the dashboard.
///
/// Example: the dashboard starts it; people have `footplate odometry` and `footplate report`.
#[derive(Args)]
#[command(hide = true)]
pub(crate) struct Arguments {}

/// What a browser asks.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) enum Question {
    /// The page of a recording that follows.
    Recording { name: String, vehicle: Option<String>, language: String },
    /// Something about a store.
    Store {
        path: PathBuf,
        /// The text of the layout.
        layout: String,
        query: StoreQuery,
    },
    /// Whether the layout that follows, `{"toml": ".."}`, is sound.
    DrawnLayout,
}

impl Arguments {
    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        limit()?;
        let mut input = std::io::stdin().lock();
        let mut line = String::new();
        (&mut input).take(LONGEST_QUESTION).read_line(&mut line)?;
        let answer = match serde_json::from_str(&line)? {
            Question::Recording { name, vehicle, language } => {
                uploaded_page(&name, &mut input, vehicle.as_deref(), AnswerForm::named(language).language())?
            }
            Question::Store { path, layout, query } => {
                let layout = WrittenLayout::of("the session's layout", layout)?.layout;
                let store = if query.writes() { Store::open(&path)? } else { Store::open_to_read(&path)? };
                query.answer(&layout, store)?
            }
            Question::DrawnLayout => {
                serde_json::from_reader::<_, DrawnLayout>(&mut input)?.written()?;
                json!({ "taken": true }).to_string()
            }
        };
        output.write_all(answer.as_bytes())?;
        Ok(Outcome::Done)
    }
}

/// Limits this program before it reads anything.
#[cfg(unix)]
fn limit() -> anyhow::Result<()> {
    use rustix::process::{Resource, Rlimit, nice, setrlimit};
    let at_most = |most| Rlimit { current: Some(most), maximum: Some(most) };
    // All private memory that can be written, on Linux; elsewhere only the heap that grows by `brk`.
    setrlimit(Resource::Data, at_most(MEMORY))?;
    setrlimit(Resource::Cpu, at_most(PROCESSOR_S))?;
    setrlimit(Resource::Core, at_most(0))?;
    nice(NICE)?;
    Ok(())
}

#[cfg(not(unix))]
fn limit() -> anyhow::Result<()> {
    Ok(())
}

/// Which limit ended a clerk, in words for the person who asked.
pub(super) fn limit_that_ended(status: ExitStatus, errors: &str) -> Option<String> {
    let memory = || {
        format!(
            "this takes more than {} MB of memory, which is more than a browser may ask for: use the same \
                 verb in a terminal",
            MEMORY >> 20
        )
    };
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        // By name on all systems: 24 on most.
        let ran_out = [rustix::process::Signal::XCPU.as_raw(), rustix::process::Signal::KILL.as_raw()];
        return Some(if ran_out.contains(&signal) {
            format!("this takes more than {PROCESSOR_S} s of processor time: use the same verb in a terminal")
        } else {
            memory()
        });
    }
    (!status.success() && errors.contains("out of memory")).then(memory)
}
