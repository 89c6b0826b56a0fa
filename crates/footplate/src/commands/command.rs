//! The list of verbs, and how each of them may end.

use std::io::Write;

use super::{
    calibrate, clerk, compare, completions, convert, demo, doctor, drive, layout, measure, odometry, predict,
    replay, report, serve, simulate, store,
};

use crate::link::Cable;

/// Makes the list of verbs from the names of their files.
macro_rules! verbs {
    ($($Verb:ident: $file:ident,)+) => {
        /// What the program is asked to do.
        #[derive(clap::Subcommand)]
        pub(crate) enum Command {
            $($Verb($file::Arguments),)+
        }

        impl Command {
            /// Does it, and writes the result to `output`.
            ///
            /// # Errors
            /// What was wrong with the usage or the input, and what would be right.
            pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
                match self {
                    $(Self::$Verb(arguments) => arguments.run(output),)+
                }
            }
        }
    };
}

verbs! {
    Calibrate: calibrate,
    Clerk: clerk,
    Compare: compare,
    Completions: completions,
    Convert: convert,
    Demo: demo,
    Doctor: doctor,
    Drive: drive,
    Layout: layout,
    Measure: measure,
    Odometry: odometry,
    Predict: predict,
    Replay: replay,
    Report: report,
    Serve: serve,
    Simulate: simulate,
    Store: store,
}

/// A line outside this program over which trains are driven.
pub(crate) struct GuardedLine {
    pub(crate) cable: Cable,
    /// Whether a program that dies is started again.
    pub(crate) restarts: bool,
}

impl Command {
    /// The line that trains are driven over, where somebody has to stop them if this program dies. A simulated railway ends
    /// with its program, and `doctor` moves no train.
    pub(crate) fn guarded_line(&self) -> Option<GuardedLine> {
        let (link, restarts) = match self {
            Self::Calibrate(arguments) => (arguments.link()?, false),
            Self::Drive(arguments) => (arguments.link(), false),
            Self::Serve(arguments) => (arguments.link(), arguments.restarts()),
            _ => return None,
        };
        Some(GuardedLine { cable: link.cable()?, restarts })
    }
}

impl Default for Command {
    /// What somebody sees who asks for nothing.
    fn default() -> Self {
        Self::Demo(demo::Arguments::default())
    }
}

/// How a verb ended that was asked rightly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// As wanted.
    Done,
    /// It worked, but the result is not good enough: a check failed, a target was missed.
    FallsShort,
}
