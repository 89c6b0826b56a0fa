//! Alarms, each with the key of its sentence in the pages.

use footplate_core::control::learn::Fault;
use footplate_core::control::{Alarm as Noticed, Notice};
use footplate_core::track::Layout;
use footplate_core::tracking::Drift;
use footplate_core::{HALF_95, Length, TrainId};
use footplate_wire::LinkNotice;
use serde::Serialize;

/// The key of the alarm about missed stop intervals.
const MISSED_INTERVALS: &str = "promises-broken";

/// The severity of an alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Grade {
    /// Trains may collide, or do something that was not commanded.
    Danger,
    /// Something deviates from the plan.
    Warning,
    /// The alarms of this train are over; without a train, those of the link.
    Over,
}

/// A message that every page shows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Alarm {
    /// The key of the sentence in the pages.
    what: &'static str,
    pub(super) grade: Grade,
    pub(super) train: Option<TrainId>,
    /// The values that the sentence is filled with.
    blanks: Vec<String>,
    /// The sentence in English, for API clients.
    text: String,
    /// Whether a line of text says the same.
    is_said: bool,
}

impl Alarm {
    fn new(grade: Grade, what: &'static str, train: impl Into<Option<TrainId>>, blanks: Vec<String>) -> Self {
        Self { what, grade, train: train.into(), blanks, text: String::new(), is_said: false }
    }

    /// Adds the English text that was also printed as a line.
    pub(crate) fn said(self, text: &str) -> Self {
        Self { text: text.to_owned(), is_said: true, ..self }
    }

    /// The detections of a train drift from their predictions.
    pub(super) fn drifts(train: TrainId, drift: Drift) -> Self {
        let (what, text) = match drift {
            Drift::Slower => (
                "drifts-slower",
                "sensor reports come later and later: the train runs slower than \
                                   calibrated",
            ),
            Drift::Faster => (
                "drifts-faster",
                "sensor reports come earlier and earlier: the train runs faster than \
                                   calibrated",
            ),
        };
        Self { text: text.to_owned(), ..Self::new(Grade::Warning, what, train, Vec::new()) }
    }

    /// A train missed its stop intervals too often; `by` is the standard deviation that was added to them.
    pub(crate) fn promises_broken(train: TrainId, by: Length) -> Self {
        let by = format!("{:.0}", HALF_95 * by.as_mm());
        Self::new(Grade::Warning, MISSED_INTERVALS, train, vec![by])
    }

    /// Whether this alarm is about missed stop intervals.
    pub(crate) fn is_of_promises(&self) -> bool {
        self.what == MISSED_INTERVALS
    }

    /// A command that the session rejected.
    pub(crate) fn not_sent(text: &str) -> Self {
        let alarm = Self::new(Grade::Danger, "not-sent", None, vec![text.to_owned()]);
        Self { text: format!("not sent: {text}"), ..alarm }
    }

    /// The alarm of a notice of the link; `None` if it needs no attention. That the station answers again ends earlier
    /// alarms.
    pub(crate) fn of_line(notice: &LinkNotice) -> Option<Self> {
        let (grade, what, train, blanks) = match notice {
            LinkNotice::Closed(_) | LinkNotice::Identified { .. } => return None,
            LinkNotice::Answers => (Grade::Over, "line-answers", None, Vec::new()),
            LinkNotice::Silent { since, .. } => {
                (Grade::Danger, "line-silent", None, vec![format!("{:.1}", since.as_s())])
            }
            LinkNotice::NotReady { since } => {
                (Grade::Danger, "line-not-ready", None, vec![format!("{:.1}", since.as_s())])
            }
            LinkNotice::ReplyLost { .. } => (Grade::Warning, "line-reply-lost", None, Vec::new()),
            LinkNotice::UnexpectedBytes { count } => {
                (Grade::Warning, "line-unexpected", None, vec![count.to_string()])
            }
            LinkNotice::Repeated { .. } => (Grade::Warning, "line-repeated", None, Vec::new()),
            LinkNotice::ReverseInDoubt { train } => {
                (Grade::Danger, "line-reverse-in-doubt", Some(*train), Vec::new())
            }
            LinkNotice::HeldClosed { sensor } => {
                (Grade::Warning, "line-held-closed", None, vec![sensor.to_string()])
            }
            LinkNotice::Reads(_) => (Grade::Warning, "line-reads-all-only", None, Vec::new()),
            LinkNotice::SolenoidLate { turnout, held } => {
                let blanks = vec![turnout.to_string(), format!("{:.0}", held.as_ms())];
                (Grade::Danger, "line-solenoid-late", None, blanks)
            }
            LinkNotice::OtherThrottle { train, .. } => {
                (Grade::Danger, "line-says", Some(*train), vec![notice.to_string()])
            }
            LinkNotice::Restarted
            | LinkNotice::PowerLost
            | LinkNotice::Unconfirmed { .. }
            | LinkNotice::Locked => (Grade::Danger, "line-says", None, vec![notice.to_string()]),
            other => (Grade::Warning, "line-says", None, vec![other.to_string()]),
        };
        Some(Self { text: notice.to_string(), ..Self::new(grade, what, train, blanks) })
    }

    /// The alarm of a notice; `None` if the notice is no alarm.
    pub(crate) fn of_notice(layout: &Layout, notice: &Notice) -> Option<Self> {
        let name = |sensor: &footplate_core::SensorId| layout.sensor_name(*sensor).to_owned();
        let none = Vec::new();
        let (grade, what, train, blanks) = match notice {
            Notice::Lost { train } => (Grade::Danger, "lost", Some(*train), none),
            Notice::HeldBack { train, leader, .. } => {
                (Grade::Warning, "held-back", Some(*train), vec![leader.to_string()])
            }
            Notice::Overshoots { train, by, .. } => {
                (Grade::Warning, "overshoots", Some(*train), vec![format!("{:.0}", by.as_mm())])
            }
            Notice::TurnoutMismatch { turnout, curved, train } => {
                let what = if *curved { "lies-curved" } else { "lies-straight" };
                (Grade::Warning, what, Some(*train), vec![turnout.to_string()])
            }
            Notice::Overdue { train, sensor, by } => {
                (Grade::Warning, "overdue", Some(*train), vec![name(sensor), format!("{:.1}", by.as_s())])
            }
            Notice::TrackEnds { train, end } => {
                (Grade::Warning, "track-ends", Some(*train), vec![layout.node_name(*end).to_owned()])
            }
            Notice::SensorStuck { sensor } => (Grade::Warning, "contact-stuck", None, vec![name(sensor)]),
            Notice::Unexplained { sensor, .. } => (Grade::Warning, "unexplained", None, vec![name(sensor)]),
            Notice::UnauthorisedMovement { from, to, .. } => {
                (Grade::Danger, "unauthorised", None, vec![name(from), name(to)])
            }
            Notice::TrackClear => (Grade::Over, "track-clear", None, none),
            Notice::Unconfirmed { command } => {
                (Grade::Danger, "unconfirmed", None, vec![command.to_string()])
            }
            Notice::Danger { train, why, .. } => (Grade::Danger, stop_reason(*why), Some(*train), none),
            Notice::PowerOff { train } => (Grade::Danger, "power-off", Some(*train), none),
            Notice::NeedsOperator { train, .. } => (Grade::Danger, "needs-person", Some(*train), none),
            Notice::Cancelled { train, .. } => (Grade::Warning, "dropped", Some(*train), none),
            Notice::Recovered { train, .. } => (Grade::Over, "recovered", Some(*train), none),
            Notice::Deadlocked { train } => (Grade::Danger, "deadlocked", Some(*train), none),
            Notice::Deadlock { train, moves } => {
                (Grade::Warning, "deadlock", Some(*train), vec![listed(moves)])
            }
            Notice::Diverged { train, stopped } if stopped.is_empty() => {
                (Grade::Danger, "diverged", Some(*train), none)
            }
            Notice::Diverged { train, stopped } => {
                (Grade::Danger, "diverged-and-others", Some(*train), vec![listed(stopped)])
            }
            Notice::ReservedAsUnknown { train } => (Grade::Warning, "held-as-unknown", Some(*train), none),
            _ => return None,
        };
        Some(Self::new(grade, what, train, blanks))
    }

    /// The alarm of a fault during a calibration.
    pub(super) fn of_fault(layout: &Layout, train: TrainId, fault: &Fault) -> Self {
        let name = |sensor| layout.sensor_name(sensor).to_owned();
        let (grade, what, blanks) = match fault {
            Fault::Stalled { step } => (Grade::Warning, "mishap-stalled", vec![step.to_string()]),
            Fault::Missed { count, before } => {
                (Grade::Warning, "mishap-missed", vec![count.to_string(), name(*before)])
            }
            Fault::Unexplained { sensor } => (Grade::Warning, "unexplained", vec![name(*sensor)]),
            Fault::WrongLeg { turnout, .. } => {
                (Grade::Warning, "mishap-wrong-leg", vec![turnout.to_string()])
            }
            Fault::Moved { to, .. } => {
                (Grade::Danger, "mishap-moved", vec![layout.node_name(*to).to_owned()])
            }
            Fault::Lost { .. } => (Grade::Danger, "mishap-lost", Vec::new()),
            Fault::LengthsDiffer { hops } => (Grade::Warning, "mishap-lengths", vec![hops.len().to_string()]),
        };
        Self::new(grade, what, train, blanks)
    }
}

/// The key of the reason why the watchdog stopped a train.
const fn stop_reason(why: Noticed) -> &'static str {
    match why {
        Noticed::Drift(Drift::Slower) => "stands-slower",
        Noticed::Drift(Drift::Faster) => "stands-faster",
        Noticed::Lost => "stands-lost",
        Noticed::Elsewhere(_) => "stands-elsewhere",
        Noticed::Untimely(_) => "stands-untimely",
        Noticed::Misses => "stands-misses",
        Noticed::LinkSilent => "stands-silent",
        Noticed::StopUnconfirmed => "stands-unconfirmed",
        Noticed::DoesNotStop(_) => "does-not-stop",
        _ => "stands-distrusted",
    }
}

fn listed(trains: &[TrainId]) -> String {
    let trains: Vec<String> = trains.iter().map(ToString::to_string).collect();
    if trains.is_empty() { "–".to_owned() } else { trains.join(", ") }
}
