//! The fingerprint of all that a replay follows from, run by run: what comes behind a run does not change that of the run.

use std::fmt;

use footplate_core::link::PollTiming;
use footplate_core::track::Layout;
use footplate_core::{SpeedStep, TrainId};

use crate::content_hash::ContentHash;
use crate::motion_file::MOTION_MODEL_VERSION;
use crate::recording::Run;
use crate::speed_profile::SpeedProfile;

/// What is read of stored runs. A change to what is read raises it, so that all is replayed once.
const READS: u32 = 2;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Fingerprint(ContentHash);

impl Fingerprint {
    /// Before the first run: of the formulas, the track and the train.
    ///
    /// What they are made of is written as programmers see it, which has every number to its last bit. Another compiler may
    /// write it otherwise; then all is replayed once.
    pub(super) fn of(
        layout: &Layout,
        train: TrainId,
        highest: SpeedStep,
        profile: Option<&SpeedProfile>,
    ) -> Self {
        let program = env!("CARGO_PKG_VERSION");
        let all = format!("{MOTION_MODEL_VERSION} {READS} {program} {train} {highest} {layout:?}");
        let before = Self(ContentHash::of(all.as_bytes()));
        profile.map_or(before, |profile| Self(ContentHash::of(format!("{before} {profile:?}").as_bytes())))
    }

    /// Behind one more run, whose link was polled in this rhythm.
    pub(super) fn with(self, recording: &str, run: &Run, timing: PollTiming) -> Self {
        Self(ContentHash::of(format!("{self} {recording:?} {run:?} {timing:?}").as_bytes()))
    }
}

impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
