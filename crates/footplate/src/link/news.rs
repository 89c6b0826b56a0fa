//! What a watchdog wants to know of all that is heard of a line.

use footplate_core::control::LinkNews;
use footplate_wire::LinkNotice;

/// Whether the station has fallen silent or answers again, and which train may face either way; most of what is heard says
/// nothing of the kind.
pub(crate) const fn news_of(notice: &LinkNotice) -> Option<LinkNews> {
    match notice {
        // After a reset, too, it is not known what of the last commands was heard; it answers when it has been asked everything.
        LinkNotice::Silent { .. } | LinkNotice::NotReady { .. } | LinkNotice::Restarted => {
            Some(LinkNews::Silent)
        }
        LinkNotice::Answers => Some(LinkNews::Answers),
        LinkNotice::ReverseInDoubt { train } | LinkNotice::OtherThrottle { train, reversed: true } => {
            Some(LinkNews::ReverseInDoubt { train: *train })
        }
        _ => None,
    }
}
