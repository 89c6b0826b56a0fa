//! The program: command line, clock, sockets and threads around the crates that have none.
//!
//! A library, so that the fuzzer can call what reads orders and HTTP bodies in its own process; `main.rs` only calls [`run`].

#![warn(clippy::print_stderr)]

mod accept_queue;
mod chaos;
mod clock;
mod commands;
mod comment;
mod counted;
mod dashboard;
mod error_text;
pub mod fuzzed;
mod guardian;
mod layout_check;
mod link;
mod live_lines;
mod phones;
mod progress;
mod reading;
mod recorded;
mod runtime;
mod session_journal;
mod spread;
mod standard_error;
mod tally;

use std::io::{ErrorKind, Write};
use std::process::ExitCode;

use clap::Parser;

use commands::{Command, Outcome};
use error_text::error_text;
use standard_error::say;

/// Exit status when the usage or the input is wrong; the command line parser ends with it, too.
const BAD_INPUT: u8 = 2;

/// Measures, models and predicts how trains move, with true uncertainty on every number.
#[derive(Parser)]
#[command(
    version,
    after_help = "Without a command: `footplate demo`.\n\nExit status: 0 done, 1 the result falls short, 2 wrong usage or input."
)]
struct Footplate {
    #[command(subcommand)]
    command: Option<Command>,
}

/// Runs the program on the arguments of this process, and returns its exit status.
pub fn run() -> ExitCode {
    // Not locked: the live view of a terminal is drawn from a thread of its own.
    let mut output = std::io::stdout();
    let command = Footplate::parse().command.unwrap_or_default();
    #[cfg(unix)]
    if let Some(ended) = guarded(&command).transpose() {
        return ended.unwrap_or_else(|error| failed(&error));
    }
    let result = command.run(&mut output).and_then(|outcome| {
        output.flush()?;
        Ok(outcome)
    });
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::FallsShort) => ExitCode::FAILURE,
        Err(error) if is_closed_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => failed(&error),
    }
}

fn failed(error: &anyhow::Error) -> ExitCode {
    say!("error: {}", error_text(error));
    ExitCode::from(BAD_INPUT)
}

/// A program that drives over a real line is watched by a guardian: this process becomes it and starts the program again, which
/// finds its guardian here.
///
/// # Errors
/// No guardian can be had.
#[cfg(unix)]
fn guarded(command: &Command) -> anyhow::Result<Option<ExitCode>> {
    guardian::become_ward()?;
    let Some(line) = command.guarded_line().filter(|_| !guardian::is_ward()) else { return Ok(None) };
    guardian::keep(line.cable, line.restarts).map(Some)
}

/// Whether the reader of our output has seen enough, as `head` does.
fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error.downcast_ref::<std::io::Error>().is_some_and(|error| error.kind() == ErrorKind::BrokenPipe)
}
