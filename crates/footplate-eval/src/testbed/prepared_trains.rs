//! Several trains on one layout, each calibrated alone, and then put where a score needs them.

use std::collections::BTreeMap;

use anyhow::Context;
use footplate_core::control::{Driver, Machine};
use footplate_core::model::{MotionFit, MotionModel};
use footplate_core::track::{Layout, Leg, Position, TurnoutStates};
use footplate_core::tracking::PathPoint;
use footplate_core::{Approach, Length, NodeId, SpeedStep, TimeSpan, Timestamp, TrainId};
use footplate_sim::Incident;
use footplate_sim::living::{End, LivingLayout, LivingSwitches, VirtualStation};

use super::{VirtualLine, calibrate};

/// The standard deviation of a position that an operator reads off: the end of the shoe beside a sensor, whose own
/// place is known to 5 mm.
const READ_OFF_BY_HAND: Length = Length::from_mm(12.0);
/// The time in which repeated commands to lifted trains end.
const REPEATS_END: TimeSpan = TimeSpan::from_s(12.0);

/// A world with calibrated trains.
#[derive(Clone)]
pub struct PreparedTrains<'l> {
    layout: &'l Layout,
    /// The link to the station.
    pub line: VirtualLine<'l>,
    /// The calibrated models.
    pub models: BTreeMap<TrainId, MotionModel>,
    /// The fits that the models are of.
    pub fits: BTreeMap<TrainId, MotionFit>,
    /// The turnout positions: all straight at first.
    pub turnouts: TurnoutStates,
    /// Where trains were put.
    places: BTreeMap<TrainId, PathPoint>,
}

/// How the trouble of a train begins that touched another, derailed or ran off the track.
pub(crate) const GRIEF: &str = "came to grief";

/// What happened, one sentence each.
pub(crate) fn in_words(incidents: &[Incident]) -> Vec<String> {
    incidents.iter().map(ToString::to_string).collect()
}

impl<'l> PreparedTrains<'l> {
    /// What happened since there were this many incidents, if trains came to grief.
    pub(crate) fn grief_since(&self, incidents: usize) -> Option<String> {
        let said = self.incidents_since(incidents);
        (!said.is_empty()).then(|| format!("{GRIEF}: {}", said.join("; ")))
    }

    /// The incidents since there were this many, in words.
    pub(crate) fn incidents_since(&self, incidents: usize) -> Vec<String> {
        in_words(self.world().incidents().get(incidents..).unwrap_or_default())
    }

    /// Draws trains and track from the seed, calibrates each train while the others are off the layout, lifts them all,
    /// and sets all turnouts straight. A calibration with a fault is repeated from another place.
    ///
    /// # Errors
    /// The layout has no room for a train.
    pub fn prepare(
        layout: &'l Layout,
        seed: u64,
        trains: &[TrainId],
        switches: &LivingSwitches,
        budget: TimeSpan,
    ) -> anyhow::Result<Self> {
        Self::prepare_on(layout, layout, seed, trains, switches, budget)
    }

    /// The same, with trains calibrated on the layout `assumed`, whose lengths may differ from the true ones.
    ///
    /// # Errors
    /// The layout has no room for a train.
    pub fn prepare_on(
        layout: &'l Layout,
        assumed: &Layout,
        seed: u64,
        trains: &[TrainId],
        switches: &LivingSwitches,
        budget: TimeSpan,
    ) -> anyhow::Result<Self> {
        let mut station = VirtualStation::draw(layout, seed, trains, switches)?;
        let starts_at: Vec<Option<(Position, End)>> = trains
            .iter()
            .map(|train| {
                let truth = station.world.truth().train(*train)?;
                Some((truth.position?, truth.leads))
            })
            .collect();
        trains.iter().for_each(|train| station.world.lift(*train));
        let mut line = VirtualLine::open(station)?;
        let (mut models, mut fits) = (BTreeMap::new(), BTreeMap::new());
        for (nth, train) in trains.iter().enumerate() {
            // The route ahead of a train is unknown at first. If it runs off the track, it starts again from another
            // train's place.
            let starts = starts_at.iter().cycle().skip(nth).take(trains.len()).flatten();
            let mut calibrated = None;
            for (position, leads) in starts {
                let faults = line.station.world.incidents().len();
                line.station.world.place(*train, *position, *leads)?;
                calibrated = Some(calibrate(assumed, &mut line, *train, budget));
                line.station.world.lift(*train);
                if line.station.world.incidents().len() == faults {
                    break;
                }
            }
            let calibrated = calibrated.with_context(|| format!("there is no room for train {train}"))?;
            models.insert(*train, calibrated.model);
            fits.insert(*train, calibrated.fit);
        }
        let mut turnouts = TurnoutStates::unknown();
        for (turnout, _) in layout.turnouts() {
            line.station.world.lay(turnout, Leg::Straight);
            turnouts.set(turnout, Leg::Straight);
        }
        let mut prepared = Self { layout, line, models, fits, turnouts, places: BTreeMap::new() };
        prepared.drain_commands();
        Ok(prepared)
    }

    /// Waits until commands in transit have reached the decoders of lifted trains.
    fn drain_commands(&mut self) {
        let until = self.line.now() + REPEATS_END;
        while self.line.drive(&mut Idle, until).is_some() {}
    }

    /// The world, with the truth.
    pub fn world(&self) -> &LivingLayout<'l> {
        &self.line.station.world
    }

    /// Puts a train down with the leading end of its shoe past the sensor at a node, nose first, in the node's
    /// direction.
    ///
    /// # Errors
    /// There is no room.
    pub fn put(&mut self, train: TrainId, node: NodeId, offset: Length) -> anyhow::Result<()> {
        let at = footplate_core::track::Landmark { node, offset };
        let position = self.layout.locate(at, &self.turnouts)?;
        self.line.station.world.place(train, position, End::Nose)?;
        self.places.insert(train, PathPoint { node, distance: offset });
        Ok(())
    }

    /// The step of a train whose speed is nearest to one in mm/s; 0 for an unknown train.
    pub fn nearest_step(&self, train: TrainId, mm_per_s: f64) -> SpeedStep {
        self.models.get(&train).map_or(SpeedStep::STAND, |model| nearest_step(model, steps(model), mm_per_s))
    }

    /// A driver that knows the trains and their places.
    pub fn driver(&self) -> Driver {
        self.driver_on(self.layout)
    }

    /// The same, on a layout whose lengths may differ.
    pub fn driver_on(&self, layout: &Layout) -> Driver {
        let mut driver = Driver::new(layout.clone(), self.turnouts.clone());
        for (train, at) in &self.places {
            if let Some(model) = self.models.get(train) {
                driver.add_train(model.clone());
                driver.place(self.line.now(), *train, *at, READ_OFF_BY_HAND);
            }
        }
        driver
    }
}

/// All steps of a train except 0.
pub(crate) fn steps(model: &MotionModel) -> impl Iterator<Item = SpeedStep> + use<> {
    (1..=model.highest().get()).filter_map(SpeedStep::new)
}

/// The estimated speed of a step, reached from below, in mm/s.
pub(crate) fn speed(model: &MotionModel, step: SpeedStep) -> f64 {
    model.speed(step, Approach::Below).value.as_mm_per_s()
}

/// The one of several steps whose speed is nearest to one in mm/s.
pub(crate) fn nearest_step(
    model: &MotionModel,
    steps: impl Iterator<Item = SpeedStep>,
    mm_per_s: f64,
) -> SpeedStep {
    let off = |step: &SpeedStep| (speed(model, *step) - mm_per_s).abs();
    steps.min_by(|one, other| off(one).total_cmp(&off(other))).unwrap_or(SpeedStep::STAND)
}

/// A machine that sends no commands.
struct Idle;

impl Machine for Idle {
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
    fn an_incident_says_when_and_to_which_train_it_happened() {
        let kind = footplate_sim::IncidentKind::Overrun;
        let incident = Incident { at: Timestamp::from_s(12.5), train: Some(TrainId(24)), kind };
        assert_eq!(in_words(&[incident]), ["12.5 s: train 24 ran past the end of its track"]);
    }

    #[test]
    fn trains_are_located_at_rest_where_they_were_put() {
        let layout = layout_named("track-a").expect("built in").layout;
        let trains = [TrainId(24), TrainId(58)];
        let budget = TimeSpan::from_s(60.0);
        let switches = LivingSwitches::well_kept();
        let mut prepared =
            PreparedTrains::prepare(&layout, 3, &trains, &switches, budget).expect("two trains");
        for (train, sensor) in trains.into_iter().zip(["C13", "D5"]) {
            let node = layout.node_named(sensor).expect("a sensor of track A");
            prepared.put(train, node, Length::from_mm(30.0)).expect("room");
            let driver = prepared.driver();
            let located = driver.locate(train, prepared.line.now()).expect("placed");
            assert_eq!(located.at.node, node);
            let sensor = layout.sensor_at(node).expect("a sensor");
            let past = prepared.world().truth().past(train, sensor).expect("near");
            assert!((past - located.at.distance).abs() < Length::from_mm(15.0), "{past:?}");
            assert!(driver.is_at_rest(train, prepared.line.now()));
        }
    }
}
