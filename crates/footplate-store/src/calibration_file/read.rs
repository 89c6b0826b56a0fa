//! Reading a calibration file back.

use std::fs;
use std::path::Path;

use super::form::{CalibrationFile, MODEL_VERSION};

/// Larger files are no calibration: one of a hundred trains has about 2 MB.
const LARGEST: u64 = 64 << 20;

/// Why a calibration file could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrationFileError {
    /// The file could not be read.
    #[error("{file}: {source}")]
    Read {
        /// The file.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is too large to be a calibration.
    #[error("{file}: {bytes} bytes, which no calibration has; one has at most {LARGEST}")]
    TooLarge {
        /// The file.
        file: String,
        /// Its size.
        bytes: u64,
    },
    /// Its name does not say what is in it.
    #[error("{file}: a calibration is a .toml or .json file, as `footplate calibrate --out` writes it")]
    UnknownEnding {
        /// The file.
        file: String,
    },
    /// It is no calibration.
    #[error("{file}: {problem} (docs/formats/calibration.md says what stands where)")]
    Form {
        /// The file.
        file: String,
        /// What is wrong, with line and column.
        problem: String,
    },
    /// It was made by formulas that give other numbers.
    #[error(
        "{file}: made by version {found} of the model, this program has version {MODEL_VERSION}; calibrate anew \
         from the recordings or the store"
    )]
    OtherModel {
        /// The file.
        file: String,
        /// Its version.
        found: String,
    },
}

impl CalibrationFile {
    /// Reads a file that `footplate calibrate --out` wrote, TOML or JSON by its ending.
    pub fn read(path: &Path) -> Result<Self, CalibrationFileError> {
        let file = path.display().to_string();
        let unreadable = |source| CalibrationFileError::Read { file: file.clone(), source };
        let bytes = fs::metadata(path).map_err(unreadable)?.len();
        if bytes > LARGEST {
            return Err(CalibrationFileError::TooLarge { file, bytes });
        }
        let text = fs::read_to_string(path).map_err(unreadable)?;
        let parsed = match path.extension().and_then(|ending| ending.to_str()) {
            Some("toml") => toml::from_str(&text).map_err(|error: toml::de::Error| error.to_string()),
            Some("json") => serde_json::from_str(&text).map_err(|error| error.to_string()),
            _ => return Err(CalibrationFileError::UnknownEnding { file }),
        };
        let form: Self = parsed.map_err(|problem| CalibrationFileError::Form {
            file: file.clone(),
            problem: problem.trim_end().to_owned(),
        })?;
        if form.model_version != MODEL_VERSION {
            return Err(CalibrationFileError::OtherModel { file, found: form.model_version });
        }
        Ok(form)
    }
}
