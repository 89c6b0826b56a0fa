//! How a child finds its guardian: its standard input is the connection until it has taken the real one from there.

use std::io::IoSliceMut;
use std::mem::MaybeUninit;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, bail};
use rustix::net::{RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, recvmsg};

/// The environment variable that marks a guardian's child.
pub(super) const WARD: &str = "FOOTPLATE_WARD";

static CONNECTION: Mutex<Option<UnixStream>> = Mutex::new(None);
static IS_WARD: AtomicBool = AtomicBool::new(false);

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
    *CONNECTION.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = Some(stream);
    IS_WARD.store(true, Ordering::Release);
    Ok(())
}

/// Whether a guardian monitors this program.
pub(crate) fn is_ward() -> bool {
    IS_WARD.load(Ordering::Acquire)
}

/// The connection to the guardian, if there is one.
pub(super) fn connection() -> std::io::Result<Option<UnixStream>> {
    let connection = CONNECTION.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    connection.as_ref().map(UnixStream::try_clone).transpose()
}
