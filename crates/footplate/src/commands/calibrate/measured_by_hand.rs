//! Which of the files given are measurements by hand, and of which kind.

use std::path::{Path, PathBuf};

use anyhow::bail;
use footplate_store::{PositionSeries, TapedMoves};

/// Files of one kind.
pub(super) enum Given {
    /// Sensor logs, or no files at all.
    Logs,
    /// Series of positions of one start or stop each.
    Positions(Vec<PositionSeries>),
    /// Measured short moves.
    ShortMoves(Vec<TapedMoves>),
}

impl Given {
    /// Finds out what the files are.
    ///
    /// # Errors
    /// A file cannot be read, or they are of several kinds.
    pub(super) fn read(paths: &[PathBuf]) -> anyhow::Result<Self> {
        let mut given: Option<Self> = None;
        for path in paths {
            given = Some(match (given, Self::of_file(path)?) {
                (None, first) => first,
                (Some(Self::Logs), Self::Logs) => Self::Logs,
                (Some(Self::Positions(mut all)), Self::Positions(more)) => {
                    all.extend(more);
                    Self::Positions(all)
                }
                (Some(Self::ShortMoves(mut all)), Self::ShortMoves(more)) => {
                    all.extend(more);
                    Self::ShortMoves(all)
                }
                (Some(before), other) => bail!(
                    "{}: {} and {} cannot be calibrated together: run the command for each kind",
                    path.display(),
                    other.kind(),
                    before.kind()
                ),
            });
        }
        Ok(given.unwrap_or(Self::Logs))
    }

    fn of_file(path: &Path) -> anyhow::Result<Self> {
        // A pipe can be read once only: what comes through one is a log.
        if path.metadata().is_ok_and(|about| !about.is_file() && !about.is_dir()) {
            return Ok(Self::Logs);
        }
        if let Some(series) = PositionSeries::read(path)? {
            return Ok(Self::Positions(vec![series]));
        }
        Ok(TapedMoves::read(path)?.map_or(Self::Logs, |moves| Self::ShortMoves(vec![moves])))
    }

    const fn kind(&self) -> &'static str {
        match self {
            Self::Logs => "sensor logs",
            Self::Positions(_) => "series of positions",
            Self::ShortMoves(_) => "short moves",
        }
    }
}
