//! Several trains on one layout, each calibrated alone, and put where a scorer wants them.

use std::collections::BTreeMap;

use anyhow::Context;
use footplate_core::control::{Driver, Machine};
use footplate_core::model::MotionModel;
use footplate_core::track::{Layout, Leg, Position, TurnoutStates};
use footplate_core::tracking::WayPoint;
use footplate_core::{Length, NodeId, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_sim::living::{End, LivingLayout, LivingSwitches, VirtualStation};

use super::{VirtualLine, calibrate};

/// How well a person sees where the end of a shoe is, beside a contact whose own place is known to 5 mm.
const HAND: Length = Length::from_mm(12.0);
/// What a lifted train was told it may still be told once more; then the line is quiet.
const QUIET: TimeSpan = TimeSpan::from_s(12.0);

/// A world with trains that are known, as well as a calibration within a budget gets to know them.
#[derive(Clone)]
pub struct Rehearsal<'l> {
    layout: &'l Layout,
    /// The line to the station.
    pub line: VirtualLine<'l>,
    /// What calibration found.
    pub models: BTreeMap<TrainId, MotionModel>,
    /// How the turnouts lie: all straight in the beginning, and known to.
    pub turnouts: TurnoutStates,
    /// Where trains were put.
    places: BTreeMap<TrainId, WayPoint>,
}

impl<'l> Rehearsal<'l> {
    /// Draws trains and rails from the seed, calibrates each train while the others are lifted, and lifts them all. A train
    /// that comes to grief is put elsewhere and calibrated again. A hand lays all turnouts straight then.
    ///
    /// # Errors
    /// When no train can run round on the layout.
    pub fn prepare(
        layout: &'l Layout,
        seed: u64,
        trains: &[TrainId],
        switches: &LivingSwitches,
        budget: TimeSpan,
    ) -> anyhow::Result<Self> {
        Self::prepare_believing(layout, layout, seed, trains, switches, budget)
    }

    /// The same with trains calibrated on what people believe the layout to be: its lengths may be others.
    ///
    /// # Errors
    /// When no train can run round on the layout.
    pub fn prepare_believing(
        layout: &'l Layout,
        believed: &Layout,
        seed: u64,
        trains: &[TrainId],
        switches: &LivingSwitches,
        budget: TimeSpan,
    ) -> anyhow::Result<Self> {
        let mut station = VirtualStation::draw(layout, seed, trains, switches)?;
        let stood: Vec<Option<(Position, End)>> = trains
            .iter()
            .map(|train| {
                let truth = station.world().truth().train(*train)?;
                Some((truth.position?, truth.leads))
            })
            .collect();
        trains.iter().for_each(|train| station.world_mut().lift(*train));
        let mut line = VirtualLine::open(station)?;
        let mut models = BTreeMap::new();
        for (nth, train) in trains.iter().enumerate() {
            // Nobody knows at first where it runs to. Whoever saw it run off the rails puts it where another began.
            let begins = stood.iter().cycle().skip(nth).take(trains.len()).flatten();
            let mut model = None;
            for (position, leads) in begins {
                let mishaps = line.station.world().mishaps().len();
                line.station.world_mut().place(*train, *position, *leads)?;
                model = Some(calibrate(believed, &mut line, *train, budget).model);
                line.station.world_mut().lift(*train);
                if line.station.world().mishaps().len() == mishaps {
                    break;
                }
            }
            models.insert(*train, model.with_context(|| format!("there is no room for train {train}"))?);
        }
        let mut turnouts = TurnoutStates::unknown();
        for (turnout, _) in layout.turnouts() {
            line.station.world_mut().lay(turnout, Leg::Straight);
            turnouts.set(turnout, Leg::Straight);
        }
        let mut rehearsal = Self { layout, line, models, turnouts, places: BTreeMap::new() };
        rehearsal.quieten();
        Ok(rehearsal)
    }

    /// Lets commands that are still on their way reach decoders that are in somebody's hand.
    fn quieten(&mut self) {
        let until = self.line.now() + QUIET;
        while self.line.drive(&mut Silent, until).is_some() {}
    }

    /// The world, for scorers.
    pub fn world(&self) -> &LivingLayout<'l> {
        self.line.station.world()
    }

    /// Puts a train down with the leading end of its shoe past the contact at a node, its nose in front, running in the
    /// node's direction.
    ///
    /// # Errors
    /// When there is no room there.
    pub fn put(&mut self, train: TrainId, node: NodeId, offset: Length) -> anyhow::Result<()> {
        let at = footplate_core::track::Landmark { node, offset };
        let position = self.layout.locate(at, &self.turnouts)?;
        self.line.station.world_mut().place(train, position, End::Nose)?;
        self.places.insert(train, WayPoint { node, way: offset });
        Ok(())
    }

    /// A driver that knows the trains that were put down, and where.
    pub fn driver(&self) -> Driver {
        self.driver_on(self.layout)
    }

    /// The same with another idea of the layout.
    pub fn driver_on(&self, layout: &Layout) -> Driver {
        let mut driver = Driver::new(layout.clone(), self.turnouts.clone());
        for (train, at) in &self.places {
            if let Some(model) = self.models.get(train) {
                driver.add_train(model.clone());
                driver.place(self.line.now(), *train, *at, HAND);
            }
        }
        driver
    }
}

/// A machine that wants nothing.
struct Silent;

impl Machine for Silent {
    type Notice = SpeedStep;

    fn handle_event(&mut self, _: Timestamp, _: &footplate_core::Event) {}
    fn handle_timeout(&mut self, _: Timestamp) {}
    fn poll_output(&mut self) -> Option<footplate_core::control::Output<SpeedStep>> {
        None
    }
    fn next_timeout(&self) -> Option<Timestamp> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use footplate_store::layout_named;

    #[test]
    fn trains_are_known_and_stand_where_they_were_put() {
        let layout = layout_named("track-a").expect("built in").layout;
        let trains = [TrainId(24), TrainId(58)];
        let budget = TimeSpan::from_s(60.0);
        let switches = LivingSwitches::well_kept();
        let mut rehearsal = Rehearsal::prepare(&layout, 3, &trains, &switches, budget).expect("two trains");
        for (train, contact) in trains.into_iter().zip(["C13", "D5"]) {
            let node = layout.node_named(contact).expect("a contact of track A");
            rehearsal.put(train, node, Length::from_mm(60.0)).expect("room");
            let driver = rehearsal.driver();
            let located = driver.locate(train, rehearsal.line.now()).expect("placed");
            assert_eq!(located.at.node, node);
            let sensor = layout.sensor_at(node).expect("a contact");
            let past = rehearsal.world().truth().felt_past(train, sensor).expect("near");
            assert!((past - located.at.way).abs() < Length::from_mm(30.0), "{past:?}");
            assert!(driver.is_at_rest(train, rehearsal.line.now()));
        }
    }
}
