//! Files in one piece: written so that whoever looks finds the old one or the new one, never half of it, and read up to a limit.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// A file that is being written beside the one whose place it will take.
#[derive(Debug)]
pub struct WholeFile {
    file: File,
    path: PathBuf,
    unfinished: PathBuf,
    is_finished: bool,
}

impl WholeFile {
    /// Begins a file of its own beside `path`.
    ///
    /// # Errors
    /// What the system said; `path` is then what it was before.
    pub fn create(path: &Path) -> io::Result<Self> {
        let name = path.file_name().ok_or(io::ErrorKind::InvalidFilename)?;
        let unfinished = path.with_file_name(format!(".{}.{}.part", name.display(), std::process::id()));
        let file = OpenOptions::new().write(true).create_new(true).open(&unfinished)?;
        Ok(Self { file, path: path.to_owned(), unfinished, is_finished: false })
    }

    /// Renames it to the path it is meant for when it is safely on disk.
    ///
    /// # Errors
    /// What the system said; the path is then what it was before.
    pub fn finish(mut self) -> io::Result<()> {
        self.file.sync_all()?;
        fs::rename(&self.unfinished, &self.path)?;
        self.is_finished = true;
        Ok(())
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        if !self.is_finished {
            // What went wrong has been said; a file that cannot be removed adds nothing to it.
            let _ = fs::remove_file(&self.unfinished);
        }
    }
}

/// Writes `contents` to a file of its own beside `path` and renames it to `path` when it is safely on disk.
///
/// # Errors
/// What the system said; `path` is then what it was before.
pub fn write_whole(path: &Path, contents: &[u8]) -> io::Result<()> {
    let mut file = WholeFile::create(path)?;
    file.write_all(contents)?;
    file.finish()
}

/// Reads at most one byte more of a file than `largest`: its parser sees that it is too large, and no file fills the memory.
///
/// # Errors
/// What the system said.
pub fn read_at_most(path: &Path, largest: usize) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(largest as u64 + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_or_stays_as_it_was() {
        let folder = std::env::temp_dir().join(format!("footplate-whole-file-{}", std::process::id()));
        fs::create_dir(&folder).unwrap();
        let path = folder.join("layout.toml");
        write_whole(&path, b"first").unwrap();
        write_whole(&path, b"second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "nothing is left beside it");

        assert!(write_whole(&folder.join("missing/layout.toml"), b"third").is_err());
        assert!(write_whole(Path::new("/"), b"third").is_err());
        assert_eq!(fs::read(&path).unwrap(), b"second");

        let mut abandoned = WholeFile::create(&path).unwrap();
        abandoned.write_all(b"fourth").unwrap();
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
        drop(abandoned);
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "nor of what is given up");
        fs::remove_dir_all(&folder).unwrap();
    }
}
