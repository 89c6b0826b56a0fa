//! The list of verbs, and how a verb may end.

use std::io::Write;

use super::{
    calibrate, clerk, compare, completions, convert, demo, doctor, drive, layout, measure, odometry, predict,
    profiles, replay, report, serve, simulate, store,
};

use crate::link::Cable;

/// Declares the enum of verbs from the names of their files.
macro_rules! verbs {
    ($($Verb:ident: $file:ident,)+) => {
        /// A verb with its arguments.
        #[derive(clap::Subcommand)]
        pub(crate) enum Command {
            $($Verb($file::Arguments),)+
        }

        impl Command {
            /// Runs the verb and writes its result to `output`.
            ///
            /// # Errors
            /// The usage or the input is wrong; the message says what would be right.
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
    Profiles: profiles,
    Replay: replay,
    Report: report,
    Serve: serve,
    Simulate: simulate,
    Store: store,
}

/// A link to a real command station that drives trains.
pub(crate) struct GuardedLine {
    pub(crate) cable: Cable,
    /// Whether to start a program again that died.
    pub(crate) restarts: bool,
}

impl Command {
    /// The link that the guardian watches, to stop all trains if this program dies. `None` for a simulated railway,
    /// which ends with its program, and for `doctor`, which moves no train.
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
    /// The verb that runs without arguments.
    fn default() -> Self {
        Self::Demo(demo::Arguments::default())
    }
}

/// How a verb ended that was used correctly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// As requested.
    Done,
    /// It ran, but the result is insufficient: a check failed or a target was missed.
    FallsShort,
}
