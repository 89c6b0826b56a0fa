//! A file of instructions, read and checked as a whole before the first train moves.

use std::path::Path;

use anyhow::{Context, bail};

use super::instruction::Instruction;
use super::parse::parse;
use super::reader::Known;

/// The longest script that is read, in bytes: a day of driving.
const LONGEST: u64 = 1 << 20;

/// One instruction and what was written for it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Step {
    /// As it was written, without remarks and spaces around.
    pub(super) text: String,
    pub(super) instruction: Instruction,
    /// Only a part of what was written, and not the last: nothing is said when it has been done.
    pub(super) is_part: bool,
    /// Whether it has been tried before, and waited for its train to be found.
    pub(super) is_again: bool,
}

/// Reads a script.
///
/// # Errors
/// All that is wrong with it, each with its line and column.
pub(super) fn read_script(path: &Path, known: Known<'_>) -> anyhow::Result<Vec<Step>> {
    let named = || format!("reading script `{}`", path.display());
    let size = std::fs::metadata(path).with_context(named)?.len();
    if size > LONGEST {
        bail!("{}: {size} bytes are too many for a script: the limit is {LONGEST}", path.display());
    }
    let text = std::fs::read_to_string(path).with_context(named)?;
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

/// Reads one line.
pub(super) fn step(line: &str, known: Known<'_>) -> Result<Option<Step>, super::words::Mistake> {
    let text = line.split('#').next().unwrap_or_default().trim();
    Ok(parse(line, known)?.map(|instruction| Step {
        text: text.to_owned(),
        instruction,
        is_part: false,
        is_again: false,
    }))
}
