//! How far a file has been read, shown to a person who waits.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::time::Duration;

use footplate_store::open_file;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// What ends sooner shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// A file that shows on standard error how far it has been read, if that takes long and is a terminal.
pub(crate) struct ProgressReader {
    file: File,
    bar: ProgressBar,
    shown: bool,
}

impl ProgressReader {
    /// Opens the file at `path`.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        let (file, about) = open_file(path)?;
        let bar = ProgressBar::with_draw_target(Some(about.len()), ProgressDrawTarget::hidden());
        if let Ok(style) = ProgressStyle::with_template("{msg} {bar:30} {bytes} of {total_bytes}, {eta} left")
        {
            bar.set_style(style);
        }
        bar.set_message(path.display().to_string());
        Ok(Self { file, bar, shown: false })
    }
}

impl Read for ProgressReader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        self.bar.inc(count as u64);
        if !self.shown && self.bar.elapsed() >= PATIENCE {
            self.shown = true;
            // Nothing is drawn where standard error is no terminal.
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        Ok(count)
    }
}

impl Drop for ProgressReader {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
