//! The child process that computes an answer. It ends when its client is gone.

use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use anyhow::{Context, anyhow, bail};

/// How often the end of a child that has closed its output is looked for.
const LOOKED_EVERY: Duration = Duration::from_millis(2);

/// A child process, shared by the thread that serves it and the request that waits for its answer.
#[derive(Debug, Clone, Default)]
pub(super) struct ClerkProcess(Arc<Mutex<State>>);

#[derive(Debug, Default)]
enum State {
    #[default]
    NotStarted,
    Runs(Child),
    /// Its client was gone before it started.
    Unwanted,
}

impl ClerkProcess {
    /// Starts the child, whose input, output and errors are pipes.
    ///
    /// # Errors
    /// The client is gone, or the process cannot be started.
    pub(super) fn start(
        &self,
        command: &mut Command,
    ) -> anyhow::Result<(ChildStdin, ChildStdout, ChildStderr)> {
        let mut state = self.locked();
        if matches!(*state, State::Unwanted) {
            bail!("the client has disconnected");
        }
        let mut child = command.spawn().context("cannot start a process to compute the answer")?;
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        *state = State::Runs(child);
        let (Some(input), Some(output), Some(errors)) = pipes else {
            return Err(anyhow!("a pipe is missing"));
        };
        Ok((input, output, errors))
    }

    /// Kills the child if it runs; one that was not started does not start any more.
    pub(super) fn kill(&self) {
        let mut state = self.locked();
        match &mut *state {
            State::Runs(child) => drop(child.kill()),
            State::NotStarted | State::Unwanted => *state = State::Unwanted,
        }
    }

    /// Waits until the child has ended. It can be killed meanwhile.
    ///
    /// # Errors
    /// There is no child.
    pub(super) fn wait(&self) -> anyhow::Result<ExitStatus> {
        loop {
            let ended = match &mut *self.locked() {
                State::Runs(child) => child.try_wait()?,
                State::NotStarted | State::Unwanted => bail!("no process was started"),
            };
            if let Some(status) = ended {
                return Ok(status);
            }
            std::thread::sleep(LOOKED_EVERY);
        }
    }

    /// Ends the child if it still runs.
    pub(super) fn end(&self) {
        self.kill();
        let _ = self.wait();
    }

    fn locked(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Kills a child process when it is dropped.
#[derive(Debug)]
pub(super) struct UntilDropped(ClerkProcess);

impl UntilDropped {
    pub(super) fn of(process: &ClerkProcess) -> Self {
        Self(process.clone())
    }
}

impl Drop for UntilDropped {
    fn drop(&mut self) {
        self.0.kill();
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::io::Read;
    use std::process::Stdio;

    use super::*;

    fn endless() -> Command {
        let mut command = Command::new("sleep");
        command.arg("600").stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    #[test]
    fn a_child_ends_when_its_client_is_gone() {
        let process = ClerkProcess::default();
        let client = UntilDropped::of(&process);
        let (_input, mut output, _errors) = process.start(&mut endless()).expect("a child");
        drop(client);
        let mut text = String::new();
        assert_eq!(output.read_to_string(&mut text).expect("its output ends"), 0);
        assert!(!process.wait().expect("a child").success());
    }

    #[test]
    fn a_child_whose_client_is_gone_is_not_started() {
        let process = ClerkProcess::default();
        drop(UntilDropped::of(&process));
        assert!(process.start(&mut endless()).is_err());
        process.end();
    }
}
