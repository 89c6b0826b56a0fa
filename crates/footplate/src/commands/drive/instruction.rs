//! The instructions that a script or an operator can give, and their parser; an error names the column and suggests a correction.

use footplate_core::control::{Aim, Gap, Journey, Order, StopOrder, TrainLengths};
use footplate_core::track::Landmark;
use footplate_core::{FunctionNumber, SensorId, SpeedStep, TimeSpan, TrainId};
use footplate_store::Schedule;

use super::reader::{Known, Words};
use super::words::{Mistake, meant, words};
use crate::comment::without_comment;

/// The text of `help`.
pub(super) const HELP: &str = include_str!("help.txt").trim_ascii_end();

const VERBS: [&str; 20] = [
    "speed", "reverse", "turnout", "stop", "go", "move", "hold", "follow", "arrive", "find", "place",
    "length", "light", "function", "halt", "power", "where", "wait", "schedule", "help",
];

/// One line of a script or of the prompt.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Instruction {
    /// An order of the driver.
    Order(Order),
    /// Send a train to a place; the dispatcher chooses the route.
    Go(TrainId, Journey),
    /// Have a train creep to the next sensor and stop there, so that its position is known.
    Find(TrainId),
    /// Throw all turnouts straight, one after the other.
    Straighten,
    /// The operator says where a train at rest is.
    Place(TrainId, Landmark),
    /// The operator states the lengths of a train.
    Length(TrainId, TrainLengths),
    /// Switch a function of a train on or off.
    Function(TrainId, FunctionNumber, bool),
    /// Stop all trains and switch the track power off, at once.
    Halt,
    /// Switch the track power on.
    PowerOn,
    /// Print the position of one train, or of all.
    Where(Option<TrainId>),
    /// Continue with the next line when a condition is met.
    Wait(Until),
    /// Print the saved schedules, and how far those have come that run.
    ListSchedules,
    /// Begin a saved schedule.
    RunSchedule(Schedule),
    /// End the schedule of this name.
    EndSchedule(String),
    /// Print the list of instructions.
    Help,
    /// Stop all trains and end the session.
    Quit,
}

impl Instruction {
    /// The train that it drives or locates, if it does.
    pub(super) fn driven(&self) -> Option<TrainId> {
        match self {
            Self::Order(order) => order.train(),
            Self::Go(train, _) | Self::Find(train) | Self::Place(train, _) => Some(*train),
            _ => None,
        }
    }

    /// The train that it drives, locates or waits for.
    pub(super) fn concerned(&self) -> Option<TrainId> {
        match self {
            Self::Wait(until) => until.train(),
            _ => self.driven(),
        }
    }

    /// Whether it only stops a train.
    pub(super) const fn is_plain_stop(&self) -> bool {
        matches!(self, Self::Order(Order::Speed { step: SpeedStep::STAND, .. }))
    }

    /// Whether it stops one train or all and does nothing else. A stop at a place makes a train at rest run.
    pub(super) const fn only_stops(&self) -> bool {
        self.is_plain_stop() || matches!(self, Self::Halt)
    }

    /// Whether it is carried out at once, without further instructions.
    pub(super) const fn is_at_once(&self) -> bool {
        !matches!(self, Self::Go(..) | Self::Find(_) | Self::Place(..) | Self::Straighten | Self::Wait(_))
    }
}

/// The condition of a `wait`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Until {
    /// A time has passed.
    Passed(TimeSpan),
    /// A train has finished its orders and is at rest.
    AtRest(TrainId),
    /// A sensor detects a train.
    At(TrainId, SensorId),
    /// The position of a train is known.
    Located(TrainId),
}

impl Until {
    /// The train that it waits for.
    pub(super) const fn train(&self) -> Option<TrainId> {
        match self {
            Self::Passed(_) => None,
            Self::AtRest(train) | Self::At(train, _) | Self::Located(train) => Some(*train),
        }
    }
}

/// Parses one line; `None` for an empty line or a comment.
///
/// # Errors
/// The first mistake in the line.
pub(super) fn parse(line: &str, known: Known<'_>) -> Result<Option<Instruction>, Mistake> {
    let words = words(line);
    let Some((verb, rest)) = words.split_first() else { return Ok(None) };
    let end = without_comment(line).trim_end().chars().count() + 2;
    let mut words = Words { rest, known, end, after: *verb };
    let instruction = match verb.text {
        "speed" => {
            let train = words.train()?;
            Instruction::Order(Order::Speed { train, step: words.step(train)? })
        }
        "reverse" => {
            let train = words.train()?;
            let then = if words.take("at") {
                words.expect("step")?;
                words.step(train)?
            } else {
                SpeedStep::STAND
            };
            Instruction::Order(Order::Reverse { train, then })
        }
        "turnout" if words.take("all") => {
            words.expect("straight")?;
            Instruction::Straighten
        }
        "turnout" => {
            let turnout = words.turnout()?;
            Instruction::Order(Order::Turnout { turnout, curved: words.leg()? })
        }
        "stop" => words.stop()?,
        "go" => words.go()?,
        "move" => {
            let train = words.train()?;
            Instruction::Order(Order::Move { train, distance: words.distance()? })
        }
        "hold" => {
            let train = words.train()?;
            Instruction::Order(Order::Hold { train, speed: words.speed()? })
        }
        "follow" => words.follow()?,
        "arrive" => {
            let train = words.train()?;
            words.expect("at")?;
            let target = words.landmark()?;
            words.expect("in")?;
            Instruction::Order(Order::Arrive { train, target, within: words.span()? })
        }
        "find" => Instruction::Find(words.train()?),
        "place" => {
            let train = words.train()?;
            words.expect("at")?;
            Instruction::Place(train, words.landmark()?)
        }
        "length" => {
            let train = words.train()?;
            words.expect("pickup")?;
            let pickup = words.distance()?;
            words.expect("overhang")?;
            Instruction::Length(train, TrainLengths { overhang: words.distance()?, pickup })
        }
        "light" => {
            let train = words.train()?;
            Instruction::Function(train, FunctionNumber::LIGHT, words.on_or_off()?)
        }
        "function" => {
            let train = words.train()?;
            let function = words.function()?;
            Instruction::Function(train, function, words.on_or_off()?)
        }
        "halt" => Instruction::Halt,
        "power" => {
            words.expect("on")?;
            Instruction::PowerOn
        }
        "where" if words.rest.is_empty() => Instruction::Where(None),
        "where" => Instruction::Where(Some(words.train()?)),
        "wait" => Instruction::Wait(words.until()?),
        "schedule" => words.schedules()?,
        "help" => Instruction::Help,
        "quit" | "exit" => Instruction::Quit,
        other => {
            let all = format!(": write one of {}, quit", VERBS.join(", "));
            let verbs = VERBS.into_iter().chain(["quit"]);
            return Err(verb.mistake(format!("is not a command{}", meant(other, verbs, &all))));
        }
    };
    match words.rest.first() {
        None => Ok(Some(instruction)),
        Some(word) => Err(word.mistake("is one word too many: remove it")),
    }
}

impl Words<'_, '_, '_> {
    fn stop(&mut self) -> Result<Instruction, Mistake> {
        let train = self.train()?;
        if self.rest.is_empty() {
            return Ok(Instruction::Order(Order::Speed { train, step: SpeedStep::STAND }));
        }
        self.expect("at")?;
        let mut stop = StopOrder::at(train, self.landmark()?);
        while let Some(word) = self.rest.first().copied() {
            self.next("")?;
            match word.text {
                "at" => {
                    self.expect("step")?;
                    stop.step = Some(self.step(train)?);
                }
                "not-beyond" => stop.aim = Aim::NotBeyond(self.share()?),
                "next" => {
                    self.expect("round")?;
                    stop.next_round = true;
                }
                other => {
                    let known = ["at", "not-beyond", "next"].into_iter();
                    let otherwise = ": write `at step 8`, `not-beyond 0.1%` or `next round`";
                    return Err(
                        word.mistake(format!("is not allowed here{}", meant(other, known, otherwise)))
                    );
                }
            }
        }
        Ok(Instruction::Order(Order::Stop(stop)))
    }

    fn go(&mut self) -> Result<Instruction, Mistake> {
        let train = self.train()?;
        self.expect("to")?;
        let mut journey = Journey::to(self.landmark()?);
        while let Some(word) = self.rest.first().copied() {
            self.next("")?;
            match word.text {
                "facing" => journey.faces = true,
                "not-beyond" => journey.aim = Aim::NotBeyond(self.share()?),
                other => {
                    let known = ["facing", "not-beyond"].into_iter();
                    let otherwise = ": write `facing` or `not-beyond 0.1%`";
                    return Err(
                        word.mistake(format!("is not allowed here{}", meant(other, known, otherwise)))
                    );
                }
            }
        }
        Ok(Instruction::Go(train, journey))
    }

    fn schedules(&mut self) -> Result<Instruction, Mistake> {
        let word = self.next("`list`, `run` or `end`")?;
        match word.text {
            "list" => Ok(Instruction::ListSchedules),
            "run" => Ok(Instruction::RunSchedule(self.schedule()?)),
            "end" => Ok(Instruction::EndSchedule(self.schedule_name()?.1)),
            other => {
                let near = meant(other, ["list", "run", "end"].into_iter(), "");
                Err(word.mistake(format!("should be `list`, `run` or `end`{near}")))
            }
        }
    }

    fn follow(&mut self) -> Result<Instruction, Mistake> {
        let train = self.train()?;
        self.expect("behind")?;
        let behind = self.rest.first().copied();
        let leader = self.train()?;
        if let Some(word) = behind.filter(|_| leader == train) {
            return Err(word.mistake("is the same train: name the train ahead of it"));
        }
        self.expect("by")?;
        let gap = if self.is_at_span() { Gap::Time(self.span()?) } else { Gap::Way(self.distance()?) };
        Ok(Instruction::Order(Order::Follow { train, leader, gap }))
    }

    fn until(&mut self) -> Result<Until, Mistake> {
        if self.is_at_span() {
            return Ok(Until::Passed(self.span()?));
        }
        let wanted = "a time such as 2s, or a train such as 24";
        if self.rest.is_empty() {
            self.next(wanted)?;
        }
        let train = self.train()?;
        if self.take("located") {
            return Ok(Until::Located(train));
        }
        self.expect("at")?;
        if self.take("rest") { Ok(Until::AtRest(train)) } else { Ok(Until::At(train, self.sensor()?)) }
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::{Length, Ratio, Speed, TurnoutId};
    use footplate_store::layout_named;
    use proptest::collection::vec;
    use proptest::prelude::*;
    use proptest::sample::select;

    use super::*;

    fn evening() -> Schedule {
        let lines = vec!["light 24 on".to_owned()];
        Schedule { name: "Late evening".to_owned(), lines, rounds: Some(2), is_button: false }
    }

    fn read(line: &str) -> Result<Option<Instruction>, String> {
        let layout = layout_named("track-a").expect("a built-in layout").layout;
        let highest = SpeedStep::new(14).expect("a step");
        let trains = [24, 58].map(|train| (TrainId(train), highest)).into_iter().collect();
        let schedules = [evening()];
        let known = Known { layout: &layout, trains: &trains, schedules: &schedules };
        parse(line, known).map_err(|mistake| mistake.to_string())
    }

    fn order(line: &str) -> Order {
        match read(line) {
            Ok(Some(Instruction::Order(order))) => order,
            other => panic!("{line}: {other:?}"),
        }
    }

    #[test]
    fn a_line_only_stops_trains_unless_it_may_set_one_in_motion() {
        let only_stops = |line: &str| read(line).expect(line).is_some_and(|read| read.only_stops());
        for line in ["stop 24", "stop 24 # now", "speed 24 0", "halt"] {
            assert!(only_stops(line), "{line}");
        }
        for line in ["speed 24 8", "reverse 24", "stop 24 at C13 at step 8", "power on", "# halt"] {
            assert!(!only_stops(line), "{line}");
        }
    }

    #[test]
    fn every_line_of_the_help_parses() {
        let (train, step) = (TrainId(24), |step| SpeedStep::new(step).expect("a step"));
        assert_eq!(order("speed 24 8"), Order::Speed { train, step: step(8) });
        assert_eq!(order("stop 24"), Order::Speed { train, step: step(0) });
        assert_eq!(order("reverse 24"), Order::Reverse { train, then: step(0) });
        assert_eq!(order("reverse 24 at step 8"), Order::Reverse { train, then: step(8) });
        assert_eq!(order("turnout 11 curved"), Order::Turnout { turnout: TurnoutId(11), curved: true });
        assert_eq!(order("move 24 37mm"), Order::Move { train, distance: Length::from_mm(37.0) });
        assert_eq!(order("move 24 1.2 m"), Order::Move { train, distance: Length::from_mm(1200.0) });
        let Order::Stop(stop) = order("stop 24 at C13 + 120 mm not-beyond 0.1% at step 8 next round") else {
            panic!("a stop");
        };
        assert!((stop.target.offset.as_mm() - 120.0).abs() < 1e-9);
        assert_eq!((stop.step, stop.next_round), (Some(step(8)), true));
        assert_eq!(stop.aim, Aim::NotBeyond(Ratio::from_percent(0.1)));
        let wait = |line: &str| match read(line) {
            Ok(Some(Instruction::Wait(until))) => until,
            other => panic!("{line}: {other:?}"),
        };
        assert_eq!(wait("wait 500ms # a moment"), Until::Passed(TimeSpan::from_ms(500)));
        assert_eq!(wait("wait 24 at rest"), Until::AtRest(train));
        assert_eq!(wait("wait 24 located"), Until::Located(train));
        assert!(matches!(wait("wait 24 at C13"), Until::At(TrainId(24), _)));
        let Ok(Some(Instruction::Go(going, journey))) = read("go 24 to C13+120mm not-beyond 0.1% facing")
        else {
            panic!("a journey")
        };
        assert_eq!((going, journey.faces), (train, true));
        assert_eq!(journey.aim, Aim::NotBeyond(Ratio::from_percent(0.1)));
        assert_eq!(order("hold 24 250mm/s"), Order::Hold { train, speed: Speed::from_mm_per_s(250.0) });
        assert_eq!(order("hold 24 0.25 m/s"), Order::Hold { train, speed: Speed::from_mm_per_s(250.0) });
        let (follower, leader) = (TrainId(58), train);
        let gap = Gap::Time(TimeSpan::from_ms(1500));
        assert_eq!(order("follow 58 behind 24 by 1.5s"), Order::Follow { train: follower, leader, gap });
        let gap = Gap::Way(Length::from_mm(150.0));
        assert_eq!(order("follow 58 behind 24 by 150mm"), Order::Follow { train: follower, leader, gap });
        let Order::Arrive { target, within, .. } = order("arrive 24 at D5 in 12s") else { panic!("a time") };
        assert_eq!((target.offset, within), (Length::ZERO, TimeSpan::from_s(12.0)));
        let Ok(Some(Instruction::Place(placed, at))) = read("place 24 at C13+120mm") else {
            panic!("a place")
        };
        assert_eq!((placed, at.offset), (train, Length::from_mm(120.0)));
        let lengths = TrainLengths { overhang: Length::from_mm(110.0), pickup: Length::from_mm(45.0) };
        assert_eq!(
            read("length 24 pickup 45mm overhang 11cm"),
            Ok(Some(Instruction::Length(train, lengths)))
        );
        let function = |number| FunctionNumber::new(number).expect("a function");
        assert_eq!(read("light 24 off"), Ok(Some(Instruction::Function(train, function(0), false))));
        assert_eq!(read("function 24 28 on"), Ok(Some(Instruction::Function(train, function(28), true))));
        assert_eq!(read("find 24"), Ok(Some(Instruction::Find(train))));
        assert_eq!(read("halt"), Ok(Some(Instruction::Halt)));
        assert_eq!(read("power on"), Ok(Some(Instruction::PowerOn)));
        assert_eq!(read("turnout all straight"), Ok(Some(Instruction::Straighten)));
        assert_eq!(read("schedule list"), Ok(Some(Instruction::ListSchedules)));
        assert_eq!(read("schedule run Late evening"), Ok(Some(Instruction::RunSchedule(evening()))));
        assert_eq!(read("schedule run \"Late evening\""), Ok(Some(Instruction::RunSchedule(evening()))));
        let ends = Instruction::EndSchedule("Late evening".to_owned());
        assert_eq!(read("schedule end Late evening # now"), Ok(Some(ends)));
        assert_eq!(read("where"), Ok(Some(Instruction::Where(None))));
        assert_eq!(read("  # nothing but a remark"), Ok(None));
    }

    #[test]
    fn errors_name_the_column_and_the_correction() {
        let wrong: Vec<String> = [
            ("stopp 24 at C13", "column 1: `stopp` is not a command: did you mean `stop`?"),
            ("stop 25 at C13", "column 6: `25` is not a train of this session: 24, 58"),
            ("stop 24 at C1 3", "column 15: `3` is not allowed here: write `at step 8`"),
            ("stop 24 at C133", "column 12: track-a has no place `C133`"),
            ("stop 24 at C133", "did you mean `C13`?"),
            ("stop 24 at C13+120", "column 12: `+120` is not an offset: write millimetres"),
            (
                "stop 24 at C13 not-beyond 60%",
                "column 27: `60%` should be a share of stops from 0.0001% to 50%",
            ),
            ("stop 24 at C13 at step 15", "column 24: `15` should be a step from 0 to 14"),
            ("stop 24 C13", "column 9: `C13` should be `at`"),
            ("stop 24 at", "column 12: a place, such as `C13` or `C13+120mm` is missing after `at`"),
            ("speed 24", "column 10: a step from 0 to 14 is missing after `24`"),
            ("speed 24 8 9", "column 12: `9` is one word too many: remove it"),
            ("turnout 99 curved", "column 9: `99` is not a turnout of track-a: it has 1, 2"),
            (
                "turnout 11 curve",
                "column 12: `curve` should be `straight` or `curved`: did you mean `curved`?",
            ),
            ("move 24 37", "column 9: `37` should be a distance ahead, such as 37mm or 1.2m"),
            ("move 24 -5mm", "column 9: `-5mm` should be 1mm to 100m"),
            ("hold 24 250", "column 9: `250` should be a speed, such as 250mm/s"),
            ("hold 24 9m/s", "column 9: `9m/s` should be 1mm/s to 5m/s"),
            ("follow 58 behind 58 by 1s", "column 18: `58` is the same train: name the train ahead of it"),
            ("follow 58 behind 24 by 1", "column 24: `1` should be a distance ahead, such as 37mm or 1.2m"),
            ("arrive 24 at D5 by 12s", "column 17: `by` should be `in`"),
            ("go 24 at D5", "column 7: `at` should be `to`"),
            ("go 24 to D5 facin", "column 13: `facin` is not allowed here: did you mean `facing`?"),
            ("length 24 110mm", "column 11: `110mm` should be `pickup`"),
            ("function 24 29 on", "column 13: `29` should be a function from 0 (the light) to 28"),
            ("light 24 onn", "column 10: `onn` should be `on` or `off`: did you mean `on`?"),
            ("power off", "column 7: `off` should be `on`"),
            ("schedule", "column 10: `list`, `run` or `end` is missing after `schedule`"),
            ("schedule rum X", "column 10: `rum` should be `list`, `run` or `end`: did you mean `run`?"),
            (
                "schedule run Late evenin",
                "column 14: `Late evenin` is not a saved schedule: did you mean `Late evening`?",
            ),
            ("schedule run Morning", "is not a saved schedule: write one of Late evening"),
            ("wait", "a time such as 2s, or a train such as 24 is missing after `wait`"),
            ("wait 24 at C99", "column 12: `C99` is not a sensor of track-a"),
        ]
        .into_iter()
        .map(|(line, says)| (line, says, read(line).expect_err(line)))
        .filter(|(_, says, mistake)| !mistake.contains(says))
        .map(|(line, says, mistake)| format!("{line}: `{mistake}` instead of `{says}`"))
        .collect();
        assert!(wrong.is_empty(), "{wrong:#?}");
    }

    #[test]
    fn a_target_beyond_the_end_of_the_track_is_refused_before_anything_moves() {
        let layout = layout_named("track-a").expect("a built-in layout").layout;
        let end = layout.nodes().find(|(_, node)| node.name.starts_with("EX")).expect("a track end");
        let mistake = read(&format!("stop 24 at {}+10mm", end.1.name)).expect_err("off the track");
        assert!(mistake.contains("is off the track"), "{mistake}");
    }

    /// Words that lines are made of, and some that end in what a reader could stumble over.
    const SOME: &str = "24 58 at to in by step rest C13 C13+120mm C13+ + -1mm mm 1e999s 99999999999 0 2s 0.1% not-beyond \
        facing next round pickup overhang on off all straight curved behind # \u{0}";

    fn any_word() -> impl Strategy<Value = String> {
        prop_oneof![
            4 => select(VERBS.to_vec()).prop_map(str::to_owned),
            8 => select(SOME.split(' ').collect::<Vec<_>>()).prop_map(str::to_owned),
            1 => any::<f64>().prop_map(|number| format!("{number}mm")),
            1 => ".{0,8}",
        ]
    }

    proptest! {
        #[test]
        fn a_mistake_in_any_line_names_a_column_of_it(words in vec(any_word(), 0..12)) {
            let line = words.join(" ");
            if let Err(mistake) = read(&line) {
                let column = mistake.strip_prefix("column ").and_then(|rest| rest.split(':').next());
                let column: Option<usize> = column.and_then(|column| column.parse().ok());
                let is_of_it = |column: usize| (1..=line.chars().count() + 2).contains(&column);
                prop_assert!(column.is_some_and(is_of_it), "{line:?}: {mistake}");
            }
        }
    }
}
