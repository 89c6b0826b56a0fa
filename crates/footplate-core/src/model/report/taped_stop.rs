//! Stops measured with a tape, counted from the place where the train was when the command was sent.

use super::run::{MeasuredStop, RunPassages};
use super::settled::{SettledRunning, path_length};
use crate::ids::SpeedStep;
use crate::kinematics::{FromCommand, StoppingDistance};
use crate::model::MotionModel;
use crate::model::survey::SectionIndex;
use crate::time::TimeSpan;
use crate::track::Layout;
use crate::units::{Length, Speed};

/// A tape read to the centimetre beside a train: one standard deviation (m).
const TAPE_M: f64 = 0.005;
/// A person presses the key this long after the train stands (0.2 to 0.5 s).
const HUMAN_DELAY: TimeSpan = TimeSpan::from_ms(350);
/// A person who says later than this after the command where a train is at rest has read a tape and not a watch: no published
/// model train takes half as long to stop.
const WATCHED: TimeSpan = TimeSpan::from_ms(15_000);

/// One stop as measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TapedStop {
    /// The step from which it stopped.
    pub step: SpeedStep,
    /// The run, and the entry that tells where it stood.
    pub run: usize,
    /// See `run`.
    pub entry: usize,
    /// Speed when the command was sent.
    pub speed: Speed,
    /// Distance from the command to standstill.
    pub distance: StoppingDistance<FromCommand>,
    /// One standard deviation of it.
    pub uncertainty: Length,
    /// Time from the command until the train stood, the delay of the person who saw it taken off; `None` where only a
    /// tape was read, some time later.
    pub time: Option<TimeSpan>,
}

impl TapedStop {
    /// Counts a measured stop from its command: by the path from the sensor passed last before the command to the one
    /// where the tape was laid, what the tape says, less what the train ran on until the command. `None` where the
    /// train was not reported on that path.
    pub fn of(
        layout: &Layout,
        sections: &SectionIndex,
        model: &MotionModel,
        running: &SettledRunning,
        run: &RunPassages,
        stop: &MeasuredStop,
    ) -> Option<Self> {
        let landmark = layout.sensor_node(stop.landmark)?;
        let before = run.passages.iter().rposition(|passage| passage.window.until <= stop.commanded)?;
        let last = run.passages.get(before)?;
        let mut path = 0.0;
        let mut reached = last.node == landmark;
        for passage in run.passages.get(before + 1..).unwrap_or_default() {
            if reached {
                break;
            }
            path += path_length(layout, sections, model, passage.path.as_ref()?).as_m();
            reached = passage.node == landmark;
        }
        if !reached {
            return None;
        }
        let known = model.speed(last.drive.step, last.drive.approach());
        let speed = running.speed_in_run(model, run.run, last.drive)[0].as_m_per_s();
        let run_on = (stop.commanded - last.window.middle()).as_s();
        let distance = path + stop.offset.as_m() - speed * run_on;
        let ran_on_uncertainty = run_on * known.uncertainty.as_m_per_s();
        let variance = TAPE_M * TAPE_M
            + speed * speed * last.window.variance_s2()
            + ran_on_uncertainty * ran_on_uncertainty;
        let took = stop.seen - stop.commanded;
        (distance > 0.0 && reached).then(|| Self {
            step: stop.from,
            run: run.run,
            entry: stop.entry,
            speed: Speed::from_m_per_s(speed),
            distance: StoppingDistance::new(Length::from_m(distance)),
            uncertainty: Length::from_m(libm::sqrt(variance)),
            time: (took <= WATCHED).then(|| took - HUMAN_DELAY),
        })
    }
}
