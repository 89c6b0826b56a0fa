//! Which trains are driven, and what is known of how they move.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use footplate_core::model::MotionFit;
use footplate_core::model::survey::SectionIndex;
use footplate_core::model::{MotionModel, StepUse};
use footplate_core::track::{Layout, TurnoutStates};
use footplate_core::{SpeedStep, TrainId};
use footplate_store::{KeptModel, MotionFile, MotionReplay, Store};

use crate::clock::now;

/// Addresses of a 6050 or 6051.
const ADDRESSES: std::ops::RangeInclusive<u16> = 1..=80;
/// The highest step of its decoders.
const HIGHEST: u8 = 14;

/// Trains as they are known when a session begins.
#[derive(Debug, Default)]
pub(super) struct KnownTrains {
    pub(super) models: BTreeMap<TrainId, MotionModel>,
    /// What they follow from, where that is known, to go on from.
    pub(super) fits: Vec<MotionFit>,
    pub(super) turnouts: TurnoutStates,
    /// Trains of which nothing is known.
    pub(super) unknown: Vec<TrainId>,
}

/// Where to look for trains.
pub(super) struct Sources<'s> {
    /// Files of motion models.
    pub(super) files: &'s [PathBuf],
    pub(super) store: Option<&'s mut Store>,
    /// Trains to drive whether or not anything is known of them.
    pub(super) named: BTreeSet<TrainId>,
}

impl KnownTrains {
    /// # Errors
    /// A file or the store cannot be read, a model is of another layout, or there is no train at all.
    pub(super) fn gather(layout: &Layout, sources: Sources<'_>) -> anyhow::Result<Self> {
        let mut known = Self::default();
        for path in sources.files {
            let file = MotionFile::read(path)?;
            known.add(layout, &file, &path.display().to_string())?;
        }
        if let Some(store) = sources.store {
            for train in ADDRESSES.map(TrainId) {
                if !known.models.contains_key(&train) {
                    known.add_of_store(layout, store, train, sources.named.contains(&train))?;
                }
            }
        }
        for train in &sources.named {
            if !known.models.contains_key(train) {
                let fit = MotionFit::new(*train, highest());
                known.models.insert(*train, fit.model().clone());
                known.fits.push(fit);
                known.unknown.push(*train);
            }
        }
        if known.models.is_empty() {
            bail!(
                "there is no train to drive: name one with `--train 24`, or give calibrated trains with \
                 `--store` or `--model`"
            );
        }
        Ok(known)
    }

    fn add(&mut self, layout: &Layout, file: &MotionFile, place: &str) -> anyhow::Result<()> {
        if file.layout != layout.name() {
            bail!(
                "{place}: the model of train {} is of layout {}, not of {}",
                file.train,
                file.layout,
                layout.name()
            );
        }
        let model = file.model(layout).with_context(|| place.to_owned())?;
        self.models.insert(model.train(), model);
        Ok(())
    }

    /// What a store knows: the model kept last, and the events it follows from, to learn on.
    fn add_of_store(
        &mut self,
        layout: &Layout,
        store: &mut Store,
        train: TrainId,
        is_named: bool,
    ) -> anyhow::Result<()> {
        let at = now();
        match KeptModel::of_store(layout, store, train, at)? {
            KeptModel::Model(model) => drop(self.models.insert(train, model.for_later_session())),
            KeptModel::OfOtherFormulas => eprintln!(
                "the stored model of train {train} is from another version of the formulas; it is \
                 fitted again from the stored events"
            ),
            KeptModel::Nothing if is_named => {}
            KeptModel::Nothing => return Ok(()),
        }
        let replay = MotionReplay::of_store(layout, store, train, highest(), at)?;
        if replay.is_empty() {
            return Ok(());
        }
        let mut fit = replay.fit;
        fit.begin_session(&SectionIndex::of(layout));
        if let Some(model) = self.models.get(&train) {
            // Which steps move it follows from experiments, not from the events alone.
            for step in (1..=HIGHEST).filter_map(SpeedStep::new) {
                if model.uses(step) != StepUse::Untried {
                    fit.note_use(step, model.uses(step));
                }
            }
        } else {
            self.models.insert(train, fit.model().clone());
        }
        self.fits.push(fit);
        for (turnout, _) in layout.turnouts() {
            if let Some(leg) = replay.turnouts.get(turnout) {
                self.turnouts.set(turnout, leg);
            }
        }
        Ok(())
    }

    /// Keeps what was learnt.
    ///
    /// # Errors
    /// The store cannot be written.
    pub(super) fn keep(path: &Path, layout: &Layout, models: &[MotionModel]) -> anyhow::Result<()> {
        let mut store = Store::open_or_create(path)?;
        let at = now();
        for model in models {
            MotionFile::of(layout, model, Some(at)).keep(&mut store, at, at)?;
            // What this session added is gone through now that all trains stand, and not when the next one is to begin.
            MotionReplay::of_store(layout, &mut store, model.train(), highest(), at)?;
        }
        Ok(())
    }
}

fn highest() -> SpeedStep {
    SpeedStep::new(HIGHEST).unwrap_or_default()
}
