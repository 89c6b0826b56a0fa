//! How a calibration begins, as it is kept: all that its machine is made of.

use footplate_core::control::learn::{Calibrator, CalibratorSettings};
use footplate_core::model::MotionFit;
use footplate_core::track::{Layout, Leg, TurnoutStates};
use footplate_core::{Length, StretchId, TimeSpan, TurnoutId};
use serde::{Deserialize, Serialize};

use crate::commands::written_layout::WrittenLayout;
use crate::recorded::Listener;

/// All that a [`Calibrator`] is made of. A session and its replay both make theirs of it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct CalibrationBeginning {
    /// The text of the layout.
    pub(crate) layout: String,
    turnouts: Vec<(TurnoutId, Leg)>,
    budget: TimeSpan,
    train_length: Length,
    avoid: Vec<StretchId>,
    /// Absent from sessions of older versions, which did not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    sets_turnouts: bool,
    fit: MotionFit,
    /// Whether the railway is simulated and ends with its program; absent from sessions of older versions.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    is_simulated: bool,
}

impl CalibrationBeginning {
    /// The name of such a machine in a store.
    pub(crate) const KIND: &'static str = "calibrate";

    pub(crate) fn new(
        written: &WrittenLayout,
        settings: CalibratorSettings,
        fit: MotionFit,
        turnouts: &TurnoutStates,
        is_simulated: bool,
    ) -> Self {
        let CalibratorSettings { budget, train_length, avoid, sets_turnouts } = settings;
        let turnouts = written.legs(turnouts);
        let layout = written.text.clone();
        Self { layout, turnouts, budget, train_length, avoid, sets_turnouts, fit, is_simulated }
    }

    /// The calibrator that begins so, on the layout that the text says.
    pub(crate) fn calibrator(self, layout: &Layout) -> Calibrator<'_> {
        let Self { turnouts, budget, train_length, avoid, sets_turnouts, fit, .. } = self;
        let mut calibrator =
            Calibrator::new(layout, CalibratorSettings { budget, train_length, avoid, sets_turnouts }, fit);
        calibrator.set_turnouts(turnouts.into_iter().collect());
        calibrator
    }
}

/// No person speaks to it.
impl Listener for Calibrator<'_> {}
