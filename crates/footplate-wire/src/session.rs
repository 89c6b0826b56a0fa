//! A session with a command station, without a socket: bytes and commands in, bytes and entries of the recording out.

use alloc::boxed::Box;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::any::Any;
use core::fmt::{Display, Formatter, Result as FmtResult};
use core::ops::RangeInclusive;

use footplate_core::{
    Command, DecoderSteps, Event, FunctionNumber, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId,
    TurnoutId,
};

use crate::reported_functions::ReportedFunctions;

/// A session, driven by the loop around a station's line.
///
/// Every `handle_…` may produce outputs. Take them at once with [`poll_output`](Self::poll_output) until there are none: a byte counts
/// as written at the `now` of the call before. Then wait for a byte, the hand-shake or [`next_timeout`](Self::next_timeout).
pub trait Session: Any {
    /// The same session again, to see what it would do.
    fn copied(&self) -> Box<dyn Session>;

    /// Takes bytes from the station.
    fn handle_bytes(&mut self, now: Timestamp, bytes: &[u8]);

    /// Takes the state of the station's hand-shake line (`up`: bytes may be written), once at the beginning, too. No effect on links
    /// without one.
    fn handle_cts(&mut self, _now: Timestamp, _up: bool) {}

    /// Restarts after the line was lost and opened again: bytes on it are gone, and the station may wait for the rest of them.
    fn handle_reopened(&mut self, now: Timestamp);

    /// Sets how many steps a train's decoder has; 14 unless set. Steps of later commands count in these.
    ///
    /// # Errors
    /// When the station has no such address, or cannot command decoders with so many steps.
    fn set_decoder(&mut self, train: TrainId, steps: DecoderSteps) -> Result<(), CommandError>;

    /// Sets whether a train ran forward last in an earlier session, which its station may have forgotten. Not all know directions.
    fn set_direction(&mut self, _train: TrainId, _forward: bool) {}

    /// The session of that [direction](Self::set_direction) has no end, and may have reversed the train since, or not have kept any
    /// direction: the station is asked, and if it says otherwise, [`LinkNotice::DirectionContradicted`] follows.
    fn check_direction(&mut self, _train: TrainId) {}

    /// Sends a command as soon as the line is free.
    ///
    /// # Errors
    /// When the station has no such command, too many commands wait, or the session is closing. Nothing is sent then.
    fn handle_command(&mut self, now: Timestamp, command: Command) -> Result<(), CommandError>;

    /// Stops all locomotives of the station next, also those that are unknown here. No effect on stations without such a command.
    fn stop_all(&mut self) {}

    /// Keeps the line free for a command at this time: no poll begins that could still occupy it then. A later call replaces an
    /// earlier one; `None` cancels it. No effect on links that do not poll.
    fn hold_line(&mut self, _until: Option<Timestamp>) {}

    /// Polls the module of this sensor often and others rarely; `None`: all alike. No effect on links that do not poll.
    fn watch(&mut self, _sensor: Option<SensorId>) {}

    /// Also reports when one of these sensors becomes free: the detectors of blocks. Others report only trains.
    fn report_releases(&mut self, _of: &[SensorId]) {}

    /// Sets how much longer than usual for this station the line may delay a report (as measured): a sensor may have become occupied
    /// that much earlier. No effect on links that poll, whose line is not shared.
    fn expect_delays(&mut self, _excess: TimeSpan) {}

    /// Advances the clock: [`next_timeout`](Self::next_timeout) is due, or the loop woke for another reason.
    fn handle_timeout(&mut self, now: Timestamp);

    /// Returns the next output, until `None`.
    fn poll_output(&mut self) -> Option<Transmit>;

    /// When to call [`handle_timeout`](Self::handle_timeout), once all outputs are taken; `None`: only when something arrives.
    fn next_timeout(&self) -> Option<Timestamp>;

    /// Ends the session with [`LinkNotice::Closed`]: driven trains stopped, solenoids released, power off, waiting commands dropped.
    fn close(&mut self, now: Timestamp);

    /// Returns how far the end has come; before [`close`](Self::close), everything that it would have to do.
    fn closing(&self) -> Closing;
}

/// An output of a session.
#[derive(Debug, Clone, PartialEq)]
pub enum Transmit {
    /// Write this byte now.
    Byte(u8),
    /// Write these bytes now, in one piece: some stations cannot read a message that arrives in parts.
    Message(Vec<u8>),
    /// An entry of the recording: a detection, or a command that was sent.
    Event(Event),
    /// Something a person should know.
    Notice(LinkNotice),
    /// What the station has reported of a train's functions, when that changes. A link without such reports has no such output.
    Functions(TrainId, ReportedFunctions),
    /// Whether a train is commanded forward from now on, for [`set_direction`](Session::set_direction) of a later session.
    Direction(TrainId, bool),
    /// The number that a decoder reports as its train's speed, in a unit that only its owner knows; it may be seconds old.
    ReportedSpeed(TrainId, u16),
}

/// What a person should know about the line.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum LinkNotice {
    /// The station has answered for the first time, or again after a silence.
    Answers,
    /// A reply was incomplete; it was dropped, and the poll is repeated.
    ReplyLost {
        /// Bytes that were asked for.
        expected: usize,
        /// Bytes that came.
        found: usize,
    },
    /// Unexpected bytes arrived; they were dropped, and the line is synchronised again.
    UnexpectedBytes {
        /// How many since the last such notice.
        count: usize,
    },
    /// The station has not answered for a while.
    Silent {
        /// For how long.
        since: TimeSpan,
        /// Bytes that came in that time; none of them made a whole reply.
        bytes: usize,
        /// What a person should check on this kind of link.
        check: &'static str,
    },
    /// Too many bytes could not be read: the line is faulty. Reported once.
    Unreadable {
        /// Bytes that could not be read.
        bytes: usize,
        /// What a person should check on this kind of link.
        check: &'static str,
    },
    /// Many replies came garbled: nothing that is sent or heard can be relied on until the line is clean.
    Garbled,
    /// The line was lost and is open again: what was sent and reported meanwhile is unknown.
    Reopened,
    /// The station has identified itself.
    Identified(String),
    /// The station was reset: it lost all commands, and trains stopped where they were when the power went off.
    Restarted,
    /// The station did not confirm a command after all repeats; it was given up.
    Unconfirmed(Command),
    /// The station is locked for driving over the network.
    Locked,
    /// The station does not report everything that this client subscribed to.
    BroadcastsRefused {
        /// The flags that it left out.
        missing: u32,
        /// What a person should check on this kind of link.
        check: &'static str,
    },
    /// The station has no such turnout.
    TurnoutRefused {
        /// The turnout.
        turnout: TurnoutId,
        /// What a person should do at this kind of station.
        check: String,
    },
    /// The station refused a request.
    Refused(String),
    /// The station has no slot for a train: others use all of them.
    NoSlot(TrainId),
    /// Another throttle drives a train of this program.
    OtherThrottle {
        /// The train.
        train: TrainId,
        /// Whether it was reversed.
        reversed: bool,
    },
    /// Another throttle switched functions of a train of this program.
    OtherFunctions {
        /// The train.
        train: TrainId,
        /// What the station has reported of its functions.
        functions: ReportedFunctions,
    },
    /// The power went off the track without a command of this program.
    PowerLost,
    /// The station has kept its hand-shake line down, and nothing may be written.
    NotReady {
        /// For how long.
        since: TimeSpan,
        /// What a person should check on this kind of link.
        check: &'static str,
    },
    /// A command was sent shortly before a reply was lost, and was sent again.
    Repeated(Command),
    /// A train was commanded to reverse shortly before a reply was lost. The command is not repeated, because it toggles, and the
    /// direction cannot be read back: check how the train faces.
    ReverseInDoubt(TrainId),
    /// A session that has no end commanded a train in one direction, as far as was kept, and its station has the other one: it is not known
    /// which of them its decoder has heard.
    DirectionContradicted(TrainId),
    /// This sensor was occupied when the line was opened: a train is on it, or it is stuck. It is reported again after it was free.
    HeldClosed(SensorId),
    /// The interface does not answer all reads of sensor modules.
    LimitedReads {
        /// Which it answers, and what follows from that.
        how: &'static str,
    },
    /// The solenoid of a turnout was powered for longer than it tolerates.
    SolenoidLate {
        /// The turnout.
        turnout: TurnoutId,
        /// How long it was powered.
        held: TimeSpan,
    },
    /// The session is closed; nothing more will be written.
    Closed(Closing),
}

/// How a link confirms that the station received a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Confirmation {
    /// Nothing.
    #[default]
    Nothing,
    /// The hand-shake accepts the bytes; the link confirms no more than that.
    HandShake,
    /// The station answers each command; a command without an answer counts as not sent.
    Replies,
}

/// What the end of a session commanded, and how it was confirmed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Closing {
    /// Trains that were commanded to stop.
    pub commanded_to_stop: Vec<TrainId>,
    /// Trains that may be running and were not commanded to stop.
    pub not_commanded: Vec<TrainId>,
    /// Whether the solenoids were released; `None` where the station does that by itself.
    pub solenoids_released: Option<bool>,
    /// Whether the track power was switched off.
    pub power_off: bool,
    /// How the station confirmed it.
    pub confirmation: Confirmation,
}

impl Closing {
    /// Whether everything necessary was commanded.
    pub fn is_complete(&self) -> bool {
        self.not_commanded.is_empty() && self.solenoids_released != Some(false) && self.power_off
    }
}

/// Why a command was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum CommandError {
    /// This link has no such locomotive address.
    Train {
        /// The train.
        train: TrainId,
        /// The first and the last address.
        addresses: (u16, u16),
    },
    /// This link commands no decoders with so many steps.
    Decoder {
        /// The train.
        train: TrainId,
        /// Its steps.
        steps: DecoderSteps,
    },
    /// The step is above the highest of the train's decoder.
    Step {
        /// The step.
        step: SpeedStep,
        /// The highest.
        highest: u8,
    },
    /// The function is above the highest that this link can switch.
    Function {
        /// The function.
        function: FunctionNumber,
        /// The highest.
        highest: u8,
    },
    /// This link has no such turnout address.
    Turnout {
        /// The turnout.
        turnout: TurnoutId,
        /// The first and the last address.
        addresses: (u16, u16),
    },
    /// The station knows no such command.
    Unknown,
    /// This many commands wait already: the line is stuck or overloaded.
    TooManyWaiting(usize),
    /// The session is closed or being closed.
    Closed,
}

impl CommandError {
    /// Refuses a train whose address a link does not have.
    pub(crate) fn check_train(train: TrainId, addresses: &RangeInclusive<u16>) -> Result<(), Self> {
        let range = (*addresses.start(), *addresses.end());
        addresses.contains(&train.0).then_some(()).ok_or(Self::Train { train, addresses: range })
    }

    /// Refuses a turnout whose address a link does not have.
    pub(crate) fn check_turnout(turnout: TurnoutId, addresses: &RangeInclusive<u16>) -> Result<(), Self> {
        let range = (*addresses.start(), *addresses.end());
        addresses.contains(&turnout.0).then_some(()).ok_or(Self::Turnout { turnout, addresses: range })
    }
}

impl Display for CommandError {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        match self {
            Self::Train { train, addresses: (first, last) } => {
                write!(f, "train {train} has no address here; addresses are {first} to {last}")
            }
            Self::Decoder { train, steps } => write!(
                f,
                "train {train} has {steps} speed steps, and this station commands 14: leave out its steps, or use another \
                 station"
            ),
            Self::Step { step, highest } => {
                write!(f, "step {step} is beyond the decoder; steps are 0 to {highest}")
            }
            Self::Function { function, highest } => {
                write!(f, "{function} cannot be switched over this link; functions are F0 to F{highest}")
            }
            Self::Turnout { turnout, addresses: (first, last) } => {
                write!(f, "turnout {turnout} has no address here; addresses are {first} to {last}")
            }
            Self::Unknown => f.write_str("the station has no such command"),
            Self::TooManyWaiting(count) => {
                write!(f, "{count} commands already wait for the line; wait until some have been sent")
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
            Self::Unreadable { bytes, check } => write!(f, "{bytes} bytes came that could not be read; {check}"),
            Self::Garbled => f.write_str("the line garbles data: trains stop until it is clean; check its cable"),
            Self::Reopened => f.write_str("the line is open again; trains are stopped, and the station is asked for all states"),
            Self::Identified(identity) => write!(f, "the station is {identity}"),
            Self::Restarted => f.write_str(
                "the station was reset; trains stopped when the power went and stay so until they are commanded anew",
            ),
            Self::Unconfirmed(command) => {
                write!(f, "the station did not confirm: {}; check that it has not stopped", Said(*command))
            }
            Self::Locked => f.write_str(
                "the station is locked: it ignores driving over the network until its unlock code is entered in its app",
            ),
            Self::BroadcastsRefused { missing, check } => write!(
                f,
                "the station does not report everything it was asked to (broadcast flags {missing:#010x}): {check}"
            ),
            Self::TurnoutRefused { turnout, check } => {
                write!(f, "the station has no turnout {turnout}: {check}")
            }
            Self::Refused(message) => write!(f, "the station refused a request: {message}"),
            Self::NoSlot(train) => write!(
                f,
                "the station has no free slot for train {train}: release a locomotive at a throttle that drives none, or \
                 restart the station"
            ),
            Self::OtherFunctions { train, functions } => {
                let on = FunctionNumber::all().filter(|function| functions.is_on(*function) == Some(true));
                let on: Vec<String> = on.map(|function| format!("{function}")).collect();
                let on = if on.is_empty() { "none".into() } else { on.join(", ") };
                write!(f, "another throttle switched functions of train {train}; on now: {on}")
            }
            Self::OtherThrottle { train, reversed } => write!(
                f,
                "another throttle {} train {train}; drive it from one place only",
                if *reversed { "reversed" } else { "drives" }
            ),
            Self::PowerLost => f.write_str(
                "the track has lost its power: a short circuit, or another program switched it off; clear it, then \
                 switch the power on",
            ),
            Self::NotReady { since, check } => {
                write!(f, "the station has not been ready for {:.1} s (CTS is down); {check}", since.as_s())
            }
            Self::Repeated(command) => {
                write!(f, "repeated, because a reply was lost after it: {}", Said(*command))
            }
            Self::ReverseInDoubt(train) => write!(
                f,
                "train {train} was commanded to reverse just before a reply was lost; it may face \
                 either direction"
            ),
            Self::DirectionContradicted(train) => write!(
                f,
                "train {train} may have been reversed just before the last session died; it may face either direction"
            ),
            Self::HeldClosed(sensor) => {
                write!(f, "sensor {sensor} is occupied from the start: a train is on it, or it is stuck")
            }
            Self::LimitedReads { how } => write!(f, "the interface {how}"),
            Self::SolenoidLate { turnout, held } => write!(
                f,
                "turnout {turnout} was powered for {:.0} ms; check that its coil is not hot",
                ms(*held)
            ),
            Self::Closed(closing) => closing.fmt(f),
        }
    }
}

/// Prints a command.
struct Said(Command);

impl Display for Said {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        match self.0 {
            Command::Speed { train, step } => write!(f, "train {train} step {step}"),
            Command::Reverse { train } => write!(f, "train {train} reverse"),
            Command::Turnout { turnout, curved } => {
                write!(f, "turnout {turnout} {}", if curved { "curved" } else { "straight" })
            }
            Command::Function { train, function, on } => {
                write!(f, "train {train} {function} {}", if on { "on" } else { "off" })
            }
            Command::PowerOff => f.write_str("power off"),
            Command::PowerOn => f.write_str("power on"),
        }
    }
}

impl Display for Closing {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        let not = |done| if done { "" } else { "not " };
        let listed =
            |trains: &[TrainId]| trains.iter().map(ToString::to_string).collect::<Vec<String>>().join(", ");
        if !self.commanded_to_stop.is_empty() {
            write!(f, "commanded to stop: {}; ", listed(&self.commanded_to_stop))?;
        }
        if !self.not_commanded.is_empty() {
            write!(f, "NOT commanded to stop and possibly running: {}; ", listed(&self.not_commanded))?;
        }
        if let Some(released) = self.solenoids_released {
            write!(f, "solenoids {}released, ", not(released))?;
        }
        write!(f, "track power {}switched off; ", not(self.power_off))?;
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
