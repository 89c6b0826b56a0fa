//! `footplate serve` without a link: the railway is set up in the browser, then driven.
//!
//! This process serves the set-up pages. Everything that talks to the railway is done by the verb that exists for it, as a
//! child process at the same address: `doctor` checks the link, `calibrate --serve` calibrates, `serve --link` drives.
//! While a child serves the address, this process waits; afterwards it reads the set-up again, and serves the next step.
//! So a railway is never driven by two programs, and a child over a real line has its own guardian.

mod routes;
mod set_up_file;

use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

use anyhow::{Context, bail};
use footplate_core::TrainId;

use self::routes::Pages;
#[cfg(test)]
pub(crate) use self::routes::set_up_paths;
pub(crate) use self::routes::{SetUpMode, SetUpRoute, fuzzed_set_up_routes};
pub(crate) use self::set_up_file::read_fuzzed_set_up;
use self::set_up_file::{SetUp, StepResult, file_beside};
use crate::commands::{Outcome, left_running};
use crate::dashboard::{ServedAt, ServedPages, Token};
use crate::runtime::StopFlag;
use crate::standard_error::say;

/// The store of a railway that is set up, unless another one is named.
pub(super) const USUAL_STORE: &str = "railway.db";
/// Interval between two looks at the stop flag.
const LOOK: Duration = Duration::from_millis(50);
/// The most that is kept of a child's output, in bytes.
const LONGEST_REPORT: usize = 16 << 10;

/// What the owner wants next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Next {
    Calibrate(u16),
    Drive,
}

/// Sets a railway up and drives it, until the program is to end.
///
/// # Errors
/// The address cannot be used, or a file cannot be read or written.
pub(in crate::commands) fn run(
    at: &ServedAt,
    store: Option<PathBuf>,
    restarts: bool,
) -> anyhow::Result<Outcome> {
    let store = store.unwrap_or_else(|| USUAL_STORE.into());
    let begun = begin(at, store.clone(), restarts);
    let set_up = SetUp::read(&file_beside(&store));
    // A set-up that is complete is driven at once, by a process that stops trains first.
    if begun.is_err() || !set_up.as_ref().is_ok_and(|set_up| set_up.is_complete) {
        stop_left_running(&store, &set_up.unwrap_or_default())?;
    }
    let (mut session, shown) = begun?;
    loop {
        let set_up = SetUp::read(&session.file)?;
        let next = if set_up.is_complete && session.problem.is_none() {
            Some(Next::Drive)
        } else {
            session.serve_pages(set_up, &shown)?
        };
        let ended = match next {
            None => Some(Outcome::Done),
            Some(Next::Calibrate(train)) => session.calibrate(train)?,
            Some(Next::Drive) => session.drive()?,
        };
        if let Some(outcome) = ended {
            return Ok(outcome);
        }
    }
}

/// Begins a session at an address. Returns it with the end of the address that is printed, which has the token if that is new.
fn begin(at: &ServedAt, store: PathBuf, restarts: bool) -> anyhow::Result<(Session, String)> {
    let file = file_beside(&store);
    // Children need the same token; it is printed once, with the address.
    let chosen = std::env::var("FOOTPLATE_TOKEN").ok().filter(|text| !text.is_empty());
    let mut token = chosen.clone();
    if token.is_none() && at.needs_token() {
        token = Some(Token::generated()?.text().to_owned());
    }
    let shown = token.as_ref().filter(|_| chosen.is_none()).map(|token| format!("?token={token}"));
    // All steps are served at the same port.
    let at = at.with_port()?;
    let stop = StopFlag::install_saying("\nending");
    let session = Session { at, store, file, token, restarts, stop, problem: None, is_announced: false };
    Ok((session, shown.unwrap_or_default()))
}

/// Stops trains that an earlier session left running, over the link of the set-up.
///
/// # Errors
/// The store is damaged, or the link cannot be opened.
fn stop_left_running(store: &Path, set_up: &SetUp) -> anyhow::Result<()> {
    let trains: Vec<TrainId> = set_up.trains.iter().map(|train| TrainId(train.address)).collect();
    match set_up.link().ok().and_then(|link| link.parse().ok()) {
        Some(address) => left_running::stop_left_running(&address, Some(store), &trains).map(drop),
        None => left_running::warn_of_left_running(store),
    }
}

struct Session {
    at: ServedAt,
    store: PathBuf,
    file: PathBuf,
    token: Option<String>,
    restarts: bool,
    stop: StopFlag,
    /// Why the last drive could not begin.
    problem: Option<String>,
    is_announced: bool,
}

impl Session {
    /// Serves the pages until the owner chooses a step that another process carries out; `None` at the end of the program.
    fn serve_pages(&mut self, set_up: SetUp, shown: &str) -> anyhow::Result<Option<Next>> {
        let (chosen, next) = sync_channel(1);
        let pages = Pages::new(set_up, self.store.clone(), self.problem.take(), chosen);
        let token = self.token.as_deref().map(Token::chosen).transpose()?;
        let served = ServedPages::open(&self.at, token, pages.routes())?;
        if !std::mem::replace(&mut self.is_announced, true) {
            say!("the dashboard is at {}{shown}", served.url);
            say!("open it to set up the railway; what you enter is kept in {}", self.file.display());
        }
        loop {
            match next.recv_timeout(LOOK) {
                Ok(next) => return Ok(Some(next)),
                Err(RecvTimeoutError::Timeout) if !self.stop.is_up() => {}
                Err(_) => return Ok(None),
            }
        }
    }

    /// Calibrates a train, and keeps what was printed.
    fn calibrate(&self, train: u16) -> anyhow::Result<Option<Outcome>> {
        let set_up = SetUp::read(&self.file)?;
        let mut verb = verb("calibrate")?;
        verb.args(["--link", &set_up.calibration_link()?, "--layout", set_up.layout()?])
            .args(["--train", &train.to_string(), "--set-turnouts"])
            .arg("--store")
            .arg(&self.store)
            .args(["--serve", &self.at.to_string()])
            .arg("--set-up")
            .arg(&self.file);
        let result = self.attend(verb)?;
        if self.stop.is_up() {
            return Ok(Some(outcome_of(result.status)?));
        }
        // The owner may have gone back to the set-up meanwhile.
        let mut set_up = SetUp::read(&self.file)?;
        set_up.calibrations.insert(train, result);
        set_up.write(&self.file)?;
        Ok(None)
    }

    /// Drives; `None` if the owner went back to the set-up, or the session could not begin.
    fn drive(&mut self) -> anyhow::Result<Option<Outcome>> {
        let set_up = SetUp::read(&self.file)?;
        let mut verb = verb("serve")?;
        verb.arg(self.at.to_string()).args(["--link", &set_up.link()?, "--layout", set_up.layout()?]);
        for train in &set_up.trains {
            verb.args(["--train", &train.address.to_string()]);
        }
        verb.arg("--store").arg(&self.store).arg("--set-up").arg(&self.file);
        if self.restarts {
            verb.arg("--restart");
        }
        let result = self.attend(verb)?;
        if self.stop.is_up() {
            return Ok(Some(outcome_of(result.status)?));
        }
        if !SetUp::read(&self.file)?.is_complete {
            return Ok(None);
        }
        if let Ok(outcome) = outcome_of(result.status) {
            return Ok(Some(outcome));
        }
        let report = result.report;
        // What was printed before the error is not the reason.
        let reason = report.rfind("error: ").and_then(|from| report.get(from..));
        self.problem = Some(reason.unwrap_or(&report).trim_start_matches("error: ").to_owned());
        Ok(None)
    }

    /// Runs a child to its end. Its output is passed on; the end of it is kept.
    fn attend(&self, mut verb: Command) -> anyhow::Result<StepResult> {
        if let Some(token) = &self.token {
            verb.env("FOOTPLATE_TOKEN", token);
        }
        let child = verb.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let mut child = child.context("cannot start the next step")?;
        let output = child.stdout.take().map(|pipe| thread::spawn(|| passed_on(pipe, std::io::stdout())));
        let errors = child.stderr.take().map(|pipe| thread::spawn(|| passed_on(pipe, std::io::stderr())));
        let mut is_asked = false;
        let status = loop {
            if let Some(status) = child.try_wait()? {
                break status;
            }
            if self.stop.is_up() && !std::mem::replace(&mut is_asked, true) {
                ask_to_end(&mut child);
            }
            thread::sleep(LOOK);
        };
        let text = |reader: Option<thread::JoinHandle<String>>| {
            reader.and_then(|reader| reader.join().ok()).unwrap_or_default()
        };
        let (output, errors) = (text(output), text(errors));
        let report = if output.trim().is_empty() { errors } else { output };
        Ok(StepResult::of(status, &report))
    }
}

/// This program with another verb.
fn verb(name: &str) -> anyhow::Result<Command> {
    let mut verb = Command::new(std::env::current_exe()?);
    verb.arg(name);
    Ok(verb)
}

/// Passes output on, line by line; returns the end of it.
fn passed_on(pipe: impl Read, mut to: impl Write) -> String {
    let mut lines = BufReader::new(pipe);
    let (mut kept, mut line) = (Vec::new(), Vec::new());
    while matches!(lines.read_until(b'\n', &mut line), Ok(1..)) {
        // A closed output does not stop a child.
        let _ = to.write_all(&line).and_then(|()| to.flush());
        kept.append(&mut line);
        if kept.len() > LONGEST_REPORT {
            kept.drain(..kept.len() - LONGEST_REPORT);
        }
    }
    String::from_utf8_lossy(&kept).into_owned()
}

/// Passes the wish to end on to a child, which stops all trains first.
#[cfg(unix)]
fn ask_to_end(child: &mut Child) {
    // A child that has ended already needs no signal.
    let _ =
        rustix::process::kill_process(rustix::process::Pid::from_child(child), rustix::process::Signal::TERM);
}

/// The console has passed it on already.
#[cfg(not(unix))]
fn ask_to_end(_: &mut Child) {}

/// The outcome of a verb with an exit status.
fn outcome_of(status: i32) -> anyhow::Result<Outcome> {
    match status {
        0 => Ok(Outcome::Done),
        1 => Ok(Outcome::FallsShort),
        _ => bail!("the session ended with status {status}"),
    }
}

/// Checks the link: `footplate doctor`.
///
/// # Errors
/// The set-up has no link yet, or no process can be started.
fn check_link(set_up: &SetUp, store: &Path) -> anyhow::Result<StepResult> {
    let run = verb("doctor")?
        .args(["--link", &set_up.link()?, "--layout", set_up.layout()?, "--store"])
        .arg(store)
        .stdin(Stdio::null())
        .env_remove("FOOTPLATE_TOKEN")
        .output()
        .context("cannot start `footplate doctor`")?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    Ok(StepResult::of(run.status, &[text(&run.stdout), text(&run.stderr)].join("\n")))
}
