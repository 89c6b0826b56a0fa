//! What a session reports of blocks: the entry at which a train came in, instead of the detector.

use alloc::vec::Vec;

use footplate_core::SensorId;
use footplate_core::track::{Layout, Occupancy};

use crate::session::{LinkNotice, Session, Transmit};

/// Between a session, which knows numbers, and a machine, which knows places. Without blocks everything passes unchanged.
#[derive(Debug, Clone)]
pub struct BlockReports {
    layout: Layout,
    occupancy: Occupancy,
}

impl BlockReports {
    /// For a session over an open line; `None` for a layout without blocks.
    pub fn of(layout: &Layout, session: &mut dyn Session) -> Option<Self> {
        let detectors: Vec<SensorId> = layout.blocks().iter().map(|block| block.detector).collect();
        if detectors.is_empty() {
            return None;
        }
        session.report_releases(&detectors);
        Some(Self { layout: layout.clone(), occupancy: Occupancy::new(layout) })
    }

    /// An output of the session as the machine knows it; `None` if it says nothing new.
    pub fn take(&mut self, output: Transmit) -> Option<Transmit> {
        match output {
            Transmit::Event(event) => self.occupancy.take(&self.layout, event).map(Transmit::Event),
            // A train stands in this block: nothing that a person should look at.
            Transmit::Notice(LinkNotice::HeldClosed { sensor })
                if self.occupancy.occupied_from_start(&self.layout, sensor) =>
            {
                None
            }
            other => Some(other),
        }
    }

    /// Every block by its detector, and whether it is occupied, as those are in which a train stood from the start.
    pub fn states(&self) -> impl Iterator<Item = (SensorId, bool)> {
        self.occupancy.states(&self.layout)
    }

    /// The number by which the station knows a sensor.
    #[must_use]
    pub fn input(&self, sensor: SensorId) -> SensorId {
        self.layout.input(sensor)
    }
}
