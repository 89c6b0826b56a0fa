//! What a watchdog wants to know of all that is heard of a line.

use footplate_core::control::LinkNews;

use crate::session::LinkNotice;

impl LinkNotice {
    /// Whether the station has fallen silent or answers again, whether the power was lost, or which train may face in either direction; most of
    /// what is heard says nothing of the kind.
    pub const fn news(&self) -> Option<LinkNews> {
        match self {
            // After a reset, too, it is not known what of the last commands was heard; it answers when it has been asked everything.
            Self::Silent { .. }
            | Self::Garbled
            | Self::NotReady { .. }
            | Self::Restarted
            | Self::Reopened => Some(LinkNews::Silent),
            Self::Answers => Some(LinkNews::Answers),
            Self::PowerLost => Some(LinkNews::PowerLost),
            Self::ReverseInDoubt(train)
            | Self::DirectionContradicted(train)
            | Self::OtherThrottle { train, reversed: true } => {
                Some(LinkNews::ReverseInDoubt { train: *train })
            }
            Self::OtherThrottle { train, reversed: false } => Some(LinkNews::OtherThrottle { train: *train }),
            _ => None,
        }
    }
}
