//! What a watchdog wants to know of all that is heard of a line.

use footplate_core::control::LinkNews;
use footplate_wire::LinkNotice;

/// Whether the station has fallen silent or answers again; most of what is heard says neither.
pub(crate) const fn news_of(notice: &LinkNotice) -> Option<LinkNews> {
    match notice {
        LinkNotice::Silent { .. } | LinkNotice::NotReady { .. } => Some(LinkNews::Silent),
        LinkNotice::Answers => Some(LinkNews::Answers),
        _ => None,
    }
}
