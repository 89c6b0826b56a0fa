//! `footplate serve`: drives trains for browsers and API clients, without a prompt.

mod fuzzed_body;

use std::io::Write;
use std::path::PathBuf;

use anyhow::bail;
use clap::Args;

use super::Outcome;
use super::dashboard_routes::set_up_in_browser;
use super::drive;
use crate::dashboard::ServedAt;
use crate::link::Address;

pub(crate) use fuzzed_body::answer_fuzzed;

/// Drive trains from browsers and API clients, without a prompt.
///
/// Without `--link`, a page in the browser leads from the command station to the first stop; the set-up is kept beside the
/// store (railway.db unless named), and the next start drives at once. With `--link`, serves the dashboard and its HTTP
/// interface like `footplate drive --serve`. It prints the address, and runs until it receives `quit` or is interrupted. It
/// then commands all trains to stop and switches the track power off.
#[derive(Args)]
#[command(after_help = "\
Examples:
  footplate serve
  footplate serve --link sim:track-a?seed=7 --train 24 --store railway.db
  footplate serve 0.0.0.0:8417 --link marklin-serial:/dev/ttyUSB0 --layout track-a --store railway.db")]
pub(crate) struct Arguments {
    /// A port of this machine (0 for any free port), or an address. Access from other machines needs a token: the one
    /// in the environment variable FOOTPLATE_TOKEN (at least 16 characters), or one that is generated and printed.
    #[arg(value_name = "ADDRESS", default_value = "")]
    at: ServedAt,
    /// If the program dies, stop its trains and start it again. It then knows what the store contains: models and schedules,
    /// but not where trains are. Each is located by the first sensor that it passes, or by `place`.
    #[arg(long)]
    restart: bool,
    /// The set-up that this session runs; `footplate serve` without a link gives it.
    #[arg(long, value_name = "FILE", hide = true, requires = "link")]
    set_up: Option<PathBuf>,
    #[command(flatten)]
    railway: drive::Railway,
}

impl Arguments {
    pub(crate) const fn link(&self) -> Option<&Address> {
        self.railway.link()
    }

    pub(crate) const fn restarts(&self) -> bool {
        self.restart
    }

    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        if self.railway.link().is_some() {
            return drive::Arguments::served(self.railway, self.at, self.set_up).run(output);
        }
        if self.railway.is_described() {
            bail!(
                "link missing: add `--link sim:track-a?seed=7`, or the address of your command station; to set up the \
                 railway in the browser, give no more than --store"
            );
        }
        set_up_in_browser(&self.at, self.railway.store().cloned(), self.restart)
    }
}
