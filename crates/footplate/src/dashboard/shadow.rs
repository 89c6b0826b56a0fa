//! A driver that drives nothing: it shows where the train of a calibration is.

use footplate_core::control::Driver;
use footplate_core::control::learn::Calibrator;
use footplate_core::track::{Layout, TurnoutStates};

/// Follows a calibration.
#[derive(Debug)]
pub(crate) struct Shadow {
    layout: Layout,
    follows: Option<(TurnoutStates, Driver)>,
}

impl Shadow {
    pub(crate) fn new(layout: &Layout) -> Self {
        Self { layout: layout.clone(), follows: None }
    }

    pub(super) const fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Where the train of a calibration is now, as a driver would know it.
    pub(crate) fn of(&mut self, calibrator: &Calibrator<'_>) -> &Driver {
        let (turnouts, train) = (calibrator.turnouts(), calibrator.locator().train());
        // Of a train that was calibrated before nobody knows any more where it is.
        let still_follows = |(known, driver): &(TurnoutStates, Driver)| {
            known == turnouts && driver.trains().all(|other| other == train)
        };
        let follows = self.follows.take().filter(still_follows);
        let anew = || (turnouts.clone(), Driver::new(self.layout.clone(), turnouts.clone()));
        let (_, driver) = self.follows.insert(follows.unwrap_or_else(anew));
        driver.add_located(calibrator.fit().model().clone(), calibrator.locator().clone());
        driver
    }
}
