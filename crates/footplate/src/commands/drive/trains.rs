//! Finds the trains of a session and their motion models.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use footplate_core::model::MotionFit;
use footplate_core::model::survey::SectionIndex;
use footplate_core::model::{MotionModel, StepUse};
use footplate_core::track::{Layout, TurnoutStates};
use footplate_core::{DecoderSteps, SpeedStep, TrainId};
use footplate_store::{MotionFile, MotionReplay, Store, StoredModel};

use crate::clock::{LATEST, now};
use crate::counted::counted;
use crate::layout_check::lengths_warning;
use crate::link::StationKind;
use crate::standard_error::say;

/// The trains that a session begins with.
#[derive(Debug, Default)]
pub(super) struct KnownTrains {
    pub(super) models: BTreeMap<TrainId, MotionModel>,
    /// The fits that led to the models, to be continued.
    pub(super) fits: Vec<MotionFit>,
    pub(super) turnouts: TurnoutStates,
    /// Trains without a motion model.
    pub(super) unknown: Vec<TrainId>,
}

/// Where motion models come from.
pub(super) struct Sources<'s> {
    /// Files of motion models.
    pub(super) files: &'s [PathBuf],
    pub(super) store: Option<&'s mut Store>,
    /// Trains to drive even without a model, with the steps of their decoders where they were said.
    pub(super) named: BTreeMap<TrainId, Option<DecoderSteps>>,
    /// The station that commands them.
    pub(super) station: StationKind,
}

impl KnownTrains {
    /// Collects the trains of files, store and command line, in this order of precedence.
    ///
    /// # Errors
    /// A file or the store cannot be read, a model belongs to another layout, or there is no train at all.
    pub(super) fn gather(layout: &Layout, sources: Sources<'_>) -> anyhow::Result<Self> {
        let mut known = Self::default();
        for path in sources.files {
            let file = MotionFile::read(path)?;
            known.add(layout, &file, &path.display().to_string())?;
        }
        if let Some(store) = sources.store {
            let mut trains: BTreeSet<TrainId> = sources.named.keys().copied().collect();
            trains.extend(store.calibrated_trains()?);
            for train in trains {
                if !known.models.contains_key(&train) {
                    known.add_of_store(layout, store, train, sources.named.get(&train).copied())?;
                }
            }
        }
        for (train, decoder) in &sources.named {
            if let Some(model) = known.models.get(train) {
                let has = DecoderSteps::with(model.highest());
                if let Some(decoder) = decoder.filter(|decoder| *decoder != has) {
                    bail!(
                        "the motion model of train {train} is of a decoder with {has} steps, not {decoder}: calibrate it \
                         again, with `footplate calibrate --train {train}:{decoder} --afresh`"
                    );
                }
            } else {
                let decoder = decoder.unwrap_or(DecoderSteps::Fourteen);
                known.begin(MotionFit::new(*train, decoder.highest()));
            }
        }
        // A store may hold trains that only another station can command.
        let refused = known.models.values().filter_map(|model| {
            let decoder = DecoderSteps::with(model.highest());
            sources.station.check(model.train(), decoder).err().map(|why| (model.train(), why))
        });
        for (train, why) in refused.collect::<Vec<_>>() {
            say!("{why}; it is left out");
            known.models.remove(&train);
            known.fits.retain(|fit| fit.model().train() != train);
        }
        if known.models.is_empty() {
            bail!(
                "there is no train to drive: name one with `--train 24`, or give calibrated trains with \
                 `--store` or `--model`"
            );
        }
        Ok(known)
    }

    /// Adds a train that has not run yet.
    fn begin(&mut self, fit: MotionFit) {
        self.models.insert(fit.model().train(), fit.model().clone());
        self.unknown.push(fit.model().train());
        self.fits.push(fit);
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

    /// Adds a train of the store: its latest model, and the fit to its events.
    fn add_of_store(
        &mut self,
        layout: &Layout,
        store: &mut Store,
        train: TrainId,
        named: Option<Option<DecoderSteps>>,
    ) -> anyhow::Result<()> {
        let stored = StoredModel::of_store(layout, store, train, LATEST)?;
        if stored == StoredModel::Nothing && named.is_none() {
            return Ok(());
        }
        let highest = match (&stored, named.flatten()) {
            (StoredModel::Model(model), _) => model.highest(),
            (_, Some(decoder)) => decoder.highest(),
            (_, None) => stored.decoder(store, train, LATEST)?.highest(),
        };
        match stored {
            StoredModel::Model(model) => drop(self.models.insert(train, model.for_later_session())),
            StoredModel::Outdated { .. } => say!(
                "the stored model of train {train} is from another version of the formulas; it is \
                 fitted again from the stored events"
            ),
            StoredModel::Nothing => {}
        }
        let replay = MotionReplay::of_store(layout, store, train, highest, LATEST)?;
        if replay.is_empty() {
            if self.models.contains_key(&train) {
                return Ok(());
            }
            if let Some(profile) = &replay.profile {
                say!("train {train} begins with the speeds of {profile}");
                self.begin(replay.fit);
            } else if named.is_some() {
                self.begin(MotionFit::new(train, highest));
            }
            return Ok(());
        }
        if !replay.left_out.is_empty() {
            say!(
                "left out of what train {train} learnt, because other trains moved, too: {}",
                counted(replay.left_out.len(), "run")
            );
        }
        if let Some(warning) = lengths_warning(layout, replay.fit.survey_test()) {
            say!("WARNING: {}; so recordings of train {train} say", warning.english);
        }
        let mut fit = replay.fit;
        fit.begin_session(&SectionIndex::of(layout));
        if let Some(model) = self.models.get(&train) {
            // The events alone do not show which steps move the train: the model's experiments do.
            for step in (1..=highest.get()).filter_map(SpeedStep::new) {
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

    /// Stores the fitted models.
    ///
    /// # Errors
    /// The store cannot be written.
    pub(super) fn keep(path: &Path, layout: &Layout, models: &[MotionModel]) -> anyhow::Result<()> {
        let mut store = Store::open_or_create(path)?;
        let at = now();
        for model in models {
            MotionFile::of(layout, model, Some(at)).keep(&mut store, at, at)?;
            // Digests the events of this session now, while all trains are at rest, instead of at the start of the next
            // session.
            MotionReplay::of_store(layout, &mut store, model.train(), model.highest(), LATEST)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use footplate_core::{Event, EventKind, Timestamp};
    use footplate_store::{Journal, NewCalibration, ProfileSpeed, SpeedProfile, built_in};

    use super::*;

    const TRAIN: TrainId = TrainId(24);

    /// A store in which the train was driven at a step on Track A.
    fn driven(path: &Path, step: u8, date: Timestamp) -> Store {
        let store = Store::open_or_create(path).unwrap();
        let mut journal = Journal::begin(store, "evening", "track-a", None, &[], date).unwrap();
        let step = SpeedStep::new(step).unwrap();
        let event = Event { time: Timestamp::from_s(1.0), kind: EventKind::Speed { train: TRAIN, step } };
        journal.append(&[event], date).unwrap();
        journal.end()
    }

    #[test]
    fn a_clock_that_is_behind_hides_nothing_that_was_stored() {
        let folder = tempfile::tempdir().unwrap();
        let layout = built_in("track-a").unwrap().layout;
        let next_year = now() + footplate_core::TimeSpan::from_s(31_536_000.0);
        let mut store = driven(&folder.path().join("railway.db"), 20, next_year);
        assert_eq!(gathered(&mut store, None).get(), 28, "the events");
        let model = MotionModel::unknown(TRAIN, DecoderSteps::All.highest());
        MotionFile::of(&layout, &model, None).keep(&mut store, next_year, next_year).unwrap();
        assert_eq!(gathered(&mut store, None).get(), 126, "the model");
        assert_eq!(store.newest_stamp().unwrap(), Some(next_year));
    }

    #[test]
    fn a_train_with_an_imported_profile_begins_with_the_steps_of_its_decoder() {
        let folder = tempfile::tempdir().unwrap();
        for (steps, highest) in [(None, 14), (Some(28), 28), (Some(126), 126)] {
            let path = folder.path().join(format!("{highest}.db"));
            let mut store = Store::open_or_create(&path).unwrap();
            let speed = ProfileSpeed {
                line: 2,
                throttle: 0.5,
                forward_mm_s: Some(220.0),
                reverse_mm_s: None,
                uncertainty_mm_s: None,
            };
            let highest_step = steps.and_then(SpeedStep::new);
            let profile =
                SpeedProfile { highest: highest_step, speeds: vec![speed], ..SpeedProfile::default() };
            store.keep_profile(TRAIN, Some(&profile), now()).unwrap();
            assert_eq!(gathered(&mut store, None).get(), highest, "as imported");
            assert_eq!(gathered(&mut store, Some(DecoderSteps::TwentyEight)).get(), 28, "as named");
        }
    }

    fn outdated(store: &mut Store, body: &str) {
        let old = NewCalibration { train: TRAIN, as_of: now(), model_version: "8", body };
        store.keep_calibration(old, now()).unwrap();
    }

    fn gathered(store: &mut Store, named: Option<DecoderSteps>) -> SpeedStep {
        let layout = built_in("track-a").unwrap().layout;
        let named = BTreeMap::from([(TRAIN, named)]);
        let sources = Sources { files: &[], store: Some(store), named, station: StationKind::DccEx };
        let known = KnownTrains::gather(&layout, sources).unwrap();
        assert_eq!(known.fits.len(), 1);
        assert_eq!(known.fits[0].model().highest(), known.models[&TRAIN].highest());
        known.models[&TRAIN].highest()
    }

    #[test]
    fn a_train_keeps_the_steps_of_its_decoder_when_its_model_is_outdated() {
        let folder = tempfile::tempdir().unwrap();
        let mut store = driven(&folder.path().join("stated.db"), 10, now());
        outdated(&mut store, r#"{"layout":"track-a","highest_step":126}"#);
        assert_eq!(gathered(&mut store, None), DecoderSteps::All.highest());
        assert_eq!(gathered(&mut store, Some(DecoderSteps::TwentyEight)).get(), 28, "as named");
    }

    #[test]
    fn a_train_without_a_stated_decoder_has_every_step_that_it_was_commanded_to() {
        let folder = tempfile::tempdir().unwrap();
        for (step, highest) in [(14, 14), (15, 28), (29, 126)] {
            let mut store = driven(&folder.path().join(format!("{step}.db")), step, now());
            assert_eq!(gathered(&mut store, None).get(), highest, "only driven");
            outdated(&mut store, r#"{"layout":"track-a"}"#);
            assert_eq!(gathered(&mut store, None).get(), highest, "driven, with a model that says nothing");
        }
    }
}
