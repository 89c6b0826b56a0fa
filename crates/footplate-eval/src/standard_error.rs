//! Lines for people on standard error.

/// Writes a line to standard error, as `eprintln!` does, and goes on where its reader has gone.
///
/// `eprintln!` panics there: with `2>&1 | head` a session would die in the middle of a drive.
#[macro_export]
macro_rules! say {
    ($($line:tt)*) => {{
        // There is no other place to complain at.
        let _ = ::std::io::Write::write_fmt(&mut ::std::io::stderr(), ::core::format_args!("{}\n", ::core::format_args!($($line)*)));
    }};
}
