//! The files of the project, as git knows them.

use std::collections::BTreeSet;
use std::fmt::{Display, Write as _};
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::source::Source;

/// A text file of the project.
pub(crate) struct TextFile {
    /// Its path from the root of the project, with `/` between folders.
    pub(crate) path: String,
    pub(crate) text: String,
}

/// One violation.
pub(crate) struct Fault {
    pub(crate) path: String,
    /// Counted from 1.
    pub(crate) line: usize,
    pub(crate) what: String,
}

impl Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}: {}", self.path, self.line, self.what)
    }
}

/// Fails with a list of all violations.
pub(crate) fn assert_none(faults: &[Fault]) {
    let mut list = String::new();
    for fault in faults {
        let _ = writeln!(list, "  {fault}");
    }
    assert!(faults.is_empty(), "{} to mend:\n{list}", faults.len());
}

/// Every file that is tracked, or new and not ignored, by its path from the root, sorted.
pub(crate) fn paths() -> Vec<String> {
    let list = Command::new("git")
        .current_dir(top())
        // A server may check a project out as one user and test it as another.
        .args(["-c", "safe.directory=*"])
        .args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"])
        .output()
        .expect("git should be installed: it knows which files belong to the project");
    assert!(list.status.success(), "git ls-files failed: {}", String::from_utf8_lossy(&list.stderr));
    let names = String::from_utf8(list.stdout).expect("file names should be UTF-8");
    let mut paths: Vec<String> =
        names.split_terminator('\0').map(String::from).filter(|path| top().join(path).exists()).collect();
    paths.sort();
    paths.dedup();
    paths
}

/// Every text file with one of these extensions, or every text file if there are none.
pub(crate) fn text_files(endings: &[&str]) -> Vec<TextFile> {
    let wanted = |path: &str| endings.is_empty() || endings.iter().any(|ending| path.ends_with(ending));
    let read = |path: String| {
        let bytes = std::fs::read(top().join(&path)).expect("a listed file should be readable");
        // A file that is not UTF-8 is not text.
        String::from_utf8(bytes).ok().map(|text| TextFile { path, text })
    };
    paths().into_iter().filter(|path| wanted(path)).filter_map(read).collect()
}

/// The source folder of each crate, with a final `/`.
pub(crate) fn source_folders() -> BTreeSet<String> {
    let split = |path: &String| path.split_once("/src/").map(|(package, _)| format!("{package}/src/"));
    paths().iter().filter_map(split).collect()
}

/// The Rust sources below a folder, which ends in `/`, except test modules.
pub(crate) fn sources_below(folder: &str) -> Vec<Source> {
    let below = text_files(&[".rs"]).into_iter().filter(|file| file.path.starts_with(folder));
    let mut sources: Vec<Source> = below.map(|file| Source::read(&file.path, &file.text)).collect();
    let of_tests: Vec<Vec<String>> = sources.iter().flat_map(|source| source.test_modules.clone()).collect();
    sources.retain(|source| !of_tests.iter().any(|module| source.module().starts_with(module)));
    sources
}

/// The folder of the project, found when the test runs: checkouts that share a target folder share its binary.
fn top() -> PathBuf {
    let package = std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo should say where the package is");
    Path::new(&package).join("../..")
}
