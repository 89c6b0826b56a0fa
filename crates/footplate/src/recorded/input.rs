//! The inputs of a machine, and their form in the store.

use footplate_core::control::{LinkNews, Order};
use footplate_core::{Event, TrainId};
use footplate_store::Schedule;
use serde::de::DeserializeOwned;

/// Prefixes of the train number.
const REVERSE_IN_DOUBT: &str = "reverse-in-doubt ";
const OTHER_THROTTLE: &str = "other-throttle ";
/// Prefix of a number that a decoder reported, and of its train.
const REPORTED_SPEED: &str = "reported-speed ";

/// An input of a machine. All decisions follow from the machine's beginning and its inputs, in their order and at their
/// times.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Input {
    /// An event of the recording.
    Event(Event),
    /// The time that the machine asked for has come.
    Timeout,
    /// A line that a person wrote.
    Line(String),
    /// A schedule begins.
    Schedule(Schedule),
    /// The saved schedules of the layout have changed.
    Schedules(Vec<Schedule>),
    /// The schedule of this name ends.
    EndSchedule(String),
    /// An emergency stop: all trains stop, and the track power goes off.
    EmergencyStop,
    /// No more lines follow.
    NoMoreLines,
    /// An order of a program.
    Order(Order),
    /// The station fell silent, or answers again.
    Link(LinkNews),
    /// The end of the session. The machine does not receive it; a recording without it was cut off.
    End,
}

/// Why a row of the store is not an input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum InputError {
    /// A kind that this program does not know.
    Unknown { kind: String },
    /// An event or an order that cannot be read.
    Wrong { kind: String, text: String, why: String },
}

impl std::fmt::Display for InputError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unknown { kind } => {
                write!(f, "an input of the kind `{kind}`, which this version of the program does not know")
            }
            Self::Wrong { kind, text, why } => {
                write!(f, "an input of the kind `{kind}` that is none, `{text}`: {why}")
            }
        }
    }
}

impl std::error::Error for InputError {}

impl Input {
    /// Returns the kind and the text of its row.
    pub(crate) fn written(&self) -> (&'static str, String) {
        match self {
            // Numbers and names of variants have a form in JSON, so this cannot fail; an empty text would be no input.
            Self::Event(event) => ("event", serde_json::to_string(event).unwrap_or_default()),
            Self::Order(order) => ("order", serde_json::to_string(order).unwrap_or_default()),
            Self::Link(LinkNews::Silent) => ("link", "silent".to_owned()),
            Self::Link(LinkNews::Answers) => ("link", "answers".to_owned()),
            Self::Link(LinkNews::PowerLost) => ("link", "power-lost".to_owned()),
            Self::Link(LinkNews::ReverseInDoubt { train }) => ("link", format!("{REVERSE_IN_DOUBT}{train}")),
            Self::Link(LinkNews::OtherThrottle { train }) => ("link", format!("{OTHER_THROTTLE}{train}")),
            Self::Link(LinkNews::ReportedSpeed { train, number }) => {
                ("link", format!("{REPORTED_SPEED}{number} {train}"))
            }
            Self::Timeout => ("timeout", String::new()),
            Self::Line(line) => ("line", line.clone()),
            Self::Schedule(schedule) => ("schedule", serde_json::to_string(schedule).unwrap_or_default()),
            Self::Schedules(saved) => ("schedules", serde_json::to_string(saved).unwrap_or_default()),
            Self::EndSchedule(name) => ("end-schedule", name.clone()),
            Self::EmergencyStop => ("emergency-stop", String::new()),
            Self::NoMoreLines => ("no-more-lines", String::new()),
            Self::End => ("end", String::new()),
        }
    }

    /// Reads what [`written`](Self::written) writes.
    ///
    /// # Errors
    /// The row is of another version of the program, or damaged.
    pub(crate) fn read(kind: &str, text: &str) -> Result<Self, InputError> {
        Ok(match kind {
            "event" => Self::Event(of_json(kind, text)?),
            "order" => Self::Order(of_json(kind, text)?),
            "link" => Self::Link(news(text).ok_or_else(|| {
                let why = "it should be `silent`, `answers`, `power-lost`, `reverse-in-doubt 24`, `other-throttle 24` or \
                           `reported-speed 63 24`";
                InputError::Wrong { kind: kind.to_owned(), text: text.to_owned(), why: why.to_owned() }
            })?),
            "timeout" => Self::Timeout,
            "line" => Self::Line(text.to_owned()),
            "schedule" => Self::Schedule(of_json(kind, text)?),
            "schedules" => Self::Schedules(of_json(kind, text)?),
            "end-schedule" => Self::EndSchedule(text.to_owned()),
            "emergency-stop" => Self::EmergencyStop,
            "no-more-lines" => Self::NoMoreLines,
            "end" => Self::End,
            _ => return Err(InputError::Unknown { kind: kind.to_owned() }),
        })
    }
}

/// News of the link.
fn news(text: &str) -> Option<LinkNews> {
    let train = |number: &str| number.parse().ok().map(TrainId);
    if let Some(number) = text.strip_prefix(REVERSE_IN_DOUBT) {
        return Some(LinkNews::ReverseInDoubt { train: train(number)? });
    }
    if let Some(number) = text.strip_prefix(OTHER_THROTTLE) {
        return Some(LinkNews::OtherThrottle { train: train(number)? });
    }
    if let Some((number, of)) =
        text.strip_prefix(REPORTED_SPEED).and_then(|reported| reported.split_once(' '))
    {
        return Some(LinkNews::ReportedSpeed { train: train(of)?, number: number.parse().ok()? });
    }
    match text {
        "silent" => Some(LinkNews::Silent),
        "answers" => Some(LinkNews::Answers),
        "power-lost" => Some(LinkNews::PowerLost),
        _ => None,
    }
}

fn of_json<T: DeserializeOwned>(kind: &str, text: &str) -> Result<T, InputError> {
    serde_json::from_str(text).map_err(|error| InputError::Wrong {
        kind: kind.to_owned(),
        text: text.to_owned(),
        why: error.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use footplate_core::control::{Aim, StopOrder};
    use footplate_core::track::Landmark;
    use footplate_core::{
        EventKind, Length, NodeId, Ratio, Report, SensorId, SpeedStep, TimeSpan, Timestamp, TurnoutId,
    };

    use super::*;

    #[test]
    fn every_input_comes_back_from_its_row_to_the_last_bit() {
        let train = TrainId(24);
        let report = Report { sensor: SensorId(77), poll_interval: Some(TimeSpan::from_ns(57_812_345)) };
        let step = SpeedStep::new(9).unwrap();
        let kinds = [
            EventKind::Sensor(report),
            EventKind::Sensor(Report { poll_interval: None, ..report }),
            EventKind::Freed(report),
            EventKind::Speed { train, step },
            EventKind::Reverse { train },
            EventKind::Turnout { turnout: TurnoutId(11), curved: true },
            EventKind::Stopped { train, landmark: SensorId(3), offset: Length::from_m(0.1 + 0.2) },
        ];
        let time = Timestamp::from_ns(1_234_567_890_123);
        let mut inputs: Vec<Input> = kinds.map(|kind| Input::Event(Event { time, kind })).into();
        inputs.extend([
            Input::Timeout,
            Input::Line("stop 24 at C13+120mm  # näher".to_owned()),
            Input::Schedule(Schedule {
                name: "Abend".to_owned(),
                lines: vec!["go 24 to C13".to_owned(), "wait 24 at rest".to_owned()],
                rounds: None,
                is_button: true,
            }),
            Input::Schedules(vec![Schedule {
                name: "Abend".to_owned(),
                lines: vec!["light 24 on".to_owned()],
                rounds: Some(2),
                is_button: false,
            }]),
            Input::EndSchedule("Abend".to_owned()),
            Input::EmergencyStop,
            Input::NoMoreLines,
            Input::Link(LinkNews::Silent),
            Input::Link(LinkNews::Answers),
            Input::Link(LinkNews::PowerLost),
            Input::Link(LinkNews::ReverseInDoubt { train }),
            Input::Link(LinkNews::OtherThrottle { train }),
            Input::Link(LinkNews::ReportedSpeed { train, number: 63 }),
            Input::Order(Order::Stop(StopOrder {
                aim: Aim::NotBeyond(Ratio::from_parts(0.001)),
                ..StopOrder::at(train, Landmark { node: NodeId(7), offset: Length::from_m(0.1 + 0.2) })
            })),
            Input::Order(Order::Speed { train, step }),
            Input::End,
        ]);
        for input in inputs {
            let (kind, text) = input.written();
            assert_eq!(Input::read(kind, &text), Ok(input));
        }
    }

    #[test]
    fn what_is_no_input_is_named() {
        let unknown = Input::read("telepathy", "").unwrap_err().to_string();
        assert!(
            unknown.contains("`telepathy`, which this version of the program does not know"),
            "{unknown}"
        );
        assert!(matches!(Input::read("event", "{\"time\":1"), Err(InputError::Wrong { .. })));
    }
}
