//! What `footplate doctor` measured of lines, kept in a file beside the store, so that trains are driven by it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Context;
use footplate_core::TimeSpan;
use footplate_core::link::{RoundTrips, TimeModel};
use footplate_store::write_whole;
use serde::{Deserialize, Serialize};

use super::Address;

/// The lines that were measured, by where they lead.
#[derive(Debug, Default, Serialize, Deserialize)]
struct MeasuredLines {
    lines: BTreeMap<String, MeasuredLine>,
}

/// A line that was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct MeasuredLine {
    /// When, in seconds since the Unix epoch.
    pub(crate) measured_at_s: i64,
    /// What was measured.
    pub(crate) round_trips: RoundTrips,
}

/// The file beside a store: `railway.links.json` beside `railway.db`.
pub(crate) fn file_beside(store: &Path) -> PathBuf {
    store.with_extension("links.json")
}

fn read(file: &Path) -> anyhow::Result<MeasuredLines> {
    match std::fs::read_to_string(file) {
        Ok(text) => serde_json::from_str(&text).with_context(|| {
            format!(
                "{} is damaged: delete it and run `footplate doctor` with the same --store again",
                file.display()
            )
        }),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(MeasuredLines::default()),
        Err(error) => Err(error).with_context(|| format!("cannot read {}", file.display())),
    }
}

impl MeasuredLine {
    /// Returns what was measured of a line, if anything.
    ///
    /// # Errors
    /// When the file beside the store cannot be read.
    pub(crate) fn of(address: &Address, store: Option<&Path>) -> anyhow::Result<Option<Self>> {
        let Some(store) = store else { return Ok(None) };
        Ok(read(&file_beside(store))?.lines.remove(&address.place()))
    }

    /// Replaces what is stored of a line; returns the file.
    ///
    /// # Errors
    /// When the file beside the store cannot be read or written.
    pub(crate) fn keep(self, address: &Address, store: &Path) -> anyhow::Result<PathBuf> {
        let file = file_beside(store);
        let mut lines = read(&file)?;
        lines.lines.insert(address.place(), self);
        let text = serde_json::to_string_pretty(&lines)? + "\n";
        write_whole(&file, text.as_bytes()).with_context(|| format!("cannot write {}", file.display()))?;
        Ok(file)
    }
}

impl Address {
    /// Returns the time model of the link over the measured line.
    pub(crate) fn time_model(&self, line: Option<&MeasuredLine>) -> TimeModel {
        let kind = self.kind();
        match (line, kind.usual_line()) {
            (Some(line), Some(usual)) => kind.time_model().over(&line.round_trips, usual),
            _ => kind.time_model(),
        }
    }

    /// Returns how much longer than usual the measured line delays reports.
    pub(crate) fn excess(&self, line: Option<&MeasuredLine>) -> TimeSpan {
        let usual = self.kind().usual_line();
        line.zip(usual).map_or(TimeSpan::ZERO, |(line, usual)| line.round_trips.excess(usual))
    }

    /// Returns the place of the station, without settings.
    fn place(&self) -> String {
        match self {
            Self::Simulated(simulated) => format!("sim:{} {:?}", simulated.layout, simulated.station),
            Self::Station(station) => format!("{}:{}", station.kind().scheme(), station.cable),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_known_by_where_it_leads_and_only_what_was_measured_last_counts() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = folder.path().join("railway.db");
        let address: Address = "z21:192.168.0.111?steps=28".parse().expect("an address");
        assert_eq!(MeasuredLine::of(&address, Some(&store)).expect("nothing"), None);
        let slow = |ms: i64| {
            let times: Vec<TimeSpan> = (1..=100).map(|nth| TimeSpan::from_us(nth * ms * 10)).collect();
            MeasuredLine { measured_at_s: ms, round_trips: RoundTrips::of(&times, 0).expect("enough") }
        };
        slow(80).keep(&address, &store).expect("a file");
        slow(60).keep(&address, &store).expect("a file");
        let same: Address = "z21:192.168.0.111?feedback=can".parse().expect("an address");
        let other: Address = "z21:192.168.0.112".parse().expect("an address");
        let known = MeasuredLine::of(&same, Some(&store)).expect("a file");
        assert_eq!(known, Some(slow(60)));
        assert_eq!(MeasuredLine::of(&other, Some(&store)).expect("a file"), None);
        let excess = same.excess(known.as_ref());
        assert!(excess > TimeSpan::from_ms(45) && excess < TimeSpan::from_ms(60), "{excess:?}");
        assert_eq!(same.time_model(known.as_ref()).soonest, same.time_model(None).soonest + excess);
        std::fs::write(file_beside(&store), "{").expect("a file");
        let damaged = MeasuredLine::of(&same, Some(&store)).expect_err("damaged").to_string();
        assert!(damaged.contains("run `footplate doctor`"), "{damaged}");
    }
}
