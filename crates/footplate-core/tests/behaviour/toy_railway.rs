//! A small hand-made railway for tests of machines that drive trains: constant accelerations, a slow line, polled
//! sensors.
//!
//! ```text
//!          +-- 500 -- B1 -- 500 --+
//! A1 -200- 1                      2 -200- D1 --- 900 --- A1      EN1 -300- E1 -800- F1 -900- EX2
//!          +-- 520 -- C1 -- 450 --+
//! ```
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "a test may stop at the first surprise")]

use std::collections::{BTreeSet, VecDeque};
use std::sync::OnceLock;

use footplate_core::control::{Driver, Finished, Machine, Notice, Output};
use footplate_core::model::MotionFit;
use footplate_core::model::survey::SectionIndex;
use footplate_core::model::{MotionModel, StepUse};
use footplate_core::track::{
    Layout, LayoutPlan, Leg, Place, Position, RailEnd, Stretch, Survey, TurnoutStates,
};
use footplate_core::{
    Command, Event, EventKind, Length, Report, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId,
};

/// The clock of this world.
const TICK: TimeSpan = TimeSpan::from_ms(1);
/// Two bytes on the line.
const LINE: TimeSpan = TimeSpan::from_us(9_167);
/// From one poll to the next.
const POLL: TimeSpan = TimeSpan::from_ms(65);
/// From a command to its effect on the train.
const DEAD: TimeSpan = TimeSpan::from_ms(180);
/// Speed per step.
const MM_PER_S_A_STEP: f64 = 32.0;
/// Acceleration of starts and stops.
const MM_PER_S2: f64 = 170.0;

pub(crate) fn step(step: u8) -> SpeedStep {
    SpeedStep::new(step).expect("a step")
}

pub(crate) fn layout() -> Layout {
    Layout::build(&plan()).expect("a layout")
}

/// The same with sensors that report one number for both directions.
pub(crate) fn undirected_layout() -> Layout {
    let mut plan = plan();
    for place in &mut plan.places {
        if let Place::Sensor { names, sensors: [sensor, _] } = place {
            *place = Place::UndirectedSensor { names: names.clone(), sensor: *sensor };
        }
    }
    Layout::build(&plan).expect("a layout")
}

fn plan() -> LayoutPlan {
    let sensor = |name: &str, number| Place::Sensor {
        names: [format!("{name}1"), format!("{name}2")],
        sensors: [SensorId(number), SensorId(number + 1)],
    };
    let turnout = |number: u16| Place::Turnout {
        names: [format!("BR{number}"), format!("MR{number}")],
        turnout: TurnoutId(number),
    };
    let end = |number: u16| Place::End { names: [format!("EN{number}"), format!("EX{number}")] };
    let rail_end = |text: &str| match text.split_once(' ') {
        Some((node, leg)) => RailEnd { node: node.into(), leg: Some(Leg::from_curved(leg == "curved")) },
        None => RailEnd { node: text.into(), leg: None },
    };
    let stretch = |from: &str, to: &str, mm: f64| Stretch {
        from: rail_end(from),
        to: rail_end(to),
        length: Length::from_mm(mm).into(),
    };
    LayoutPlan {
        name: "toy".into(),
        survey: Survey::taped(Length::from_mm(2.0), "made up".into()),
        places: vec![
            sensor("A", 0),
            sensor("B", 2),
            sensor("C", 4),
            sensor("D", 6),
            turnout(1),
            turnout(2),
            sensor("E", 8),
            sensor("F", 10),
            end(1),
            end(2),
        ],
        stretches: vec![
            stretch("A1", "BR1", 200.0),
            stretch("BR1 straight", "B1", 500.0),
            stretch("BR1 curved", "C1", 520.0),
            stretch("B1", "MR2 straight", 500.0),
            stretch("C1", "MR2 curved", 450.0),
            stretch("MR2", "D1", 200.0),
            stretch("D1", "A1", 900.0),
            stretch("EN1", "E1", 300.0),
            stretch("E1", "F1", 800.0),
            stretch("F1", "EX2", 900.0),
        ],
        never_both_curved: vec![],
        zones: vec![],
        blocks: vec![],
    }
}

pub(crate) fn straight() -> TurnoutStates {
    [1, 2].map(|turnout| (TurnoutId(turnout), Leg::Straight)).into_iter().collect()
}

/// The true state of a train.
#[derive(Debug, Clone)]
pub(crate) struct ToyTrain {
    pub(crate) id: TrainId,
    pub(crate) at: Position,
    pub(crate) speed_mm_per_s: f64,
    target_mm_per_s: f64,
    obeys: VecDeque<(Timestamp, f64)>,
    pub(crate) travelled_mm: f64,
    /// Distance run over that with clean wheels.
    pub(crate) wheels: f64,
    /// Above this speed it accelerates at constant power, and it brakes the harder the faster it is (mm/s).
    pub(crate) knee: Option<f64>,
    pub(crate) is_off_the_track: bool,
}

impl ToyTrain {
    fn tick(&mut self, now: Timestamp, layout: &Layout, turnouts: &TurnoutStates) -> Option<SensorId> {
        while let Some((from, target)) = self.obeys.front().copied().filter(|(from, _)| *from <= now) {
            let _ = (self.obeys.pop_front(), from);
            self.target_mm_per_s = target;
        }
        let missing = self.target_mm_per_s - self.speed_mm_per_s;
        let rate = match self.knee {
            Some(knee) if missing > 0.0 => MM_PER_S2 * knee / self.speed_mm_per_s.max(knee),
            Some(knee) => MM_PER_S2 * (0.4 + 0.6 * self.speed_mm_per_s / knee),
            None => MM_PER_S2,
        };
        let change = rate * TICK.as_s();
        self.speed_mm_per_s += missing.clamp(-change, change);
        let distance = self.speed_mm_per_s * TICK.as_s() * self.wheels;
        let edge = layout.edge(self.at.edge).expect("on the layout");
        match layout.advance(self.at, Length::from_mm(distance), turnouts) {
            Ok(at) => {
                self.travelled_mm += distance;
                let passed = (at.edge != self.at.edge).then(|| layout.sensor_at(edge.to)).flatten();
                self.at = at;
                passed
            }
            Err(_) => {
                self.is_off_the_track = true;
                self.speed_mm_per_s = 0.0;
                None
            }
        }
    }
}

/// The world and the loop around a driver.
pub(crate) struct ToyRailway {
    pub(crate) layout: Layout,
    /// The true turnout positions.
    pub(crate) turnouts: TurnoutStates,
    pub(crate) now: Timestamp,
    pub(crate) trains: Vec<ToyTrain>,
    pub(crate) events: Vec<Event>,
    pub(crate) notices: Vec<Notice>,
    pub(crate) commands: Vec<(Timestamp, Command)>,
    /// No command is sent.
    pub(crate) is_silent: bool,
    /// Sensors that do not report.
    pub(crate) dead: BTreeSet<SensorId>,
    /// Turnouts that do not move.
    pub(crate) stuck: BTreeSet<TurnoutId>,
    /// The true passages: time, sensor and train.
    pub(crate) passes: Vec<(Timestamp, SensorId, TrainId)>,
    queue: VecDeque<Command>,
    line_free: Timestamp,
    closed: BTreeSet<SensorId>,
    polled: Timestamp,
}

impl ToyRailway {
    /// One train, `mm` past a node.
    pub(crate) fn new(train: u16, node: &str, mm: f64) -> Self {
        let mut railway = Self::empty();
        railway.put(train, node, mm);
        railway
    }

    /// One more train, or the same one elsewhere, `mm` past a node.
    pub(crate) fn put(&mut self, train: u16, node: &str, mm: f64) {
        let landmark = self.layout.landmark(&format!("{node}{mm:+}mm")).expect("a place");
        let at = self.layout.locate(landmark, &self.turnouts).expect("a place");
        self.trains.retain(|known| known.id != TrainId(train));
        self.trains.push(ToyTrain {
            id: TrainId(train),
            at,
            speed_mm_per_s: 0.0,
            target_mm_per_s: 0.0,
            obeys: VecDeque::new(),
            travelled_mm: 0.0,
            wheels: 1.0,
            knee: None,
            is_off_the_track: false,
        });
    }

    /// A sensor reports without a train.
    pub(crate) fn close(&mut self, sensor: SensorId) {
        self.closed.insert(sensor);
    }

    fn empty() -> Self {
        let layout = layout();
        let turnouts = straight();
        Self {
            layout,
            turnouts,
            now: Timestamp::ZERO,
            trains: Vec::new(),
            events: Vec::new(),
            notices: Vec::new(),
            commands: Vec::new(),
            is_silent: false,
            dead: BTreeSet::new(),
            stuck: BTreeSet::new(),
            passes: Vec::new(),
            queue: VecDeque::new(),
            line_free: Timestamp::ZERO,
            closed: BTreeSet::new(),
            polled: Timestamp::ZERO,
        }
    }

    pub(crate) fn command(&mut self, command: Command) {
        self.queue.push_back(command);
    }

    fn obey(&mut self, command: Command) -> EventKind {
        match command {
            Command::Speed { train, step } => {
                for toy in self.trains.iter_mut().filter(|toy| toy.id == train) {
                    toy.obeys.push_back((self.now + DEAD, MM_PER_S_A_STEP * f64::from(step.get())));
                }
                EventKind::Speed { train, step }
            }
            Command::Reverse { train } => {
                self.turn_around(train);
                EventKind::Reverse { train }
            }
            Command::Turnout { turnout, curved } => {
                if !self.stuck.contains(&turnout) {
                    self.turnouts.set(turnout, Leg::from_curved(curved));
                }
                EventKind::Turnout { turnout, curved }
            }
            _ => EventKind::Reverse { train: TrainId(0) },
        }
    }

    /// The other end of a train leads from now on.
    pub(crate) fn turn_around(&mut self, train: TrainId) {
        for toy in self.trains.iter_mut().filter(|toy| toy.id == train) {
            let back = self.layout.reversed(toy.at).expect("on the layout");
            // A shoe of 30 mm.
            let shoe = Length::from_mm(30.0);
            toy.at = self.layout.advance(back, shoe, &self.turnouts).unwrap_or(back);
        }
    }

    /// One tick of the world: what was reported or sent.
    pub(crate) fn tick(&mut self) -> Vec<Event> {
        self.now += TICK;
        let mut events = Vec::new();
        let mut passed = Vec::new();
        for train in &mut self.trains {
            let sensor = train.tick(self.now, &self.layout, &self.turnouts);
            passed.extend(sensor);
            self.passes.extend(sensor.map(|sensor| (self.now, sensor, train.id)));
        }
        let closed = passed.into_iter().filter(|sensor| !self.dead.contains(sensor));
        self.closed.extend(closed.map(|sensor| self.layout.input(sensor)));
        if self.line_free <= self.now
            && !self.is_silent
            && let Some(command) = self.queue.pop_front()
        {
            // A command takes effect once its last bit has been sent.
            self.line_free = self.now + LINE;
            self.commands.push((self.line_free, command));
            let kind = self.obey(command);
            events.push(Event { time: self.line_free, kind });
        }
        if self.now - self.polled >= POLL {
            let poll_interval = Some(self.now - self.polled);
            self.polled = self.now;
            for sensor in std::mem::take(&mut self.closed) {
                let kind = EventKind::Sensor(Report { sensor, poll_interval });
                events.push(Event { time: self.now, kind });
            }
        }
        self.events.extend(&events);
        events
    }

    /// Carries out the driver's outputs.
    pub(crate) fn listen(&mut self, driver: &mut Driver) {
        while let Some(output) = driver.poll_output() {
            match output {
                Output::Command(command) => self.command(command),
                Output::Notice(notice) => self.notices.push(notice),
                Output::HoldLine(_) | Output::Watch(_) => {}
            }
        }
    }

    /// Runs the world with a driver for some time.
    pub(crate) fn run(&mut self, driver: &mut Driver, seconds: f64) {
        self.run_until(driver, seconds, |_| false);
    }

    /// The same, until a condition holds; returns whether it does.
    pub(crate) fn run_until(
        &mut self,
        driver: &mut Driver,
        seconds: f64,
        is_so: impl Fn(&Self) -> bool,
    ) -> bool {
        let end = self.now + TimeSpan::from_s(seconds);
        self.listen(driver);
        while self.now < end && !is_so(self) {
            for event in self.tick() {
                driver.handle_event(self.now.max(event.time), &event);
                self.listen(driver);
            }
            if driver.next_timeout().is_some_and(|at| at <= self.now) {
                driver.handle_timeout(self.now);
                self.listen(driver);
            }
        }
        is_so(self)
    }

    pub(crate) fn train(&self) -> &ToyTrain {
        &self.trains[0]
    }

    pub(crate) fn finished(&self) -> Vec<Finished> {
        let done = |notice: &Notice| match notice {
            Notice::Done(finished) => Some(*finished),
            _ => None,
        };
        self.notices.iter().filter_map(done).collect()
    }

    /// The true distance of the first train beyond a place, along the shorter path.
    pub(crate) fn beyond_mm(&self, place: &str) -> f64 {
        let landmark = self.layout.landmark(place).expect("a place");
        let target = self.layout.locate(landmark, &self.turnouts).expect("a place");
        let ahead = |from, to| {
            self.layout.distance_ahead(from, to, &self.turnouts).map_or(f64::INFINITY, Length::as_mm)
        };
        let (beyond, short) = (ahead(target, self.train().at), ahead(self.train().at, target));
        if beyond <= short { beyond } else { -short }
    }
}

/// The model of a toy train after three minutes of runs and stops at eight steps.
pub(crate) fn known_model(train: u16) -> MotionModel {
    known_after(train, &[])
}

/// The same after some more minutes, in which every step was reached from below and from above.
pub(crate) fn known_model_both_approaches(train: u16) -> MotionModel {
    let up_and_down: Vec<u8> = (3..=14).chain((3..14).rev()).collect();
    known_after(train, &up_and_down)
}

fn known_after(train: u16, steps: &[u8]) -> MotionModel {
    let mut world = ToyRailway::new(train, "D1", 300.0);
    let id = TrainId(train);
    let mut fit = MotionFit::new(id, step(14));
    let turnouts = straight();
    // Long runs, and short ones that end before the speed has settled.
    let runs =
        [(8, 16.0), (12, 16.0), (5, 16.0), (4, 12.0), (4, 1.0), (6, 0.7), (14, 16.0), (4, 2.0), (10, 16.0)];
    for (speed, runs_for) in runs.into_iter().chain([(6, 10.0), (5, 0.5), (4, 16.0), (8, 0.6), (4, 16.0)]) {
        for (commanded, seconds) in [(step(speed), runs_for), (step(0), 5.0)] {
            world.command(Command::Speed { train: id, step: commanded });
            let end = world.now + TimeSpan::from_s(seconds);
            while world.now < end {
                for event in world.tick() {
                    fit.take(&world.layout, &turnouts, &event);
                }
            }
        }
        fit.note_use(step(speed), StepUse::Moves);
        fit.refit(&SectionIndex::of(&world.layout));
    }
    let rest = if steps.is_empty() { None } else { Some((0, 5.0)) };
    for (speed, runs_for) in steps.iter().map(|speed| (*speed, 9.0)).chain(rest) {
        world.command(Command::Speed { train: id, step: step(speed) });
        let end = world.now + TimeSpan::from_s(runs_for);
        while world.now < end {
            for event in world.tick() {
                fit.take(&world.layout, &turnouts, &event);
            }
        }
        if speed > 0 {
            fit.note_use(step(speed), StepUse::Moves);
        }
    }
    fit.refit(&SectionIndex::of(&world.layout));
    fit.model().clone()
}

/// A driver of train 24 with the model of [`known_model_both_approaches`].
pub(crate) fn driver_for_both_approaches(world: &ToyRailway, node: &str, mm: f64) -> Driver {
    static MODEL: OnceLock<MotionModel> = OnceLock::new();
    let mut driver = driver_of(world, node, mm);
    driver.set_model(MODEL.get_or_init(|| known_model_both_approaches(24)).clone());
    driver
}

/// Adds a train with the model of all toy trains to a driver.
pub(crate) fn add_train(driver: &mut Driver, world: &ToyRailway, train: u16, place: Option<(&str, f64)>) {
    let mut numbers = driver.model(TrainId(24)).expect("the first train").numbers();
    numbers.train = TrainId(train);
    driver.add_train(MotionModel::from_numbers(&numbers).expect("the same numbers"));
    if let Some((node, mm)) = place {
        let node = world.layout.node_named(node).expect("a node");
        let at = footplate_core::tracking::PathPoint { node, distance: Length::from_mm(mm) };
        driver.place(world.now, TrainId(train), at, Length::from_mm(2.0));
    }
}

/// A driver of train 24 with a known model and position.
pub(crate) fn driver_of(world: &ToyRailway, node: &str, mm: f64) -> Driver {
    static MODEL: OnceLock<MotionModel> = OnceLock::new();
    let model = MODEL.get_or_init(|| known_model(24)).clone();
    let mut driver = Driver::new(world.layout.clone(), straight());
    let train = model.train();
    driver.add_train(model);
    let node = world.layout.node_named(node).expect("a node");
    let at = footplate_core::tracking::PathPoint { node, distance: Length::from_mm(mm) };
    driver.place(world.now, train, at, Length::from_mm(2.0));
    driver
}
