//! `footplate calibrate --link`: a train is found, driven by a plan that is made as it goes on, and left standing.

mod beginning;
mod ended;
mod figures;
mod kept;
mod printed;
#[cfg(test)]
mod promises;
mod watcher;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{anyhow, bail};
use footplate_core::control::learn::{Calibrator, CalibratorSettings};
use footplate_core::model::MotionFit;
use footplate_core::model::StepUse;
use footplate_core::track::{Layout, TurnoutStates};
use footplate_core::{DecoderSteps, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_store::{MotionFile, MotionReplay, Store, StoredModel, layout_named};

pub(crate) use self::beginning::CalibrationBeginning;
use self::ended::{Why, outcome_of};
pub(in crate::commands) use self::figures::minutes;
pub(in crate::commands) use self::printed::line as calibration_line;
use self::watcher::Watcher;
use super::picture;
use crate::clock::{LATEST, now};
use crate::commands::Outcome;
use crate::commands::dashboard_routes::{SetUpMode, SetUpRoute, open_dashboard};
use crate::commands::left_running::recall_directions;
use crate::commands::plot::PictureFile;
use crate::commands::written_layout::WrittenLayout;
use crate::counted::counted;
use crate::dashboard::{ReadOnlyDashboard, ServedAt};
use crate::link::{
    Address, Link, MeasuredLine, NamedTrain, ObservedLink, Speed, open, open_session, open_simulated,
};
use crate::recorded::Recorded;
use crate::runtime::{Ended, Recorder, Runtime, StopFlag};
use crate::session_journal::SessionJournal;
use crate::standard_error::say;

/// The shortest session that finds a train and learns anything (s) ...
const SHORTEST_S: f64 = 20.0;
/// ... and one that is too long to wait for.
const LONGEST_S: f64 = 24.0 * 3_600.0;

/// Reads a span of track time such as `5m`, `90s` or `1h`.
pub(super) fn budget(text: &str) -> Result<TimeSpan, String> {
    let (digits, unit) = text.split_at(text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len()));
    let seconds = match unit.trim() {
        "s" | "" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3_600.0,
        _ => return Err(format!("`{unit}` is no unit of time: write 90s, 5m or 1h")),
    };
    let number = digits.trim().parse::<f64>().ok().filter(|number| number.is_finite());
    let span = number.map(|number| number * seconds).ok_or("write a time such as 90s, 5m or 1h")?;
    if !(SHORTEST_S..=LONGEST_S).contains(&span) {
        return Err(format!("a calibration takes from {SHORTEST_S:.0} s to a day: write 5m for a full one"));
    }
    Ok(TimeSpan::from_s(span))
}

/// What was asked for.
pub(super) struct Session<'a> {
    pub(super) link: &'a Address,
    pub(super) layout: &'a str,
    pub(super) train: TrainId,
    /// The steps of its decoder, if they were said.
    pub(super) decoder: Option<DecoderSteps>,
    pub(super) budget: TimeSpan,
    pub(super) is_afresh: bool,
    pub(super) sets_turnouts: bool,
    pub(super) serve: Option<&'a ServedAt>,
    pub(super) set_up: Option<&'a PathBuf>,
    pub(super) store: Option<&'a Path>,
    pub(super) out: Option<&'a Path>,
    pub(super) plot: Option<&'a PictureFile>,
    pub(super) is_json: bool,
}

/// A session that is over.
struct Driven<'l> {
    calibrator: Calibrator<'l>,
    /// When.
    at: Timestamp,
    mishaps: u32,
    why: Why,
}

impl Session<'_> {
    /// Drives, tells, keeps. `opened` is the link, if it was opened to stop trains.
    pub(super) fn run(
        &self,
        opened: Option<Box<dyn Link>>,
        output: &mut dyn Write,
    ) -> anyhow::Result<Outcome> {
        let written = WrittenLayout::named(self.layout)?;
        // A simulated railway is what its address says, whatever people believe it to be.
        let real = match self.link.simulated() {
            Some(simulated) => layout_named(&simulated.layout)?.layout,
            None => written.layout.clone(),
        };
        if let Some(simulated) = self.link.simulated()
            && !simulated.trains.contains(&self.train)
        {
            let there: Vec<String> = simulated.trains.iter().map(ToString::to_string).collect();
            bail!(
                "train {} is not on the simulated layout, where there are trains {}: choose one of them, or put it \
                 there with `&trains={}`",
                self.train,
                there.join(", "),
                self.train
            );
        }
        // Who watches lives in real time, unless the address says otherwise.
        let pace = if self.serve.is_some() { Speed::Times(1.0) } else { Speed::Unpaced };
        match self.link {
            Address::Simulated(simulated) => {
                let mut link = open_simulated(simulated, &real, pace)?;
                // All circuits of a layout share rails: one train learns, the others are off them meanwhile.
                for other in simulated.trains.iter().filter(|other| **other != self.train) {
                    say!("train {other} is taken off the simulated rails meanwhile");
                    link.station_mut().world_mut().lift(*other);
                }
                self.drive(&written, link, output)
            }
            _ => {
                let link = opened.map_or_else(|| open(self.link, &real, pace), Ok)?;
                self.drive(&written, link, output)
            }
        }
    }

    fn drive<L: Link>(&self, on: &WrittenLayout, link: L, output: &mut dyn Write) -> anyhow::Result<Outcome> {
        let layout = &on.layout;
        let store = || self.store.map(Path::to_path_buf);
        let dashboard = self
            .serve
            .map(|at| {
                let set_up = SetUpRoute::of_session(self.set_up.cloned(), SetUpMode::Calibrating, false);
                open_dashboard(at, on, store(), set_up)
            })
            .transpose()?;
        let link = ObservedLink::new(link, dashboard.as_ref().map(|dashboard| Arc::clone(&dashboard.line)));
        let showing =
            dashboard.as_ref().map(|dashboard| ReadOnlyDashboard::new(dashboard, layout, link.now()));
        let (fit, turnouts) = self.known(layout)?;
        let decoder = DecoderSteps::with(fit.model().highest());
        let settings = CalibratorSettings {
            budget: self.budget,
            sets_turnouts: self.sets_turnouts,
            ..CalibratorSettings::default()
        };
        let beginning =
            CalibrationBeginning::new(on, settings, fit, &turnouts, self.link.simulated().is_some());
        let line = MeasuredLine::of(self.link, self.store)?;
        let mut opened = open_session(self.link, &link, layout)?;
        opened.session.expect_delays(self.link.excess(line.as_ref()));
        opened.session.set_decoder(self.train, decoder)?;
        if let (Some(path), None) = (self.store, self.link.simulated())
            && path.exists()
        {
            recall_directions(opened.session.as_mut(), &Store::open_to_read(path)?, [self.train])?;
        }
        let mut written = match self.store {
            Some(path) => Some(kept::begin(path, layout, self.train, self.link, link.now(), &beginning)?),
            None => None,
        };
        let scribe = written.as_ref().and_then(SessionJournal::scribe);
        let recorder = written.as_mut().map(|written| written as &mut dyn Recorder);
        let mut calibrator = Recorded::new(beginning.calibrator(layout), scribe);
        let mut watcher = Watcher::new(layout, self.train, self.budget).seen_by(showing);
        let mut runtime = Runtime::new(link, opened, recorder, Some(StopFlag::install()));
        let ended = runtime.run(&mut calibrator, &mut watcher);
        let at = runtime.link().now();
        let closing = runtime.close();
        drop(runtime);
        // A session whose stops were not confirmed has no end in the store: the next start stops all trains first.
        let calibrator = if closing.is_complete() { calibrator.end(at) } else { calibrator.into_machine() };
        watcher.end();
        if !closing.is_complete() {
            say!("{closing}");
        }
        if let Some(written) = written {
            kept::end(written);
        }
        let why = match ended {
            Err(error) => Why::NotRecorded(error),
            Ok(Ended::Finished) => match watcher.other_layout {
                Some(other) => Why::OtherLayout { other: other.to_owned() },
                None => calibrator.ending().cloned().map_or(Why::Interrupted, Why::Ended),
            },
            Ok(Ended::Interrupted) => Why::Interrupted,
            Ok(lost) => Why::Lost(lost.to_string()),
        };
        let mishaps = watcher.mishaps;
        self.conclude(layout, Driven { calibrator, at, mishaps, why }, output)
    }

    /// Keeps what was learnt, whatever ended it, and tells it.
    fn conclude(
        &self,
        layout: &Layout,
        session: Driven<'_>,
        output: &mut dyn Write,
    ) -> anyhow::Result<Outcome> {
        let Driven { calibrator, at, mishaps, why } = session;
        let took = calibrator.progress(at).elapsed;
        let accuracy = calibrator.accuracy();
        let sections = calibrator.surveyed().clone();
        let mut fit = calibrator.into_fit();
        fit.refit(&sections);
        let made = now();
        let file = MotionFile::of(layout, fit.model(), Some(made));
        if why.is_trusted() {
            if let Some(path) = self.store {
                file.keep(&mut Store::open(path)?, made, made)?;
            }
            if let Some(path) = self.out {
                file.write(path)?;
            }
            if let Some(plot) = self.plot {
                plot.write(&picture::of_session(self.train, layout.name(), &accuracy))?;
            }
        }
        let figures =
            figures::Figures { layout, train: self.train, took, accuracy: &accuracy, mishaps, why: &why };
        if self.is_json {
            figures.write_json(output)?;
        } else {
            figures.write_table(output)?;
        }
        match why {
            Why::NotRecorded(error) => Err(error),
            Why::Lost(lost) => Err(anyhow!("{lost}")),
            why => Ok(outcome_of(&why)),
        }
    }

    /// The steps of the train's decoder: as named, as the simulated layout has it, as the store shows it, or 14.
    fn decoder(&self, layout: &Layout) -> anyhow::Result<DecoderSteps> {
        let named = NamedTrain { train: self.train, decoder: self.decoder };
        let decoders = self.link.decoders(&[named]).map_err(|error| anyhow!(error))?;
        if let Some(decoder) = decoders.get(&self.train).copied().flatten() {
            return Ok(decoder);
        }
        let store =
            self.store.filter(|path| path.exists() && !self.is_afresh).map(Store::open).transpose()?;
        let Some(store) = store else { return Ok(DecoderSteps::Fourteen) };
        let stored = StoredModel::of_store(layout, &store, self.train, LATEST)?;
        Ok(stored.decoder(&store, self.train, LATEST)?)
    }

    /// What is known of the train and the turnouts from earlier sessions, so that this one goes on from there.
    fn known(&self, layout: &Layout) -> anyhow::Result<(MotionFit, TurnoutStates)> {
        let highest = self.decoder(layout)?.highest();
        let nothing = (MotionFit::new(self.train, highest), TurnoutStates::unknown());
        let Some(path) = self.store.filter(|path| path.exists() && !self.is_afresh) else {
            return Ok(nothing);
        };
        let mut store = Store::open(path)?;
        let replay = MotionReplay::of_store(layout, &mut store, self.train, highest, LATEST)?;
        if replay.is_empty() {
            let Some(profile) = replay.profile else { return Ok(nothing) };
            say!("beginning with the speeds of {profile}; --afresh begins from nothing");
            return Ok((replay.fit, TurnoutStates::unknown()));
        }
        say!(
            "going on from {} of train {} that the store holds; --afresh begins from nothing",
            counted(replay.runs, "run"),
            self.train
        );
        let mut fit = replay.fit;
        if let StoredModel::Model(model) = StoredModel::of_store(layout, &store, self.train, LATEST)?
            && model.highest() == highest
        {
            // Which steps do not move it follows from what was tried, not from the events alone.
            let steps = (1..=highest.get()).filter_map(SpeedStep::new);
            for step in steps.filter(|step| model.uses(*step) != StepUse::Untried) {
                fit.note_use(step, model.uses(step));
            }
        }
        // Turnouts may have been thrown by hand since.
        Ok((fit, TurnoutStates::unknown()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_budget_is_read_as_people_write_it() {
        for (text, seconds) in
            [("5m", 300.0), ("90s", 90.0), ("300", 300.0), ("1.5 min", 90.0), ("1h", 3_600.0)]
        {
            assert_eq!(budget(text).map(TimeSpan::as_s), Ok(seconds), "{text}");
        }
        assert_eq!(budget("5 weeks").unwrap_err(), "`weeks` is no unit of time: write 90s, 5m or 1h");
        assert_eq!(budget("soon").unwrap_err(), "`soon` is no unit of time: write 90s, 5m or 1h");
        assert!(budget("1s").unwrap_err().contains("from 20 s to a day"));
        assert!(budget("-5m").is_err() && budget("").is_err() && budget("NaN").is_err());
    }
}
