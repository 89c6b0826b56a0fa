//! Running the built program in a test, and the files that it is given.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What one run of the program left behind.
#[derive(Debug)]
pub(crate) struct Run {
    pub(crate) status: i32,
    pub(crate) output: String,
    pub(crate) errors: String,
}

/// Runs the program to its end.
pub(crate) fn footplate(arguments: &[&str]) -> Run {
    let run = Command::new(env!("CARGO_BIN_EXE_footplate"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the program starts");
    Run {
        status: run.status.code().expect("the program ends by itself"),
        output: String::from_utf8(run.stdout).expect("output is text"),
        errors: String::from_utf8(run.stderr).expect("errors are text"),
    }
}

/// The path of a file of the repository's test data.
pub(crate) fn testdata(name: &str) -> String {
    format!("{}/../../testdata/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// A folder of a test's own, empty.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("the test folder can be made");
    folder
}

/// A file of a test's own.
pub(crate) fn written(name: &str, text: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::write(&path, text).expect("the test file can be written");
    path
}

/// Asserts that a file of measurements is refused with its name and what would be right.
pub(crate) fn assert_not_calibrated(name: &str, text: &str, expected: &str) {
    let done = footplate(&["calibrate", "--from", &written(name, text).display().to_string()]);
    assert_ne!(done.status, 0, "{name}: {}", done.output);
    assert!(done.errors.contains(expected), "{name}: {}", done.errors);
    assert!(done.errors.contains(name), "{name}: {}", done.errors);
}
