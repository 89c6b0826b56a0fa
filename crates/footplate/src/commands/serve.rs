//! `footplate serve`: drives trains for browsers and API clients, without a prompt.

mod answer_queue;
mod archive;
mod clerk_process;
mod drawn_layout;
mod fuzzed_body;
mod odometry_pages;
mod schedules;
mod set_up;
mod slides;

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::bail;
use clap::Args;
use footplate_store::parse_layout;

use super::Outcome;
use super::drive;
use super::written_layout::WrittenLayout;
use crate::dashboard::{Board, Dashboard, Routes, ServedAt, Token};
use crate::link::Address;
use crate::standard_error::say;

pub(crate) use answer_queue::{AnswerForm, AnswerQueue};
pub(crate) use archive::StoreQuery;
use archive::{Archive, archive_routes};
use drawn_layout::drawn_layout_routes;
pub(crate) use fuzzed_body::answer_fuzzed;
use odometry_pages::odometry_routes;
use schedules::schedule_routes;
#[cfg(test)]
pub(crate) use set_up::set_up_paths;
pub(crate) use set_up::{SetUpMode, SetUpRoute};
use slides::slide_routes;

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

/// Opens the dashboard of a session and prints its address.
///
/// # Errors
/// The address cannot be used.
pub(super) fn open_dashboard(
    at: &ServedAt,
    written: &WrittenLayout,
    store: Option<PathBuf>,
    set_up: SetUpRoute,
) -> anyhow::Result<Dashboard> {
    let chosen = std::env::var("FOOTPLATE_TOKEN").ok().filter(|text| !text.is_empty());
    let token = chosen.as_deref().map(Token::chosen).transpose()?;
    let layout = parse_layout(written.layout.name(), written.text.as_bytes())?;
    let answer_queue = AnswerQueue::new();
    let archive = Archive::new(store, written, &answer_queue);
    let more = |board: &Arc<Board>| session_routes(archive, &answer_queue, board).and(set_up.routes());
    let dashboard = Dashboard::open(at, token, &layout, more)?;
    say!("the dashboard is at {}", dashboard.url);
    Ok(dashboard)
}

/// The routes of a session beside those of driving and of the set-up.
fn session_routes(archive: Archive, answer_queue: &AnswerQueue, board: &Arc<Board>) -> Routes {
    archive_routes(archive.clone())
        .and(schedule_routes(archive, Arc::clone(board)))
        .and(odometry_routes(answer_queue))
        .and(slide_routes())
        .and(drawn_layout_routes())
}

/// The same for the test of the description.
#[cfg(test)]
pub(crate) fn session_paths(board: &Arc<Board>) -> Vec<&'static str> {
    let layout = WrittenLayout::named("track-a").expect("built in");
    let answer_queue = AnswerQueue::new();
    let routes = session_routes(Archive::new(None, &layout, &answer_queue), &answer_queue, board);
    routes.paths().to_vec()
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
        set_up::run(&self.at, self.railway.store().cloned(), self.restart)
    }
}
