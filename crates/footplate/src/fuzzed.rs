//! What the fuzzer calls in its own process: bytes go in, and a panic is a finding.

use crate::commands::{FuzzedSession, answer_fuzzed, read_fuzzed_set_up};

/// The most lines of one input: what lines do to each other is seen with few.
const MOST_LINES: usize = 12;

/// Takes the bytes as lines of the prompt, and runs on for some track time after each.
///
/// # Panics
/// A line does what no line may do, or the built-in layout cannot be read.
pub fn orders(bytes: &[u8]) {
    let mut session = FuzzedSession::new().unwrap_or_else(|error| panic!("no session: {error:#}"));
    for line in String::from_utf8_lossy(bytes).lines().take(MOST_LINES) {
        session.hear(line);
    }
}

/// Takes the first line of the bytes as a path of the HTTP interface and the rest as a body that is posted there, and carries
/// out what the answer says is taken.
///
/// # Panics
/// The answer is none that a client may get, or a temporary file cannot be written.
pub fn http_body(bytes: &[u8]) {
    answer_fuzzed(bytes).unwrap_or_else(|error| panic!("{error:#}"));
}

/// Takes the bytes as what a guardian or its child receives of the other.
///
/// # Panics
/// A frame is not what was received.
pub fn guardian_frames(bytes: &[u8]) {
    let again = crate::guardian::read_fuzzed(bytes).unwrap_or_else(|error| panic!("{error}"));
    assert!(bytes.starts_with(&again), "frames that were not received: {again:?}");
}

/// Takes the bytes as the set-up file beside a store.
///
/// # Panics
/// A set-up that was read cannot be written and read again, or a temporary file cannot be written.
pub fn set_up_file(bytes: &[u8]) {
    read_fuzzed_set_up(bytes).unwrap_or_else(|error| panic!("{error:#}"));
}
