//! The guardian: starts its child, relays bytes, monitors it, and sends its last will.

use std::ffi::OsString;
use std::io::{IoSlice, Write};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, ExitCode, ExitStatus};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use anyhow::Context;
use rustix::net::{SendAncillaryBuffer, SendAncillaryMessage, SendFlags, sendmsg};
use rustix::termios::{OptionalActions, Termios, tcgetattr, tcsetattr};

use super::frame::Frame;
use super::frame_stream::{FrameReader, FrameWriter};
use super::held_line::{Ear, HeldLine, LastLine, locked, tell};
use super::monitor::{LATE, LONG_ENOUGH, Monitor, Next, Request, Step};
use super::signals::Signals;
use super::voice::say;
use super::ward::WARD;
use crate::clock::Stopwatch;
use crate::link::Cable;
use crate::runtime::carry_out;

/// Pause before a restart.
const RESTART_AFTER: Duration = Duration::from_secs(1);
/// Exit status after a signal, less the number of the signal, as in shells.
const ENDED_BY_SIGNAL: u8 = 128;

/// Runs the program again as a child and holds its line. Returns once the child has ended and all trains are stopped.
///
/// # Errors
/// No child can be started.
pub(crate) fn keep(cable: Cable, restarts: bool) -> anyhow::Result<ExitCode> {
    let signals = Signals::listen().context("cannot listen to signals")?;
    let modes = tcgetattr(std::io::stdin()).ok();
    let ear: Ear = Arc::new(Mutex::new(None));
    let mut line = HeldLine::new(cable, Arc::clone(&ear));
    let clock = Stopwatch::start();
    loop {
        let mut monitor = Monitor::new(clock.now());
        let (mut child, stream) = start().context("cannot start the program that drives")?;
        signals.pass_on_to(Some(child.id()));
        if signals.ends() {
            signals.pass_on_late();
        }
        let mut frames = FrameReader::new(stream.try_clone()?);
        *locked(&ear) = Some(FrameWriter::new(stream));
        serve(&mut frames, &mut line, &ear, &mut monitor, &clock);
        // Whether the program had left its trains, and they were stopped.
        let (mut was_late, mut stopped) = (false, None);
        while let Some(step) = monitor.step() {
            match step {
                Step::Kill => {
                    was_late = true;
                    say(&format!(
                        "the program has said nothing for {:.0} ms while trains run; it is ended",
                        LATE.as_ms()
                    ));
                    let _ = child.kill();
                }
                Step::CarryOut(will) => {
                    signals.pass_on_to(None);
                    say("the program has left its trains; stopping all of them now");
                    stopped = Some(carry_out(&mut LastLine { line: &mut line, signals: &signals }, will));
                    signals.pass_on_to(Some(child.id()));
                }
                Step::AwaitEnd => {}
            }
        }
        let ended = wait_for(&mut child)?;
        signals.pass_on_to(None);
        drop(locked(&ear).take());
        if let Some(stopped) = stopped {
            say(&what_happened(ended, was_late, stopped));
            restore(modes.as_ref());
        }
        if !restarts || signals.ends() {
            return Ok(exit_code(ended));
        }
        match monitor.next(clock.now(), stopped == Some(true), ended.success()) {
            Next::End => return Ok(exit_code(ended)),
            Next::DiedSoon => {
                say(&format!("it ran for less than {:.0} s and is not started again", LONG_ENOUGH.as_s()));
                return Ok(exit_code(ended));
            }
            Next::Restart => say("the program is started again"),
        }
        std::thread::sleep(RESTART_AFTER);
        if signals.ends() {
            say("a signal asked it to end: it is not started again");
            return Ok(exit_code(ended));
        }
    }
}

/// Starts the child. Its standard input is the connection, over which it receives the real one.
fn start() -> anyhow::Result<(Child, UnixStream)> {
    let (here, there) = UnixStream::pair()?;
    let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
    let child = Command::new(std::env::current_exe()?)
        .args(arguments)
        .env(WARD, "1")
        .stdin(OwnedFd::from(there))
        .spawn()?;
    let input = std::io::stdin();
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut passed = SendAncillaryBuffer::new(&mut space);
    let input = [input.as_fd()];
    passed.push(SendAncillaryMessage::ScmRights(&input));
    sendmsg(&here, &[IoSlice::new(b"!")], &mut passed, SendFlags::empty())?;
    Ok((child, here))
}

/// Serves a child until it closes or is late.
fn serve(frames: &mut FrameReader, line: &mut HeldLine, ear: &Ear, monitor: &mut Monitor, clock: &Stopwatch) {
    while monitor.serves() {
        let request = match frames.next(monitor.deadline().map(|deadline| deadline - clock.now())) {
            Ok(Some(frame)) => monitor.hear(frame),
            Ok(None) => {
                monitor.silent(clock.now());
                continue;
            }
            Err(_) => return monitor.closed(),
        };
        match request {
            Some(Request::Open) => match line.open() {
                Ok(cts) => tell(ear, Frame::Opened { cts }),
                Err(lost) => tell(ear, Frame::NotOpened(&lost.0)),
            },
            Some(Request::Write(bytes)) => {
                if let Err(lost) = line.write(bytes) {
                    tell(ear, Frame::Lost(&lost.0));
                }
            }
            // From this thread, which would hang: the one that reads the line could go on without it.
            Some(Request::Answer) => tell(ear, Frame::Here),
            None => {}
        }
        monitor.dealt(clock.now());
    }
}

/// Waits for the end of a child that closed its connection, and kills it after a while: it cannot drive any more.
fn wait_for(child: &mut Child) -> anyhow::Result<ExitStatus> {
    const WITHIN: Duration = Duration::from_secs(10);
    const EVERY: Duration = Duration::from_millis(20);
    let watch = Stopwatch::start();
    while watch.elapsed() < WITHIN {
        if let Some(ended) = child.try_wait()? {
            return Ok(ended);
        }
        std::thread::sleep(EVERY);
    }
    let _ = child.kill();
    Ok(child.wait()?)
}

fn what_happened(ended: ExitStatus, was_late: bool, said: bool) -> String {
    let trains = if said {
        "all trains are commanded to stop and the track power is switched off; this gives no confirmation: check that \
         the trains are at rest"
    } else {
        "NO train could be commanded to stop: switch the track power off by hand"
    };
    match ended.signal() {
        Some(_) if was_late => trains.to_owned(),
        Some(signal) => format!("the program was ended by signal {signal}; {trains}"),
        None => format!("the program has ended with status {}; {trains}", ended.code().unwrap_or_default()),
    }
}

fn exit_code(ended: ExitStatus) -> ExitCode {
    let code = ended.code().and_then(|code| u8::try_from(code).ok());
    ExitCode::from(code.unwrap_or_else(|| {
        ENDED_BY_SIGNAL.saturating_add(ended.signal().and_then(|signal| signal.try_into().ok()).unwrap_or(0))
    }))
}

/// Restores the terminal, which a child that drew on it and died has left changed.
fn restore(modes: Option<&Termios>) {
    /// Leaves the other screen of a terminal and shows its cursor.
    const PLAIN: &[u8] = b"\x1b[?1049l\x1b[?25h";
    if let Some(modes) = modes {
        let _ = tcsetattr(std::io::stdin(), OptionalActions::Now, modes);
        let _ = std::io::stdout().write_all(PLAIN).and_then(|()| std::io::stdout().flush());
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;
    use std::net::TcpListener;
    use std::thread;

    use footplate_core::TimeSpan;

    use super::*;
    use crate::guardian::ward_connection::WardConnection;
    use crate::guardian::ward_link::WardLink;
    use crate::link::{Address, CableLink, Heard, Link};

    /// Bytes that are answered.
    const TURNS: usize = 20_000;

    /// A station that answers each byte with itself.
    fn echo() -> Cable {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let place = listener.local_addr().expect("an address");
        thread::spawn(move || {
            for mut program in listener.incoming().flatten() {
                program.set_nodelay(true).expect("an option of sockets");
                thread::spawn(move || {
                    let mut bytes = [0; 64];
                    while let Ok(count @ 1..) = program.read(&mut bytes) {
                        program.write_all(&bytes[..count]).expect("it listens");
                    }
                });
            }
        });
        let address: Address = format!("marklin-serial:tcp://{place}").parse().expect("a link");
        address.cable().expect("a cable")
    }

    /// Bytes that go to the station and come back, in µs, shortest first.
    fn turns(link: &mut dyn Link) -> Vec<f64> {
        let turn = |byte: usize| {
            let watch = Stopwatch::start();
            link.write(&[byte as u8]).expect("an open line");
            let until = link.now() + TimeSpan::from_s(1.0);
            assert!(matches!(link.wait(until), Heard::Byte(heard) if heard == byte as u8));
            1e6 * watch.elapsed().as_secs_f64()
        };
        let mut turns: Vec<f64> = (0..TURNS).map(turn).collect();
        turns.sort_by(f64::total_cmp);
        turns
    }

    fn guarded(cable: &Cable) -> WardLink<WardConnection> {
        let (here, there) = UnixStream::pair().expect("a pair of sockets");
        let cable_held = cable.clone();
        thread::spawn(move || {
            let ear: Ear = Arc::new(Mutex::new(Some(FrameWriter::new(here.try_clone().expect("a handle")))));
            let mut line = HeldLine::new(cable_held, Arc::clone(&ear));
            let clock = Stopwatch::start();
            let mut monitor = Monitor::new(clock.now());
            serve(&mut FrameReader::new(here), &mut line, &ear, &mut monitor, &clock);
        });
        let connection = WardConnection::over(there, cable.clone()).expect("a handle");
        WardLink::over(connection, cable.clone()).expect("a guardian")
    }

    #[test]
    fn a_guardian_passes_bytes_in_both_directions_and_tells_of_a_line_that_goes() {
        let cable = echo();
        let mut link = guarded(&cable);
        for byte in 0..=255 {
            link.write(&[byte]).expect("an open line");
            let until = link.now() + TimeSpan::from_s(10.0);
            assert!(matches!(link.wait(until), Heard::Byte(heard) if heard == byte));
        }
        link.reopen().expect("it is there");
        link.write(b"again").expect("an open line");
        let until = link.now() + TimeSpan::from_s(10.0);
        assert!(matches!(link.wait(until), Heard::Byte(b'a')));
    }

    #[test]
    #[ignore = "measures: cargo nextest run -p footplate -E 'test(what_a_guardian_costs)' --run-ignored all --no-capture"]
    fn what_a_guardian_costs() {
        let cable = echo();
        let direct = turns(&mut CableLink::open(cable.clone()).expect("a line"));
        let held = turns(&mut guarded(&cable));
        for (name, share) in [("median", 0.5), ("p99", 0.99), ("p99.9", 0.999)] {
            let of = |turns: &[f64]| turns[(share * (TURNS - 1) as f64) as usize];
            println!(
                "{name}: {:.0} µs there and back without a guardian, {:.0} µs with one",
                of(&direct),
                of(&held)
            );
        }
    }
}
