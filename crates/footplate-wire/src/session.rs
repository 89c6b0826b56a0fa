//! A command station spoken to without a socket: bytes and commands in, bytes and entries of the recording out.

use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::{Display, Formatter, Result as FmtResult};
use core::ops::RangeInclusive;

use footplate_core::{Command, Event, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use crate::marklin_serial::ModuleReads;

/// What the loop around a command station's line hands over and asks for.
///
/// Every `handle_…` may make outputs: take them with [`poll_output`](Self::poll_output) until there are none, at
/// once, because a byte counts as written at the `now` of the call before. Then wait for whatever comes first, a byte,
/// the hand-shake or [`next_timeout`](Self::next_timeout).
pub trait Session {
    /// Bytes have come from the station.
    fn handle_bytes(&mut self, now: Timestamp, bytes: &[u8]);

    /// The station's hand-shake line is `up` (bytes may come) now; also said once at the beginning. Without effect on links
    /// that have none.
    fn handle_cts(&mut self, _now: Timestamp, _up: bool) {}

    /// The line was lost and has been opened again: what was on it is gone, and the station may wait for the rest of it.
    fn handle_reopened(&mut self, now: Timestamp);

    /// Say this to the station as soon as the line is free.
    ///
    /// # Errors
    ///
    /// When the station has no bytes for it, too much is waiting already, or the session is being closed. Nothing is
    /// said then.
    fn handle_command(&mut self, now: Timestamp, command: Command) -> Result<(), CommandError>;

    /// A command is expected to leave at this time: begin no poll that could still occupy the line then. A later
    /// word replaces an earlier one; `None` takes it back. Without effect on links that do not poll.
    fn hold_line(&mut self, _until: Option<Timestamp>) {}

    /// Ask for the module of this contact often, for others now and then. `None`: for all alike. Without effect on links that
    /// do not poll.
    fn watch(&mut self, _sensor: Option<SensorId>) {}

    /// The line may delay a report by so much more than is usual for this kind of station (as measured): sensors may have become
    /// occupied that much earlier. Without effect on links that poll, as their line is not shared.
    fn expect_delays(&mut self, _excess: TimeSpan) {}

    /// The time has come that was asked for, or it is a good moment to look at the clock anyway.
    fn handle_timeout(&mut self, now: Timestamp);

    /// The next thing to do, until `None`.
    fn poll_output(&mut self) -> Option<Transmit>;

    /// When it wants to be asked again; later than the last `now` once all outputs are taken. `None`: only when
    /// something comes.
    fn next_timeout(&self) -> Option<Timestamp>;

    /// Stop every train that was ever told a step, release what is powered, take the power from the track, and ask
    /// for nothing more. What was waiting is dropped. [`LinkNotice::Closed`] says when it is done.
    fn close(&mut self, now: Timestamp);

    /// How far the closing has come; all that was not told yet if [`close`](Self::close) was never called.
    fn closing(&self) -> Closing;
}

/// What a session asks of the loop around it.
#[derive(Debug, Clone, PartialEq)]
pub enum Transmit {
    /// Write this byte now.
    Byte(u8),
    /// Write these bytes now, in one piece: some stations do not put a message together that arrives in several.
    Message(Vec<u8>),
    /// An entry of the recording: a contact was reported, a command has left.
    Event(Event),
    /// For people to know.
    Notice(LinkNotice),
}

/// What a person should know about the line.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum LinkNotice {
    /// The station has answered for the first time, or again after a silence.
    Answers,
    /// A reply did not come whole; it was dropped, and the station is asked again.
    ReplyLost {
        /// Bytes that were asked for.
        expected: usize,
        /// Bytes that came.
        found: usize,
    },
    /// Bytes came that nobody asked for; what came with them was dropped, and the line is brought back into step.
    UnexpectedBytes {
        /// How many since the last such notice.
        count: usize,
    },
    /// Nothing that was asked has been answered for a while.
    Silent {
        /// For how long.
        since: TimeSpan,
        /// Bytes that came in that time; none of them made a whole reply.
        bytes: usize,
        /// What a person should check on this kind of link.
        check: &'static str,
    },
    /// So much of what came could not be read that the line is out of order. Said once.
    Unreadable {
        /// Bytes that could not be read.
        bytes: usize,
        /// What a person should check on this kind of link.
        check: &'static str,
    },
    /// The station has said what it is.
    Identified {
        /// Its own words.
        identity: String,
    },
    /// The station was reset: it has forgotten all commands, and trains stopped where they were when the power went.
    Restarted,
    /// The station did not confirm a command, however often it was repeated; it is given up.
    Unconfirmed {
        /// The command.
        command: Command,
    },
    /// The station is locked for driving over the network.
    Locked,
    /// The station does not tell this client everything that it was asked to.
    BroadcastsRefused {
        /// The flags that it left out.
        missing: u32,
    },
    /// The station has no such turnout.
    TurnoutRefused {
        /// The turnout.
        turnout: TurnoutId,
    },
    /// The station has no slot for a train: others use all of them.
    NoSlot {
        /// The train.
        train: TrainId,
    },
    /// Another throttle drives a train of this program.
    OtherThrottle {
        /// The train.
        train: TrainId,
        /// Whether it was reversed.
        reversed: bool,
    },
    /// The power went off the track without a command of this program.
    PowerLost,
    /// The station has kept its hand-shake line down, and nothing may be written.
    NotReady {
        /// For how long.
        since: TimeSpan,
    },
    /// A command went out shortly before a reply was lost, and was said again.
    Repeated {
        /// The command.
        command: Command,
    },
    /// A train was commanded to reverse shortly before a reply was lost. It is not said again, because a second time
    /// would turn it back, and cannot be read back: see which way it faces.
    ReverseInDoubt {
        /// The train.
        train: TrainId,
    },
    /// This contact was closed when the line was opened and still is: a train stands on it, or it is stuck.
    /// It is reported when it has been open and closes again.
    HeldClosed {
        /// The contact.
        sensor: SensorId,
    },
    /// The interface does not answer all reads of sensor modules.
    Reads(ModuleReads),
    /// The solenoid of a turnout has been powered for longer than it bears.
    SolenoidLate {
        /// The turnout.
        turnout: TurnoutId,
        /// How long it was powered.
        held: TimeSpan,
    },
    /// The session is closed; nothing more will be written.
    Closed(Closing),
}

/// What on a link says that a station heard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Confirmation {
    /// Nothing.
    #[default]
    Nothing,
    /// It took the bytes by its hand-shake; more than that, the link never confirms.
    HandShake,
    /// It answers each command; what was not answered is counted as not said.
    Replies,
}

/// What the station was told at the end, and whether anything says that it heard.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Closing {
    /// Trains that were commanded to stop.
    pub commanded_to_stop: Vec<TrainId>,
    /// Trains that run or may run and were not commanded to stop.
    pub not_commanded: Vec<TrainId>,
    /// Whether the solenoids were released; `None` where the station does that by itself.
    pub solenoids_released: Option<bool>,
    /// Whether the power was taken from the track.
    pub power_off: bool,
    /// What says that the station heard.
    pub confirmation: Confirmation,
}

impl Closing {
    /// Whether everything was said that had to be.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.not_commanded.is_empty() && self.solenoids_released != Some(false) && self.power_off
    }
}

/// Why a command was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum CommandError {
    /// No locomotive decoder has this address here.
    Train {
        /// The train.
        train: TrainId,
        /// The first and the last address.
        addresses: (u16, u16),
    },
    /// Beyond the steps of this link.
    Step {
        /// The step.
        step: SpeedStep,
        /// The highest.
        highest: u8,
    },
    /// No turnout has this address here.
    Turnout {
        /// The turnout.
        turnout: TurnoutId,
        /// The first and the last address.
        addresses: (u16, u16),
    },
    /// The station knows no such command.
    Unknown,
    /// This many commands wait already; the line is stuck or is told more than it can carry.
    TooManyWaiting(usize),
    /// The session is closed or being closed.
    Closed,
}

impl CommandError {
    /// Refuses a train whose address a link does not have.
    pub(crate) fn check_train(train: TrainId, addresses: &RangeInclusive<u16>) -> Result<(), Self> {
        let has_address = addresses.contains(&train.0);
        let addresses = (*addresses.start(), *addresses.end());
        has_address.then_some(()).ok_or(Self::Train { train, addresses })
    }

    /// Refuses a turnout whose address a link does not have.
    pub(crate) fn check_turnout(turnout: TurnoutId, addresses: &RangeInclusive<u16>) -> Result<(), Self> {
        let has_address = addresses.contains(&turnout.0);
        let addresses = (*addresses.start(), *addresses.end());
        has_address.then_some(()).ok_or(Self::Turnout { turnout, addresses })
    }
}

impl Display for CommandError {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        match self {
            Self::Train { train, addresses: (first, last) } => {
                write!(f, "train {train} has no address here; addresses are {first} to {last}")
            }
            Self::Step { step, highest } => {
                write!(f, "step {step} is beyond the decoder; steps are 0 to {highest}")
            }
            Self::Turnout { turnout, addresses: (first, last) } => {
                write!(f, "turnout {turnout} has no address here; addresses are {first} to {last}")
            }
            Self::Unknown => f.write_str("the station has no such command"),
            Self::TooManyWaiting(count) => {
                write!(
                    f,
                    "{count} commands are already waiting for the line; wait until some have been \
                           sent"
                )
            }
            Self::Closed => f.write_str("the link is being closed; open it again to command trains"),
        }
    }
}

impl core::error::Error for CommandError {}

impl Display for LinkNotice {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        let ms = |span: TimeSpan| span.as_ms();
        match self {
            Self::Answers => f.write_str("the station answers"),
            Self::ReplyLost { expected, found } => {
                write!(f, "a sensor reply had {found} bytes instead of {expected}; it was dropped and \
                           the read repeated")
            }
            Self::UnexpectedBytes { count } => write!(
                f,
                "{count} unexpected bytes were dropped; the line is being synchronised again"
            ),
            Self::Silent { since, bytes: 0, check } => {
                write!(f, "the station has answered nothing for {:.1} s; {check}", since.as_s())
            }
            Self::Silent { since, bytes, check } => {
                write!(f, "no whole reply for {:.1} s, only {bytes} stray bytes; {check}", since.as_s())
            }
            Self::Unreadable { bytes, check } => {
                write!(f, "{bytes} bytes came that could not be read; {check}")
            }
            Self::Identified { identity } => write!(f, "the station is {identity}"),
            Self::Restarted => f.write_str(
                "the station was reset; trains stopped when the power went and stay so until they are commanded anew",
            ),
            Self::Unconfirmed { command } => {
                write!(f, "the station did not confirm: {}; check that it has not stopped", Said(*command))
            }
            Self::Locked => f.write_str(
                "the station is locked: it ignores driving over the network until its unlock code is entered in its app",
            ),
            Self::BroadcastsRefused { missing } => write!(
                f,
                "the station does not report everything it was asked to (broadcast flags {missing:#010x}): check its firmware, \
                 and what its sensors are connected to (feedback=r-bus, can or loconet)"
            ),
            Self::TurnoutRefused { turnout } => write!(
                f,
                "the station has no turnout {turnout}: define it there (<T {turnout} DCC address sub>), or leave out \
                 `turnouts=defined`"
            ),
            Self::NoSlot { train } => write!(
                f,
                "the station has no free slot for train {train}: release a locomotive at a throttle that drives none, or \
                 restart the station"
            ),
            Self::OtherThrottle { train, reversed } => write!(
                f,
                "another throttle {} train {train}; drive it from one place only",
                if *reversed { "reversed" } else { "drives" }
            ),
            Self::PowerLost => f.write_str(
                "the track has lost its power: a short circuit, or another program switched it off; clear it, then \
                 switch the power on",
            ),
            Self::NotReady { since } => write!(
                f,
                "the station has not been ready for {:.1} s (CTS is down); check its power and the cable, or try \
                 the timed mode if the adapter has no CTS",
                since.as_s()
            ),
            Self::Repeated { command } => {
                write!(f, "repeated, because a reply was lost after it: {}", Said(*command))
            }
            Self::ReverseInDoubt { train } => write!(
                f,
                "train {train} was commanded to reverse just before a reply was lost; it may face \
                 either direction"
            ),
            Self::HeldClosed { sensor } => {
                write!(f, "sensor {sensor} is occupied from the start: a train is on it, or it is stuck")
            }
            Self::Reads(reads) => write!(f, "the interface {reads}"),
            Self::SolenoidLate { turnout, held } => write!(
                f,
                "turnout {turnout} was powered for {:.0} ms; check that its coil is not hot",
                ms(*held)
            ),
            Self::Closed(closing) => closing.fmt(f),
        }
    }
}

/// A command in words.
struct Said(Command);

impl Display for Said {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        match self.0 {
            Command::Speed { train, step } => write!(f, "train {train} step {step}"),
            Command::Reverse { train } => write!(f, "train {train} reverse"),
            Command::Turnout { turnout, curved } => {
                write!(f, "turnout {turnout} {}", if curved { "curved" } else { "straight" })
            }
            Command::PowerOff => f.write_str("power off"),
            Command::PowerOn => f.write_str("power on"),
        }
    }
}

/// Trains as `24, 58`.
struct Listed<'l>(&'l [TrainId]);

impl Display for Listed<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        for (at, train) in self.0.iter().enumerate() {
            let comma = if at == 0 { "" } else { ", " };
            write!(f, "{comma}{train}")?;
        }
        Ok(())
    }
}

impl Display for Closing {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        let told = |said| if said { "" } else { "not " };
        if !self.commanded_to_stop.is_empty() {
            write!(f, "commanded to stop: {}; ", Listed(&self.commanded_to_stop))?;
        }
        if !self.not_commanded.is_empty() {
            write!(f, "NOT commanded to stop and possibly running: {}; ", Listed(&self.not_commanded))?;
        }
        if let Some(released) = self.solenoids_released {
            write!(f, "solenoids {}released, ", told(released))?;
        }
        write!(f, "track power {}switched off; ", told(self.power_off))?;
        f.write_str(match self.confirmation {
            Confirmation::HandShake => {
                "the station accepted the bytes; this line gives no further \
                                        confirmation"
            }
            Confirmation::Nothing => "this line gives no confirmation: check that the trains are at rest",
            Confirmation::Replies if self.is_complete() => "the station has confirmed it",
            Confirmation::Replies => {
                "the station did not confirm the rest: check that the trains are at rest, and switch \
                 the track power off by hand"
            }
        })
    }
}
