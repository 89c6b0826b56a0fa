//! The virtual DCC-EX board: a living layout behind the texts that an EX-CommandStation exchanges.
//!
//! The codec is that of the program; the times are the simulation's own, by what was
//! measured on the real firmware. Directions are absolute, the decoders know 14 speed steps, sensors report by themselves.
//! It does not watch its clients: trains run on when they are gone.

mod obeying;

use std::collections::VecDeque;

use footplate_core::track::Leg;
use footplate_core::{Ratio, SensorId, TimeSpan, Timestamp, TrainId, TurnoutId};
use footplate_wire::dcc_ex::{
    ANSWER_LONGEST, ANSWER_SHORTEST, Framing, Reply, Request, SENSOR_DELAY_LONGEST, SENSOR_DELAY_SHORTEST,
    Throttle,
};

use crate::draws::{Draws, Purpose};
use crate::living::delivery::{Delivery, Outgoing};
use crate::living::due_queue::DueQueue;
use crate::living::s88::Edge;
use crate::living::world::LivingLayout;

/// Its identity.
const IDENTITY: &str = "DCC-EX V-5.6.0 / SIMULATED / FOOTPLATE G-virtual";
/// One byte on a serial line of 115200 baud: ten bits.
const BYTE_TIME: TimeSpan = TimeSpan::from_ns(10 * 1_000_000_000 / 115_200);
/// The size of the input buffer, in bytes.
const BUFFER: usize = 64;
/// The time that the board needs for one request (chosen so that about half of 100 requests that are written without a pause
/// are answered: on the firmware 54 were).
const BUSY: TimeSpan = TimeSpan::from_us(1_400);
/// The exponent of the distribution of the answer time between its limits: with u^1.6, half of the answers come within 3.4 ms, as measured.
const ANSWER_SHAPE: f64 = 1.6;
/// The time from a reset to the identity (2 to 6 s are reported).
const BOOT: TimeSpan = TimeSpan::from_ms(2_000);
/// The time between two lines that arrive separately: a little more than 15 characters take at 115200 baud.
const LINE_TIME: TimeSpan = TimeSpan::from_us(1_500);
/// The longest step of the world: less than the shortest delay of a report.
const LOOK_EVERY: TimeSpan = TimeSpan::from_ms(3);
/// Diagnostic texts between replies.
const CHATTER: [&str; 3] = [
    "<* LCD1: Free RAM= 5538b\n(largest <block> 5500b) *>\n",
    "<@ 0 3 \"Ready\">\n",
    "<* Opcode=s params=0 *>\n",
];

/// The properties of the board and its line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardSwitches {
    /// Whether it sends its identity after a reset, with the text around it.
    pub has_banner: bool,
    /// How often a message has a diagnostic or display text before it.
    pub chatter: Ratio,
    /// Whether it confirms a command to a turnout that is already in that position.
    pub answers_unchanged: bool,
    /// Whether turnouts can be defined by their kind, and shown. Firmware before version 4.2, and DCC++, refuse one or the other.
    pub defines: bool,
    /// Whether bytes beyond its input buffer of 64 are lost.
    pub overruns: bool,
    /// How often a byte is lost on the line, in either direction.
    pub lost: Ratio,
    /// The portions in which its messages arrive.
    pub delivery: Delivery,
}

impl Default for BoardSwitches {
    fn default() -> Self {
        Self {
            has_banner: true,
            chatter: Ratio::ZERO,
            answers_unchanged: false,
            defines: true,
            overruns: true,
            lost: Ratio::ZERO,
            delivery: Delivery::Each,
        }
    }
}

/// A locomotive that the board drives.
#[derive(Debug, Clone, Copy)]
struct Slot {
    cab: u16,
    throttle: Throttle,
    forward: bool,
    functions: u32,
}

/// A turnout that is defined on the board.
#[derive(Debug, Clone, Copy)]
struct Defined {
    id: u16,
    /// The linear address of its decoder's output.
    turnout: TurnoutId,
    thrown: bool,
    /// Whether its owner has stored it, so that a reset does not delete it.
    is_stored: bool,
}

/// A living layout behind a DCC-EX board, on a clock of its own.
#[derive(Debug, Clone)]
pub struct VirtualBoard<'l> {
    /// The layout; an operator intervenes in it.
    pub world: LivingLayout<'l>,
    switches: BoardSwitches,
    draws: Draws,
    now: Timestamp,
    /// Bytes on the line from the host.
    incoming: VecDeque<(Timestamp, u8)>,
    host_is_free: Timestamp,
    /// Bytes that have not been read, and when the board reads again.
    buffer: VecDeque<u8>,
    busy_until: Timestamp,
    framing: Framing,
    /// Replies and reports of sensors that have not been sent.
    replies: VecDeque<(Timestamp, String)>,
    pushes: DueQueue<(SensorId, bool)>,
    outgoing: Outgoing,
    slots: Vec<Slot>,
    turnouts: Vec<Defined>,
    /// The end of a power cut or a start.
    dark_until: Option<Timestamp>,
}

/// An occurrence in the station or on its line.
#[derive(Debug, Clone, Copy)]
enum Next {
    Incoming,
    Reads,
    Reply,
    Push,
    Outgoing,
    Light,
}

impl<'l> VirtualBoard<'l> {
    /// A board in front of a layout, which has been driving the trains on it: it knows which end of each leads. The track has
    /// no power yet. The sensors have the numbers of the layout, the turnouts are defined under theirs.
    pub fn new(mut world: LivingLayout<'l>, seed: u64, switches: BoardSwitches) -> Self {
        let now = world.now();
        let known = |train: TrainId| {
            let forward = world.runs_forward(train).unwrap_or(true);
            Slot { cab: train.0, throttle: Throttle::Speed(0), forward, functions: 0 }
        };
        let slots = world.train_ids().map(known).collect();
        let turnouts = world.layout().turnouts();
        let stored = |turnout: TurnoutId| {
            let thrown = world.lies(turnout) == Some(Leg::Curved);
            Defined { id: turnout.0, turnout, thrown, is_stored: true }
        };
        let turnouts = turnouts.map(|(turnout, _)| stored(turnout)).collect();
        world.power(false, now);
        world.s88.take_edges(now);
        Self {
            world,
            switches,
            draws: Draws::new(seed, Purpose::Line),
            now,
            incoming: VecDeque::new(),
            host_is_free: now,
            buffer: VecDeque::new(),
            busy_until: now,
            framing: Framing::default(),
            replies: VecDeque::new(),
            pushes: DueQueue::new(),
            outgoing: Outgoing::new(now, switches.delivery, LINE_TIME),
            slots,
            turnouts,
            dark_until: None,
        }
    }

    /// The time.
    pub const fn now(&self) -> Timestamp {
        self.now
    }

    /// The operator presses its reset button, or opens its serial port: the track loses power, and the board reads nothing for
    /// some seconds. Then it sends its identity, if it has a banner, and has forgotten all locomotives.
    pub fn restart(&mut self) {
        let now = self.now;
        self.world.power(false, now);
        self.world.forget_commands();
        self.slots.clear();
        self.turnouts.retain(|defined| defined.is_stored);
        self.buffer.clear();
        self.replies.clear();
        self.pushes.clear();
        self.outgoing.clear();
        self.framing = Framing::default();
        self.busy_until = now;
        self.dark_until = Some(now + BOOT);
    }

    /// The host puts bytes on the line, behind those that have not arrived yet.
    pub fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.host_is_free = self.host_is_free.max(self.now) + BYTE_TIME;
            self.incoming.push_back((self.host_is_free, *byte));
        }
    }

    /// Advances to a time, or until something reaches the host before it: the bytes of one portion.
    pub fn advance(&mut self, until: Timestamp) -> Option<Vec<u8>> {
        loop {
            let next = self.next().filter(|(at, _)| *at <= until);
            let at = next.map_or(until, |(at, _)| at).max(self.now);
            let looks = at.min(self.now + LOOK_EVERY);
            self.world.advance(looks);
            self.now = looks;
            self.look(looks);
            match next {
                _ if looks < at => {}
                Some((_, Next::Outgoing)) => {
                    if let Some(portion) = self.portion() {
                        return Some(portion);
                    }
                }
                Some((_, next)) => self.happen(next),
                // A push may have become due while the world went on.
                None if self.next().is_none_or(|(at, _)| at > until) => return None,
                None => {}
            }
        }
    }

    /// The next occurrence and its time; of simultaneous ones, the first of this list.
    fn next(&self) -> Option<(Timestamp, Next)> {
        let reads = (!self.buffer.is_empty() && self.dark_until.is_none()).then_some(self.busy_until);
        let coming = [
            (self.incoming.front().map(|(at, _)| *at), Next::Incoming),
            (reads, Next::Reads),
            (self.replies.front().map(|(at, _)| *at), Next::Reply),
            (self.pushes.due(), Next::Push),
            (self.outgoing.due(), Next::Outgoing),
            (self.dark_until, Next::Light),
        ];
        coming.into_iter().filter_map(|(at, next)| Some((at?, next))).min_by_key(|(at, _)| *at)
    }

    fn happen(&mut self, next: Next) {
        match next {
            Next::Incoming => {
                let byte = self.incoming.pop_front();
                let is_held = self.buffer.len() < BUFFER || !self.switches.overruns;
                if let Some((_, byte)) = byte
                    && is_held
                    && !self.loses_one()
                {
                    self.buffer.push_back(byte);
                }
            }
            Next::Reads => self.read(),
            Next::Reply => {
                if let Some((_, text)) = self.replies.pop_front() {
                    self.say(&text);
                }
            }
            Next::Push => {
                if let Some((sensor, active)) = self.pushes.take() {
                    self.say(&line(&Reply::Sensor { id: sensor.0, active }));
                }
            }
            Next::Light => {
                self.dark_until = None;
                self.buffer.clear();
                if self.switches.has_banner {
                    self.say("<* License GPLv3 fsf.org (c) dcc-ex.com *>\n");
                    self.say(&line(&Reply::Identity(IDENTITY.into())));
                    self.say("<* Track A sensOffset=0 *>\n<@ 0 3 \"Ready\">\n");
                }
            }
            Next::Outgoing => {}
        }
    }

    /// The portion that arrives next, without the bytes that the line loses.
    fn portion(&mut self) -> Option<Vec<u8>> {
        let mut bytes = self.outgoing.take()?;
        if self.switches.lost > Ratio::ZERO {
            bytes.retain(|_| !self.draws.chance(self.switches.lost.as_parts()));
        }
        (!bytes.is_empty()).then_some(bytes)
    }

    fn loses_one(&mut self) -> bool {
        let lost = self.switches.lost;
        lost > Ratio::ZERO && self.draws.chance(lost.as_parts())
    }

    /// Finds the sensors that have changed, and when the board will report them.
    fn look(&mut self, by: Timestamp) {
        for Edge { at, sensor, is_occupied } in self.world.s88.take_edges(by) {
            if self.dark_until.is_some() {
                continue;
            }
            let delays = SENSOR_DELAY_SHORTEST.as_s()..SENSOR_DELAY_LONGEST.as_s();
            let due = (at + TimeSpan::from_s(self.draws.uniform(delays))).max(self.now);
            self.pushes.add_report(due, (sensor, is_occupied), |(other, _)| *other == sensor);
        }
    }

    /// Reads bytes until a request is complete, and executes it.
    fn read(&mut self) {
        let at = self.busy_until.max(self.now);
        while let Some(byte) = self.buffer.pop_front() {
            let Some(text) = self.framing.push(byte) else { continue };
            let request = Request::read(text);
            self.busy_until = at + BUSY;
            let answer = match request {
                Some(request) => self.obey(at, request),
                None => line(&Reply::Failed),
            };
            if !answer.is_empty() {
                let limits = (ANSWER_SHORTEST.as_s(), ANSWER_LONGEST.as_s());
                let part = libm::pow(self.draws.uniform(0.0..1.0), ANSWER_SHAPE);
                let due = at + TimeSpan::from_s(limits.0 + part * (limits.1 - limits.0));
                let last = self.replies.back().map_or(due, |(last, _)| *last);
                self.replies.push_back((due.max(last), answer));
            }
            return;
        }
    }

    /// Sends a text to the host.
    fn say(&mut self, text: &str) {
        let chatter = self.switches.chatter;
        if chatter > Ratio::ZERO && self.draws.chance(chatter.as_parts()) {
            let noise = CHATTER[self.draws.below(CHATTER.len())];
            self.post(noise.as_bytes());
        }
        self.post(text.as_bytes());
    }

    fn post(&mut self, bytes: &[u8]) {
        self.outgoing.post(self.now, bytes, &mut self.draws);
    }
}

/// The line of a message.
fn line(reply: &Reply) -> String {
    format!("{reply}\n")
}
