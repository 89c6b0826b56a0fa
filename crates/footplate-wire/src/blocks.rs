//! What a session reports of blocks: the entry at which a train came in, instead of the detector.
//!
//! A sensor that reports both directions under one number passes unchanged: only who knows the trains can tell the direction.

use alloc::vec::Vec;

use footplate_core::track::{Layout, Occupancy};
use footplate_core::{Event, EventKind, SensorId};

use crate::session::{LinkNotice, Session, Transmit};

/// Between a session, which knows numbers, and a machine, which knows places. Without blocks every report passes unchanged.
#[derive(Debug, Clone)]
pub struct BlockReports {
    layout: Layout,
    occupancy: Occupancy,
}

impl BlockReports {
    /// For a session over an open line; `None` for a layout whose sensors all report the direction.
    pub fn of(layout: &Layout, session: &mut dyn Session) -> Option<Self> {
        if !layout.has_open_reports() {
            return None;
        }
        let detectors: Vec<SensorId> = layout.blocks().iter().map(|block| block.detector).collect();
        if !detectors.is_empty() {
            session.report_releases(&detectors);
        }
        Some(Self { layout: layout.clone(), occupancy: Occupancy::new(layout) })
    }

    /// An output of the session as the machine knows it; `None` if it says nothing new.
    pub fn take(&mut self, output: Transmit) -> Option<Transmit> {
        match output {
            // An input that the layout does not name, and whose number stands for a place inside.
            Transmit::Event(Event { kind: EventKind::Sensor(report), .. })
                if self.layout.is_never_reported(report.sensor) =>
            {
                None
            }
            Transmit::Event(event) => self.occupancy.take(&self.layout, event).map(Transmit::Event),
            // A train stands in this block: nothing that a person should look at.
            Transmit::Notice(LinkNotice::HeldClosed(sensor))
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
    pub fn input(&self, sensor: SensorId) -> SensorId {
        self.layout.input(sensor)
    }
}

#[cfg(test)]
mod tests {
    use alloc::format;
    use alloc::vec;

    use footplate_core::track::{LayoutPlan, Place, RailEnd, Stretch, Survey};
    use footplate_core::{Length, Report, Timestamp};

    use super::*;
    use crate::marklin_serial::{Interface, Settings};

    /// A circuit of three sensors with these numbers.
    fn circuit(numbers: [u16; 3]) -> Layout {
        let name = |nth: usize, back: &str| format!("S{}{back}", nth % 3);
        let end = |node| RailEnd { node, leg: None };
        let stretch = |nth| Stretch {
            from: end(name(nth, "")),
            to: end(name(nth + 1, "")),
            length: Length::from_mm(800.0).into(),
        };
        let sensor = |nth: usize| Place::UndirectedSensor {
            names: [name(nth, ""), name(nth, "back")],
            sensor: SensorId(numbers[nth]),
        };
        let plan = LayoutPlan {
            name: "circuit".into(),
            survey: Survey::taped(Length::from_mm(2.0), "made up".into()),
            places: (0..3).map(sensor).collect(),
            stretches: (0..3).map(stretch).collect(),
            never_both_curved: vec![],
            zones: vec![],
            blocks: vec![],
        };
        Layout::build(&plan).unwrap()
    }

    #[test]
    fn an_input_that_the_layout_does_not_name_is_no_direction_of_another_sensor() {
        let layout = circuit([4, 5, 6]);
        let mut interface = Interface::new(Timestamp::ZERO, Settings::with_cts(1)).unwrap();
        let mut reports = BlockReports::of(&layout, &mut interface).unwrap();
        let report = |number| {
            let report = Report { sensor: SensorId(number), poll_interval: None };
            Transmit::Event(Event { time: Timestamp::ZERO, kind: EventKind::Sensor(report) })
        };
        assert_eq!(reports.take(report(5)), Some(report(5)), "the driver finds the direction");
        // Inside, 8 is the second direction of 5; at the station it is a push button.
        let back = layout.sensor_named("S1back").unwrap();
        assert_eq!((back, reports.input(back)), (SensorId(8), SensorId(5)));
        assert_eq!(reports.take(report(8)), None);
        assert_eq!(reports.take(report(3)), Some(report(3)), "of no place");
    }
}
