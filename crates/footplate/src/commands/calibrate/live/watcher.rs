//! Who watches a calibration: tells it to people, and notices when the layout is another one than they said.

use footplate_core::control::calibrate::{CalibrationNotice, Calibrator, Mishap};
use footplate_core::track::{HopId, Layout};
use footplate_core::{Command, Length, TimeSpan, Timestamp, TrainId};
use footplate_store::{BUILT_IN, built_in};
use footplate_wire::{CommandError, LinkNotice};
use indicatif::{ProgressBar, ProgressStyle};

use super::figures::minutes;
use super::told;
use crate::dashboard::{Alarm, Showing};
use crate::runtime::{Attendant, Wish};
use crate::witness::Witnessed;

/// A length of another layout explains what is felt if it is so near: curves and surveys account for it.
const EXPLAINED: Length = Length::from_mm(40.0);

/// What a browser is told that wants to drive.
const DRIVES_ITSELF: &str = "a calibration drives by itself: `footplate serve` takes orders";

/// Two lengths that are those of the other layout, and not of the one that was said, are no chance.
const FEWEST_EXPLAINED: usize = 2;

/// Tells people how it goes, on standard error.
pub(super) struct Watcher<'l> {
    layout: &'l Layout,
    train: TrainId,
    bar: ProgressBar,
    budget: TimeSpan,
    began: Option<Timestamp>,
    /// Things that went wrong.
    pub(super) mishaps: u32,
    /// The layout that the reports fit better, by name.
    pub(super) other_layout: Option<&'static str>,
    showing: Option<Showing>,
    is_halted: bool,
}

impl<'l> Watcher<'l> {
    pub(super) fn new(layout: &'l Layout, train: TrainId, budget: TimeSpan) -> Self {
        eprintln!("calibrating train {train} on {} within {} of track time", layout.name(), minutes(budget));
        // Hidden by itself where standard error is no terminal.
        let bar = ProgressBar::new(budget.as_s().max(1.0) as u64);
        let style = ProgressStyle::with_template("{bar:24} {pos:>4} of {len} s  {msg}");
        let bar = if let Ok(style) = style { bar.with_style(style) } else { bar };
        Self {
            layout,
            train,
            bar,
            budget,
            began: None,
            mishaps: 0,
            other_layout: None,
            showing: None,
            is_halted: false,
        }
    }

    /// Those who watch in a browser see it, too.
    pub(super) fn seen_by(self, showing: Option<Showing>) -> Self {
        Self { showing, ..self }
    }

    /// The bar is taken away.
    pub(super) fn end(&self) {
        self.bar.finish_and_clear();
    }

    fn say(&self, now: Timestamp, text: &str) {
        let at = minutes(self.began.map_or(TimeSpan::ZERO, |began| now - began));
        self.bar.suspend(|| eprintln!("{at:>5}  {text}"));
        if let Some(showing) = &self.showing {
            showing.say(now, text);
        }
    }

    /// Another built-in layout with the lengths that are felt.
    fn layout_with(&self, hops: &[(HopId, Length, Length)]) -> Option<&'static str> {
        BUILT_IN.iter().copied().filter(|name| *name != self.layout.name()).find(|name| {
            let Ok(other) = built_in(name) else { return false };
            // Early in a session one or the other length is still wrong.
            let explained = hops.iter().filter(|(hop, surveyed, felt)| {
                let Some(hop) = self.layout.hop(*hop) else { return false };
                let ends =
                    [hop.from, hop.to].map(|node| other.layout.node_named(self.layout.node_name(node)));
                let [Some(from), Some(to)] = ends else { return false };
                let there = other.layout.hops_from(from).find(|other| other.to == to);
                let is_nearer = |there: Length| (there - *felt).abs() < 0.5 * (*surveyed - *felt).abs();
                there
                    .is_some_and(|there| (there.length - *felt).abs() <= EXPLAINED && is_nearer(there.length))
            });
            explained.count() >= FEWEST_EXPLAINED
        })
    }
}

impl<'l> Attendant<Witnessed<Calibrator<'l>>> for Watcher<'_> {
    fn hear(&mut self, now: Timestamp, notice: CalibrationNotice) {
        let line = told::line(self.layout, &notice);
        if let Some(showing) = &mut self.showing {
            showing.hear(now, self.train, &notice, line.as_deref().unwrap_or_default());
        }
        if let CalibrationNotice::Progress(progress) = &notice {
            self.began = self.began.or(Some(now + (TimeSpan::ZERO - progress.elapsed)));
            self.bar.set_position(progress.elapsed.as_s().min(self.budget.as_s()) as u64);
            self.bar.set_message(told::state(progress));
        }
        if let CalibrationNotice::Mishap(mishap) = &notice {
            self.mishaps += 1;
            if let Mishap::LengthsDiffer { hops } = mishap {
                self.other_layout = self.other_layout.or_else(|| self.layout_with(hops));
            }
        }
        if let Some(line) = line {
            self.say(now, &line);
        }
    }

    fn hear_of_line(&mut self, now: Timestamp, notice: &LinkNotice) {
        if let (Some(showing), Some(alarm)) = (&mut self.showing, Alarm::of_line(notice)) {
            showing.alarm(now, &alarm.said(&notice.to_string()));
        }
        self.say(now, &notice.to_string());
    }

    fn hear_of_refusal(&mut self, now: Timestamp, command: Command, error: CommandError) {
        if let Some(showing) = &mut self.showing {
            showing.alarm(now, &Alarm::not_sent(&format!("{command}: {error}")));
        }
        self.say(now, &format!("{command} was not taken: {error}"));
    }

    fn attend(&mut self, now: Timestamp, machine: &mut Witnessed<Calibrator<'l>>) -> Wish {
        if let Some(showing) = &mut self.showing {
            showing.calibrator(machine.machine(), now);
            self.is_halted |= showing.is_halted(DRIVES_ITSELF);
        }
        let is_over = machine.machine().ending().is_some() || self.other_layout.is_some() || self.is_halted;
        if is_over { Wish::Finish } else { Wish::GoOn }
    }
}
