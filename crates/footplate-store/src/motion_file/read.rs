//! Reads and writes motion model files, and stores models.

use std::io;
use std::path::Path;

use footplate_core::model::MotionModel;
use footplate_core::track::Layout;
use footplate_core::{DecoderSteps, SpeedStep, Timestamp, TrainId};
use serde::Deserialize;

use super::form::{MOTION_MODEL_VERSION, MotionFile};
use crate::store::{Calibration, NewCalibration, Store, StoreError};
use crate::whole_file::{read_at_most, write_whole};

/// The largest file: a model of a decoder with 126 steps has about 1 MB.
const LARGEST: usize = 16 << 20;

/// A motion model that could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MotionFileError {
    /// The file could not be read or written.
    #[error("{file}: {source}")]
    System {
        /// The file.
        file: String,
        /// The error of the system.
        source: std::io::Error,
    },
    /// The file is too large to be a motion model.
    #[error("{0}: too large for a motion model, which has at most {LARGEST} bytes")]
    TooLarge(String),
    /// The extension is neither .toml nor .json.
    #[error("{0}: a motion model is a .toml or .json file")]
    UnknownEnding(String),
    /// It is not a motion model.
    #[error("{file}: {problem} (docs/formats/motion-model.md describes the format)")]
    Form {
        /// The file, or the place in the store.
        file: String,
        /// The error, with line and column.
        problem: String,
    },
    /// A calibration in the old format, from before there was one model per train.
    #[error(
        "{0}: a calibration in an old format, computed with other formulas; calibrate again: \
         footplate calibrate --from LOGS --layout LAYOUT --out FILE, or from a store with --store"
    )]
    OldForm(String),
    /// A model of another version of the formulas.
    #[error(
        "{file}: computed by version {found} of the model, this program has version {MOTION_MODEL_VERSION}; calibrate \
         again from the store with its events"
    )]
    OtherModel {
        /// The file, or the place in the store.
        file: String,
        /// Its version.
        found: String,
    },
    /// The store could not be read.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Whether a path ends in `.toml`; `None` if it ends in neither that nor `.json`.
fn is_toml(path: &Path) -> Option<bool> {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("toml") => Some(true),
        Some("json") => Some(false),
        _ => None,
    }
}

/// Whether a text has the lists of trains and polling that only old calibrations had.
fn is_old_form(text: &str) -> bool {
    let has = |toml: &str, json: &str| text.contains(toml) || text.contains(json);
    has("[[trains]]", "\"trains\"") && has("[[polling]]", "\"polling\"")
}

impl MotionFile {
    /// Reads a file written by [`write`](Self::write), TOML or JSON by its extension.
    ///
    /// # Errors
    /// The file is invalid.
    pub fn read(path: &Path) -> Result<Self, MotionFileError> {
        let file = path.display().to_string();
        let system = |source| MotionFileError::System { file: file.clone(), source };
        // Devices and pipes have no size that could be asked for.
        let bytes = read_at_most(path, LARGEST).map_err(system)?;
        if bytes.len() > LARGEST {
            return Err(MotionFileError::TooLarge(file));
        }
        let text = String::from_utf8(bytes)
            .map_err(|error| system(io::Error::new(io::ErrorKind::InvalidData, error)))?;
        if is_old_form(&text) {
            return Err(MotionFileError::OldForm(file));
        }
        let parsed = match is_toml(path) {
            Some(true) => toml::from_str(&text).map_err(|error: toml::de::Error| error.to_string()),
            Some(false) => serde_json::from_str(&text).map_err(|error| error.to_string()),
            None => return Err(MotionFileError::UnknownEnding(file)),
        };
        Self::checked(file, parsed)
    }

    /// Writes the file, TOML or JSON by its extension.
    ///
    /// # Errors
    /// The extension is another one, or the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), MotionFileError> {
        let file = path.display().to_string();
        let form = |problem| MotionFileError::Form { file: file.clone(), problem };
        let text = match is_toml(path) {
            Some(true) => toml::to_string(self).map_err(|error| form(error.to_string()))?,
            Some(false) => serde_json::to_string_pretty(self).map_err(|error| form(error.to_string()))?,
            None => return Err(MotionFileError::UnknownEnding(file)),
        };
        write_whole(path, text.as_bytes()).map_err(|source| MotionFileError::System { file, source })
    }

    /// Stores the model, as computed at `now` from the events up to `as_of`.
    ///
    /// # Errors
    /// The store cannot be written.
    pub fn keep(&self, store: &mut Store, as_of: Timestamp, now: Timestamp) -> Result<(), MotionFileError> {
        let file = || format!("the motion model of train {}", self.train);
        let body = serde_json::to_string(self)
            .map_err(|error| MotionFileError::Form { file: file(), problem: error.to_string() })?;
        let new =
            NewCalibration { train: self.train, as_of, model_version: &self.model_version, body: &body };
        Ok(store.keep_calibration(new, now)?)
    }

    /// The latest model of a train as of a date, on whatever layout it was made.
    ///
    /// # Errors
    /// The store cannot be read, or the model is of another version of the formulas.
    pub fn of_store(store: &Store, train: TrainId, at: Timestamp) -> Result<Option<Self>, MotionFileError> {
        store.calibration(train, at)?.map(|kept| Self::of_row(store, &kept)).transpose()
    }

    /// The latest model of a train on a layout as of a date.
    ///
    /// # Errors
    /// As for [`of_store`](Self::of_store).
    pub fn of_store_on(
        store: &Store,
        train: TrainId,
        layout: &str,
        at: Timestamp,
    ) -> Result<Option<Self>, MotionFileError> {
        store.calibration_on(train, layout, at)?.map(|kept| Self::of_row(store, &kept)).transpose()
    }

    fn of_row(store: &Store, kept: &Calibration) -> Result<Self, MotionFileError> {
        let place = format!("{}, motion model of train {}", store.path().display(), kept.train);
        if kept.model_version != MOTION_MODEL_VERSION {
            return Err(MotionFileError::OtherModel { file: place, found: kept.model_version.clone() });
        }
        let parsed = serde_json::from_str(&kept.body).map_err(|error| error.to_string());
        Self::checked(place, parsed)
    }

    fn checked(file: String, parsed: Result<Self, String>) -> Result<Self, MotionFileError> {
        let form: Self = parsed.map_err(|problem| MotionFileError::Form {
            file: file.clone(),
            problem: problem.trim_end().to_owned(),
        })?;
        if form.model_version != MOTION_MODEL_VERSION {
            return Err(MotionFileError::OtherModel { file, found: form.model_version });
        }
        Ok(form)
    }
}

/// A stored motion model.
#[derive(Debug, Clone, PartialEq)]
pub enum StoredModel {
    /// There is none.
    Nothing,
    /// A usable model.
    Model(Box<MotionModel>),
    /// A model of another version of the formulas. It can be fitted again from the stored events.
    Outdated {
        /// The highest step of the train's decoder, if the model states it.
        highest: Option<SpeedStep>,
    },
}

/// What a model of any version states of the train's decoder.
#[derive(Deserialize)]
struct StatedDecoder {
    highest_step: SpeedStep,
}

impl StoredModel {
    /// The model of a train on a layout as of a date.
    ///
    /// # Errors
    /// The store cannot be read, or its content is not a model.
    pub fn of_store(
        layout: &Layout,
        store: &Store,
        train: TrainId,
        at: Timestamp,
    ) -> Result<Self, MotionFileError> {
        let Some(kept) = store.calibration_on(train, layout.name(), at)? else { return Ok(Self::Nothing) };
        let model = match MotionFile::of_row(store, &kept) {
            // Numbers that are not a model today may have been one in their own version.
            Ok(file) => file.model(layout).ok(),
            Err(MotionFileError::OtherModel { .. }) => None,
            Err(error) => return Err(error),
        };
        Ok(model.map_or_else(
            || {
                let stated = serde_json::from_str::<StatedDecoder>(&kept.body).ok();
                Self::Outdated { highest: stated.map(|stated| stated.highest_step) }
            },
            |model| Self::Model(Box::new(model)),
        ))
    }

    /// The steps of the train's decoder: as the model states them, or else the fewest that contain the highest step of the
    /// imported profile and every step that the train was commanded to until a date; 14 if neither is there.
    ///
    /// # Errors
    /// The store cannot be read.
    pub fn decoder(&self, store: &Store, train: TrainId, at: Timestamp) -> Result<DecoderSteps, StoreError> {
        let stated = match self {
            Self::Model(model) => Some(model.highest()),
            Self::Outdated { highest } => *highest,
            Self::Nothing => None,
        };
        let Some(stated) = stated else {
            let imported = store.profile(train, at)?.and_then(|profile| profile.highest).unwrap_or_default();
            return Ok(DecoderSteps::with(store.highest_step(train, at)?.max(imported)));
        };
        Ok(DecoderSteps::with(stated))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use footplate_core::SpeedStep;
    use footplate_core::model::MotionModel;

    use super::*;

    fn file() -> MotionFile {
        let layout = crate::built_in("track-a").unwrap().layout;
        MotionFile::of(&layout, &MotionModel::unknown(TrainId(24), SpeedStep::new(14).unwrap()), None)
    }

    #[test]
    fn a_model_comes_back_from_a_file_and_from_a_store() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["motion.toml", "motion.json"] {
            let path = folder.path().join(name);
            file().write(&path).unwrap();
            assert_eq!(MotionFile::read(&path).unwrap(), file());
        }
        let mut store = Store::open_or_create(&folder.path().join("railway.db")).unwrap();
        let at = Timestamp::from_s;
        assert_eq!(MotionFile::of_store(&store, TrainId(24), at(9.0)).unwrap(), None);
        file().keep(&mut store, at(1.0), at(2.0)).unwrap();
        assert_eq!(MotionFile::of_store(&store, TrainId(24), at(9.0)).unwrap(), Some(file()));
    }

    #[test]
    fn a_model_of_one_layout_stays_in_force_when_the_train_runs_on_another() {
        let folder = tempfile::tempdir().unwrap();
        let mut store = Store::open_or_create(&folder.path().join("railway.db")).unwrap();
        let (layout, at) = (crate::built_in("track-a").unwrap().layout, Timestamp::from_s);
        let of_store =
            |store: &Store, date| StoredModel::of_store(&layout, store, TrainId(24), at(date)).unwrap();
        let with_126 = MotionModel::unknown(TrainId(24), DecoderSteps::All.highest());
        let here = MotionFile::of(&layout, &with_126, None);
        let there = MotionFile { layout: "yard".to_owned(), ..file() };
        there.keep(&mut store, at(1.0), at(1.0)).unwrap();
        assert_eq!(of_store(&store, 9.0), StoredModel::Nothing);
        here.keep(&mut store, at(2.0), at(2.0)).unwrap();
        there.keep(&mut store, at(3.0), at(3.0)).unwrap();
        MotionFile { model_version: "0".to_owned(), ..there.clone() }
            .keep(&mut store, at(4.0), at(4.0))
            .unwrap();
        let StoredModel::Model(model) = of_store(&store, 9.0) else { panic!("{:?}", of_store(&store, 9.0)) };
        assert_eq!(model.highest(), DecoderSteps::All.highest());
        assert_eq!(MotionFile::of_store_on(&store, TrainId(24), "yard", at(3.0)).unwrap(), Some(there));
        assert_eq!(
            MotionFile::of_store_on(&store, TrainId(24), "track-a", at(3.0)).unwrap(),
            Some(here.clone())
        );
        // An outdated model of this layout says which decoder to fit the events for.
        MotionFile { model_version: "0".to_owned(), ..here }.keep(&mut store, at(5.0), at(5.0)).unwrap();
        let highest = Some(DecoderSteps::All.highest());
        assert_eq!(of_store(&store, 9.0), StoredModel::Outdated { highest });
    }

    #[test]
    fn invalid_models_differ_from_models_of_another_version() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let other = MotionFile { model_version: "0".to_owned(), ..file() };
        other.write(&path("old.toml")).unwrap();
        let refused = MotionFile::read(&path("old.toml")).unwrap_err().to_string();
        let says =
            format!("computed by version 0 of the model, this program has version {MOTION_MODEL_VERSION}");
        assert!(refused.contains(&says), "{refused}");
        fs::write(path("letter.toml"), "Dear train,\n").unwrap();
        assert!(matches!(MotionFile::read(&path("letter.toml")), Err(MotionFileError::Form { .. })));
        fs::write(path("old.json"), "{\"model_version\":\"1\",\"polling\":[],\"trains\":[]}").unwrap();
        let refused = MotionFile::read(&path("old.json")).unwrap_err().to_string();
        assert!(
            refused.contains("old form") && refused.contains("footplate calibrate --from LOGS"),
            "{refused}"
        );
        assert!(matches!(file().write(&path("model.xml")), Err(MotionFileError::UnknownEnding(_))));
        assert!(matches!(MotionFile::read(&path("none.toml")), Err(MotionFileError::System { .. })));
    }
}
