//! A small layout with a circuit: an oval with six sensors and a passing loop on one side.

use footplate_core::track::{Layout, LayoutPlan, Leg, Place, RailEnd, Stretch, Survey, TurnoutStates};
use footplate_core::{Length, SensorId, SpeedStep, TimeSpan, Timestamp, TrainId, TurnoutId};
use footplate_sim::{
    Circuit, Conditions, Faults, Link, Railway, Script, SimulatedRun, Train, TrueTrack, World,
};

/// The layout.
pub(crate) fn oval() -> Layout {
    let sensor = |number: u16| Place::Sensor {
        names: [format!("S{number}"), format!("R{number}")],
        sensors: [SensorId(2 * number), SensorId(2 * number + 1)],
    };
    let turnout = |number: u16, facing: &str, trailing: &str| Place::Turnout {
        names: [facing.to_owned(), trailing.to_owned()],
        turnout: TurnoutId(number),
    };
    let end = |node: &str, leg| RailEnd { node: node.to_owned(), leg };
    let plain = |from: &str, to: &str, mm: f64| Stretch {
        from: end(from, None),
        to: end(to, None),
        length: Length::from_mm(mm).into(),
    };
    let (straight, curved) = (Some(Leg::Straight), Some(Leg::Curved));
    let places = (0..6).map(sensor).chain([turnout(1, "B1", "M1"), turnout(2, "B2", "M2")]).collect();
    let stretches = vec![
        plain("S0", "B1", 180.0),
        Stretch { from: end("B1", straight), to: end("S1", None), length: Length::from_mm(400.0).into() },
        Stretch { from: end("S1", None), to: end("M2", straight), length: Length::from_mm(380.0).into() },
        Stretch { from: end("B1", curved), to: end("S2", None), length: Length::from_mm(430.0).into() },
        Stretch { from: end("S2", None), to: end("M2", curved), length: Length::from_mm(410.0).into() },
        plain("M2", "S3", 210.0),
        plain("S3", "S4", 785.0),
        plain("S4", "S5", 640.0),
        plain("S5", "S0", 875.0),
    ];
    Layout::build(&LayoutPlan {
        name: "oval".to_owned(),
        survey: Survey::taped(Length::from_mm(10.0), "chosen".to_owned()),
        places,
        stretches,
        never_both_curved: Vec::new(),
        zones: Vec::new(),
        blocks: Vec::new(),
    })
    .unwrap()
}

/// A train on the oval, with the settings of a world that a test may change.
pub(crate) struct Yard<'l> {
    pub(crate) railway: Railway<'l>,
    pub(crate) link: Link,
    pub(crate) faults: Faults,
    pub(crate) train: Train,
}

impl<'l> Yard<'l> {
    /// The circuit over the straight track of the passing loop, without faults, on rails drawn from a seed.
    pub(crate) fn new(layout: &'l Layout, train: Train, seed: u64) -> Self {
        let start = layout.node_named("S0").unwrap();
        let circuit = Circuit::from_turnouts(layout, start, &TurnoutStates::unknown()).unwrap();
        let railway = Railway { layout, track: TrueTrack::draw(layout, seed), circuit };
        Self { railway, link: Link::every_report(), faults: Faults::default(), train }
    }

    /// One run of a train that is half warm.
    pub(crate) fn run(&self, script: &Script, seed: u64) -> SimulatedRun {
        let Self { railway, link, faults, train } = self;
        let world = World { railway, link, faults, train_id: TrainId(24), train };
        world.run(script, Conditions { clock: Timestamp::ZERO, warmth: 0.5 }, seed).0
    }
}

pub(crate) fn step(number: u8) -> SpeedStep {
    SpeedStep::new(number).unwrap()
}

pub(crate) const fn seconds(whole: i64) -> TimeSpan {
    TimeSpan::from_ms(1000 * whole)
}
