//! Why a session ended, in words and as an exit status.

use std::fmt::{Display, Formatter, Result as FmtResult};

use footplate_core::control::learn::Ending;

use crate::commands::Outcome;

/// Why it ended.
#[derive(Debug)]
pub(super) enum Why {
    /// By itself.
    Ended(Ending),
    /// Somebody pressed Ctrl-C, or a signal came.
    Interrupted,
    /// The times between detections are those of another layout.
    OtherLayout { other: String },
    /// The line or the station is gone.
    Lost(String),
    /// The store could not be written.
    NotRecorded(anyhow::Error),
}

impl Why {
    /// Whether what was learnt may be kept as knowledge of the train on this layout.
    pub(super) const fn is_trusted(&self) -> bool {
        !matches!(
            self,
            Self::OtherLayout { .. }
                | Self::Ended(
                    Ending::WrongLayout { .. } | Ending::NotFound | Ending::NoDirection | Ending::NoCircuit
                )
        )
    }

    /// One word for programs.
    pub(super) const fn word(&self) -> &'static str {
        match self {
            Self::Ended(Ending::Budget) => "budget",
            Self::Ended(Ending::NothingToGain) => "nothing-to-gain",
            Self::Ended(Ending::Told) | Self::Interrupted => "interrupted",
            Self::Ended(Ending::NotFound) => "not-found",
            Self::Ended(Ending::NoDirection) => "no-direction",
            Self::Ended(Ending::NoCircuit) => "no-circuit",
            Self::Ended(Ending::TurnoutsUnset) => "turnouts-unset",
            Self::Ended(Ending::WrongLayout { .. }) | Self::OtherLayout { .. } => "wrong-layout",
            Self::Lost(_) => "link-lost",
            Self::NotRecorded(_) => "not-recorded",
        }
    }
}

impl Display for Why {
    fn fmt(&self, f: &mut Formatter<'_>) -> FmtResult {
        match self {
            Self::Ended(Ending::Budget) => f.write_str("the time budget is used up"),
            Self::Ended(Ending::NothingToGain) => f.write_str(
                "no remaining experiment is worth its \
                                                               time",
            ),
            Self::Ended(Ending::Told) | Self::Interrupted => f.write_str(
                "interrupted; the measurements \
                                                                          so far are kept",
            ),
            Self::Ended(Ending::NotFound) => f.write_str(
                "the train was not found: no sensor reported it at any step. Check that it is on the \
                 track, that the track has power and that the address is right",
            ),
            Self::Ended(Ending::NoDirection) => f.write_str(
                "the order of the sensors does not show in which direction the train runs: a circuit needs three of them, or one \
                 that reports the direction",
            ),
            Self::Ended(Ending::NoCircuit) => {
                f.write_str("no circuit can be reached from the train's position: put it on a closed loop")
            }
            Self::Ended(Ending::TurnoutsUnset) => f.write_str(
                "incomplete: the turnouts of the circuit could not be set, because the train is always too near to them: \
                 set them with `--set-turnouts`, or write more lengths into the layout",
            ),
            Self::Ended(Ending::WrongLayout { .. }) => f.write_str(
                "the sensors report in an order that is impossible on this layout: check \
                             `--layout`",
            ),
            Self::OtherLayout { other } => write!(
                f,
                "the times between sensors fit {other}: use `--layout {other}` if that is the layout"
            ),
            Self::Lost(lost) => f.write_str(lost),
            Self::NotRecorded(error) => write!(f, "{error:#}"),
        }
    }
}

/// A calibration that used its time, or needed less, is done; all else falls short.
pub(super) const fn outcome_of(why: &Why) -> Outcome {
    match why {
        Why::Ended(Ending::Budget | Ending::NothingToGain) => Outcome::Done,
        _ => Outcome::FallsShort,
    }
}
