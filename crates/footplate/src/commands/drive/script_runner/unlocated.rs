//! Trains whose position is unknown: nothing keeps another train clear of them, so they are located before it is ordered anywhere.

use footplate_core::control::{Order, Refusal};
use footplate_core::{SpeedStep, TimeSpan, Timestamp, TrainId};

use super::ScriptRunner;
use super::queue::Wait;
use crate::commands::drive::instruction::{Instruction, Until};
use crate::commands::drive::script::Step;

/// How long to search for a train because of another one. At 70 mm/s, slower than most trains creep, it runs 8 m: further than
/// from sensor to sensor on any built-in layout. A store also names trains that are not on the track today.
pub(super) const SEARCH_LIMIT: TimeSpan = TimeSpan::from_s(120.0);

impl ScriptRunner {
    /// Whether an instruction has to wait until all trains are located.
    pub(super) fn waits_for_others(&self, now: Timestamp, instruction: &Instruction) -> bool {
        let Instruction::Order(order) = instruction else { return false };
        self.needs_all(order) && self.trains.keys().any(|train| self.dispatcher.is_nowhere(now, *train))
    }

    /// Whether a train is sent somewhere. What ends the run of a moving train is not delayed.
    fn needs_all(&self, order: &Order) -> bool {
        let Some(train) = order.train().filter(|_| self.trains.len() > 1) else { return false };
        match order {
            Order::Hold { .. } | Order::Follow { .. } | Order::Move { .. } => true,
            Order::Stop(_) | Order::Arrive { .. } => self.driver().commanded(train) == SpeedStep::STAND,
            Order::Speed { .. } | Order::Reverse { .. } | Order::Turnout { .. } => false,
        }
    }

    /// Begins to locate the next train that has to be located before an order is carried out: its own, or another one, each once.
    /// `false` if there is none.
    pub(super) fn locates_before(&mut self, now: Timestamp, step: &Step, order: &Order) -> bool {
        self.forget_located(now);
        if !self.needs_all(order) {
            return false;
        }
        let others = self.trains.keys().copied().filter(|train| Some(*train) != order.train());
        let next = order
            .train()
            .into_iter()
            .chain(others)
            .find(|train| self.dispatcher.is_nowhere(now, *train) && !self.sought.contains(train));
        let Some(train) = next else { return false };
        self.sought.insert(train);
        self.say(format!("train {train} is located first"));
        self.queues.push_front(step.clone());
        if self.driver().commanded(train) > SpeedStep::STAND {
            // It runs, and passes a sensor without being stopped at it.
            let instruction = Instruction::Wait(Until::Located(train));
            self.queues.push_front(Step { instruction, is_part: true, ..step.clone() });
        } else {
            self.find(train, step);
        }
        true
    }

    /// Warns, once for each of them, of trains that the train of an order cannot be kept clear of.
    pub(super) fn warn_of_unlocated(&mut self, now: Timestamp, step: &Step, order: &Order) {
        self.forget_located(now);
        let sets_out = match order {
            Order::Speed { step, .. } | Order::Reverse { then: step, .. } => *step > SpeedStep::STAND,
            Order::Turnout { .. } => false,
            _ => true,
        };
        let Some(train) = order.train().filter(|_| sets_out && !step.is_part) else { return };
        let others = self.trains.keys().copied().filter(|other| *other != train);
        let unlocated: Vec<TrainId> =
            others.filter(|other| self.dispatcher.is_nowhere(now, *other)).collect();
        for other in unlocated {
            if self.warned.insert(other) {
                self.say(Refusal::OtherNowhere { train, other }.to_string());
            }
        }
    }

    /// Trains that are located are searched for, and warned of, anew once they are lost again.
    fn forget_located(&mut self, now: Timestamp) {
        let nowhere: Vec<TrainId> =
            self.trains.keys().copied().filter(|train| self.dispatcher.is_nowhere(now, *train)).collect();
        self.sought.retain(|train| nowhere.contains(train));
        self.warned.retain(|train| nowhere.contains(train));
    }

    /// The train that a wait is the search for, because another one is to be sent.
    pub(super) fn searched_by(&self, wait: &Wait) -> Option<TrainId> {
        wait.until.train().filter(|train| {
            wait.is_part && matches!(wait.until, Until::Located(_)) && self.sought.contains(train)
        })
    }

    /// How long a wait lasts at most.
    pub(super) fn limit_of(&self, wait: &Wait) -> TimeSpan {
        self.searched_by(wait).map_or(self.wait_limit, |_| self.wait_limit.min(SEARCH_LIMIT))
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::control::{Machine as _, Output};
    use footplate_core::{Command, Event, EventKind};

    use super::super::schedules::tests::runner;
    use super::*;
    use crate::commands::drive::session_message::SessionMessage;
    use crate::recorded::{Input, Listener as _};

    const T24: TrainId = TrainId(24);
    const T58: TrainId = TrainId(58);

    /// Gives a line to a session at a time; returns what is said, and the commanded speeds.
    fn hear(runner: &mut ScriptRunner, at: f64, line: &str) -> (Vec<String>, Vec<(TrainId, u8)>) {
        runner.handle_word(Timestamp::from_s(at), &Input::Line(line.to_owned()));
        heard(runner)
    }

    fn heard(runner: &mut ScriptRunner) -> (Vec<String>, Vec<(TrainId, u8)>) {
        let (mut said, mut speeds) = (Vec::new(), Vec::new());
        while let Some(output) = runner.poll_output() {
            match output {
                Output::Command(Command::Speed { train, step }) => speeds.push((train, step.get())),
                Output::Notice(SessionMessage::Line { text, .. }) => said.push(text),
                _ => {}
            }
        }
        (said, speeds)
    }

    const OF_58: &str = "train 24 cannot be kept clear of train 58, whose position is unknown: run that train over a sensor, \
                         for example with `speed 58 6`, or enter its position, for example `place 58 at C13`";

    #[test]
    fn an_order_locates_all_trains_before_it_is_carried_out() {
        for line in [
            "hold 24 250mm/s",
            "arrive 24 at C13+120mm in 30s",
            "stop 24 at C13+120mm",
            "move 24 100mm",
            "follow 24 behind 58 by 6s",
        ] {
            let mut runner = runner(&[T24, T58]);
            hear(&mut runner, 1.0, "place 24 at C13+400mm");
            let (said, speeds) = hear(&mut runner, 2.0, line);
            assert!(said.contains(&"train 58 is located first".to_owned()), "{line}: {said:?}");
            assert_eq!(speeds, [(T58, runner.driver().finding_step(T58).get())], "{line}");
        }
    }

    #[test]
    fn the_train_of_the_order_is_located_before_others() {
        let mut runner = runner(&[T24, T58]);
        let (said, _) = hear(&mut runner, 1.0, "hold 24 250mm/s");
        assert_eq!(said, ["train 24 is located first"]);
    }

    #[test]
    fn a_train_that_is_alone_is_not_searched_for() {
        let mut runner = runner(&[T24]);
        let (said, _) = hear(&mut runner, 1.0, "hold 24 250mm/s");
        assert!(!said.iter().any(|line| line.contains("is located first")), "{said:?}");
    }

    #[test]
    fn a_speed_warns_of_each_unlocated_train_once() {
        let mut runner = runner(&[T24, T58]);
        assert_eq!(hear(&mut runner, 1.0, "speed 24 8"), (vec![OF_58.to_owned()], vec![(T24, 8)]));
        assert_eq!(hear(&mut runner, 2.0, "speed 24 9"), (Vec::new(), vec![(T24, 9)]));
        assert_eq!(hear(&mut runner, 3.0, "stop 24").0, Vec::<String>::new(), "a stop is no danger");
    }

    #[test]
    fn a_moving_train_stops_at_a_place_without_a_search() {
        let mut runner = runner(&[T24, T58]);
        hear(&mut runner, 1.0, "place 24 at C13+400mm");
        hear(&mut runner, 2.0, "speed 24 8");
        hear(&mut runner, 3.0, "stop 24 at C13+120mm next round");
        assert_eq!(runner.driver().commanded(T58), SpeedStep::STAND);
    }

    #[test]
    fn a_train_that_is_not_found_delays_one_order_and_no_other() {
        let mut runner = runner(&[T24, T58]);
        hear(&mut runner, 1.0, "place 24 at C13+400mm");
        hear(&mut runner, 2.0, "move 24 100mm");
        let (mut said, mut moved) = (Vec::new(), Vec::new());
        for second in 3..260 {
            runner.handle_timeout(Timestamp::from_s(f64::from(second)));
            // The station confirms each command at once.
            let (lines, speeds) = heard(&mut runner);
            for (train, step) in &speeds {
                let step = SpeedStep::new(*step).expect("a step");
                let kind = EventKind::Speed { train: *train, step };
                runner.handle_event(
                    Timestamp::from_s(f64::from(second)),
                    &Event { time: Timestamp::from_s(f64::from(second)), kind },
                );
            }
            said.extend(lines);
            moved.extend(speeds.into_iter().map(|speed| (second, speed)));
        }
        assert!(said.iter().any(|line| line.starts_with("train 58 was not found within 120 s")), "{said:?}");
        assert!(said.contains(&OF_58.to_owned()), "{said:?}");
        assert!(moved.iter().any(|(_, (train, step))| *train == T24 && *step > 0), "{moved:?} {said:?}");
        let (said, _) = hear(&mut runner, 270.0, "hold 24 250mm/s");
        assert!(!said.iter().any(|line| line.contains("is located first")), "{said:?}");
    }
}
