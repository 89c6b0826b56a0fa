//! How the driving half of a turn begins, as it is kept: all that its driver is made of.

use footplate_core::control::Driver;
use footplate_core::model::MotionModel;
use footplate_core::track::{Layout, Leg};
use footplate_core::tracking::Locator;
use footplate_core::{Timestamp, TurnoutId};
use serde::{Deserialize, Serialize};

use super::calibrating::Calibrated;
use crate::commands::written_layout::WrittenLayout;
use crate::recorded::{Input, Listener};

/// All that the driver of a train is made of that has just been calibrated.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct TourBeginning {
    /// The text of the layout.
    pub(crate) layout: String,
    turnouts: Vec<(TurnoutId, Leg)>,
    model: MotionModel,
    /// Where the train is.
    locator: Locator,
}

impl TourBeginning {
    /// The name of such a machine in a store.
    pub(crate) const KIND: &'static str = "tour";

    pub(super) fn new(on: &WrittenLayout, known: &Calibrated) -> Self {
        Self {
            layout: on.text.clone(),
            turnouts: on.legs(&known.turnouts),
            model: known.fit.model().clone(),
            locator: known.locator.clone(),
        }
    }

    /// The driver that begins so, on the layout that the text says.
    pub(crate) fn driver(self, layout: &Layout) -> Driver {
        let mut driver = Driver::new(layout.clone(), self.turnouts.into_iter().collect());
        driver.add_located(self.model, self.locator);
        driver
    }
}

impl Listener for Driver {
    fn handle_word(&mut self, now: Timestamp, word: &Input) {
        if let Input::Order(order) = word {
            // What it refuses, it refuses again.
            let _ = self.order(now, *order);
        }
    }
}
