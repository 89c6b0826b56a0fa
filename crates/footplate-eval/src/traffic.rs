//! Several trains, sent to random places one after the other, scored by the truth.

mod page;
mod session;

pub use self::page::{LONGEST_NOWHERE_S, Page};
pub use self::session::{
    Asked, HAND, LENGTHS, Session, Tally, is_on_reserved_track, place_by_hand, rest_error, set_out,
};
