//! `footplate serve`: drives trains without a prompt, for browsers and programs.

mod archive;
mod desk;
mod odometry_desk;
mod slides;

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use footplate_store::parse_layout;

use super::Outcome;
use super::drive;
use super::written_layout::WrittenLayout;
use crate::dashboard::{Dashboard, ServedAt, Token};
use crate::link::Address;

pub(crate) use archive::{StoreQuery, archive_routes};
pub(crate) use desk::{Desk, Wished};
pub(crate) use odometry_desk::odometry_routes;
pub(crate) use slides::slide_routes;

/// Drive trains from browsers and programs, without a prompt.
///
/// The dashboard and its HTTP interface, the same as `footplate drive --serve` with nobody at the prompt: prints where to look, and drives until it is told to
/// `quit` or interrupted. Then all trains are commanded to stop and the power is taken from the track.
#[derive(Args)]
#[command(after_help = "\
Examples:
  footplate serve --link sim:track-a?seed=7 --train 24 --store railway.db
  footplate serve 0.0.0.0:8417 --link marklin-serial:/dev/ttyUSB0 --layout track-a --store railway.db")]
pub(crate) struct Arguments {
    /// A port of this machine (0 for any that is free), or an address. Beyond this machine a token is needed: the one
    /// in the environment as FOOTPLATE_TOKEN (at least 16 characters), or one that is generated and printed.
    #[arg(value_name = "ADDRESS", default_value = "")]
    at: ServedAt,
    /// If the program dies, start it again once its trains are stopped. It knows what the store knows, and looks for its trains
    /// anew.
    #[arg(long)]
    restart: bool,
    #[command(flatten)]
    railway: drive::Railway,
}

/// Opens a dashboard for a session on a layout, and says where.
///
/// # Errors
/// It cannot be served there.
pub(super) fn open_dashboard(
    at: &ServedAt,
    written: &WrittenLayout,
    store: Option<PathBuf>,
) -> anyhow::Result<Dashboard> {
    let chosen = std::env::var("FOOTPLATE_TOKEN").ok().filter(|text| !text.is_empty());
    let token = chosen.as_deref().map(Token::chosen).transpose()?;
    let layout = parse_layout(written.layout.name(), written.text.as_bytes())?;
    let desk = Desk::new();
    let more = archive_routes(store, written, &desk).and(odometry_routes(&desk)).and(slide_routes());
    let dashboard = Dashboard::open(at, token, &layout, more)?;
    eprintln!("the dashboard is at {}", dashboard.url);
    Ok(dashboard)
}

impl Arguments {
    pub(crate) const fn link(&self) -> &Address {
        self.railway.link()
    }

    pub(crate) const fn restarts(&self) -> bool {
        self.restart
    }

    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        drive::Arguments::served(self.railway, self.at).run(output)
    }
}
