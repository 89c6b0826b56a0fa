//! Where the estimates go: a file that appears when it is complete, or standard output as they come.

use std::io::{self, Write};
use std::path::Path;

use footplate_core::estimation::odometry::MotionEstimate;
use footplate_store::WholeFile;
use footplate_store::odometry::ResultCsv;

use super::STANDARD;

/// Where the estimates go.
pub(super) enum Results<'o> {
    Output(ResultCsv<&'o mut dyn Write>),
    File(ResultCsv<WholeFile>),
}

impl<'o> Results<'o> {
    /// Begins them. `with_runs` says that there are several runs, so that every row names its own.
    pub(super) fn begin(out: &Path, output: &'o mut dyn Write, with_runs: bool) -> io::Result<Self> {
        if out.as_os_str() == STANDARD {
            return Ok(Self::Output(ResultCsv::new(output, with_runs)));
        }
        Ok(Self::File(ResultCsv::new(WholeFile::create(out)?, with_runs)))
    }

    pub(super) fn push(&mut self, run: &str, estimate: &MotionEstimate) -> io::Result<()> {
        match self {
            Self::Output(csv) => csv.push(run, estimate),
            Self::File(csv) => csv.push(run, estimate),
        }
    }

    /// After the estimates of all rows that are there: whoever reads along wants them now.
    pub(super) fn end_block(&mut self) -> io::Result<()> {
        match self {
            Self::Output(csv) => csv.flush(),
            Self::File(_) => Ok(()),
        }
    }

    pub(super) fn finish(self) -> io::Result<()> {
        match self {
            Self::Output(csv) => csv.finish().map(|_| ()),
            Self::File(csv) => csv.finish()?.finish(),
        }
    }
}
