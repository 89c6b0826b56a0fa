//! The virtual 6051: a living layout behind the bytes of its serial line.
//!
//! The codec is that of the program; the times are the simulation's own, by
//! what is known of the real box. One byte takes 4.583 ms in either direction. A command acts when its last byte
//! has arrived; sensors are read when the request for them has.

use std::collections::VecDeque;

use footplate_core::track::{Layout, Leg};
use footplate_core::{Ratio, TimeSpan, Timestamp, TrainId, TurnoutId};
use footplate_wire::marklin_serial::{BYTE_TIME, Message, REPLY_BYTE_SPACING, SOLENOID_HOLD_LONGEST};

use crate::circuit::CircuitError;
use crate::draws::{Draws, Purpose};
use crate::living::cts::{Cts, CtsSwitch};
use crate::living::switches::LivingSwitches;
use crate::living::world::LivingLayout;
use crate::physics_range::PhysicsRange;

/// The time from the last bit of a request to the reading of the sensors (chosen: the modules are clocked out within it).
const READING: TimeSpan = TimeSpan::from_us(300);
/// The time after which a powered coil burns (chosen: ten times what is allowed).
const BURNS: TimeSpan = TimeSpan::from_ms(5000);

/// The properties of a 6051 and its line.
#[derive(Debug, Clone, PartialEq)]
pub struct StationSwitches {
    /// How it signals that it is ready.
    pub cts: CtsSwitch,
    /// The shortest time from the last bit of a request until the first byte of the answer begins (chosen: with it a
    /// poll of five modules takes the 55 to 60 ms that are reported).
    pub turnaround: TimeSpan,
    /// The range of an additional random time, with equal probability (measured: about 5 ms).
    pub turnaround_spread: TimeSpan,
    /// Whether a byte that arrives while the station is not ready is lost, together with a byte of the present answer.
    /// Otherwise it waits.
    pub strict: bool,
    /// How often a byte is lost on the line, in either direction.
    pub lost: Ratio,
    /// How often a whole answer is lost.
    pub lost_replies: Ratio,
    /// Whether modules remember sensors that closed since the last reading.
    pub latches: bool,
    /// Whether it answers a request for a single module; otherwise it ignores the request, like any unknown byte.
    pub reads_single_modules: bool,
}

impl StationSwitches {
    /// Interfaces as they occur: latching or not, with answers within 10 to 100 ms, 2 % of answers lost, and one in three that
    /// does not answer requests for a single module.
    pub fn draw(seed: u64, physics: PhysicsRange) -> Self {
        if !physics.includes(PhysicsRange::Interface) {
            return Self::default();
        }
        let mut draws = PhysicsRange::draws(seed).split();
        Self {
            turnaround: TimeSpan::from_s(draws.uniform(0.01..0.1)),
            lost_replies: Ratio::from_percent(2.0),
            latches: draws.chance(0.5),
            reads_single_modules: !draws.chance(1.0 / 3.0),
            ..Self::default()
        }
    }
}

impl Default for StationSwitches {
    fn default() -> Self {
        Self {
            cts: CtsSwitch::per_byte(),
            turnaround: TimeSpan::from_ms(1),
            turnaround_spread: TimeSpan::from_ms(5),
            strict: true,
            lost: Ratio::ZERO,
            lost_replies: Ratio::ZERO,
            latches: true,
            reads_single_modules: true,
        }
    }
}

/// What reaches the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FromStation {
    /// The last bit of a byte.
    Byte(u8),
    /// The station is ready for a byte, or no longer.
    Cts(bool),
}

/// A solenoid was left powered for longer than half a second.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CoilAlarm {
    /// The turnout.
    pub turnout: TurnoutId,
    /// The time at which its solenoid was powered.
    pub since: Timestamp,
}

/// A solenoid under power.
#[derive(Debug, Clone, Copy)]
struct Coil {
    turnout: TurnoutId,
    since: Timestamp,
    is_alarming: bool,
}

/// A living layout behind the bytes of a 6051, on a clock of its own.
#[derive(Debug, Clone)]
pub struct VirtualStation<'l> {
    /// The layout; an operator intervenes in it.
    pub world: LivingLayout<'l>,
    switches: StationSwitches,
    draws: Draws,
    now: Timestamp,
    cts: Cts,
    /// Bytes from the host, each with the arrival of its last bit, and whether the station was ready when it began.
    incoming: VecDeque<(Timestamp, u8, bool)>,
    host_is_free: Timestamp,
    /// The first byte of a message of two.
    begun: Option<u8>,
    /// A request whose sensors have not been read.
    asked: Option<(Timestamp, Message)>,
    reply: VecDeque<(Timestamp, u8)>,
    /// When the last byte of the present answer has been sent.
    answers_until: Timestamp,
    forgets: bool,
    /// The end of a power cut.
    dark_until: Option<Timestamp>,
    coil: Option<Coil>,
    alarms: Vec<CoilAlarm>,
}

/// An occurrence in the station or on its line.
#[derive(Debug, Clone, Copy)]
enum Next {
    Incoming,
    Reading,
    Reply,
    Cts,
    Coil,
    Light,
}

impl<'l> VirtualStation<'l> {
    /// A station in front of a layout, just switched on.
    pub fn new(world: LivingLayout<'l>, seed: u64, switches: StationSwitches) -> Self {
        let now = world.now();
        Self {
            world,
            cts: Cts::new(switches.cts),
            switches,
            draws: Draws::new(seed, Purpose::Line),
            now,
            incoming: VecDeque::new(),
            host_is_free: now,
            begun: None,
            asked: None,
            reply: VecDeque::new(),
            answers_until: now,
            forgets: false,
            dark_until: None,
            coil: None,
            alarms: Vec::new(),
        }
    }

    /// A station in front of a layout with trains: see [`LivingLayout::draw`].
    ///
    /// # Errors
    /// [`CircuitError`] when the layout has no circuit.
    pub fn draw(
        layout: &'l Layout,
        seed: u64,
        trains: &[TrainId],
        switches: &LivingSwitches,
    ) -> Result<Self, CircuitError> {
        let box_switches = StationSwitches::draw(seed, switches.physics);
        Ok(Self::new(LivingLayout::draw(layout, seed, trains, switches)?, seed, box_switches))
    }

    /// The time.
    pub const fn now(&self) -> Timestamp {
        self.now
    }

    /// Whether the station says that it is ready for a byte.
    pub const fn cts(&self) -> bool {
        self.cts.is_up
    }

    /// Solenoids that were left powered for too long.
    pub fn alarms(&self) -> &[CoilAlarm] {
        &self.alarms
    }

    /// The operator disconnects the station from the mains, and connects it again some time later. Meanwhile it neither
    /// receives nor answers, and the rails have no power; afterwards it has forgotten its commands to trains, remembers
    /// every detection until it is commanded not to, and switches the power on.
    pub fn restart(&mut self, dark_for: TimeSpan) {
        let now = self.now;
        self.let_go(now);
        self.world.power(false, now);
        self.world.forget_commands();
        (self.begun, self.asked, self.forgets) = (None, None, false);
        self.reply.clear();
        self.answers_until = now;
        self.dark_until = Some(now + dark_for.max(TimeSpan::ZERO));
    }

    /// The host puts a byte on the line, behind those that have not arrived yet; its last bit arrives 4.583 ms
    /// after it began.
    pub fn write(&mut self, byte: u8) {
        let begins = self.host_is_free.max(self.now);
        self.host_is_free = begins + BYTE_TIME;
        // A byte behind another one begins before the station can have said anything.
        let is_heard = begins == self.now && self.cts.hears() || self.switches.cts == CtsSwitch::None;
        self.incoming.push_back((self.host_is_free, byte, is_heard));
    }

    /// Advances to a time, or until something reaches the host before it.
    pub fn advance(&mut self, until: Timestamp) -> Option<FromStation> {
        while let Some((at, next)) = self.next().filter(|(at, _)| *at <= until) {
            self.world.advance(at);
            self.now = self.now.max(at);
            let heard = match next {
                Next::Incoming => {
                    if let Some((at, byte, is_heard)) = self.incoming.pop_front() {
                        self.receive(at, byte, is_heard);
                    }
                    None
                }
                Next::Reading => {
                    self.answer();
                    None
                }
                Next::Reply => self.reply.pop_front().map(|(_, byte)| FromStation::Byte(byte)),
                Next::Cts => Some(FromStation::Cts(self.cts.change())),
                Next::Coil => {
                    self.watch_coil();
                    None
                }
                Next::Light => {
                    self.dark_until = None;
                    self.world.power(true, at);
                    None
                }
            };
            let is_lost = matches!(heard, Some(FromStation::Byte(_))) && self.loses_one();
            if heard.is_some() && !is_lost {
                return heard;
            }
        }
        self.world.advance(until);
        self.now = self.now.max(until);
        None
    }

    /// The next occurrence and its time; of simultaneous ones, the first of this list.
    fn next(&self) -> Option<(Timestamp, Next)> {
        let mut next = self.incoming.front().map(|(at, ..)| (*at, Next::Incoming));
        let mut or = |at: Option<Timestamp>, what| {
            if let Some(at) = at.filter(|at| next.is_none_or(|(first, _)| *at < first)) {
                next = Some((at, what));
            }
        };
        or(self.asked.map(|(at, _)| at), Next::Reading);
        or(self.reply.front().map(|(at, _)| *at), Next::Reply);
        or(self.cts.next(), Next::Cts);
        or(
            self.coil.map(|coil| coil.since + if coil.is_alarming { BURNS } else { SOLENOID_HOLD_LONGEST }),
            Next::Coil,
        );
        or(self.dark_until, Next::Light);
        next
    }

    fn loses_one(&mut self) -> bool {
        let lost = self.switches.lost;
        lost > Ratio::ZERO && self.draws.chance(lost.as_parts())
    }

    /// The last bit of a byte from the host has arrived.
    fn receive(&mut self, at: Timestamp, byte: u8, is_heard: bool) {
        if self.dark_until.is_some() {
            return;
        }
        let answers = self.asked.is_some() || at < self.answers_until;
        if (answers || !is_heard) && self.switches.strict {
            self.reply.pop_front();
            return;
        }
        if self.loses_one() {
            return;
        }
        let bytes = [self.begun.unwrap_or(byte), byte];
        let message = match self.begun.take() {
            Some(_) => Message::decode(&bytes),
            None => Message::decode(&bytes[..1]),
        };
        let Some((message, _)) = message else {
            self.begun = Some(byte);
            self.cts.received(at, at, &mut self.draws);
            return;
        };
        let busy_until = self.obey(at, message);
        self.cts.received(at, busy_until, &mut self.draws);
    }

    /// Executes a message; returns the time until which the station is busy.
    fn obey(&mut self, at: Timestamp, message: Message) -> Timestamp {
        match message {
            Message::Drive { train, step, .. } => self.world.command(train, step, at),
            Message::Reverse { train, .. } => self.world.reverse(train, at),
            Message::Turnout { turnout, curved } => {
                self.let_go(at);
                if self.world.is_powered() {
                    self.world.points.power(turnout, Leg::from_curved(curved), at);
                    self.coil = Some(Coil { turnout, since: at, is_alarming: false });
                }
            }
            Message::SolenoidOff => self.let_go(at),
            Message::Go => self.world.power(true, at),
            Message::Stop => {
                self.let_go(at);
                self.world.power(false, at);
            }
            Message::ResetMode { on } => self.forgets = on,
            Message::ReadModule { .. } if !self.switches.reads_single_modules => {}
            Message::ReadModules { .. } | Message::ReadModule { .. } => return self.ask(at, message),
            Message::Functions { .. } | Message::Unknown { .. } => {}
        }
        at
    }

    fn ask(&mut self, at: Timestamp, request: Message) -> Timestamp {
        let bytes = 2 * request.modules_read().count() as i64;
        let spread = self.switches.turnaround_spread.as_s();
        let varies = TimeSpan::from_s(self.draws.uniform(0.0..spread.max(f64::MIN_POSITIVE)));
        let first = at + (self.switches.turnaround + varies).max(READING) + BYTE_TIME;
        self.asked = Some((at + READING, request));
        self.answers_until = first + TimeSpan::from_ns((bytes - 1) * REPLY_BYTE_SPACING.as_ns());
        self.answers_until
    }

    /// Reads the sensors and sends their states.
    fn answer(&mut self) {
        let Some((at, request)) = self.asked.take() else { return };
        let lost = self.switches.lost_replies;
        let is_lost = lost > Ratio::ZERO && self.draws.chance(lost.as_parts());
        let bytes = 2 * request.modules_read().count() as i64;
        let spacing = REPLY_BYTE_SPACING.as_ns();
        let mut goes = self.answers_until - TimeSpan::from_ns((bytes - 1) * spacing);
        for module in request.modules_read() {
            for byte in self.world.s88.read(module, at, self.forgets, self.switches.latches).encode() {
                if !is_lost {
                    self.reply.push_back((goes, byte));
                }
                goes += TimeSpan::from_ns(spacing);
            }
        }
    }

    fn let_go(&mut self, at: Timestamp) {
        if let Some(coil) = self.coil.take() {
            self.world.points.release(coil.turnout, at);
        }
    }

    fn watch_coil(&mut self) {
        let Some(coil) = &mut self.coil else { return };
        if coil.is_alarming {
            let turnout = coil.turnout;
            self.coil = None;
            self.world.burn(turnout, self.now);
        } else {
            coil.is_alarming = true;
            self.alarms.push(CoilAlarm { turnout: coil.turnout, since: coil.since });
        }
    }
}
