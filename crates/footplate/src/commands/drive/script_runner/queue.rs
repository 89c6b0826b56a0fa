//! Queues of instructions: the script or the operator of the session, and the schedules that run beside it.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::Bound;

use footplate_core::{Timestamp, TrainId};
use footplate_store::Schedule;

use crate::commands::drive::instruction::Until;
use crate::commands::drive::script::{CommandSource, QueueId, Step};

/// Steps that are carried out one after the other.
#[derive(Debug)]
pub(super) struct StepQueue {
    pub(super) source: CommandSource,
    pub(super) steps: VecDeque<Step>,
    pub(super) wait: Option<Wait>,
    /// Since when the next step has waited for a train that cannot be driven at present.
    pub(super) interrupted: Option<Timestamp>,
    /// The schedule that the steps belong to.
    pub(super) run: Option<ScheduleRun>,
}

/// A `wait` in progress.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wait {
    pub(super) until: Until,
    pub(super) since: Timestamp,
    pub(super) is_met: bool,
    /// Whether it is part of the search for a train.
    pub(super) is_part: bool,
    /// The number of its line in a schedule, from 0.
    pub(super) line: usize,
}

/// A schedule that runs.
#[derive(Debug)]
pub(super) struct ScheduleRun {
    pub(super) schedule: Schedule,
    /// The steps of one round.
    round_steps: Vec<Step>,
    /// The number of the present round, from 1.
    pub(super) round: u32,
    /// When the present round began.
    pub(super) began: Timestamp,
    /// The lines that were refused, with the reasons.
    pub(super) refused: BTreeMap<usize, String>,
    /// The trains that it drives.
    pub(super) trains: BTreeSet<TrainId>,
}

/// How far a schedule has come.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ScheduleState {
    pub(super) next: Option<usize>,
    pub(super) active: BTreeSet<usize>,
}

impl StepQueue {
    pub(super) fn new(source: CommandSource, steps: Vec<Step>) -> Self {
        Self { source, steps: steps.into(), wait: None, interrupted: None, run: None }
    }

    /// The lines of a schedule that are carried out now, beside those of orders in progress, and the line that follows.
    pub(super) fn state(&self) -> ScheduleState {
        ScheduleState {
            next: self.steps.front().map(|step| step.line),
            active: self.wait.iter().map(|wait| wait.line).collect(),
        }
    }
}

/// All queues of a session, the session's own first.
#[derive(Debug)]
pub(super) struct Queues {
    queues: BTreeMap<QueueId, StepQueue>,
    next: u32,
}

impl Queues {
    pub(super) fn new(session: StepQueue) -> Self {
        Self { queues: BTreeMap::from([(QueueId::SESSION, session)]), next: QueueId::SESSION.0 + 1 }
    }

    /// Whether the steps of a queue come from a script: its trains finish one order before they begin the next. A queue that has
    /// ended leaves its orders to the operator.
    pub(super) fn is_script(&self, id: QueueId) -> bool {
        self.queues.get(&id).is_some_and(|queue| queue.source == CommandSource::Script)
    }

    /// Adds a schedule; its first round begins now.
    pub(super) fn add(&mut self, now: Timestamp, schedule: Schedule, steps: Vec<Step>) -> QueueId {
        let id = QueueId(self.next);
        self.next += 1;
        let round_steps: Vec<Step> = steps.into_iter().map(|step| Step { queue: id, ..step }).collect();
        let trains = round_steps.iter().filter_map(|step| step.instruction.driven()).collect();
        let refused = BTreeMap::new();
        let mut queue = StepQueue::new(CommandSource::Script, round_steps.clone());
        queue.run = Some(ScheduleRun { schedule, round_steps, round: 1, began: now, refused, trains });
        self.queues.insert(id, queue);
        id
    }

    /// Begins the next round of a schedule; `None` if there is none.
    pub(super) fn begin_round(&mut self, id: QueueId, now: Timestamp) -> Option<()> {
        let queue = self.queues.get_mut(&id)?;
        let run = queue.run.as_mut()?;
        if run.schedule.rounds.is_some_and(|rounds| run.round >= rounds) {
            return None;
        }
        run.round += 1;
        run.began = now;
        run.refused.clear();
        queue.steps = run.round_steps.clone().into();
        Some(())
    }

    /// The queue behind another one.
    pub(super) fn after(&self, id: QueueId) -> Option<QueueId> {
        self.queues.range((Bound::Excluded(id), Bound::Unbounded)).next().map(|(id, _)| *id)
    }

    pub(super) fn get(&self, id: QueueId) -> Option<&StepQueue> {
        self.queues.get(&id)
    }

    pub(super) fn get_mut(&mut self, id: QueueId) -> Option<&mut StepQueue> {
        self.queues.get_mut(&id)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (QueueId, &StepQueue)> {
        self.queues.iter().map(|(id, queue)| (*id, queue))
    }

    pub(super) fn waits_mut(&mut self) -> impl Iterator<Item = &mut Wait> {
        self.queues.values_mut().filter_map(|queue| queue.wait.as_mut())
    }

    /// Puts a step before all others of its queue; a step of a queue that has ended is dropped.
    pub(super) fn push_front(&mut self, step: Step) {
        if let Some(queue) = self.queues.get_mut(&step.queue) {
            queue.steps.push_front(step);
        }
    }

    /// The schedules that run, with their queues.
    pub(super) fn runs(&self) -> impl Iterator<Item = (QueueId, &ScheduleRun)> {
        self.queues.iter().filter_map(|(id, queue)| Some((*id, queue.run.as_ref()?)))
    }

    /// Ends a schedule; the orders in progress go on.
    pub(super) fn end(&mut self, id: QueueId) -> Option<ScheduleRun> {
        self.queues.get(&id)?.run.as_ref()?;
        self.queues.remove(&id)?.run
    }

    /// Drops all steps, and ends all schedules.
    pub(super) fn clear(&mut self) {
        self.queues.retain(|id, _| *id == QueueId::SESSION);
        for queue in self.queues.values_mut() {
            queue.steps.clear();
            queue.wait = None;
        }
    }
}
