//! Several trains, sent to random places one after the other, and what comes of it by the truth.

mod page;
mod session;

pub use self::page::Page;
pub use self::session::{Asked, Session, Tally};
