//! Reads a script and checks it as a whole before the first train moves.

use std::path::Path;

use anyhow::{Context, anyhow, bail};
use footplate_store::read_at_most;
use serde::{Deserialize, Serialize};

use super::instruction::{Instruction, parse};
use super::reader::Known;
use crate::comment::without_comment;

/// The largest script, in bytes: about a day of driving.
const LONGEST: usize = 1 << 20;

/// The source of the instructions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum CommandSource {
    /// A file or a program: a train finishes one order before it begins the next.
    Script,
    /// An operator: a new order replaces the previous one.
    Person,
}

/// The number of a queue of steps in a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct QueueId(pub(super) u32);

impl QueueId {
    /// The queue of the session: its script or its operator. Schedules have queues of their own.
    pub(super) const SESSION: Self = Self(0);
}

/// One instruction and the text that it was parsed from.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Step {
    /// The line without its comment and surrounding spaces.
    pub(super) text: String,
    pub(super) instruction: Instruction,
    /// One of several steps that a line expands to, and not the last: its end is not reported.
    pub(super) is_part: bool,
    /// Whether this is the second attempt, after its train was lost and located.
    pub(super) is_retry: bool,
    /// The queue that it belongs to.
    pub(super) queue: QueueId,
    /// The number of its line in a schedule, from 0.
    pub(super) line: usize,
}

/// Reads a script.
///
/// # Errors
/// All mistakes of the script, each with its line and column.
pub(super) fn read_script(path: &Path, known: Known<'_>) -> anyhow::Result<Vec<Step>> {
    let named = || format!("reading script `{}`", path.display());
    // Devices and pipes have no size that could be asked for.
    let bytes = read_at_most(path, LONGEST).with_context(named)?;
    if bytes.len() > LONGEST {
        bail!("{}: too long for a script: the limit is {LONGEST} bytes", path.display());
    }
    let text = std::str::from_utf8(&bytes).map_err(|error| {
        let before = &bytes[..error.valid_up_to()];
        let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
        let byte = 1 + before.iter().rev().take_while(|byte| **byte != b'\n').count();
        anyhow!("{}: line {line}, byte {byte}: not UTF-8; save the script as UTF-8", path.display())
    })?;
    // Editors of some systems begin a file with a mark that is not part of its text.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut steps = Vec::new();
    let mut mistakes = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        match step(line, known) {
            Ok(step) => steps.extend(step),
            Err(mistake) => mistakes.push(format!("{}: line {number}, {mistake}", path.display())),
        }
    }
    if !mistakes.is_empty() {
        bail!("{}", mistakes.join("\n       "));
    }
    Ok(steps)
}

/// Parses one line; `None` for an empty line or a comment.
pub(super) fn step(line: &str, known: Known<'_>) -> Result<Option<Step>, super::words::Mistake> {
    let text = without_comment(line).trim();
    Ok(parse(line, known)?.map(|instruction| Step {
        text: text.to_owned(),
        instruction,
        is_part: false,
        is_retry: false,
        queue: QueueId::SESSION,
        line: 0,
    }))
}
