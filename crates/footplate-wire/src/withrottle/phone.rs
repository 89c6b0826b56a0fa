//! The conversation with one phone.
//!
//! A phone's slider is a part of full speed. Steps of a decoder are uneven: the train gets the step whose measured speed is
//! nearest to that part of its highest speed, so that half of the slider is half of the speed for every train.
//!
//! What the train does by itself, for instance at the end of its movement authority, is shown on the phone. A phone that is
//! silent, leaves or loses its connection leaves no train running.

use alloc::collections::{BTreeMap, VecDeque};
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use alloc::{format, vec};

use footplate_core::track::Leg;
use footplate_core::{FunctionNumber, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};

use super::client_line::{Action, ClientLine, ThrottleKey, TurnoutAction};
use super::server_line::{FULL_SPEED, ServerLine};

/// How often a phone has to show that it is alive; JMRI and DCC-EX say the same.
pub const HEARTBEAT: TimeSpan = TimeSpan::from_ms(10_000);
/// The trains of a silent phone are stopped after this time: the heartbeat and a moment for the network. (DCC-EX waits for
/// 20 s.)
pub const SILENCE_LIMIT: TimeSpan = TimeSpan::from_ms(12_000);

/// The railway may not have carried out a command before this time; the phone shows what it commanded.
const CARRIED_OUT_WITHIN: TimeSpan = TimeSpan::from_ms(1_500);
/// A reversal stops the train first: it takes as long as the longest stop.
const REVERSED_WITHIN: TimeSpan = TimeSpan::from_ms(20_000);
/// The function that phones use as a horn: on while the key is pressed. All others change with each press, as in JMRI.
const HORN: u8 = 2;

/// A train that phones can choose.
#[derive(Debug, Clone, PartialEq)]
pub struct RosterTrain {
    /// Its address.
    pub key: ThrottleKey,
    /// Its name.
    pub name: String,
    /// Its steady speed at each step from 0 on, in any unit.
    pub speeds: Vec<f64>,
}

impl RosterTrain {
    /// The step for a part of full speed. Only 0 is a stop.
    fn step(&self, part: u8) -> SpeedStep {
        if part == 0 {
            return SpeedStep::STAND;
        }
        let top = self.speeds.last().copied().unwrap_or_default();
        let wanted = top * f64::from(part) / f64::from(FULL_SPEED);
        let off = |speed: f64| (speed - wanted).abs();
        let nearest =
            self.speeds.iter().enumerate().skip(1).min_by(|one, other| off(*one.1).total_cmp(&off(*other.1)));
        let step = nearest.and_then(|(step, _)| SpeedStep::new(u8::try_from(step).ok()?));
        step.unwrap_or(SpeedStep::STAND)
    }

    /// The part of full speed of a step.
    fn part(&self, step: SpeedStep) -> u8 {
        let top = self.speeds.last().copied().unwrap_or_default();
        let speed = self.speeds.get(usize::from(step.get())).copied().unwrap_or_default();
        if top <= 0.0 || step == SpeedStep::STAND {
            return 0;
        }
        let part = (f64::from(FULL_SPEED) * speed / top + 0.5) as u8;
        part.clamp(1, FULL_SPEED)
    }
}

/// What a train does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TrainState {
    /// The train.
    pub train: TrainId,
    /// The step commanded last.
    pub step: SpeedStep,
    /// Its direction; the one at the begin of the session is forward.
    pub forward: bool,
    /// The functions that are on, one bit each.
    pub functions: u32,
}

/// The state of the railway, as phones show it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Railway {
    /// Whether the track has power; `None` if unknown.
    pub power: Option<bool>,
    /// The trains.
    pub trains: Vec<TrainState>,
    /// The turnouts with their positions.
    pub turnouts: Vec<(TurnoutId, Option<Leg>)>,
}

impl Railway {
    fn train(&self, train: TrainId) -> Option<TrainState> {
        self.trains.iter().find(|state| state.train == train).copied()
    }

    fn leg(&self, turnout: TurnoutId) -> Option<Leg> {
        self.turnouts.iter().find(|(known, _)| *known == turnout)?.1
    }
}

/// An order of a phone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PhoneOrder {
    /// Run a train at a step.
    Speed {
        /// The train.
        train: TrainId,
        /// The step.
        step: SpeedStep,
    },
    /// Reverse a train, after a stop if it runs.
    Reverse {
        /// The train.
        train: TrainId,
    },
    /// Switch a function.
    Function {
        /// The train.
        train: TrainId,
        /// The function.
        function: FunctionNumber,
        /// On or off.
        on: bool,
    },
    /// Throw a turnout.
    Turnout {
        /// The turnout.
        turnout: TurnoutId,
        /// To this leg.
        leg: Leg,
    },
    /// Stop all trains and switch the track power off.
    EmergencyStop,
    /// Switch the track power on.
    PowerOn,
}

/// What a conversation asks of its caller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PhoneOutput {
    /// Send this line.
    Line(ServerLine),
    /// Carry this out; report a refusal with [`Phone::handle_refusal`].
    Order(PhoneOrder),
    /// Close the connection.
    Close,
}

/// What a phone shows of a train that it drives.
#[derive(Debug, Clone, Copy)]
struct Shown {
    part: u8,
    forward: bool,
    functions: u32,
    /// Until then its own last speed is not replaced by the train's.
    speed_settled: Timestamp,
    /// The same for its direction.
    direction_settled: Timestamp,
}

/// A conversation with one phone. Each `handle_…` may produce outputs; take them with [`poll_output`](Self::poll_output).
#[derive(Debug, Clone)]
pub struct Phone {
    name: String,
    roster: Vec<RosterTrain>,
    railway: Railway,
    driven: BTreeMap<(char, ThrottleKey), Shown>,
    is_watched: bool,
    last_heard: Timestamp,
    outputs: VecDeque<PhoneOutput>,
}

impl Phone {
    /// A conversation that begins now, with the lines that tell the phone what there is.
    pub fn connected(now: Timestamp, roster: Vec<RosterTrain>, railway: Railway) -> Self {
        let trains = roster.iter().map(|train| (train.key, train.name.clone())).collect();
        let lines = vec![
            ServerLine::Version,
            ServerLine::Roster(trains),
            ServerLine::Power(railway.power),
            ServerLine::TurnoutWords,
            ServerLine::Turnouts(railway.turnouts.clone()),
            heartbeat(),
        ];
        Self {
            name: String::from("a phone"),
            roster,
            railway,
            driven: BTreeMap::new(),
            is_watched: false,
            last_heard: now,
            outputs: lines.into_iter().map(PhoneOutput::Line).collect(),
        }
    }

    /// The name that the phone gave itself.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The trains that it drives.
    pub fn driven(&self) -> impl Iterator<Item = TrainId> + '_ {
        self.driven.keys().map(|(_, key)| key.train)
    }

    /// The next output, until `None`.
    pub fn poll_output(&mut self) -> Option<PhoneOutput> {
        self.outputs.pop_front()
    }

    /// When to call [`handle_timeout`](Self::handle_timeout), if no line arrives before.
    pub fn next_timeout(&self) -> Option<Timestamp> {
        (self.is_watched && !self.driven.is_empty()).then(|| self.last_heard + SILENCE_LIMIT)
    }

    /// Stops the trains of a phone that has been silent for too long, and takes them from it.
    pub fn handle_timeout(&mut self, now: Timestamp) {
        if self.next_timeout().is_some_and(|limit| now >= limit) {
            let seconds = SILENCE_LIMIT.as_s();
            self.say(ServerLine::Alert(format!("no sign of life for {seconds} s: your trains were stopped")));
            self.stop_trains();
        }
    }

    /// The connection has ended: its trains are stopped.
    pub fn handle_closed(&mut self) {
        self.outputs.clear();
        self.stop_trains();
    }

    /// A line of the phone, without its end.
    pub fn handle_line(&mut self, now: Timestamp, line: &str) {
        // Whatever it means, the phone is alive.
        self.last_heard = now;
        match ClientLine::read(line) {
            None | Some(ClientLine::Alive) => {}
            Some(ClientLine::Name(name)) => {
                self.name = name;
                self.say(heartbeat());
            }
            Some(ClientLine::Watch(is_watched)) => self.is_watched = is_watched,
            Some(ClientLine::Acquire { throttle, key }) => self.acquire(now, throttle, key),
            Some(ClientLine::Release { throttle, key }) => self.release(throttle, key),
            Some(ClientLine::Act { throttle, key, action }) => {
                for key in self.keys(throttle, key) {
                    self.act(now, throttle, key, action);
                }
            }
            Some(ClientLine::Power(true)) => self.order(PhoneOrder::PowerOn),
            Some(ClientLine::Power(false)) => self.order(PhoneOrder::EmergencyStop),
            Some(ClientLine::Turnout { turnout, action }) => self.throw(turnout, action),
            Some(ClientLine::Quit) => {
                self.stop_trains();
                self.outputs.push_back(PhoneOutput::Close);
            }
        }
    }

    /// An order was refused: the phone shows why, and what its trains really do.
    pub fn handle_refusal(&mut self, now: Timestamp, why: &str) {
        self.say(ServerLine::Alert(why.to_string()));
        for shown in self.driven.values_mut() {
            (shown.speed_settled, shown.direction_settled) = (now, now);
        }
    }

    /// The state of the railway now: the phone shows what has changed.
    pub fn handle_railway(&mut self, now: Timestamp, railway: Railway) {
        if railway.power != self.railway.power {
            self.say(ServerLine::Power(railway.power));
        }
        for (turnout, leg) in &railway.turnouts {
            if self.railway.leg(*turnout) != *leg {
                self.say(ServerLine::Turnout(*turnout, *leg));
            }
        }
        let mut lines = Vec::new();
        for ((throttle, key), shown) in &mut self.driven {
            let Some(state) = railway.train(key.train) else { continue };
            let train = self.roster.iter().find(|train| train.key.train == key.train);
            if let Some(train) = train.filter(|train| train.step(shown.part) != state.step)
                && now >= shown.speed_settled
            {
                shown.part = train.part(state.step);
                lines.push(ServerLine::Speed(*throttle, *key, Some(shown.part)));
            }
            if shown.forward != state.forward && now >= shown.direction_settled {
                shown.forward = state.forward;
                lines.push(ServerLine::Direction(*throttle, *key, shown.forward));
            }
            lines.extend(changed_functions(*throttle, *key, shown.functions, state.functions));
            shown.functions = state.functions;
        }
        self.railway = railway;
        lines.into_iter().for_each(|line| self.say(line));
    }

    fn say(&mut self, line: ServerLine) {
        self.outputs.push_back(PhoneOutput::Line(line));
    }

    fn order(&mut self, order: PhoneOrder) {
        self.outputs.push_back(PhoneOutput::Order(order));
    }

    /// The locomotives that a line is for.
    fn keys(&self, throttle: char, key: Option<ThrottleKey>) -> Vec<ThrottleKey> {
        let is_meant = |(of, known): &&(char, ThrottleKey)| {
            *of == throttle && key.is_none_or(|key| key.train == known.train)
        };
        self.driven.keys().filter(is_meant).map(|(_, key)| *key).collect()
    }

    fn acquire(&mut self, now: Timestamp, throttle: char, key: ThrottleKey) {
        let found = self.roster.iter().find(|train| train.key.train == key.train);
        let Some((train, state)) = found.zip(self.railway.train(key.train)) else {
            let trains: Vec<String> = self.roster.iter().map(|train| train.key.train.to_string()).collect();
            let number = key.train.0;
            let known = trains.join(", ");
            self.say(ServerLine::Alert(format!(
                "{number} is not a train of this session: choose one of {known}"
            )));
            return;
        };
        let shown = Shown {
            part: train.part(state.step),
            forward: state.forward,
            functions: state.functions,
            speed_settled: now,
            direction_settled: now,
        };
        self.driven.insert((throttle, key), shown);
        self.say(ServerLine::Acquired(throttle, key));
        changed_functions(throttle, key, !state.functions, state.functions).for_each(|line| self.say(line));
        self.say(ServerLine::Speed(throttle, key, Some(shown.part)));
        self.say(ServerLine::Direction(throttle, key, shown.forward));
        self.say(ServerLine::StepMode(throttle, key));
    }

    /// Stops a train that has no driver any more.
    fn release(&mut self, throttle: char, key: Option<ThrottleKey>) {
        for key in self.keys(throttle, key) {
            self.driven.remove(&(throttle, key));
            if !self.driven().any(|train| train == key.train) {
                self.order(PhoneOrder::Speed { train: key.train, step: SpeedStep::STAND });
            }
            self.say(ServerLine::Released(throttle, key));
        }
    }

    fn stop_trains(&mut self) {
        let trains: Vec<TrainId> = self.driven().collect();
        for (throttle, key) in core::mem::take(&mut self.driven).into_keys() {
            self.say(ServerLine::Released(throttle, key));
        }
        for train in trains {
            self.order(PhoneOrder::Speed { train, step: SpeedStep::STAND });
        }
    }

    fn act(&mut self, now: Timestamp, throttle: char, key: ThrottleKey, action: Action) {
        let Some(shown) = self.driven.get_mut(&(throttle, key)) else { return };
        let (train, state) = (key.train, self.railway.train(key.train));
        match action {
            Action::Speed(part) => {
                let Some(known) = self.roster.iter().find(|known| known.key.train == train) else { return };
                let step = known.step(part);
                // A slider that is moved sends many speeds, most of which are the same step.
                let own = (now < shown.speed_settled).then(|| known.step(shown.part));
                // A train that is at rest for a moment may be about to run again: a stop is always ordered.
                let is_new = step == SpeedStep::STAND || own.or(state.map(|state| state.step)) != Some(step);
                shown.part = part;
                if is_new {
                    shown.speed_settled = now + CARRIED_OUT_WITHIN;
                    self.order(PhoneOrder::Speed { train, step });
                }
            }
            Action::EmergencyStop => {
                shown.part = 0;
                self.order(PhoneOrder::EmergencyStop);
                self.say(ServerLine::Speed(throttle, key, None));
            }
            Action::Direction { forward } => {
                // Each command reverses: a phone that repeats itself must not reverse the train twice.
                if shown.forward != forward {
                    shown.forward = forward;
                    shown.direction_settled = now + REVERSED_WITHIN;
                    self.order(PhoneOrder::Reverse { train });
                }
            }
            Action::Function { function, pressed } => {
                let is_on = state.is_some_and(|state| function.is_in(state.functions));
                if function.get() == HORN {
                    self.order(PhoneOrder::Function { train, function, on: pressed });
                } else if pressed {
                    self.order(PhoneOrder::Function { train, function, on: !is_on });
                }
            }
            Action::SetFunction { function, on } => self.order(PhoneOrder::Function { train, function, on }),
            Action::QuerySpeed => {
                let part = shown.part;
                self.say(ServerLine::Speed(throttle, key, Some(part)));
            }
            Action::QueryDirection => {
                let forward = shown.forward;
                self.say(ServerLine::Direction(throttle, key, forward));
            }
        }
    }

    fn throw(&mut self, turnout: TurnoutId, action: TurnoutAction) {
        let leg = match action {
            TurnoutAction::Close => Leg::Straight,
            TurnoutAction::Throw => Leg::Curved,
            TurnoutAction::Toggle if self.railway.leg(turnout) == Some(Leg::Straight) => Leg::Curved,
            TurnoutAction::Toggle => Leg::Straight,
        };
        self.order(PhoneOrder::Turnout { turnout, leg });
    }
}

fn heartbeat() -> ServerLine {
    ServerLine::Heartbeat(HEARTBEAT.as_s() as u16)
}

/// The lines for functions that differ between two states.
fn changed_functions(
    throttle: char,
    key: ThrottleKey,
    before: u32,
    after: u32,
) -> impl Iterator<Item = ServerLine> {
    FunctionNumber::all()
        .filter(move |function| function.is_in(before ^ after))
        .map(move |function| ServerLine::Function(throttle, key, function, function.is_in(after)))
}
