//! `footplate drive`: drives trains by commands from a script, a prompt or a browser, and reports the result of each.

mod beginning;
mod console;
mod formatter;
mod fuzzed_session;
mod instruction;
mod long_drive;
mod reader;
mod script;
mod script_runner;
mod session_message;
mod terminal;
mod trains;
mod truth;
mod words;

use std::collections::BTreeMap;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{anyhow, bail};
use clap::Args;
use footplate_core::model::MotionModel;
use footplate_core::track::{Layout, Leg};
use footplate_core::{DecoderSteps, Timestamp, TrainId, TurnoutId};
use footplate_store::{Schedule, Store, layout_named, parse_layout};

pub(crate) use self::beginning::DriveBeginning;
use self::console::{Console, lines_of_stdin};
pub(super) use self::formatter::NoticeFormatter;
pub(crate) use self::fuzzed_session::FuzzedSession;
use self::instruction::HELP;
pub(crate) use self::long_drive::LongDrive;
use self::reader::Known;
use self::script::{CommandSource, read_script};
pub(crate) use self::script_runner::ScriptRunner;
use self::session_message::ResultLine;
pub(crate) use self::session_message::SessionMessage;
use self::terminal::Terminal;
use self::trains::{KnownTrains, Sources};
use self::truth::{GroundTruth, StartOdometers};
use super::Outcome;
use super::dashboard_routes::{SetUpMode, SetUpRoute, open_dashboard};
use super::left_running::{recall_directions, stop_left_running};
use super::predict::turnout_state;
use super::written_layout::WrittenLayout;
use crate::clock::now;
use crate::dashboard::{Answer, Board, Dashboard, LayoutPicture, ServedAt};
use crate::layout_check::{LayoutWatch, LengthWarning};
use crate::link::{
    Address, Link, MeasuredLine, NamedTrain, ObservedLink, SharedTallies, Speed, open, open_session,
    open_simulated,
};
use crate::phones::{Phones, PhonesAt};
use crate::recorded::Recorded;
use crate::runtime::{Ended, Recorder, Runtime, StopFlag};
use crate::session_journal::{SessionJournal, WhenFull};
use crate::standard_error::say;

/// Drive trains: speeds, turnouts, exact stops, moves, following.
///
/// Without `--script`, commands are read from standard input, one a line; at a terminal there is a prompt, and a new
/// command replaces the train's previous one. With `--serve` they are read at a terminal only: others send them over
/// HTTP. `help` lists the commands. The program prints each detection beside its prediction, and each stop beside its
/// predicted interval. However the program ends, it first commands all trains to stop and switches the track power off.
#[derive(Args)]
#[command(mut_arg("link", |link| link.required(true)), after_help = "\
Examples:
  footplate drive --link sim:track-a?seed=7 --store railway.db
  footplate drive --link marklin-serial:/dev/ttyUSB0 --layout track-a --store railway.db --script evening.txt --json")]
pub(crate) struct Arguments {
    #[command(flatten)]
    railway: Railway,
    /// Run the commands in this file, one after the other; a train finishes one command before it begins the next.
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// How long a script waits for a train to arrive or to be recovered before it continues without it; 600 s by
    /// default.
    #[arg(long, value_name = "SECONDS", requires = "script", value_parser = wait_limit)]
    wait_limit: Option<f64>,
    /// Print one line of JSON for each finished command; all other output goes to standard error.
    #[arg(long)]
    json: bool,
    /// Serve the live dashboard, which also accepts commands: on a port of this machine (default 8417; 0 for any free
    /// port), or on an address. Access from other machines needs a token: the one in the environment variable
    /// FOOTPLATE_TOKEN (at least 16 characters), or one that is generated and printed.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "")]
    serve: Option<ServedAt>,
    /// Print plain lines of text, even at a terminal.
    #[arg(long)]
    plain: bool,
    /// No operator at this console, whatever standard input is.
    #[arg(skip)]
    is_headless: bool,
    /// The set-up that this session runs, if it was made in the browser.
    #[arg(skip)]
    set_up: Option<PathBuf>,
}

/// The railway to drive: command station, layout and trains.
#[derive(Args)]
pub(crate) struct Railway {
    /// The command station: sim:track-a?seed=7, marklin-serial:/dev/ttyUSB0, dcc-ex:/dev/ttyACM0, z21:192.168.0.111, marklin-can:192.168.0.5,
    /// loconet:192.168.0.20, jmri:192.168.0.20, or tcp://host:port in place of a device.
    #[arg(long, value_name = "URL")]
    link: Option<Address>,
    /// The layout: the name of a built-in layout, or a layout file; not needed for a simulated link.
    #[arg(long)]
    layout: Option<String>,
    /// The store with the motion models of the trains; the session is recorded in it.
    #[arg(long, value_name = "FILE")]
    store: Option<PathBuf>,
    /// A motion model as a file; may be repeated.
    #[arg(long = "model", value_name = "FILE")]
    models: Vec<PathBuf>,
    /// Also drive this train, even without a motion model; with the steps of its decoder, 3850:126, unless it has 14. May be repeated.
    #[arg(long = "train", value_name = "N[:STEPS]")]
    trains: Vec<NamedTrain>,
    /// The position of a turnout when the session begins, such as 6=straight; may be repeated.
    #[arg(long = "turnout", value_name = "N=LEG", value_parser = turnout_state)]
    turnouts: Vec<(TurnoutId, Leg)>,
    /// Let phones drive (WiThrottle, Engine Driver and the like): on a port of this machine (default 12090), or on an address. The
    /// protocol has no token: everyone who can reach the port can drive.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "")]
    phones: Option<PhonesAt>,
}

impl Railway {
    pub(super) const fn link(&self) -> Option<&Address> {
        self.link.as_ref()
    }

    pub(super) const fn store(&self) -> Option<&PathBuf> {
        self.store.as_ref()
    }

    /// Whether the command line names more of the railway than its store.
    pub(super) const fn is_described(&self) -> bool {
        self.layout.is_some()
            || !self.trains.is_empty()
            || !self.models.is_empty()
            || !self.turnouts.is_empty()
    }

    /// The link, which a driving session needs.
    fn station(&self) -> anyhow::Result<&Address> {
        self.link.as_ref().ok_or_else(|| {
            anyhow!("link missing: add `--link sim:track-a?seed=7`, or the address of your command station")
        })
    }

    /// What the doctor measured of the line.
    fn line(&self) -> anyhow::Result<Option<MeasuredLine>> {
        MeasuredLine::of(self.station()?, self.store.as_deref())
    }
}

impl Arguments {
    pub(crate) const fn link(&self) -> Option<&Address> {
        self.railway.link()
    }

    /// A session that only browsers and API clients operate (`footplate serve`).
    pub(super) const fn served(railway: Railway, at: ServedAt, set_up: Option<PathBuf>) -> Self {
        Self {
            railway,
            script: None,
            wait_limit: None,
            json: false,
            serve: Some(at),
            plain: true,
            is_headless: true,
            set_up,
        }
    }

    pub(crate) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let address = self.railway.station()?;
        let trains: Vec<TrainId> = self.railway.trains.iter().map(|named| named.train).collect();
        let opened = stop_left_running(address, self.railway.store.as_deref(), &trains)?;
        let written = self.layout()?;
        let layout = &written.layout;
        // With an operator the session runs in real time; a simulated script need not.
        let is_watched = self.script.is_none() || self.serve.is_some();
        let pace = if is_watched { Speed::Times(1.0) } else { Speed::Unpaced };
        let mut store = self.railway.store.as_deref().map(Store::open_or_create).transpose()?;
        let named = address.decoders(&self.railway.trains).map_err(|error| anyhow!(error))?;
        let station = address.kind();
        let known = KnownTrains::gather(
            layout,
            Sources { files: &self.railway.models, store: store.as_mut(), named, station },
        )?;
        let saved = |store: &Store| store.schedules(layout.name());
        let schedules = store.as_ref().map_or_else(|| Ok(Vec::new()), saved)?;
        drop(store);
        let beginning = self.beginning(&written, known, schedules)?;
        match address {
            Address::Simulated(simulated) => {
                // The simulator uses the built-in layout; `--layout` may differ from it to study a wrong survey.
                let real = layout_named(&simulated.layout)?.layout;
                let link = open_simulated(simulated, &real, pace)?;
                self.drive(&written, link, beginning, output)
            }
            _ => {
                let link = opened.map_or_else(|| open(address, layout, pace), Ok)?;
                self.drive(&written, link, beginning, output)
            }
        }
    }

    /// The named layout, or that of the simulated link.
    fn layout(&self) -> anyhow::Result<WrittenLayout> {
        let named = match (&self.railway.layout, self.railway.station()?.simulated()) {
            (Some(named), _) => named,
            (None, Some(simulated)) => &simulated.layout,
            (None, None) => {
                bail!("layout missing: add `--layout track-a` or `--layout my-layout.toml`")
            }
        };
        WrittenLayout::named(named)
    }

    fn beginning(
        &self,
        written: &WrittenLayout,
        known: KnownTrains,
        schedules: Vec<Schedule>,
    ) -> anyhow::Result<DriveBeginning> {
        let layout = &written.layout;
        let mut turnouts = known.turnouts;
        for (turnout, leg) in &self.railway.turnouts {
            if layout.branch(*turnout).is_none() {
                bail!("--turnout: {} has no turnout {turnout}", layout.name());
            }
            turnouts.set(*turnout, *leg);
        }
        for train in &known.unknown {
            say!(
                "train {train} is not calibrated, so its stops are uncertain: run `footplate calibrate` \
                 first"
            );
        }
        let highest: BTreeMap<_, _> =
            known.models.iter().map(|(train, model)| (*train, model.highest())).collect();
        let (source, steps) = match &self.script {
            Some(path) => {
                let known = Known { layout, trains: &highest, schedules: &schedules };
                (CommandSource::Script, read_script(path, known)?)
            }
            None if std::io::stdin().is_terminal() || self.is_headless() => {
                (CommandSource::Person, Vec::new())
            }
            None => (CommandSource::Script, Vec::new()),
        };
        Ok(DriveBeginning {
            layout: written.text.clone(),
            turnouts: written.legs(&turnouts),
            models: known.models.into_values().collect(),
            fits: known.fits,
            source,
            script: steps.into_iter().map(|step| step.text).collect(),
            is_complete: self.script.is_some(),
            wait_limit_s: self.wait_limit,
            schedules,
            link: self.railway.station()?.time_model(self.railway.line()?.as_ref()),
            is_simulated: self.railway.station()?.simulated().is_some(),
        })
    }

    /// Whether to draw the live view: an operator at a terminal that supports it.
    fn is_drawn(&self) -> bool {
        let can = std::io::stdin().is_terminal()
            && std::io::stdout().is_terminal()
            && std::env::var_os("TERM").is_some_and(|term| term != "dumb");
        can && !self.plain && !self.json && self.script.is_none() && !self.is_headless()
    }

    /// Whether all operators are at browsers or API clients.
    fn is_headless(&self) -> bool {
        self.is_headless || self.serve.is_some() && !std::io::stdin().is_terminal()
    }

    fn dashboard(&self, written: &WrittenLayout) -> anyhow::Result<Option<Dashboard>> {
        let store = || self.railway.store.clone();
        let offers_truth = self.railway.station()?.simulated().is_some();
        let set_up = || SetUpRoute::of_session(self.set_up.clone(), SetUpMode::Driving, offers_truth);
        self.serve.as_ref().map(|at| open_dashboard(at, written, store(), set_up())).transpose()
    }

    /// The journal that records the session in the store; the clock of the link reads `at` now.
    fn journal(
        &self,
        layout: &Layout,
        at: Timestamp,
        beginning: &DriveBeginning,
    ) -> anyhow::Result<Option<SessionJournal>> {
        let Some(path) = &self.railway.store else { return Ok(None) };
        // A simulated clock can wait for a slow disk; a real railway cannot.
        let is_simulated = self.railway.station()?.simulated().is_some();
        let when_full = if is_simulated { WhenFull::Wait } else { WhenFull::Lose };
        beginning.journal(path, layout, at, when_full).map(Some)
    }

    fn drive<L: Link + GroundTruth>(
        &self,
        written: &WrittenLayout,
        link: L,
        beginning: DriveBeginning,
        output: &mut dyn Write,
    ) -> anyhow::Result<Outcome> {
        let layout = &written.layout;
        let address = self.railway.station()?;
        // Only now that there is a link: a page of a session that cannot begin would be gone before it has loaded.
        let dashboard = self.dashboard(written)?;
        let dashboard = dashboard.as_ref();
        let line = dashboard.map(|dashboard| Arc::clone(&dashboard.line));
        let line = line.or_else(|| self.railway.phones.map(|_| SharedTallies::default()));
        let link = ObservedLink::new(link, line.clone());
        let mut opened = open_session(address, &link, layout)?;
        opened.session.expect_delays(address.excess(self.railway.line()?.as_ref()));
        if let (Some(store), None) = (&self.railway.store, address.simulated()) {
            let trains = beginning.models.iter().map(MotionModel::train);
            recall_directions(opened.session.as_mut(), &Store::open_to_read(store)?, trains)?;
        }
        for model in &beginning.models {
            opened.session.set_decoder(model.train(), DecoderSteps::with(model.highest()))?;
        }
        let sits_at_terminal = self.is_drawn();
        let asks = self.script.is_none() && !self.is_headless() && !sits_at_terminal;
        // The board keeps the alarms: every operator has one.
        let is_shown = sits_at_terminal || asks || self.railway.phones.is_some();
        let board = dashboard.map(|dashboard| Arc::clone(&dashboard.board));
        let board = board.or_else(|| is_shown.then(|| Board::new(now().as_ns())));
        let phones = self.railway.phones.zip(board.as_ref()).zip(line.as_ref());
        let _phones = phones.map(|((at, board), line)| Phones::serve(at, board, line)).transpose()?;
        let mut console = Console::new(asks.then(lines_of_stdin), self.json, board.as_ref());
        let mut terminal = None;
        if let Some(board) = board.filter(|_| sits_at_terminal) {
            if let Some(dashboard) = dashboard {
                board.say(0.0, &format!("the dashboard is at {}", dashboard.url));
            }
            console.silence();
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
        if script_runner.is_interactive() && !self.json && !self.is_headless() {
            console.say(HELP, "");
        }
        let mut script_runner = Recorded::new(script_runner, scribe);
        let recorder = journal.as_mut().map(|journal| journal as &mut dyn Recorder);
        let mut watch = LayoutWatch::new(layout, trains, recorder);
        console.watch_lengths(watch.warning());
        let mut runtime = Runtime::new(link, opened, Some(&mut watch), Some(StopFlag::install()));
        let mut start_odometers = StartOdometers::default();
        let mut unwritten = None;
        let ending = loop {
            let ending = runtime.run(&mut script_runner, &mut console)?;
            for message in std::mem::take(&mut console.for_scoring) {
                if let Some((ended, truth)) = start_odometers.score(runtime.link(), layout, &message) {
                    let result = ResultLine::of(layout, ended, truth);
                    if let Some(dashboard) = dashboard {
                        dashboard.board.publish("ended", &result);
                    }
                    // Trains go on when the reader of results has gone, and what was learnt is kept.
                    if self.json && unwritten.is_none() {
                        let line = serde_json::to_string(&result)?;
                        unwritten = writeln!(output, "{line}").and_then(|()| output.flush()).err();
                    }
                }
            }
            for asked in std::mem::take(&mut console.for_truth) {
                let trains = script_runner.machine().trains();
                let found: Option<Vec<_>> =
                    trains.map(|train| runtime.link().whereabouts(layout, train)).collect();
                asked.answer(match found {
                    Some(trains) => Answer::Found(serde_json::to_string(&trains)?),
                    None => Answer::Refused(
                        "only a simulated railway knows where its trains really are".to_owned(),
                    ),
                });
            }
            if console.is_over || !matches!(ending, Ended::Finished) {
                break ending;
            }
        };
        if terminal.take().is_some() {
            say!("stopping all trains and switching the track power off");
        }
        let at = runtime.link().now();
        let closing = runtime.close();
        let wrecks = runtime.link().wrecks();
        drop(runtime);
        for wreck in &wrecks {
            say!("an accident on the simulated railway, at {wreck}");
        }
        let length_warning = watch.lengths_doubted();
        if let Some(warning) = length_warning.as_ref().filter(|_| watch.warning().get().is_none()) {
            say!("{}", warning.english);
        }
        // A session whose trains may still run has no end: the next one stops them first.
        let mut script_runner =
            if closing.is_complete() { script_runner.end(at) } else { script_runner.into_machine() };
        if !closing.is_complete() {
            say!("{closing}");
        }
        if let Some(store) = &self.railway.store {
            // The journal is written out before the models that were fitted to it.
            drop(journal);
            KnownTrains::keep(store, layout, &script_runner.learnt())?;
        }
        match ending {
            Ended::Finished if script_runner.fell_short() || !wrecks.is_empty() => Ok(Outcome::FallsShort),
            Ended::Finished => match unwritten {
                Some(error) => Err(error.into()),
                None => Ok(LengthWarning::outcome(length_warning.as_ref())),
            },
            Ended::Interrupted => {
                say!("interrupted; {closing}");
                Ok(Outcome::FallsShort)
            }
            lost => Err(anyhow!("{lost}")),
        }
    }
}

/// Parses a waiting time in seconds: above 0, at most one day.
fn wait_limit(text: &str) -> Result<f64, String> {
    let seconds = text.parse::<f64>().ok().filter(|seconds| *seconds > 0.0 && *seconds <= 86_400.0);
    seconds.ok_or_else(|| format!("`{text}` is not a number of seconds above 0 and up to 86400"))
}
