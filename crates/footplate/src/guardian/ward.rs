//! How a child finds its guardian: its standard input is the connection until it has taken the real one from there.

use std::io::IoSliceMut;
use std::mem::MaybeUninit;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::time::Duration;

use anyhow::{Context, bail};
use rustix::net::{RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, recvmsg};
use rustix::process::{Pid, Signal, getppid, kill_process};

use crate::clock::Stopwatch;

/// The environment variable that marks a guardian's child.
pub(super) const WARD: &str = "FOOTPLATE_WARD";

static CONNECTION: Mutex<Option<UnixStream>> = Mutex::new(None);
static IS_WARD: AtomicBool = AtomicBool::new(false);

/// The guardian's process; 0 without one.
static GUARDIAN: AtomicI32 = AtomicI32::new(0);
/// A guardian that was killed is gone after this time, with its line: it has nothing left to do.
const GONE_WITHIN: Duration = Duration::from_secs(1);
/// Between two looks whether it is.
const LOOK: Duration = Duration::from_millis(1);

/// If a guardian started this program: connects to it and takes the standard input that it passes on. Call it once, before
/// anything reads standard input.
///
/// # Errors
/// Standard input is not a guardian's connection.
pub(crate) fn become_ward() -> anyhow::Result<()> {
    if std::env::var_os(WARD).is_none() {
        return Ok(());
    }
    let stream = UnixStream::from(std::io::stdin().as_fd().try_clone_to_owned()?);
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut passed = RecvAncillaryBuffer::new(&mut space);
    let mut byte = [0];
    recvmsg(&stream, &mut [IoSliceMut::new(&mut byte)], &mut passed, RecvFlags::CMSG_CLOEXEC)
        .with_context(|| format!("{WARD} is set, but no guardian has started this program; unset it"))?;
    let input = passed.drain().find_map(|message| match message {
        RecvAncillaryMessage::ScmRights(mut files) => files.next(),
        _ => None,
    });
    let Some(input) = input else { bail!("the guardian passed no standard input on") };
    rustix::stdio::dup2_stdin(input)?;
    GUARDIAN.store(Pid::as_raw(getppid()), Ordering::Release);
    *CONNECTION.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = Some(stream);
    IS_WARD.store(true, Ordering::Release);
    Ok(())
}

/// Whether a guardian monitors this program.
pub(crate) fn is_ward() -> bool {
    IS_WARD.load(Ordering::Acquire)
}

/// Ends the guardian if it is still there, and waits until it has left the line to this process.
pub(super) fn end_guardian() {
    // A guardian that has died is no longer the parent; another process may have its number.
    let parent =
        || getppid().filter(|parent| parent.as_raw_nonzero().get() == GUARDIAN.load(Ordering::Acquire));
    if let Some(guardian) = parent() {
        // It may die at this moment.
        let _ = kill_process(guardian, Signal::KILL);
    }
    let watch = Stopwatch::start();
    while parent().is_some() && watch.elapsed() < GONE_WITHIN {
        std::thread::sleep(LOOK);
    }
}

/// The connection to the guardian, if there is one.
pub(super) fn connection() -> std::io::Result<Option<UnixStream>> {
    let connection = CONNECTION.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    connection.as_ref().map(UnixStream::try_clone).transpose()
}
