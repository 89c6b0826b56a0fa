//! Who watches a calibration: tells it to people, and notices when the layout is another one than they said.

use footplate_core::control::learn::{CalibrationNotice, Calibrator, Fault};
use footplate_core::track::Layout;
use footplate_core::{Command, TimeSpan, Timestamp, TrainId};
use footplate_wire::{BlockReports, CommandError, LinkNotice};
use indicatif::{ProgressBar, ProgressStyle};

use super::figures::minutes;
use super::printed;
use crate::dashboard::{Alarm, ReadOnlyDashboard};
use crate::layout_check::layout_with;
use crate::recorded::Recorded;
use crate::runtime::{Attendant, Wish};
use crate::standard_error::say;

/// The answer to a browser that wants to drive.
const DRIVES_ITSELF: &str = "a calibration runs by itself: use `footplate serve` to command trains";

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
    showing: Option<ReadOnlyDashboard>,
    is_halted: bool,
}

impl<'l> Watcher<'l> {
    pub(super) fn new(layout: &'l Layout, train: TrainId, budget: TimeSpan) -> Self {
        say!("calibrating train {train} on {} within {} of track time", layout.name(), minutes(budget));
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
    pub(super) fn seen_by(self, showing: Option<ReadOnlyDashboard>) -> Self {
        Self { showing, ..self }
    }

    /// The bar is taken away.
    pub(super) fn end(&self) {
        self.bar.finish_and_clear();
    }

    fn say(&self, now: Timestamp, text: &str) {
        let at = minutes(self.began.map_or(TimeSpan::ZERO, |began| now - began));
        self.bar.suspend(|| say!("{at:>5}  {text}"));
        if let Some(showing) = &self.showing {
            showing.say(now, text);
        }
    }
}

impl<'l> Attendant<Recorded<Calibrator<'l>>> for Watcher<'_> {
    fn hear(&mut self, now: Timestamp, notice: CalibrationNotice) {
        let line = printed::line(self.layout, &notice);
        if let Some(showing) = &mut self.showing {
            showing.hear(now, self.train, &notice, line.as_deref().unwrap_or_default());
        }
        if let CalibrationNotice::Progress(progress) = &notice {
            self.began = self.began.or(Some(now + (TimeSpan::ZERO - progress.elapsed)));
            self.bar.set_position(progress.elapsed.as_s().min(self.budget.as_s()) as u64);
            self.bar.set_message(printed::state(progress));
        }
        if let CalibrationNotice::Mishap(mishap) = &notice {
            self.mishaps += 1;
            if let Fault::LengthsDiffer { hops } = mishap {
                self.other_layout = self.other_layout.or_else(|| layout_with(self.layout, hops));
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

    fn see_blocks(&mut self, blocks: &BlockReports) {
        if let Some(showing) = &mut self.showing {
            showing.see_blocks(blocks);
        }
    }

    fn hear_of_refusal(&mut self, now: Timestamp, command: Command, error: CommandError) {
        if let Some(showing) = &mut self.showing {
            showing.alarm(now, &Alarm::not_sent(&format!("{command}: {error}")));
        }
        self.say(now, &format!("{command} was not sent: {error}"));
    }

    fn attend(&mut self, now: Timestamp, machine: &mut Recorded<Calibrator<'l>>) -> Wish {
        if let Some(showing) = &mut self.showing {
            showing.calibrator(machine.machine(), now);
            self.is_halted |= showing.is_halted(now, DRIVES_ITSELF);
        }
        let is_over = machine.machine().ending().is_some() || self.other_layout.is_some() || self.is_halted;
        if is_over { Wish::Finish } else { Wish::GoOn }
    }
}
