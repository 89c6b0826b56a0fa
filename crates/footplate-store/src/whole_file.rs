//! Writing a file so that whoever looks finds the old one or the new one, never half of it.

use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

/// Writes `contents` to a file of its own beside `path` and renames it to `path` when it is safely on disk.
///
/// # Errors
/// What the system said; `path` is then what it was before.
pub fn write_whole(path: &Path, contents: &[u8]) -> io::Result<()> {
    let name = path.file_name().ok_or(io::ErrorKind::InvalidFilename)?;
    let unfinished = path.with_file_name(format!(".{}.{}.part", name.display(), std::process::id()));
    let written = OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(&unfinished)
        .and_then(|mut file| {
            file.write_all(contents)?;
            file.sync_all()
        })
        .and_then(|()| fs::rename(&unfinished, path));
    if written.is_err() {
        // The first error says what is wrong; a file that cannot be removed adds nothing to it.
        let _ = fs::remove_file(&unfinished);
    }
    written
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
        fs::remove_dir_all(&folder).unwrap();
    }
}
