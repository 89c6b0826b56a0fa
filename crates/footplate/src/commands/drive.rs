//! `footplate drive`: trains told what to do, line by line, and what comes of it.

mod beginning;
mod formatter;
mod instruction;
mod learning;
mod parse;
mod reader;
mod result_line;
mod script;
mod script_runner;
mod spoken;
mod stage;
mod terminal;
mod trains;
mod truth;
mod words;

use std::collections::{BTreeMap, BTreeSet};
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{anyhow, bail};
use clap::Args;
use footplate_core::track::{Layout, Leg};
use footplate_core::{Timestamp, TrainId, TurnoutId};
use footplate_store::{Journal, NewMachine, Store, layout_named, parse_layout};

pub(crate) use self::beginning::DriveBeginning;
pub(super) use self::formatter::NoticeFormatter;
use self::instruction::HELP;
use self::reader::Known;
use self::result_line::ResultLine;
use self::script::read_script;
use self::script_runner::Giver;
pub(crate) use self::script_runner::ScriptRunner;
pub(crate) use self::spoken::Spoken;
use self::stage::{Stage, ended, lines_of_stdin};
use self::terminal::Terminal;
use self::trains::{KnownTrains, Sources};
use self::truth::{Beginnings, Referee};
use super::Outcome;
use super::left_running::stop_left_running;
use super::predict::turnout_state;
use super::serve::open_dashboard;
use super::written_layout::WrittenLayout;
use crate::clock::{local, now};
use crate::dashboard::{Board, Dashboard, LayoutPicture, ServedAt};
use crate::layout_check::LayoutWatch;
use crate::link::{Address, Link, ObservedLink, Speed, open, open_session, open_simulated};
use crate::recorded::Recorded;
use crate::runtime::{Ended, Recorder, Runtime, StopFlag};
use crate::session_journal::{IfUnkept, PROGRAM, SessionJournal, WhenFull};

/// Drive trains: speeds, turnouts, stops at a place, moves by a distance.
///
/// Without `--script` lines are read from standard input, at a prompt if that is a terminal, where a new order takes the
/// place of the one before; `help` lists what can be
/// said. Each contact that a train passes is printed with what had been predicted; each stop with what was promised.
/// However the program ends, all trains are commanded to stop and the power is taken from the track first.
#[derive(Args)]
#[command(after_help = "\
Examples:
  footplate drive --link sim:track-a?seed=7 --store railway.db
  footplate drive --link marklin-serial:/dev/ttyUSB0 --layout track-a --store railway.db --script evening.txt --json")]
pub(crate) struct Arguments {
    #[command(flatten)]
    railway: Railway,
    /// Lines to carry out, one after the other; a train ends one order before it begins the next.
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// How long a script waits for a train that has to arrive or to be brought back, before it goes on without; 600 s unless
    /// named.
    #[arg(long, value_name = "SECONDS", requires = "script", value_parser = wait_limit)]
    wait_limit: Option<f64>,
    /// Print a line of JSON for every finished order; all else goes to standard error.
    #[arg(long)]
    json: bool,
    /// Show trains live in a browser, and take orders from there: at a port of this machine (8417 unless named, 0 for any
    /// that is free), or at an address. Beyond this machine a token is needed: the one in the environment as FOOTPLATE_TOKEN
    /// (at least 16 characters), or one that is generated and printed.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "")]
    serve: Option<ServedAt>,
    /// Lines of text instead of the live view, at a terminal, too.
    #[arg(long)]
    plain: bool,
    /// Nobody sits here, whatever standard input is.
    #[arg(skip)]
    is_headless: bool,
}

/// What is driven: a station, a layout, and what is known of trains.
#[derive(Args)]
pub(crate) struct Railway {
    /// The command station: sim:track-a?seed=7, marklin-serial:/dev/ttyUSB0, dcc-ex:/dev/ttyACM0, z21:192.168.0.111, marklin-can:192.168.0.5, or
    /// tcp://host:port in place of a device.
    #[arg(long, value_name = "URL")]
    link: Address,
    /// The layout: the name of a built-in one or a layout file; a simulated link brings its own.
    #[arg(long)]
    layout: Option<String>,
    /// The store that knows the trains; what they do is written down there.
    #[arg(long, value_name = "FILE")]
    store: Option<PathBuf>,
    /// What is known of a train, as a file of its own; may be repeated.
    #[arg(long = "model", value_name = "FILE")]
    models: Vec<PathBuf>,
    /// Drive this train, too, even if nothing is known of it; may be repeated.
    #[arg(long = "train", value_name = "N", value_parser = clap::value_parser!(u16).range(1..=80))]
    trains: Vec<u16>,
    /// How a turnout lies when the session begins, such as 6=straight; may be repeated.
    #[arg(long = "turnout", value_name = "N=LEG", value_parser = turnout_state)]
    turnouts: Vec<(TurnoutId, Leg)>,
}

impl Railway {
    pub(super) const fn link(&self) -> &Address {
        &self.link
    }
}

impl Arguments {
    pub(crate) const fn link(&self) -> &Address {
        &self.railway.link
    }

    /// Drives for browsers and programs alone.
    pub(super) const fn served(railway: Railway, at: ServedAt) -> Self {
        Self {
            railway,
            script: None,
            wait_limit: None,
            json: false,
            serve: Some(at),
            plain: true,
            is_headless: true,
        }
    }

    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let written = self.layout()?;
        let layout = &written.layout;
        // A person at the prompt lives in real time; a script need not.
        let is_watched = self.script.is_none() || self.serve.is_some();
        let pace = if is_watched { Speed::Times(1.0) } else { Speed::Unpaced };
        let mut store = self.railway.store.as_deref().map(Store::open_or_create).transpose()?;
        let stop = |store: &Store| stop_left_running(&self.railway.link, layout, store, pace);
        let opened = store.as_ref().map(stop).transpose()?.flatten();
        // Nothing is written to a damaged store: it would bury what can still be salvaged.
        store.as_ref().map_or(Ok(()), Store::check)?;
        let mut named: BTreeSet<TrainId> = self.railway.trains.iter().copied().map(TrainId).collect();
        if let Some(simulated) = self.railway.link.simulated() {
            named.extend(&simulated.trains);
        }
        let known = KnownTrains::gather(
            layout,
            Sources { files: &self.railway.models, store: store.as_mut(), named },
        )?;
        drop(store);
        let beginning = self.beginning(&written, known)?;
        let dashboard = self.dashboard(&written)?;
        match &self.railway.link {
            Address::Simulated(simulated) => {
                // A simulated railway is what its address says, whatever people believe it to be.
                let real = layout_named(&simulated.layout)?.layout;
                let link = open_simulated(simulated, &real, pace)?;
                self.drive(layout, link, beginning, dashboard.as_ref(), output)
            }
            Address::Serial(_) | Address::Board(_) | Address::Z21(_) | Address::Can(_) => {
                let link = opened.map_or_else(|| open(&self.railway.link, layout, pace), Ok)?;
                self.drive(layout, link, beginning, dashboard.as_ref(), output)
            }
        }
    }

    /// The layout: the one that was named, or the simulated one.
    fn layout(&self) -> anyhow::Result<WrittenLayout> {
        let named = match (&self.railway.layout, self.railway.link.simulated()) {
            (Some(named), _) => named,
            (None, Some(simulated)) => &simulated.layout,
            (None, None) => {
                bail!("layout missing: add `--layout track-a` or `--layout my-layout.toml`")
            }
        };
        WrittenLayout::named(named)
    }

    fn beginning(&self, written: &WrittenLayout, known: KnownTrains) -> anyhow::Result<DriveBeginning> {
        let layout = &written.layout;
        let mut turnouts = known.turnouts;
        for (turnout, leg) in &self.railway.turnouts {
            if layout.branch(*turnout).is_none() {
                bail!("--turnout: {} has no turnout {turnout}", layout.name());
            }
            turnouts.set(*turnout, *leg);
        }
        for train in &known.unknown {
            eprintln!(
                "train {train} is not calibrated, so its stops are uncertain: run `footplate calibrate` \
                 first"
            );
        }
        let highest: BTreeMap<_, _> =
            known.models.iter().map(|(train, model)| (*train, model.highest())).collect();
        let (giver, steps) = match &self.script {
            Some(path) => (Giver::Script, read_script(path, Known { layout, trains: &highest })?),
            None if std::io::stdin().is_terminal() || self.is_headless() => (Giver::Person, Vec::new()),
            None => (Giver::Script, Vec::new()),
        };
        Ok(DriveBeginning {
            layout: written.text.clone(),
            turnouts: written.legs(&turnouts),
            models: known.models.into_values().collect(),
            fits: known.fits,
            giver,
            script: steps.into_iter().map(|step| step.text).collect(),
            is_complete: self.script.is_some(),
            wait_limit_s: self.wait_limit,
            link: self.railway.link.time_model(),
        })
    }

    /// Whether somebody sits at a terminal that can be drawn on.
    fn is_drawn(&self) -> bool {
        let can = std::io::stdin().is_terminal()
            && std::io::stdout().is_terminal()
            && std::env::var_os("TERM").is_some_and(|term| term != "dumb");
        can && !self.plain && !self.json && self.script.is_none() && !self.is_headless()
    }

    /// Whether nobody sits here, and people are elsewhere.
    fn is_headless(&self) -> bool {
        self.is_headless || self.serve.is_some() && !std::io::stdin().is_terminal()
    }

    fn dashboard(&self, written: &WrittenLayout) -> anyhow::Result<Option<Dashboard>> {
        let store = || self.railway.store.clone();
        self.serve.as_ref().map(|at| open_dashboard(at, written, store())).transpose()
    }

    /// What writes the session down; the line's clock stands at `at`.
    fn journal(
        &self,
        layout: &Layout,
        at: Timestamp,
        beginning: &DriveBeginning,
    ) -> anyhow::Result<Option<SessionJournal>> {
        let Some(path) = &self.railway.store else { return Ok(None) };
        let now = now();
        let began_at = Some(now + (Timestamp::ZERO - at));
        let name = format!("drive {}", local(now));
        let store = Store::open_or_create(path)?;
        let mut journal = Journal::begin(store, &name, layout.name(), began_at, &[], now)?;
        let body = serde_json::to_string(beginning)?;
        journal
            .begin_machine(NewMachine { kind: DriveBeginning::KIND, program: PROGRAM, body: &body }, now)?;
        // Only a simulated clock can wait for a disk.
        let is_simulated = self.railway.link.simulated().is_some();
        let when_full = if is_simulated { WhenFull::Wait } else { WhenFull::Lose };
        Ok(Some(SessionJournal::start(journal, began_at, when_full, IfUnkept::Stop)?))
    }

    fn drive<L: Link + Referee>(
        &self,
        layout: &Layout,
        link: L,
        beginning: DriveBeginning,
        dashboard: Option<&Dashboard>,
        output: &mut dyn Write,
    ) -> anyhow::Result<Outcome> {
        let link = ObservedLink::new(link, dashboard.map(|dashboard| Arc::clone(&dashboard.line)));
        let session = open_session(&self.railway.link, &link, layout)?;
        let sits_at_terminal = self.is_drawn();
        let drawn = || Board::new(now().as_ns());
        let board = dashboard.map(|dashboard| Arc::clone(&dashboard.board));
        let board = board.or_else(|| sits_at_terminal.then(drawn));
        let asks = self.script.is_none() && !self.is_headless() && !sits_at_terminal;
        let mut stage = Stage::new(asks.then(lines_of_stdin), self.json, board.as_ref());
        let mut terminal = None;
        if let Some(board) = board.filter(|_| sits_at_terminal) {
            if let Some(dashboard) = dashboard {
                board.say(0.0, &format!("the dashboard is at {}", dashboard.url));
            }
            stage.be_silent();
            let file = parse_layout(layout.name(), beginning.layout().as_bytes())?;
            terminal = Some(Terminal::open(&board, &LayoutPicture::of(&file))?);
        }
        let mut journal = self.journal(layout, link.now(), &beginning)?;
        if let (Some(journal), Some(dashboard)) = (&journal, dashboard) {
            dashboard.board.follow_journal(journal.written());
        }
        let scribe = journal.as_ref().and_then(SessionJournal::scribe);
        let trains = beginning.models.len();
        let script_runner = beginning.script_runner()?;
        if script_runner.listens_to_a_person() && !self.json {
            stage.say(HELP, "");
        }
        let mut script_runner = Recorded::new(script_runner, scribe);
        let recorder = journal.as_mut().map(|journal| journal as &mut dyn Recorder);
        let mut watch = LayoutWatch::new(layout, trains, recorder);
        let mut runtime = Runtime::new(link, session, Some(&mut watch), Some(StopFlag::install()));
        let mut beginnings = Beginnings::default();
        let ending = loop {
            let ending = runtime.run(&mut script_runner, &mut stage)?;
            for spoken in std::mem::take(&mut stage.for_referee) {
                if let Spoken::Begun(train) = spoken {
                    beginnings.note(runtime.link(), train);
                }
                if let Some(ended) = ended(&spoken) {
                    let truth = beginnings.error(runtime.link(), layout, ended);
                    let result = ResultLine::of(layout, ended, truth);
                    if let Some(dashboard) = dashboard {
                        dashboard.board.tell("ended", &result);
                    }
                    if self.json {
                        writeln!(output, "{}", serde_json::to_string(&result)?)?;
                        output.flush()?;
                    }
                }
            }
            if stage.is_over || !matches!(ending, Ended::Finished) {
                break ending;
            }
        };
        if terminal.take().is_some() {
            eprintln!("stopping all trains and switching the track power off");
        }
        let at = runtime.link().now();
        let closing = runtime.close();
        drop(runtime);
        if let Some(said) = watch.lengths_doubted() {
            eprintln!("{said}");
        }
        // A session whose trains may still run has no end: the next one stops them first.
        let mut script_runner =
            if closing.is_complete() { script_runner.end(at) } else { script_runner.into_machine() };
        if !closing.is_complete() {
            eprintln!("{closing}");
        }
        if let Some(store) = &self.railway.store {
            // What still waits is written down before what follows from it.
            drop(journal);
            KnownTrains::keep(store, layout, &script_runner.learnt())?;
        }
        match ending {
            Ended::Finished if script_runner.fell_short() => Ok(Outcome::FallsShort),
            Ended::Finished => Ok(Outcome::Done),
            Ended::Interrupted => {
                eprintln!("interrupted; {closing}");
                Ok(Outcome::FallsShort)
            }
            lost => Err(anyhow!("{lost}")),
        }
    }
}

/// Seconds for which something may be waited: more than none, and no more than a day.
fn wait_limit(text: &str) -> Result<f64, String> {
    let seconds = text.parse::<f64>().ok().filter(|seconds| *seconds > 0.0 && *seconds <= 86_400.0);
    seconds.ok_or_else(|| format!("`{text}` is not a number of seconds above 0 and up to 86400"))
}
