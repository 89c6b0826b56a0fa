//! Alarms, each with the key of its sentence in the pages.

use footplate_core::control::learn::Fault;
use footplate_core::control::{Alarm as Noticed, Notice};
use footplate_core::track::Layout;
use footplate_core::tracking::Drift;
use footplate_core::{HALF_95, Length, SensorId, TrainId, TurnoutId};
use footplate_wire::LinkNotice;
use serde::Serialize;

/// The key of the alarm about missed stop intervals.
const MISSED_INTERVALS: &str = "promises-broken";
/// The key of the alarm about a sensor that reports where no train can be.
const STUCK_SENSOR: &str = "contact-stuck";
/// The key of the alarm about a train whose direction is unknown.
const DIRECTION_UNKNOWN: &str = "line-reverse-in-doubt";
/// The prefix of the keys of faults during a calibration.
const FAULT_PREFIX: &str = "mishap-";

/// The severity of an alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Grade {
    /// Trains may collide, or do something that was not commanded.
    Danger,
    /// Something deviates from the plan.
    Warning,
    /// The alarm, or what the message is about, is over.
    Over,
}

/// What an alarm is about: alarms of one cause are one entry of the list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Cause {
    family: &'static str,
    train: Option<TrainId>,
    /// The sensor, turnout or command, where a family has one entry for each.
    subject: String,
}

/// What resolves an alarm, beside news of it and the operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Resolution {
    /// Its train is located, and the watchdog does not distrust it.
    Located,
    /// Its train is commanded to run again.
    Runs,
    /// A sensor detects its train.
    Detected,
    /// This sensor detects a train.
    Reported(SensorId),
    /// Its train is at rest.
    AtRest,
    /// The turnout is in the other position.
    Thrown { turnout: TurnoutId, curved: bool },
    /// It has not recurred for a while.
    Quiet,
    /// News of the link, the sensor or the power, or the operator.
    News,
}

/// A message that every page shows. Sessions record its form for debugging: its fields keep their names.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Alarm {
    /// The key of the sentence in the pages.
    pub(super) what: &'static str,
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

    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// A greater number is more severe. Within a cause, what needs the operator ranks above the danger that led to it.
    pub(super) fn severity(&self) -> u8 {
        match (self.what, self.grade) {
            ("needs-person" | "line-silent" | "line-garbled" | "line-not-ready", _) => 3,
            (_, Grade::Danger) => 2,
            (_, Grade::Warning) => 1,
            (_, Grade::Over) => 0,
        }
    }

    /// The key without the prefix of calibrations: the same fault has the same cause there.
    fn key(&self) -> &'static str {
        self.what.strip_prefix(FAULT_PREFIX).unwrap_or(self.what)
    }

    /// The cause of the alarm.
    pub(super) fn cause(&self) -> Cause {
        let of_train = |family| Cause { family, train: self.train, subject: String::new() };
        let of_link = |family| Cause { family, train: None, subject: String::new() };
        let about =
            |family| Cause { family, train: None, subject: self.blanks.first().cloned().unwrap_or_default() };
        match self.key() {
            "lost" | "needs-person" | "held-as-unknown" | "overdue" | "stands-lost" | "stands-elsewhere"
            | "stands-untimely" | "stands-misses" | "stands-stalled" | "moved" => of_train("position"),
            "drifts-slower" | "drifts-faster" | "stands-slower" | "stands-faster" | "stands-distrusted" => {
                of_train("model")
            }
            "diverged"
            | "diverged-and-others"
            | "track-ends"
            | "held-back"
            | "deadlock"
            | "deadlocked"
            | "dropped"
            | "track-reserved"
            | "overshoots" => of_train("route"),
            "stands-unconfirmed" | "does-not-stop" => of_train("stopping"),
            "line-silent" | "line-garbled" | "line-not-ready" | "stands-silent" => of_link("link"),
            "stands-noise" => of_link("noise"),
            "line-reply-lost" | "line-unexpected" | "line-repeated" => of_link("line noise"),
            "power-off" | "line-power-lost" | "line-restarted" => of_link("power"),
            "lies-curved" | "lies-straight" => about("turnout"),
            STUCK_SENSOR | "unexplained" | "line-held-closed" => about("sensor"),
            "not-sent" | "unconfirmed" | "line-solenoid-late" => about(self.what),
            "line-says" => Cause { train: self.train, ..about(self.what) },
            other => of_train(other),
        }
    }

    /// What resolves the alarm.
    pub(super) fn resolution(&self) -> Resolution {
        let number = || self.blanks.first().and_then(|number| number.parse().ok());
        match self.key() {
            "line-held-closed" => {
                number().map_or(Resolution::News, |sensor| Resolution::Reported(SensorId(sensor)))
            }
            "overdue" => Resolution::Detected,
            "overshoots" => Resolution::AtRest,
            "lies-curved" | "lies-straight" => number().map_or(Resolution::News, |turnout| {
                Resolution::Thrown { turnout: TurnoutId(turnout), curved: self.what == "lies-curved" }
            }),
            "lost" | "needs-person" | "held-as-unknown" | "stands-lost" | "stands-elsewhere"
            | "stands-untimely" | "stands-misses" | "stands-stalled" | "stands-slower" | "stands-faster"
            | "stands-distrusted" | "stands-silent" | "stands-noise" | "stands-unconfirmed"
            | "does-not-stop" | "moved" | DIRECTION_UNKNOWN => Resolution::Located,
            "diverged"
            | "diverged-and-others"
            | "track-ends"
            | "track-reserved"
            | "held-back"
            | "deadlock"
            | "deadlocked"
            | "dropped" => Resolution::Runs,
            "unexplained"
            | "line-reply-lost"
            | "line-unexpected"
            | "line-repeated"
            | "line-reads-all-only"
            | "drifts-slower"
            | "drifts-faster"
            | "stalled"
            | "missed"
            | "wrong-leg" => Resolution::Quiet,
            _ => Resolution::News,
        }
    }

    /// Whether this message, of the kind `over`, resolves an alarm.
    pub(super) fn resolves(&self, alarm: &Self) -> bool {
        let cause = alarm.cause();
        match self.what {
            "recovered" => {
                alarm.train == self.train
                    && matches!(cause.family, "position" | "model" | "stopping" | "route")
            }
            "line-answers" => matches!(cause.family, "link" | "line noise" | "not-sent" | "unconfirmed"),
            "sensor-restored" => cause.family == "sensor" && alarm.blanks == self.blanks,
            "power-on" => cause.family == "power",
            "track-clear" => cause.family == "unauthorised",
            "noise-over" => cause.family == "noise",
            _ => false,
        }
    }

    /// The same alarm as a message that it is over.
    pub(super) fn over(self) -> Self {
        Self { grade: Grade::Over, ..self }
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

    /// A train was stopped before track that is reserved for others.
    pub(crate) fn track_reserved(train: TrainId, holders: &[TrainId]) -> Self {
        Self::new(Grade::Warning, "track-reserved", train, vec![listed(holders)])
    }

    /// Lengths are not those of the layout; `differences` are the lengths, in no language.
    pub(crate) fn lengths_differ(text: &str, differences: &str) -> Self {
        Self::new(Grade::Warning, "lengths-differ", None, vec![differences.to_owned()]).said(text)
    }

    /// Whether this alarm is about missed stop intervals.
    pub(crate) fn is_of_promises(&self) -> bool {
        self.what == MISSED_INTERVALS
    }

    /// Whether trains wait until an operator places this one, or switches the power on.
    pub(crate) fn needs_operator(&self) -> bool {
        matches!(self.what, "needs-person" | "deadlocked" | "unauthorised" | "power-off")
    }

    /// The train that it is about, if it is about one.
    pub(crate) const fn train(&self) -> Option<TrainId> {
        self.train
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
            LinkNotice::Closed(_) | LinkNotice::Identified(_) | LinkNotice::OtherFunctions { .. } => {
                return None;
            }
            LinkNotice::Answers => (Grade::Over, "line-answers", None, Vec::new()),
            LinkNotice::Silent { since, .. } => {
                (Grade::Danger, "line-silent", None, vec![format!("{:.1}", since.as_s())])
            }
            LinkNotice::Garbled => (Grade::Danger, "line-garbled", None, Vec::new()),
            LinkNotice::NotReady { since, .. } => {
                (Grade::Danger, "line-not-ready", None, vec![format!("{:.1}", since.as_s())])
            }
            LinkNotice::ReplyLost { .. } => (Grade::Warning, "line-reply-lost", None, Vec::new()),
            LinkNotice::UnexpectedBytes { count } => {
                (Grade::Warning, "line-unexpected", None, vec![count.to_string()])
            }
            LinkNotice::Repeated(_) => (Grade::Warning, "line-repeated", None, Vec::new()),
            LinkNotice::ReverseInDoubt(train) | LinkNotice::DirectionContradicted(train) => {
                (Grade::Danger, DIRECTION_UNKNOWN, Some(*train), Vec::new())
            }
            LinkNotice::HeldClosed(sensor) => {
                (Grade::Warning, "line-held-closed", None, vec![sensor.to_string()])
            }
            LinkNotice::LimitedReads { .. } => (Grade::Warning, "line-reads-all-only", None, Vec::new()),
            LinkNotice::SolenoidLate { turnout, held } => {
                let blanks = vec![turnout.to_string(), format!("{:.0}", held.as_ms())];
                (Grade::Danger, "line-solenoid-late", None, blanks)
            }
            LinkNotice::OtherThrottle { train, .. } => {
                (Grade::Danger, "line-says", Some(*train), vec![notice.to_string()])
            }
            LinkNotice::PowerLost => (Grade::Danger, "line-power-lost", None, Vec::new()),
            LinkNotice::Restarted => (Grade::Danger, "line-restarted", None, Vec::new()),
            LinkNotice::Unconfirmed(_) | LinkNotice::Locked => {
                (Grade::Danger, "line-says", None, vec![notice.to_string()])
            }
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
            Notice::SpeedReportsIgnored { train } => {
                (Grade::Warning, "speed-reports-ignored", Some(*train), none)
            }
            Notice::TrackEnds { train, end } => {
                (Grade::Warning, "track-ends", Some(*train), vec![layout.node_name(*end).to_owned()])
            }
            Notice::SensorStuck { sensor } => (Grade::Warning, STUCK_SENSOR, None, vec![name(sensor)]),
            Notice::Unexplained { sensor, .. } => (Grade::Warning, "unexplained", None, vec![name(sensor)]),
            Notice::UnauthorisedMovement { from, to, .. } => {
                (Grade::Danger, "unauthorised", None, vec![name(from), name(to)])
            }
            Notice::TrackClear => (Grade::Over, "track-clear", None, none),
            Notice::Noise => (Grade::Danger, "noise", None, none),
            Notice::NoiseOver => (Grade::Over, "noise-over", None, none),
            Notice::Unconfirmed { command } => {
                (Grade::Danger, "unconfirmed", None, vec![command.to_string()])
            }
            Notice::Danger { train, why, .. } => (Grade::Danger, stop_reason(*why), Some(*train), none),
            Notice::PowerOff { train } => (Grade::Danger, "power-off", Some(*train), none),
            Notice::NeedsOperator { train, .. } => (Grade::Danger, "needs-person", Some(*train), none),
            Notice::Cancelled { train, .. } => (Grade::Warning, "dropped", Some(*train), none),
            Notice::Recovered { train, .. } => (Grade::Over, "recovered", Some(*train), none),
            Notice::SensorRestored { sensor } => (Grade::Over, "sensor-restored", None, vec![name(sensor)]),
            Notice::PowerOn => (Grade::Over, "power-on", None, none),
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
            Fault::OtherSpeeds { ratio } => {
                (Grade::Warning, "other-train", vec![format!("{:.0}", 100.0 * ratio)])
            }
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
        Noticed::Stalled => "stands-stalled",
        Noticed::LinkSilent => "stands-silent",
        Noticed::Noise => "stands-noise",
        Noticed::StopUnconfirmed => "stands-unconfirmed",
        Noticed::DoesNotStop(_) => "does-not-stop",
        _ => "stands-distrusted",
    }
}

fn listed(trains: &[TrainId]) -> String {
    let trains: Vec<String> = trains.iter().map(ToString::to_string).collect();
    if trains.is_empty() { "–".to_owned() } else { trains.join(", ") }
}
