//! `footplate profiles import`: speeds of another program as the prior of a train's motion model.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use footplate_core::TrainId;
use footplate_core::model::MotionModel;
use footplate_store::{MotionReplay, SpeedProfile, Store, layout_named, read_profile};

use super::preview::Preview;
use super::{Reading, short, stored_model};
use crate::clock::{LATEST, now};
use crate::commands::Outcome;

/// Import speed profiles, each for one train; without --store, only show what they would change.
///
/// `drive` and `calibrate` begin with the imported speeds and correct them by what the train does. A profile has no stops: their
/// uncertainty stays that of an unknown train until stops are measured. The newest import of a train counts; earlier ones stay in
/// the store's history.
#[derive(Args)]
#[command(after_help = "\
Examples:
  footplate profiles import roster/Santa_Fe_5253.xml
  footplate profiles import roster/*.xml --store railway.db
  footplate profiles import mvtrack.csv --scale 87 --loco V200 --train 24 --store railway.db")]
pub(super) struct Arguments {
    /// The profiles: roster entries of JMRI (XML), mvtrack.csv of Rocrail, CSV with step, forward_mm_s and reverse_mm_s.
    #[arg(required = true, value_name = "PROFILE")]
    files: Vec<PathBuf>,
    /// The train, if not the one whose address the file names.
    #[arg(long, value_name = "N")]
    train: Option<u16>,
    /// The store to keep them in.
    #[arg(long, value_name = "FILE")]
    store: Option<PathBuf>,
    /// Show what would change, and keep nothing.
    #[arg(long)]
    preview: bool,
    /// The layout of the train's earlier runs, if not that of its stored model.
    #[arg(long, value_name = "LAYOUT")]
    layout: Option<String>,
    #[command(flatten)]
    reading: Reading,
    /// Write JSON, one line for each profile.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        // All are read before the first is kept: a wrong one stops the import before it begins.
        let profiles = self.read_all()?;
        let at = now();
        let existing =
            self.store.as_ref().filter(|path| path.exists()).map(|path| Store::open(path)).transpose()?;
        for (train, profile) in &profiles {
            let [current, merged] = self.models(existing.as_ref(), *train, profile)?;
            let kept_in = self.store.as_ref().filter(|_| !self.preview).map(|path| short(path));
            let preview = Preview { train: *train, profile, current: &current, merged: &merged, kept_in };
            if self.json { preview.write_json(output)? } else { preview.write(output)? }
        }
        if let Some(path) = self.store.as_ref().filter(|_| !self.preview) {
            drop(existing);
            let mut store = Store::open_or_create(path)?;
            for (train, profile) in &profiles {
                store.keep_profile(*train, Some(profile), at)?;
            }
        }
        Ok(Outcome::Done)
    }

    fn read_all(&self) -> anyhow::Result<BTreeMap<TrainId, SpeedProfile>> {
        let mut profiles: BTreeMap<TrainId, SpeedProfile> = BTreeMap::new();
        let context = self.reading.context();
        for path in &self.files {
            let mut profile = read_profile(path, &context)?;
            let Some(train) = self.train.map(TrainId).or(profile.train) else {
                bail!("{}: the file names no address; say which train it is with --train", path.display());
            };
            (profile.source, profile.highest) = (short(path), self.reading.stated());
            if let Some(other) = profiles.get(&train) {
                bail!(
                    "{}: a profile of train {train}, as {} is; import one of them",
                    path.display(),
                    other.source
                );
            }
            profiles.insert(train, profile);
        }
        Ok(profiles)
    }

    /// The model as it is and as it would be with the profile.
    fn models(
        &self,
        store: Option<&Store>,
        train: TrainId,
        profile: &SpeedProfile,
    ) -> anyhow::Result<[MotionModel; 2]> {
        let highest = self.reading.highest();
        if let Some(store) = store {
            let named = |name: &String| layout_named(name).map(|named| named.layout);
            let layout = match stored_model(store, train, self.layout.as_deref())? {
                Some((_, layout)) => Some(layout),
                None => self.layout.as_ref().map(named).transpose()?,
            };
            if let Some(layout) = layout {
                let merged =
                    MotionReplay::with_profile(&layout, store, Some(profile), train, highest, LATEST)?;
                let before = store.profile(train, LATEST)?;
                let current =
                    MotionReplay::with_profile(&layout, store, before.as_ref(), train, highest, LATEST)?;
                return Ok([current.fit.model().clone(), merged.fit.model().clone()]);
            }
            if let Some(before) = store.profile(train, LATEST)? {
                return Ok([before.beginning(train, highest), profile.beginning(train, highest)]);
            }
        }
        Ok([MotionModel::unknown(train, highest), profile.beginning(train, highest)])
    }
}
