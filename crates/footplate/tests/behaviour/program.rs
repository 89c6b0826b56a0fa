//! Running the built program in a test.

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
