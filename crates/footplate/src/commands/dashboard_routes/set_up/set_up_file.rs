//! The set-up of a railway, in a file beside its store: station, layout and trains, as the owner gave them in the browser.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::ExitStatus;

use anyhow::{Context, bail};
use footplate_core::{DecoderSteps, TrainId};
use footplate_store::{Store, StoredModel, write_whole};
use serde::{Deserialize, Serialize};

use crate::clock::LATEST;
use crate::commands::written_layout::WrittenLayout;
use crate::link::{Address, Speed, StationKind, open_simulated};

/// The link of a simulated railway: its layout and trains are those of the set-up.
pub(super) const SIMULATED: &str = "sim";
/// The seed of the simulated railway: any will do; this one is that of the examples.
const SEED: u64 = 7;
/// A calibration of a simulated train runs so many times as fast as real: five minutes in a quarter of one.
const CALIBRATION_SPEED: f64 = 20.0;
/// The most trains, and the longest name of one, in characters.
const MOST_TRAINS: usize = 16;
const LONGEST_NAME: usize = 40;

/// The file beside a store: `railway.setup.json` beside `railway.db`.
pub(super) fn file_beside(store: &Path) -> PathBuf {
    store.with_extension("setup.json")
}

/// A train of the set-up.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct SetUpTrain {
    pub(super) address: u16,
    #[serde(default)]
    pub(super) name: String,
}

/// What a step of the set-up printed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct StepResult {
    /// The exit status: 0 done, 1 falls short, 2 not possible.
    pub(super) status: i32,
    pub(super) report: String,
}

impl StepResult {
    /// What a process came to; one that a signal ended counts as not possible.
    pub(super) fn of(status: ExitStatus, report: &str) -> Self {
        Self {
            status: status.code().unwrap_or(i32::from(crate::BAD_INPUT)),
            report: report.trim().to_owned(),
        }
    }
}

/// A railway as far as it is set up.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct SetUp {
    /// The link as `--link` takes it, or `sim`.
    #[serde(default)]
    pub(super) link: Option<String>,
    /// Simulated time over real time while driving; `None` for real time.
    #[serde(default)]
    pub(super) speed: Option<f64>,
    /// The layout as `--layout` takes it.
    #[serde(default)]
    pub(super) layout: Option<String>,
    #[serde(default)]
    pub(super) trains: Vec<SetUpTrain>,
    /// The last check of the link.
    #[serde(default)]
    pub(super) line: Option<StepResult>,
    /// The last calibration of each train.
    #[serde(default)]
    pub(super) calibrations: BTreeMap<u16, StepResult>,
    /// Whether `footplate serve` drives at once.
    #[serde(default)]
    pub(super) is_complete: bool,
}

impl SetUp {
    /// Reads the file; a missing one is an empty set-up.
    ///
    /// # Errors
    /// The file cannot be read, or is damaged.
    pub(super) fn read(file: &Path) -> anyhow::Result<Self> {
        match std::fs::read_to_string(file) {
            Ok(text) => serde_json::from_str(&text).with_context(|| {
                format!(
                    "{} is damaged: delete it to set up the railway again; the store keeps all calibrations",
                    file.display()
                )
            }),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Self::default()),
            Err(error) => Err(error).with_context(|| format!("cannot read {}", file.display())),
        }
    }

    /// Writes the file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn write(&self, file: &Path) -> anyhow::Result<()> {
        let text = serde_json::to_string_pretty(self)? + "\n";
        write_whole(file, text.as_bytes()).with_context(|| format!("cannot write {}", file.display()))
    }

    /// Sets the station; `speed` is that of a simulation.
    ///
    /// # Errors
    /// It is not a link.
    pub(super) fn set_link(&mut self, link: &str, speed: Option<f64>) -> anyhow::Result<()> {
        if link != SIMULATED
            && let Address::Simulated(_) = link.parse::<Address>().map_err(anyhow::Error::msg)?
        {
            bail!("choose the simulated railway in the list instead of an address");
        }
        if speed.is_some_and(|speed| !(speed > 0.0 && speed <= CALIBRATION_SPEED)) {
            bail!("a simulated railway runs up to {CALIBRATION_SPEED} times as fast as real");
        }
        if self.link.as_deref() != Some(link) {
            self.line = None;
        }
        (self.link, self.speed) = (Some(link.to_owned()), speed);
        self.check_world()
    }

    /// Sets the layout: a built-in one or a file.
    ///
    /// # Errors
    /// There is none, it is invalid, or the trains do not fit on it.
    pub(super) fn set_layout(&mut self, named: &str) -> anyhow::Result<()> {
        WrittenLayout::named(named)?;
        if self.layout.as_deref() != Some(named) {
            self.calibrations.clear();
        }
        self.layout = Some(named.to_owned());
        self.check_world()
    }

    /// Sets the trains.
    ///
    /// # Errors
    /// An address is impossible or used twice, a name is too long, or a simulated layout has no room for them.
    pub(super) fn set_trains(&mut self, trains: Vec<SetUpTrain>) -> anyhow::Result<()> {
        if trains.is_empty() {
            bail!("name one train at least: the address of its decoder");
        }
        if trains.len() > MOST_TRAINS {
            bail!("{} trains are too many: the set-up takes {MOST_TRAINS}", trains.len());
        }
        let mut addresses = BTreeSet::new();
        for SetUpTrain { address, name } in &trains {
            if *address == 0 {
                bail!("0 is not an address of a train: addresses begin with 1");
            }
            if !addresses.insert(*address) {
                bail!("address {address} is used twice: each train needs its own");
            }
            if name.chars().count() > LONGEST_NAME {
                bail!("the name of train {address} is too long: use up to {LONGEST_NAME} characters");
            }
        }
        self.trains = trains;
        self.calibrations.retain(|train, _| addresses.contains(train));
        self.check_world()
    }

    /// The kind of the command station; `None` before one is chosen.
    pub(super) fn station(&self) -> Option<StationKind> {
        let link = self.link.as_deref()?;
        if link == SIMULATED {
            return Some(StationKind::default());
        }
        link.parse::<Address>().ok().map(|address| address.kind())
    }

    /// Checks that the station has the addresses of the trains, and that the simulated railway exists.
    fn check_world(&self) -> anyhow::Result<()> {
        if let Some(station) = self.station() {
            for SetUpTrain { address, .. } in &self.trains {
                station.check(TrainId(*address), DecoderSteps::Fourteen).map_err(anyhow::Error::msg)?;
            }
        }
        let (Ok(link), Some(layout)) = (self.link(), &self.layout) else { return Ok(()) };
        if let Address::Simulated(simulated) = link.parse().map_err(anyhow::Error::msg)? {
            open_simulated(&simulated, &WrittenLayout::named(layout)?.layout, Speed::Unpaced)?;
        }
        Ok(())
    }

    /// The link for driving.
    ///
    /// # Errors
    /// A step is missing.
    pub(super) fn link(&self) -> anyhow::Result<String> {
        self.link_at(self.speed)
    }

    /// The link for a calibration.
    ///
    /// # Errors
    /// A step is missing.
    pub(super) fn calibration_link(&self) -> anyhow::Result<String> {
        self.link_at(Some(CALIBRATION_SPEED))
    }

    fn link_at(&self, speed: Option<f64>) -> anyhow::Result<String> {
        let link = self.link.as_deref().context("choose a command station first")?;
        if link != SIMULATED {
            return Ok(link.to_owned());
        }
        let layout = self.layout()?;
        if self.trains.is_empty() {
            bail!("name a train first");
        }
        let trains: Vec<String> = self.trains.iter().map(|train| train.address.to_string()).collect();
        let speed = speed.map(|speed| format!("&speed={speed}")).unwrap_or_default();
        Ok(format!("sim:{layout}?seed={SEED}&trains={}{speed}", trains.join(",")))
    }

    /// The layout.
    ///
    /// # Errors
    /// It was not chosen yet.
    pub(super) fn layout(&self) -> anyhow::Result<&str> {
        self.layout.as_deref().context("choose or draw a layout first")
    }

    /// The trains that the store has a motion model of.
    pub(super) fn calibrated(&self, store: &Path) -> anyhow::Result<BTreeSet<u16>> {
        let Some(layout) = self.layout.as_deref().filter(|_| store.exists()) else {
            return Ok(BTreeSet::new());
        };
        let (layout, store) = (WrittenLayout::named(layout)?.layout, Store::open(store)?);
        let mut found = BTreeSet::new();
        for train in &self.trains {
            if StoredModel::of_store(&layout, &store, TrainId(train.address), LATEST)? != StoredModel::Nothing
            {
                found.insert(train.address);
            }
        }
        Ok(found)
    }
}

/// Reads bytes as the file, for the fuzzer, asks what the set-up is asked at a start, and writes it again. Returns whether it is one.
///
/// # Errors
/// A set-up that was read cannot be read again after it was written, or a temporary file cannot be written.
pub(crate) fn read_fuzzed_set_up(bytes: &[u8]) -> anyhow::Result<bool> {
    let file = std::env::temp_dir().join(format!("footplate-fuzz-{}.setup.json", std::process::id()));
    std::fs::write(&file, bytes)?;
    let read = SetUp::read(&file);
    if let Ok(set_up) = &read {
        let _ = (set_up.station(), set_up.link(), set_up.calibration_link(), set_up.layout());
        let _ = set_up.clone().set_trains(set_up.trains.clone());
        set_up.write(&file)?;
        SetUp::read(&file)?;
    }
    std::fs::remove_file(&file)?;
    Ok(read.is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn train(address: u16) -> SetUpTrain {
        SetUpTrain { address, name: String::new() }
    }

    #[test]
    fn a_set_up_is_written_and_read_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = file_beside(&folder.path().join("railway.db"));
        assert_eq!(file.file_name().and_then(|name| name.to_str()), Some("railway.setup.json"));
        let mut set_up = SetUp::read(&file).expect("nothing is an empty set-up");
        assert_eq!(set_up, SetUp::default());
        set_up.set_link("sim", None).expect("a simulation");
        set_up.set_layout("track-a").expect("built in");
        assert!(set_up.link().unwrap_err().to_string().contains("name a train"));
        set_up.set_trains(vec![train(24), train(58)]).expect("two trains");
        set_up.write(&file).expect("a place for it");
        assert_eq!(SetUp::read(&file).expect("written"), set_up);
        assert_eq!(set_up.link().expect("complete"), "sim:track-a?seed=7&trains=24,58");
        assert_eq!(set_up.calibration_link().expect("complete"), "sim:track-a?seed=7&trains=24,58&speed=20");
        std::fs::write(&file, "{").expect("a place for it");
        assert!(format!("{:#}", SetUp::read(&file).unwrap_err()).contains("delete it to set up"));
    }

    #[test]
    fn what_is_impossible_is_rejected_with_what_would_be_right() {
        let mut set_up = SetUp::default();
        let says = |result: anyhow::Result<()>| format!("{:#}", result.expect_err("rejected"));
        assert!(says(set_up.set_link("/dev/ttyUSB0", None)).contains("marklin-serial:/dev/ttyUSB0"));
        assert!(says(set_up.set_link("sim:track-a", None)).contains("in the list"));
        assert!(says(set_up.set_link("sim", Some(-1.0))).contains("up to 20"));
        assert!(says(set_up.set_layout("nowhere.toml")).contains("nowhere.toml"));
        assert!(says(set_up.set_trains(Vec::new())).contains("one train at least"));
        assert!(says(set_up.set_trains(vec![train(0)])).contains("begin with 1"));
        assert!(says(set_up.set_trains(vec![train(3), train(3)])).contains("twice"));
        assert_eq!(set_up, SetUp::default(), "nothing was changed");
    }

    #[test]
    fn the_station_decides_which_addresses_trains_have() {
        let mut set_up = SetUp::default();
        set_up.set_link("z21:192.168.0.111", None).expect("a station");
        set_up.set_trains(vec![train(3107)]).expect("an address of a Z21");
        let station_first = set_up.set_link("marklin-serial:/dev/ttyUSB0", None).unwrap_err().to_string();
        assert!(station_first.contains("train 3107") && station_first.contains("1 to 80"), "{station_first}");
        let mut trains_first = SetUp::default();
        trains_first.set_link("sim", None).expect("a simulation");
        let wrong = trains_first.set_trains(vec![train(81)]).unwrap_err().to_string();
        assert!(wrong.contains("train 81") && wrong.contains("a 6051"), "{wrong}");
    }

    #[test]
    fn another_layout_makes_earlier_results_void() {
        let mut set_up = SetUp::default();
        set_up.set_layout("track-a").expect("built in");
        set_up.set_trains(vec![train(24)]).expect("a train");
        let result = StepResult { status: 0, report: "as it should be".to_owned() };
        set_up.calibrations.insert(24, result.clone());
        set_up.line = Some(result);
        set_up.set_layout("track-b").expect("built in");
        assert!(set_up.calibrations.is_empty());
        set_up.set_link("z21:192.168.0.111", None).expect("a station");
        assert_eq!(set_up.line, None);
    }
}
