//! Replay: gives the recorded inputs to a machine again, and compares its decisions with the recorded ones.
//!
//! Replay is open loop: the machine receives the recorded inputs, whatever it decides. After the first difference the
//! inputs still follow from the recorded decisions, except for the clock: from there on the machine is also woken when it
//! asks for it.

use std::collections::VecDeque;
use std::rc::Rc;

use footplate_core::{TimeSpan, Timestamp};
use footplate_store::{Side, Traced};

use super::decision::Decision;
use super::input::{Input, InputError};
use super::machine::Listener;

/// Two equal commands within this time count as the same command (chosen: a lap takes longer).
const SAME_COMMAND_WITHIN: TimeSpan = TimeSpan::from_ms(10_000);

/// How late a loop may wake a machine. An input that was recorded within this time wakes it.
const WOKEN_WITHIN: TimeSpan = TimeSpan::from_ms(5);

/// What to replay and compare.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Extent {
    /// Stop at this time, on the clock of the session.
    pub(crate) until: Option<Timestamp>,
    /// Continue after the first difference.
    pub(crate) all: bool,
    /// Compare notices, too. They are compared by their text, which may differ between versions.
    pub(crate) notices: bool,
}

impl Extent {
    fn compares(self, kind: &str) -> bool {
        self.notices || kind != Decision::NOTICE
    }
}

/// The result of a replay.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Replay {
    /// Inputs that the machine received.
    pub(crate) inputs: u64,
    /// Recorded decisions that were compared.
    pub(crate) decisions: u64,
    pub(crate) differences: Vec<Difference>,
    pub(crate) ending: Ending,
    /// Time of the last input.
    pub(crate) at: Timestamp,
}

/// Where it ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Ending {
    /// At the end of the session.
    Whole,
    /// At the time that was asked for.
    Asked,
    /// At the first difference, as asked.
    Differs,
    /// The recording has no end: the program was killed, or the power failed.
    CutOff,
    /// Rows are missing from this number on.
    Gap { number: u64 },
    /// A row is not an input.
    Unreadable { number: u64, why: InputError },
}

/// A decision that differs from the recorded one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Difference {
    /// Time of the input that it follows from.
    pub(crate) time: Timestamp,
    /// Command, hold-line, watch or notice.
    pub(crate) kind: String,
    /// The recorded decision, if there was one.
    pub(crate) then: Option<String>,
    /// The decision now, if there is one.
    pub(crate) now: Option<String>,
    /// By how much the same decision comes later now.
    pub(crate) later_by: Option<TimeSpan>,
    /// The input before it, as text.
    pub(crate) after: String,
}

/// Gives the inputs of a trace to a machine, and compares its decisions.
pub(crate) fn replay<M: Listener>(machine: &mut M, trace: Vec<Traced>, extent: Extent) -> Replay {
    let mut replay = Replay {
        inputs: 0,
        decisions: 0,
        differences: Vec::new(),
        ending: Ending::CutOff,
        at: Timestamp::ZERO,
    };
    let mut lone = Vec::new();
    let mut after: Rc<str> = "the beginning".into();
    let mut now = decided(machine, Timestamp::ZERO, &after, extent);
    let mut rows = trace.into_iter().zip(0_u64..).peekable();
    let mut is_over = false;
    while !is_over {
        // Inputs in a row, up to the first decision.
        while let Some((row, place)) = rows.next_if(|(row, _)| row.side == Side::Input) {
            match input_of(&row, place, extent) {
                Ok(input) => {
                    if !lone.is_empty() {
                        now.extend(decided_by_itself(machine, replay.at, row.time, extent));
                    }
                    after = format!("input {}: {} {}", row.number, row.kind, row.text).into();
                    machine.handle_input(row.time, &input);
                    now.extend(decided(machine, row.time, &after, extent));
                    replay.inputs += 1;
                    replay.at = row.time;
                }
                Err(ending) => {
                    replay.ending = ending;
                    is_over = true;
                    break;
                }
            }
        }
        // What was decided upon it then.
        let mut then = Vec::new();
        while let Some((row, place)) = rows.next_if(|(row, _)| !is_over && row.side == Side::Decision) {
            if let Some(ending) = obstacle(&row, place, extent) {
                replay.ending = ending;
                is_over = true;
                break;
            }
            let (kind, text) = (row.kind.into_owned(), row.text);
            if extent.compares(&kind) {
                then.push(Row { kind, text, time: row.time, after: Rc::clone(&after) });
            }
        }
        is_over |= rows.peek().is_none();
        // Killed in the middle of writing: what is missing at the very end was decided, and is not there.
        let is_torn = is_over && replay.ending != Ending::Whole && replay.ending != Ending::Asked;
        if is_torn && now.starts_with(&then) {
            now.truncate(then.len());
        }
        replay.decisions += then.len() as u64;
        let now = std::mem::take(&mut now);
        if then != now {
            lone.push(unmatched(&then, &now));
            if !extent.all {
                replay.ending = Ending::Differs;
                break;
            }
        }
    }
    replay.differences = differences(lone);
    replay
}

/// What a machine that has decided otherwise decides between two inputs of then: it asks for other times now.
fn decided_by_itself<M: Listener>(
    machine: &mut M,
    from: Timestamp,
    until: Timestamp,
    extent: Extent,
) -> Vec<Row> {
    let after: Rc<str> = "the time that it asks for now".into();
    let mut rows = Vec::new();
    let mut last = from;
    while let Some(due) = machine.next_timeout().filter(|due| *due > last && until - *due > WOKEN_WITHIN) {
        machine.handle_timeout(due);
        rows.extend(decided(machine, due, &after, extent));
        last = due;
    }
    rows
}

/// The input of a row, or why it ends there.
fn input_of(row: &Traced, place: u64, extent: Extent) -> Result<Input, Ending> {
    if let Some(ending) = obstacle(row, place, extent) {
        return Err(ending);
    }
    match Input::read(&row.kind, &row.text) {
        Ok(Input::End) => Err(Ending::Whole),
        Ok(input) => Ok(input),
        Err(why) => Err(Ending::Unreadable { number: row.number, why }),
    }
}

/// Why a row is not to be looked at.
fn obstacle(row: &Traced, place: u64, extent: Extent) -> Option<Ending> {
    if row.number != place {
        return Some(Ending::Gap { number: place });
    }
    extent.until.is_some_and(|until| row.time > until).then_some(Ending::Asked)
}

/// All that a machine has decided since it was asked last.
fn decided<M: Listener>(machine: &mut M, time: Timestamp, after: &Rc<str>, extent: Extent) -> Vec<Row> {
    let outputs = std::iter::from_fn(|| machine.poll_output());
    let row = |Decision { kind, text }| Row { kind: kind.to_owned(), text, time, after: Rc::clone(after) };
    let decisions = outputs.map(|output| Decision::of(&output));
    decisions.filter(|decision| extent.compares(decision.kind)).map(row).collect()
}

/// A decision of then or of now.
#[derive(Debug, Clone)]
struct Row {
    kind: String,
    text: String,
    /// Time of the input that it follows from.
    time: Timestamp,
    /// That, in words.
    after: Rc<str>,
}

/// When it was is no part of a decision: several inputs may have come before it was asked for.
impl PartialEq for Row {
    fn eq(&self, other: &Self) -> bool {
        (&self.kind, &self.text) == (&other.kind, &other.text)
    }
}

/// Decisions upon the same inputs that are only of then and only of now.
type Lone = [Vec<Row>; 2];

/// What differs: the same command at another time, something else upon the same inputs, or something and nothing.
fn differences(mut lone: Vec<Lone>) -> Vec<Difference> {
    let mut found = moved_commands(&mut lone);
    for [then, now] in lone {
        let mut now: VecDeque<Row> = now.into();
        for row in then {
            // Of what is decided now instead, the next of its kind.
            let instead = now.iter().position(|other| other.kind == row.kind);
            let instead = instead.and_then(|place| now.remove(place)).map(|row| row.text);
            found.push(Difference::of(row.clone(), Some(row.text), instead, None));
        }
        found.extend(now.into_iter().map(|row| Difference::of(row.clone(), None, Some(row.text), None)));
    }
    found.sort_by_key(|difference| difference.time);
    found
}

impl Difference {
    fn of(row: Row, then: Option<String>, now: Option<String>, later_by: Option<TimeSpan>) -> Self {
        let Row { kind, time, after, .. } = row;
        Self { time, kind, then, now, later_by, after: after.to_string() }
    }
}

/// Takes out commands of then that are given now as well, only a little earlier or later.
fn moved_commands(lone: &mut [Lone]) -> Vec<Difference> {
    let mut found = Vec::new();
    for group in 0..lone.len() {
        let mut place = 0;
        while let Some(row) = lone[group][0].get(place).cloned() {
            let all = lone.iter().enumerate().flat_map(|(other, [_, now])| {
                now.iter().enumerate().map(move |(place, row)| (other, place, row))
            });
            let same = all.filter(|(_, _, now)| row.kind == Decision::COMMAND && **now == row);
            let nearest = same.min_by_key(|(_, _, now)| (now.time - row.time).abs());
            let nearest = nearest.map(|(other, place, now)| (other, place, now.time - row.time));
            match nearest.filter(|(_, _, by)| by.abs() <= SAME_COMMAND_WITHIN) {
                Some((other, at, by)) => {
                    lone[other][1].remove(at);
                    lone[group][0].remove(place);
                    let text = Some(row.text.clone());
                    found.push(Difference::of(row, text.clone(), text, Some(by)));
                }
                None => place += 1,
            }
        }
    }
    found
}

/// What is left of two lists without their longest common part.
fn unmatched(then: &[Row], now: &[Row]) -> Lone {
    // Length of the longest common part of what stands from here on in both.
    let mut common = vec![vec![0_usize; now.len() + 1]; then.len() + 1];
    for i in (0..then.len()).rev() {
        for j in (0..now.len()).rev() {
            common[i][j] = if then[i] == now[j] {
                common[i + 1][j + 1] + 1
            } else {
                common[i + 1][j].max(common[i][j + 1])
            };
        }
    }
    let (mut i, mut j) = (0, 0);
    let (mut of_then, mut of_now) = (Vec::new(), Vec::new());
    while i < then.len() && j < now.len() {
        if then[i] == now[j] {
            (i, j) = (i + 1, j + 1);
        } else if common[i + 1][j] >= common[i][j + 1] {
            of_then.push(then[i].clone());
            i += 1;
        } else {
            of_now.push(now[j].clone());
            j += 1;
        }
    }
    of_then.extend_from_slice(&then[i..]);
    of_now.extend_from_slice(&now[j..]);
    [of_then, of_now]
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;

    use footplate_core::control::{Machine, Output};
    use footplate_core::{Command, Event, SpeedStep, TrainId};

    use super::*;

    /// Commands the step that lines ask for.
    #[derive(Default)]
    struct Obedient {
        adds: u8,
        waits: TimeSpan,
        pending: Option<(u8, Timestamp)>,
        outputs: VecDeque<Output<String>>,
    }

    impl Machine for Obedient {
        type Notice = String;
        fn handle_event(&mut self, _: Timestamp, _: &Event) {}
        fn handle_timeout(&mut self, now: Timestamp) {
            if let Some((step, _)) = self.pending.take_if(|(_, due)| *due <= now) {
                let step = SpeedStep::new(step + self.adds).unwrap();
                self.outputs.push_back(Output::Command(Command::Speed { train: TrainId(24), step }));
            }
        }
        fn poll_output(&mut self) -> Option<Output<String>> {
            self.outputs.pop_front()
        }
        fn next_timeout(&self) -> Option<Timestamp> {
            self.pending.map(|(_, due)| due)
        }
    }

    impl Listener for Obedient {
        fn handle_word(&mut self, now: Timestamp, word: &Input) {
            let Input::Line(line) = word else { return };
            self.outputs.push_back(Output::Notice(line.clone()));
            self.pending = line.parse().ok().map(|step| (step, now + self.waits));
            self.handle_timeout(now);
        }
    }

    fn traced(number: u64, ms: i64, side: Side, kind: &'static str, text: &str) -> Traced {
        let time = Timestamp::ZERO + TimeSpan::from_ms(ms);
        Traced { number, time, side, kind: Cow::Borrowed(kind), text: text.to_owned() }
    }

    fn evening() -> Vec<Traced> {
        let command = |step: u8| format!("step {step} for train 24");
        vec![
            traced(0, 10, Side::Input, "line", "3"),
            traced(1, 10, Side::Decision, "notice", "\"3\""),
            traced(2, 10, Side::Decision, "command", &command(3)),
            traced(3, 500, Side::Input, "timeout", ""),
            traced(4, 900, Side::Input, "line", "5"),
            traced(5, 900, Side::Decision, "notice", "\"5\""),
            traced(6, 900, Side::Decision, "command", &command(5)),
            traced(7, 1_000, Side::Input, "timeout", ""),
            traced(8, 1_000, Side::Input, "end", ""),
        ]
    }

    const ALL: Extent = Extent { until: None, all: true, notices: true };

    #[test]
    fn the_same_machine_decides_the_same() {
        let found = replay(&mut Obedient::default(), evening(), ALL);
        assert_eq!((found.inputs, found.decisions, found.ending), (4, 4, Ending::Whole));
        assert_eq!(found.differences, []);
    }

    #[test]
    fn another_command_is_shown_with_both_and_the_input_before() {
        let mut other = Obedient { adds: 1, ..Obedient::default() };
        let found = replay(&mut other, evening(), ALL);
        assert_eq!(found.differences.len(), 2);
        let first = &found.differences[0];
        assert_eq!(first.then.as_deref(), Some("step 3 for train 24"));
        assert_eq!(first.now.as_deref(), Some("step 4 for train 24"));
        assert_eq!((first.after.as_str(), first.later_by), ("input 0: line 3", None));
        let only_first =
            replay(&mut Obedient { adds: 1, ..Obedient::default() }, evening(), Extent::default());
        assert_eq!(
            (only_first.ending, &only_first.differences[..]),
            (Ending::Differs, &found.differences[..1])
        );
    }

    #[test]
    fn another_wording_is_a_difference_only_if_notices_are_compared() {
        let mut trace = evening();
        let said = trace.iter_mut().find(|row| row.kind == "notice").unwrap();
        said.text = "Drive(\"3\")".to_owned();
        let differences = |extent| replay(&mut Obedient::default(), trace.clone(), extent).differences.len();
        assert_eq!(differences(ALL), 1);
        assert_eq!(differences(Extent { notices: false, ..ALL }), 0);
    }

    #[test]
    fn the_same_command_at_another_time_is_one_difference_and_says_by_how_much() {
        // It is woken when it asks for it, or when something was recorded soon after.
        for (waits, later_by) in [(40, [40, 40]), (488, [490, 100])] {
            let mut slow = Obedient { waits: TimeSpan::from_ms(waits), ..Obedient::default() };
            let found = replay(&mut slow, evening(), ALL);
            let by: Vec<_> = found.differences.iter().filter_map(|difference| difference.later_by).collect();
            assert_eq!(by, later_by.map(TimeSpan::from_ms)[..by.len()], "{waits} ms");
            assert!(!by.is_empty());
        }
    }

    #[test]
    fn a_recording_that_was_cut_off_is_the_same_as_far_as_it_goes() {
        for length in 0..evening().len() {
            let mut trace = evening();
            trace.truncate(length);
            let found = replay(&mut Obedient::default(), trace, ALL);
            assert_eq!((found.ending, found.differences), (Ending::CutOff, Vec::new()), "{length}");
        }
        // But for a decision that was another one.
        let mut trace = evening();
        trace.truncate(7);
        let found = replay(&mut Obedient { adds: 1, ..Obedient::default() }, trace, ALL);
        assert_eq!(found.differences.len(), 2);
    }

    #[test]
    fn a_gap_an_unknown_input_and_the_time_asked_for_end_it() {
        let mut gap = evening();
        gap.remove(3);
        let found = replay(&mut Obedient::default(), gap, ALL);
        assert_eq!((found.ending, found.differences.len()), (Ending::Gap { number: 3 }, 0));
        let mut strange = evening();
        strange[3].kind = Cow::Borrowed("telepathy");
        let found = replay(&mut Obedient::default(), strange, ALL);
        assert!(matches!(found.ending, Ending::Unreadable { number: 3, .. }));
        let until = Extent { until: Some(Timestamp::ZERO + TimeSpan::from_ms(600)), ..ALL };
        let found = replay(&mut Obedient::default(), evening(), until);
        assert_eq!((found.ending, found.inputs, found.decisions), (Ending::Asked, 2, 2));
    }
}
