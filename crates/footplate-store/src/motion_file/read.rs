//! Reads and writes motion model files, and stores models.

use std::fs;
use std::path::Path;

use footplate_core::model::MotionModel;
use footplate_core::track::Layout;
use footplate_core::{Timestamp, TrainId};

use super::form::{MOTION_MODEL_VERSION, MotionFile};
use crate::store::{NewCalibration, Store, StoreError};
use crate::whole_file::write_whole;

/// The largest file: a model of a decoder with 126 steps has about 1 MB.
const LARGEST: u64 = 16 << 20;

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
    #[error("{file}: {bytes} bytes, which no motion model has; one has at most {LARGEST}")]
    TooLarge {
        /// The file.
        file: String,
        /// Its size.
        bytes: u64,
    },
    /// The extension is neither .toml nor .json.
    #[error("{file}: a motion model is a .toml or .json file")]
    UnknownEnding {
        /// The file.
        file: String,
    },
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
        "{file}: a calibration in an old format, computed with other formulas; calibrate again: \
         footplate calibrate --from LOGS --layout LAYOUT --out FILE, or from a store with --store"
    )]
    OldForm {
        /// The file.
        file: String,
    },
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
        let bytes = fs::metadata(path).map_err(system)?.len();
        if bytes > LARGEST {
            return Err(MotionFileError::TooLarge { file, bytes });
        }
        let text = fs::read_to_string(path).map_err(system)?;
        if is_old_form(&text) {
            return Err(MotionFileError::OldForm { file });
        }
        let parsed = match is_toml(path) {
            Some(true) => toml::from_str(&text).map_err(|error: toml::de::Error| error.to_string()),
            Some(false) => serde_json::from_str(&text).map_err(|error| error.to_string()),
            None => return Err(MotionFileError::UnknownEnding { file }),
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
            None => return Err(MotionFileError::UnknownEnding { file }),
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

    /// The model of a train as of a date.
    ///
    /// # Errors
    /// The store cannot be read, or the model is of another version of the formulas.
    pub fn of_store(store: &Store, train: TrainId, at: Timestamp) -> Result<Option<Self>, MotionFileError> {
        let Some(kept) = store.calibration(train, at)? else { return Ok(None) };
        let place = format!("{}, motion model of train {train}", store.path().display());
        if kept.model_version != MOTION_MODEL_VERSION {
            return Err(MotionFileError::OtherModel { file: place, found: kept.model_version });
        }
        let parsed = serde_json::from_str(&kept.body).map_err(|error| error.to_string());
        Self::checked(place, parsed).map(Some)
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
    Outdated,
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
        let file = match MotionFile::of_store(store, train, at) {
            Ok(file) => file.filter(|file| file.layout == layout.name()),
            Err(MotionFileError::OtherModel { .. }) => return Ok(Self::Outdated),
            Err(error) => return Err(error),
        };
        Ok(match file.map(|file| file.model(layout)) {
            None => Self::Nothing,
            Some(Ok(model)) => Self::Model(Box::new(model)),
            // Numbers that are not a model today may have been one in their own version.
            Some(Err(_)) => Self::Outdated,
        })
    }
}

#[cfg(test)]
mod tests {
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
        assert!(matches!(file().write(&path("model.xml")), Err(MotionFileError::UnknownEnding { .. })));
        assert!(matches!(MotionFile::read(&path("none.toml")), Err(MotionFileError::System { .. })));
    }
}
