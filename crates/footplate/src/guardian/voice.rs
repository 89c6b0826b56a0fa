//! What a guardian says to people, on standard error.

use std::io::Write;

/// Says something. A guardian goes on when nobody listens.
pub(super) fn say(words: &str) {
    let _ = writeln!(std::io::stderr(), "guardian: {words}");
}
