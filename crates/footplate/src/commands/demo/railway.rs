//! The simulated railway of the demo, behind the bytes of a 6051, and its control loop.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use footplate_core::control::Machine;
use footplate_core::track::{Layout, Position};
use footplate_core::{Command, Event, Timestamp, TrainId};
use footplate_sim::living::{End, LivingLayout, LivingSwitches, VirtualStation};
use footplate_wire::marklin_serial::{Interface, Settings};
use footplate_wire::{CommandError, LinkNotice};

use crate::link::{Link as _, SimulatedLink, Speed, module_count};
use crate::runtime::{Attendant, Ended, Recorder, Runtime, StopFlag, Wish};
use crate::session_journal::SessionJournal;
use crate::standard_error::say;

/// Counts the events of the runtime, and records them if there is a journal.
#[derive(Debug, Default)]
pub(super) struct Record {
    pub(super) journal: Option<SessionJournal>,
    pub(super) events: u64,
}

/// A record shared by the runtime and the display.
#[derive(Debug, Clone, Default)]
pub(super) struct SharedRecord(pub(super) Rc<RefCell<Record>>);

impl Recorder for SharedRecord {
    fn record(&mut self, events: &[Event]) -> anyhow::Result<()> {
        let mut record = self.0.borrow_mut();
        record.events += events.len() as u64;
        match &mut record.journal {
            Some(journal) => journal.record(events),
            None => Ok(()),
        }
    }
}

pub(super) struct Railway<'r, 'l> {
    runtime: Runtime<'r, SimulatedLink<'l>>,
    /// Trains off the rails, and where each was.
    lifted: BTreeMap<TrainId, Option<(Position, End)>>,
}

impl<'r, 'l> Railway<'r, 'l> {
    /// Draws trains and a well-kept layout from the seed. All trains are off the rails until [`Self::put_down`].
    pub(super) fn new(
        layout: &'l Layout,
        seed: u64,
        trains: &[TrainId],
        speed: Speed,
        record: &'r mut SharedRecord,
    ) -> anyhow::Result<Self> {
        let switches = LivingSwitches { turnouts_set: true, ..LivingSwitches::well_kept() };
        let station = VirtualStation::draw(layout, seed, trains, &switches)?;
        let line = SimulatedLink::new(station, speed);
        let session = Interface::new(line.now(), Settings::with_cts(module_count(layout)))?;
        let runtime = Runtime::new(line, session, Some(record), Some(StopFlag::install()));
        let mut railway = Self { runtime, lifted: BTreeMap::new() };
        trains.iter().for_each(|train| railway.lift(*train));
        Ok(railway)
    }

    pub(super) fn now(&self) -> Timestamp {
        self.runtime.link().now()
    }

    /// The simulated world, with the truth.
    pub(super) fn world(&self) -> &LivingLayout<'l> {
        self.runtime.link().station().world()
    }

    /// Takes a train off the rails.
    pub(super) fn lift(&mut self, train: TrainId) {
        let was_at = self.world().truth().train(train).and_then(|truth| Some((truth.position?, truth.leads)));
        self.lifted.insert(train, was_at);
        self.runtime.link_mut().station_mut().world_mut().lift(train);
    }

    /// Puts a train back to where it was.
    pub(super) fn put_down(&mut self, train: TrainId) -> anyhow::Result<()> {
        if let Some((position, leads)) = self.lifted.remove(&train).flatten() {
            self.runtime.link_mut().station_mut().world_mut().place(train, position, leads)?;
        }
        Ok(())
    }

    /// Runs the loop until its next turn has ended, and returns the notices of that turn.
    ///
    /// # Errors
    /// The link is lost, or the operator interrupts.
    pub(super) fn advance<M: Machine>(&mut self, machine: &mut M) -> anyhow::Result<Vec<M::Notice>> {
        let mut turn = Turn { notices: Vec::new() };
        match self.runtime.run(machine, &mut turn)? {
            Ended::Finished => Ok(turn.notices),
            ended => anyhow::bail!("{ended}"),
        }
    }

    /// Stops all trains and switches the track power off.
    pub(super) fn close(&mut self) {
        let closing = self.runtime.close();
        if !closing.is_complete() {
            say!("{closing}");
        }
    }
}

/// Collects the notices of one turn of the loop.
struct Turn<N> {
    notices: Vec<N>,
}

impl<M: Machine> Attendant<M> for Turn<M::Notice> {
    fn hear(&mut self, _: Timestamp, notice: M::Notice) {
        self.notices.push(notice);
    }

    fn hear_of_line(&mut self, _: Timestamp, _: &LinkNotice) {}

    fn hear_of_refusal(&mut self, _: Timestamp, _: Command, _: CommandError) {}

    fn attend(&mut self, _: Timestamp, _: &mut M) -> Wish {
        Wish::Finish
    }
}
