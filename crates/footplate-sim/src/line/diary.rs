//! What happens in a run, written down when it changes.

use footplate_core::{Acceleration, Timestamp};

use super::bogie::Conduct;
use super::faults::Channels;
use super::recording::{LineEvent, LineEventKind, LineTruth, WheelTruth};

/// The events of a run.
pub(crate) struct Diary {
    pub(crate) events: Vec<LineEvent>,
    wheels: [WheelTruth; 2],
    conduct: Conduct,
    fault: Option<(f64, f64)>,
    is_faulty: bool,
}

impl Diary {
    /// A diary that knows when the fault of a run lasts.
    pub(crate) fn new(channels: &Channels) -> Self {
        Self {
            events: Vec::new(),
            wheels: [WheelTruth::Rolling; 2],
            conduct: Conduct::Follows,
            fault: channels.lasts(),
            is_faulty: false,
        }
    }

    /// Writes down that something happened.
    pub(crate) fn write(&mut self, time: Timestamp, what: LineEventKind) {
        self.events.push(LineEvent { time, what });
    }

    /// Notes what is different from before, at a time on the recorder's clock and the same on the world's (s).
    pub(crate) fn note(&mut self, time: Timestamp, now: f64, real: &LineTruth, conduct: Conduct) {
        for wheelset in [0, 1] {
            let does = real.wheels[wheelset];
            if does != self.wheels[wheelset] {
                self.write(time, LineEventKind::Wheel { wheelset, does });
            }
        }
        self.wheels = real.wheels;
        if conduct != self.conduct {
            match conduct {
                Conduct::DrawnAway(extra) => {
                    let extra = Acceleration::from_m_per_s2(extra);
                    self.write(time, LineEventKind::DrawnAway { extra });
                }
                Conduct::Follows => self.write(time, LineEventKind::FollowsAgain),
                _ => {}
            }
            self.conduct = conduct;
        }
        let is_faulty = self.fault.is_some_and(|(from, to)| from <= now && now < to);
        if is_faulty != self.is_faulty {
            self.is_faulty = is_faulty;
            let what = if is_faulty { LineEventKind::FaultBegins } else { LineEventKind::FaultEnds };
            self.write(time, what);
        }
    }
}
