//! What Footplate's own operations cost, and what public crates that do the same cost beside them.
//!
//! - [`Operation`] is one thing to time: a body that does it so many times, with input that varies.
//! - [`profiles`] lists the operations on motion profiles, [`odometry`] those on tachometer counts, [`replays`] those
//!   on recordings, [`living`] those on simulated layouts. Another subject is another such list, a file in
//!   `benches/` that runs it, and a line in [`everything`].
//! - [`contest`] runs the operations of one group in turns and prints what each takes, as a ratio to the first.
//! - The program `once` does one operation so many times and nothing else, for an instruction counter:
//!   `crates/footplate-bench/instructions.sh` prints instructions per operation.

pub mod contest;
pub mod living;
pub mod odometry;
pub mod operation;
pub mod profiles;
pub mod replays;

pub use operation::Operation;

/// Every operation there is.
pub fn everything() -> Vec<Operation> {
    [profiles::operations(), odometry::operations(), replays::operations(), living::operations()]
        .into_iter()
        .flatten()
        .collect()
}
