//! Files in one piece: written so that a reader finds the old one or the new one, never half of it, and read up to a limit.

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// Names that are tried for the unfinished file: a killed program of the same number may have left some behind.
const MOST_NAMES: u32 = 100;
/// Links that are followed before they count as a circle.
const MOST_LINKS: u32 = 40;

/// A file that is being written beside the one whose place it will take.
#[derive(Debug)]
pub struct WholeFile {
    file: File,
    /// The file and the one whose place it will take; `None` for a pipe or a device, which is written as it stands.
    places: Option<[PathBuf; 2]>,
    is_finished: bool,
}

impl WholeFile {
    /// Begins a file of its own beside `path`, or beside the file that `path` is a link to. A pipe or a device is not replaced:
    /// what is written goes straight into it.
    ///
    /// # Errors
    /// What the system said; `path` is then what it was before.
    pub fn create(path: &Path) -> io::Result<Self> {
        // Asked of the path as it is given: what /dev/stdout leads to has no path of its own.
        if let Ok(about) = fs::metadata(path)
            && !about.is_file()
        {
            if about.is_dir() {
                return Err(io::ErrorKind::IsADirectory.into());
            }
            let file = OpenOptions::new().write(true).open(path)?;
            return Ok(Self { file, places: None, is_finished: false });
        }
        let path = linked(path)?;
        let name = path.file_name().ok_or(io::ErrorKind::InvalidFilename)?;
        let process = std::process::id();
        let mut number = 0;
        loop {
            let again = if number == 0 { String::new() } else { format!(".{number}") };
            let unfinished = path.with_file_name(format!(".{}.{process}{again}.part", name.display()));
            match OpenOptions::new().write(true).create_new(true).open(&unfinished) {
                Ok(file) => return Ok(Self { file, places: Some([unfinished, path]), is_finished: false }),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists && number < MOST_NAMES => {
                    number += 1;
                }
                Err(error) => {
                    return Err(io::Error::new(error.kind(), format!("{}: {error}", unfinished.display())));
                }
            }
        }
    }

    /// Renames it to the path it is meant for when it is safely on disk.
    ///
    /// # Errors
    /// What the system said; the path is then what it was before.
    pub fn finish(mut self) -> io::Result<()> {
        if let Some([unfinished, path]) = &self.places {
            self.file.sync_all()?;
            fs::rename(unfinished, path)?;
        }
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
        if let Some([unfinished, _]) = self.places.as_ref().filter(|_| !self.is_finished) {
            // What went wrong has been said; a file that cannot be removed adds nothing to it.
            let _ = fs::remove_file(unfinished);
        }
    }
}

/// The path that a link leads to, whether there is a file or not; any other path as it is.
fn linked(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        let Ok(target) = fs::read_link(&path) else { return Ok(path) };
        path = path.parent().map_or(target.clone(), |folder| folder.join(&target));
    }
    Err(io::Error::other("its links lead in a circle"))
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

/// Opens a file to read, and returns what the system says of it.
///
/// # Errors
/// What the system said, or that it is a folder: on some systems that opens like a file, and then fails with a number.
pub fn open_file(path: &Path) -> io::Result<(File, Metadata)> {
    let file = File::open(path)?;
    let about = file.metadata()?;
    if about.is_dir() { Err(io::Error::other("it is a folder")) } else { Ok((file, about)) }
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

    #[test]
    fn what_a_killed_program_left_blocks_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("layout.toml");
        fs::write(folder.path().join(format!(".layout.toml.{}.part", std::process::id())), b"half").unwrap();
        write_whole(&path, b"whole").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        let refused = write_whole(&folder.path().join("missing/layout.toml"), b"").unwrap_err();
        assert!(refused.to_string().contains(".part: "), "{refused}");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_a_link_and_a_pipe_a_pipe() {
        use std::os::unix::fs::{FileTypeExt, symlink};

        let folder = tempfile::tempdir().unwrap();
        let [file, link, dangling, circle] =
            ["file", "link", "dangling", "circle"].map(|name| folder.path().join(name));
        fs::write(&file, b"old").unwrap();
        symlink("file", &link).unwrap();
        symlink("new", &dangling).unwrap();
        symlink("circle", &circle).unwrap();
        write_whole(&link, b"through").unwrap();
        write_whole(&dangling, b"made").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"through");
        assert_eq!(fs::read(folder.path().join("new")).unwrap(), b"made");
        assert!([&link, &dangling].iter().all(|path| path.is_symlink()));
        assert!(write_whole(&circle, b"").unwrap_err().to_string().contains("circle"));

        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read(pipe).unwrap()
        });
        write_whole(&pipe, b"into the pipe").unwrap();
        assert_eq!(reader.join().unwrap(), b"into the pipe");
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
    }
}
