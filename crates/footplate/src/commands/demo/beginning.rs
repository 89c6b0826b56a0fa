//! The inputs of the driver in a tour, as they are recorded for a replay.

use footplate_core::control::Driver;
use footplate_core::model::MotionModel;
use footplate_core::track::{Layout, Leg};
use footplate_core::tracking::Locator;
use footplate_core::{Timestamp, TurnoutId};
use serde::{Deserialize, Serialize};

use super::calibrating::Calibrated;
use crate::commands::written_layout::WrittenLayout;
use crate::witness::{Input, Listener};

/// Everything that the driver of a calibrated train is built from.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct TourBeginning {
    /// The text of the layout file.
    pub(crate) layout: String,
    turnouts: Vec<(TurnoutId, Leg)>,
    model: MotionModel,
    /// The located train.
    locator: Locator,
}

impl TourBeginning {
    /// The kind of this machine in a store.
    pub(crate) const KIND: &'static str = "tour";

    pub(super) fn new(on: &WrittenLayout, known: &Calibrated) -> Self {
        Self {
            layout: on.text.clone(),
            turnouts: on.legs(&known.turnouts),
            model: known.fit.model().clone(),
            locator: known.locator.clone(),
        }
    }

    /// Builds the driver; `layout` is the one in the text.
    pub(crate) fn driver(self, layout: &Layout) -> Driver {
        let mut driver = Driver::new(layout.clone(), self.turnouts.into_iter().collect());
        driver.add_located(self.model, self.locator);
        driver
    }
}

impl Listener for Driver {
    fn handle_word(&mut self, now: Timestamp, word: &Input) {
        if let Input::Order(order) = word {
            // An order that was refused live is refused in a replay, too.
            let _ = self.order(now, *order);
        }
    }
}
