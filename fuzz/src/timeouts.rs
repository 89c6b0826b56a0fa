//! The time-outs of a session, one after the other.

use footplate_core::Timestamp;
use footplate_wire::Session;

/// Lets the next time-out of a session come, if it is not after `end`, and returns whether it was not. Afterwards the session waits
/// for a later one, or is done.
pub(crate) fn passes_timeout(session: &mut impl Session, now: &mut Timestamp, end: Timestamp) -> bool {
    let Some(at) = session.next_timeout().filter(|at| *at <= end) else { return false };
    *now = at.max(*now);
    session.handle_timeout(*now);
    let next = session.next_timeout();
    assert!(next.is_none_or(|next| next > *now), "a session that is never done");
    true
}
