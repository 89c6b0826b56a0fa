//! The guardian's messages on standard error.

use std::io::Write;

/// Prints a message. A closed standard error does not stop the guardian.
pub(super) fn say(words: &str) {
    let _ = writeln!(std::io::stderr(), "guardian: {words}");
}
