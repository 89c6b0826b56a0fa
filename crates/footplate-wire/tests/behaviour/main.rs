//! What the codecs promise: the meaning of recorded bytes, round trips, and no panic on any input.
#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "a test may stop at the first surprise"
)]

mod confirmations;
mod dcc_ex_desk;
mod dcc_ex_round_trip;
mod dcc_ex_session;
mod dcc_ex_turnouts;
mod dcc_ex_vectors;
mod desk;
mod directions;
mod emergency_stops;
mod floods;
mod jmri_codec;
mod jmri_session;
mod loconet_codec;
mod loconet_session;
mod marklin_can_roster;
mod marklin_can_round_trip;
mod marklin_can_session;
mod marklin_can_vectors;
mod marklin_serial_bench;
mod marklin_serial_faults;
mod marklin_serial_line;
mod marklin_serial_recovery;
mod marklin_serial_round_trip;
mod marklin_serial_transcript;
mod marklin_serial_vectors;
mod withrottle;
mod z21_desk;
mod z21_round_trip;
mod z21_session;
mod z21_vectors;
