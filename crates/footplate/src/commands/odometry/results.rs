//! Where the estimates go: a file that appears when it is complete, or standard output as they come.

use std::io::{self, Write};
use std::path::Path;

use anyhow::Context;
use footplate_core::odometry::MotionEstimate;
use footplate_store::odometry::{LiveResult, ResultWriter};
use footplate_store::{TableForm, WholeFile};

use super::STANDARD;

/// Where the estimates go.
pub(super) enum Results<'o> {
    Output(LiveResult<&'o mut dyn Write>),
    File(ResultWriter<WholeFile>),
}

impl<'o> Results<'o> {
    /// Begins them. `with_runs` says that there are several runs, so that every row names its own; `warning` holds for all of them.
    pub(super) fn begin(
        out: &Path,
        output: &'o mut dyn Write,
        with_runs: bool,
        warning: Option<&str>,
    ) -> anyhow::Result<Self> {
        if out.as_os_str() == STANDARD {
            return Ok(Self::Output(LiveResult::new(output, with_runs)));
        }
        let form = TableForm::of_path(out)?;
        let begun = WholeFile::create(out).and_then(|file| ResultWriter::new(file, form, with_runs, warning));
        Ok(Self::File(begun.with_context(|| format!("writing {}", out.display()))?))
    }

    pub(super) fn push(&mut self, run: &str, estimate: &MotionEstimate) -> io::Result<()> {
        match self {
            Self::Output(result) => result.push(run, estimate),
            Self::File(result) => result.push(run, estimate),
        }
    }

    /// After the estimates of all rows that are there: a program that reads along needs them now.
    pub(super) fn end_block(&mut self) -> io::Result<()> {
        match self {
            Self::Output(result) => result.flush(),
            Self::File(_) => Ok(()),
        }
    }

    pub(super) fn finish(self) -> io::Result<()> {
        match self {
            Self::Output(mut result) => result.flush(),
            Self::File(result) => result.finish()?.finish(),
        }
    }
}
