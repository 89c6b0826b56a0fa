//! Simulated runs as files: a recording with the truth, and the vehicle as its operator knows it.

use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::Context;
use footplate_sim::line::LineRun;
use footplate_store::odometry::{simulated_columns, simulated_rows, simulated_vehicle};
use footplate_store::{TableForm, TachometerWriter, WholeFile, write_vehicle, write_whole};
use serde_json::{Value, json};

use crate::counted::counted;

/// The files of one run, and what is in them.
pub(super) struct WrittenRun {
    recording: PathBuf,
    vehicle: PathBuf,
    scenario: String,
    seed: u64,
    periods: usize,
    lasted_s: f64,
    travelled_m: f64,
}

impl WrittenRun {
    /// Writes `name-seed.csv` or `.parquet`, and `name-seed.toml` beside it.
    pub(super) fn write(
        folder: &Path,
        name: &str,
        seed: u64,
        form: TableForm,
        run: &LineRun,
    ) -> anyhow::Result<Self> {
        let ending = match form {
            TableForm::Csv => "csv",
            TableForm::Parquet => "parquet",
        };
        let recording = folder.join(format!("{name}-{seed}.{ending}"));
        let vehicle = folder.join(format!("{name}-{seed}.toml"));
        write_recording(&recording, form, run).with_context(|| format!("writing {}", recording.display()))?;
        let text = write_vehicle(&simulated_vehicle(&run.vehicle)?);
        write_whole(&vehicle, text.as_bytes()).with_context(|| format!("writing {}", vehicle.display()))?;
        Ok(Self {
            recording,
            vehicle,
            scenario: run.vehicle.name.clone(),
            seed,
            periods: run.samples.len(),
            lasted_s: run.samples.last().map_or(0.0, |sample| sample.time.as_s()),
            travelled_m: run.truth.last().map_or(0.0, |truth| truth.distance.as_m()),
        })
    }

    pub(super) fn as_json(&self) -> Value {
        json!({
            "scenario": self.scenario, "seed": self.seed, "recording": self.recording, "vehicle": self.vehicle,
            "periods": self.periods, "simulated_s": self.lasted_s, "distance_m": self.travelled_m,
        })
    }

    pub(super) fn as_text(&self) -> String {
        format!(
            "{}: {}, {:.0} s, {:.0} m",
            self.recording.display(),
            counted(self.periods, "period"),
            self.lasted_s,
            self.travelled_m
        )
    }
}

fn write_recording(path: &Path, form: TableForm, run: &LineRun) -> anyhow::Result<()> {
    let file = BufWriter::new(WholeFile::create(path)?);
    let mut writer = TachometerWriter::new(file, form, simulated_columns(run))?;
    for (period, truth) in simulated_rows(run) {
        writer.push("", &period, &truth)?;
    }
    let file = writer.finish()?.into_inner().map_err(std::io::IntoInnerError::into_error)?;
    Ok(file.finish()?)
}
