//! Schedules: saved scripts that run beside the operator, one line after the other, as the lines of a script file do.

use footplate_core::{TimeSpan, Timestamp, TrainId};
use footplate_store::Schedule;

use super::ScriptRunner;
use super::waiting::is_open_ended;
use crate::commands::drive::instruction::Instruction;
use crate::commands::drive::script::{CommandSource, QueueId, Step, step};
use crate::dashboard::SchedulePicture;

/// A round takes this long at least, so that a schedule without waiting times does not flood the station.
const LEAST_ROUND: TimeSpan = TimeSpan::from_s(1.0);
/// The longest schedule, in lines: an evening of driving.
const MAX_LINES: usize = 500;
/// Schedules that may run at a time.
const MAX_SCHEDULES: usize = 16;

impl ScriptRunner {
    /// The steps of a schedule, or its mistakes, a line each.
    ///
    /// # Errors
    /// All mistakes with their lines and columns.
    pub(in crate::commands::drive) fn read_schedule(&self, schedule: &Schedule) -> Result<Vec<Step>, String> {
        if schedule.lines.len() > MAX_LINES {
            return Err(format!(
                "{} lines are too many for a schedule: the limit is {MAX_LINES}",
                schedule.lines.len()
            ));
        }
        if schedule.rounds == Some(0) {
            return Err("0 rounds: use 1 or more, or leave it open".to_owned());
        }
        let (mut steps, mut mistakes) = (Vec::new(), Vec::new());
        for (line, text) in schedule.lines.iter().enumerate() {
            match step(text, self.known()) {
                Ok(Some(Step {
                    instruction:
                        Instruction::Quit
                        | Instruction::Help
                        | Instruction::ListSchedules
                        | Instruction::RunSchedule(_)
                        | Instruction::EndSchedule(_),
                    ..
                })) => {
                    mistakes.push(format!("line {}: `{}` is not for schedules", line + 1, text.trim()));
                }
                Ok(read) => steps.extend(read.map(|step| Step { line, ..step })),
                Err(mistake) => mistakes.push(format!("line {}, {mistake}", line + 1)),
            }
        }
        if !mistakes.is_empty() {
            return Err(mistakes.join("\n"));
        }
        if steps.is_empty() {
            return Err("the schedule has no line that does anything".to_owned());
        }
        Ok(steps)
    }

    /// Why a schedule cannot begin now, if it cannot.
    ///
    /// # Errors
    /// Its mistakes, or the schedule that already runs or drives its trains.
    pub(in crate::commands::drive) fn check_run(&self, schedule: &Schedule) -> Result<(), String> {
        let steps = self.read_schedule(schedule)?;
        if self.queues.runs().count() >= MAX_SCHEDULES {
            return Err(format!("{MAX_SCHEDULES} schedules run already: end one first"));
        }
        for (_, run) in self.queues.runs() {
            if run.schedule.name == schedule.name {
                return Err(format!("schedule `{}` runs already", schedule.name));
            }
            let driven = |step: &Step| step.instruction.driven();
            if let Some(train) = steps.iter().filter_map(driven).find(|train| run.trains.contains(train)) {
                return Err(format!(
                    "schedule `{}` drives train {train} already: end it first",
                    run.schedule.name
                ));
            }
        }
        Ok(())
    }

    /// Begins a schedule that [`check_run`](Self::check_run) has accepted.
    pub(super) fn begin_schedule(&mut self, now: Timestamp, schedule: Schedule) {
        match self.check_run(&schedule).and_then(|()| self.read_schedule(&schedule)) {
            Ok(steps) => {
                self.ended_schedules.retain(|ended| ended.name != schedule.name);
                self.say(format!("schedule `{}` begins", schedule.name));
                self.queues.add(now, schedule, steps);
            }
            Err(why) => {
                self.fell_short = true;
                self.say(why);
            }
        }
        self.advance(now);
    }

    /// Prints the saved schedules, and how far those have come that run.
    pub(super) fn list_schedules(&mut self) {
        let states = self.schedule_pictures();
        let mut lines: Vec<String> =
            states.iter().filter(|state| !state.is_over).map(Self::progress).collect();
        let idle = self.saved.iter().filter(|schedule| !self.runs(&schedule.name));
        lines.extend(idle.map(|schedule| format!("schedule `{}` is saved", schedule.name)));
        if lines.is_empty() {
            lines.push("no schedule is saved: the page `Schedules` of the dashboard writes them".to_owned());
        }
        lines.into_iter().for_each(|line| self.say(line));
    }

    fn progress(state: &SchedulePicture) -> String {
        let rounds = state.rounds.map_or_else(String::new, |rounds| format!(" of {rounds}"));
        format!("schedule `{}` runs: round {}{rounds}", state.name, state.round)
    }

    /// Whether a schedule of this name runs.
    pub(in crate::commands::drive) fn runs(&self, name: &str) -> bool {
        self.queues.runs().any(|(_, run)| run.schedule.name == name)
    }

    /// Ends a schedule; its trains finish the orders that they have.
    pub(super) fn end_schedule(&mut self, now: Timestamp, name: &str) {
        let found = self.queues.runs().find(|(_, run)| run.schedule.name == name).map(|(id, _)| id);
        match found {
            Some(id) => self.close_schedule(id, "was ended; its trains finish their present commands"),
            None => self.say(format!("no schedule `{name}` runs")),
        }
        self.advance(now);
    }

    /// The operator commands a train: the schedule that drives it ends.
    pub(super) fn take_over(&mut self, train: TrainId) {
        let found = self.queues.runs().find(|(_, run)| run.trains.contains(&train)).map(|(id, _)| id);
        if let Some(id) = found {
            self.close_schedule(id, &format!("ended: train {train} was commanded by hand"));
        }
    }

    /// Ends all schedules at an emergency stop.
    pub(super) fn close_schedules(&mut self) {
        for id in self.queues.runs().map(|(id, _)| id).collect::<Vec<_>>() {
            self.close_schedule(id, "ended");
        }
    }

    fn close_schedule(&mut self, id: QueueId, how: &str) {
        let Some(picture) = self.schedule_picture(id) else { return };
        self.queues.end(id);
        self.say(format!("schedule `{}` {how}", picture.name));
        self.ended_schedules.push(SchedulePicture {
            active: Vec::new(),
            next: None,
            is_over: true,
            ..picture
        });
        if self.ended_schedules.len() > MAX_SCHEDULES {
            self.ended_schedules.remove(0);
        }
    }

    /// Begins the next round of a schedule whose lines have been carried out, or ends it.
    pub(super) fn continue_schedule(&mut self, now: Timestamp, id: QueueId) {
        let Some(queue) = self.queues.get(id) else { return };
        let Some(run) = &queue.run else { return };
        let mut own = self.pending.values().filter(|step| step.queue == id);
        let is_done = queue.steps.is_empty() && queue.wait.is_none() && own.all(is_open_ended);
        if !is_done || now < run.began + LEAST_ROUND {
            return;
        }
        let refused = run.refused.len();
        if self.queues.begin_round(id, now).is_some() {
            // Nothing else may wake the machine for the first line of the round.
            self.advance_queue(now, id);
        } else {
            let how = match refused {
                0 => "has ended".to_owned(),
                1 => "has ended; one line of its last round was refused".to_owned(),
                more => format!("has ended; {more} lines of its last round were refused"),
            };
            self.close_schedule(id, &how);
        }
    }

    /// When a schedule that has carried out its lines may begin its next round.
    pub(super) fn round_due(&self) -> Option<Timestamp> {
        let ends = self.queues.iter().filter_map(|(_, queue)| {
            let run = queue.run.as_ref().filter(|_| queue.steps.is_empty() && queue.wait.is_none())?;
            Some(run.began + LEAST_ROUND).filter(|due| *due > self.last_event)
        });
        ends.min()
    }

    /// Notes a line of a schedule that was refused.
    pub(super) fn note_refusal(&mut self, step: &Step, why: &str) {
        if let Some(run) = self.queues.get_mut(step.queue).and_then(|queue| queue.run.as_mut()) {
            run.refused.insert(step.line, why.to_owned());
        }
    }

    /// The state of all schedules, those that have ended among them.
    pub(super) fn schedule_pictures(&self) -> Vec<SchedulePicture> {
        let running = self.queues.runs().filter_map(|(id, _)| self.schedule_picture(id));
        running.chain(self.ended_schedules.iter().cloned()).collect()
    }

    fn schedule_picture(&self, id: QueueId) -> Option<SchedulePicture> {
        let queue = self.queues.get(id)?;
        let run = queue.run.as_ref()?;
        let mut state = queue.state();
        let own = self.pending.values().filter(|step| step.queue == id);
        state.active.extend(own.map(|step| step.line));
        Some(SchedulePicture {
            name: run.schedule.name.clone(),
            round: run.round,
            rounds: run.schedule.rounds,
            active: state.active.into_iter().collect(),
            next: state.next,
            refused: run.refused.clone(),
            is_over: false,
        })
    }

    /// Whether an operator gives the instructions of the session.
    pub(in crate::commands::drive) fn is_interactive(&self) -> bool {
        self.queues.get(QueueId::SESSION).is_some_and(|queue| queue.source == CommandSource::Person)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use footplate_core::SpeedStep;
    use footplate_core::control::{Driver, Learning, Machine as _};
    use footplate_core::model::MotionModel;
    use footplate_core::track::TurnoutStates;
    use footplate_store::layout_named;

    use super::*;
    use crate::commands::drive::session_message::SessionMessage;
    use crate::recorded::{Input, Listener as _};

    fn schedule(name: &str, lines: &[&str], rounds: Option<u32>) -> Schedule {
        let lines = lines.iter().map(|line| (*line).to_owned()).collect();
        Schedule { name: name.to_owned(), lines, rounds, is_button: false }
    }

    /// An operator's session with trains whose places are unknown.
    pub(in super::super) fn runner(trains: &[TrainId]) -> ScriptRunner {
        let layout = layout_named("track-a").expect("built in").layout;
        let mut driver = Driver::new(layout.clone(), TurnoutStates::default());
        for train in trains {
            driver.add_train(MotionModel::unknown(*train, SpeedStep::new(14).expect("a step")));
        }
        let mut runner =
            ScriptRunner::new(driver, Learning::new(&layout, Vec::new()), CommandSource::Person, Vec::new());
        runner.handle_timeout(Timestamp::ZERO);
        runner
    }

    /// Runs for a time, as the loop does: whenever the machine asks for it.
    fn run_until(runner: &mut ScriptRunner, end: Timestamp) {
        while let Some(due) = runner.next_timeout().filter(|due| *due <= end) {
            runner.handle_timeout(due.max(runner.last_event + TimeSpan::from_ms(1)));
            while runner.poll_output().is_some() {}
        }
    }

    #[test]
    fn rounds_follow_each_other_a_second_apart_at_least_and_end() {
        let mut runner = runner(&[TrainId(24)]);
        let at = Timestamp::from_s;
        runner.handle_word(
            at(1.0),
            &Input::Schedule(schedule("lights", &["light 24 on", "light 24 off"], Some(3))),
        );
        let state = |runner: &ScriptRunner| {
            let [picture] = runner.schedule_pictures().try_into().expect("one schedule");
            (picture.round, picture.is_over)
        };
        assert_eq!(state(&runner), (1, false));
        run_until(&mut runner, at(2.9));
        assert_eq!(state(&runner), (2, false));
        run_until(&mut runner, at(10.0));
        assert_eq!(state(&runner), (3, true));
        assert!(!runner.runs("lights"));
    }

    #[test]
    fn a_command_by_hand_ends_the_schedule_of_its_train_and_a_wait_does_not() {
        let mut runner = runner(&[TrainId(24)]);
        let at = Timestamp::from_s;
        let lines = ["wait 100s", "", "speed 24 3 # the third line"];
        runner.handle_word(at(1.0), &Input::Schedule(schedule("evening", &lines, None)));
        let [before] = runner.schedule_pictures().try_into().expect("one schedule");
        assert_eq!((before.active, before.next), (vec![0], Some(2)), "empty lines count as lines");
        runner.handle_word(at(2.0), &Input::Line("wait 1s".to_owned()));
        runner.handle_word(at(2.0), &Input::Line("light 24 on".to_owned()));
        assert!(runner.runs("evening"));
        let why = runner.check_run(&schedule("night", &["speed 24 2"], Some(1))).unwrap_err();
        assert_eq!(why, "schedule `evening` drives train 24 already: end it first");
        runner.handle_word(at(3.0), &Input::Line("speed 24 0".to_owned()));
        let [after] = runner.schedule_pictures().try_into().expect("one schedule");
        assert!(after.is_over && after.active.is_empty());
        assert_eq!(runner.check_run(&schedule("night", &["speed 24 2"], Some(1))), Ok(()));
    }

    #[test]
    fn a_line_begins_and_ends_a_saved_schedule_by_its_name() {
        let mut runner = runner(&[TrainId(24)]);
        let at = Timestamp::from_s;
        let said = |runner: &mut ScriptRunner| {
            let outputs = std::iter::from_fn(|| runner.poll_output());
            let lines = outputs.filter_map(|output| match output {
                footplate_core::control::Output::Notice(SessionMessage::Line { text, .. }) => Some(text),
                _ => None,
            });
            lines.collect::<Vec<_>>()
        };
        let line = |text: &str| Input::Line(text.to_owned());
        let lights = schedule("all lights", &["light 24 on", "wait 60s"], Some(2));
        runner.handle_word(at(1.0), &Input::Schedules(vec![lights, schedule("night", &["stop 24"], None)]));
        runner.handle_word(at(2.0), &line("schedule run all lights"));
        assert!(runner.runs("all lights"));
        said(&mut runner);
        runner.handle_word(at(3.0), &line("schedule list"));
        assert_eq!(
            said(&mut runner),
            ["schedule `all lights` runs: round 1 of 2", "schedule `night` is saved"]
        );
        assert_eq!(runner.functions.get(&TrainId(24)), Some(&1), "its first line has been carried out");
        runner.handle_word(at(4.0), &line("schedule end all lights"));
        assert!(!runner.runs("all lights"));
        runner.handle_word(at(5.0), &line("schedule end all lights"));
        assert_eq!(said(&mut runner).last().map(String::as_str), Some("no schedule `all lights` runs"));
        let mistakes = runner.read_schedule(&schedule("x", &["schedule run night"], None)).unwrap_err();
        assert_eq!(mistakes, "line 1: `schedule run night` is not for schedules");
    }

    #[test]
    fn a_schedule_that_cannot_be_read_names_every_mistake() {
        let runner = runner(&[TrainId(24)]);
        let read = |lines: &[&str], rounds| {
            runner.read_schedule(&schedule("x", lines, rounds)).expect_err("mistakes")
        };
        let mistakes = read(&["sped 24 8", "# nothing", "quit"], None);
        assert!(mistakes.contains("line 1, column 1: `sped`"), "{mistakes}");
        assert!(mistakes.contains("line 3: `quit` is not for schedules"), "{mistakes}");
        assert!(read(&["# nothing"], None).contains("no line that does anything"));
        assert!(read(&["light 24 on"], Some(0)).contains("0 rounds"));
    }
}
