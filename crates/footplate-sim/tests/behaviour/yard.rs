//! A living layout for tests: two ovals, one inside the other, joined by a crossover, and a siding with an end.

use footplate_core::track::{Layout, LayoutPlan, Leg, Place, Position, RailEnd, Stretch, Survey};
use footplate_core::{Length, SensorId, TimeSpan, TrainId, TurnoutId};
use footplate_sim::{
    End, FromStation, LawFamily, LivingLayout, LivingSwitches, StationSwitches, Train, VirtualStation,
};

/// The train of most tests, and the other one.
pub(crate) const TRAIN: TrainId = TrainId(24);
pub(crate) const OTHER: TrainId = TrainId(58);

/// Outer loop S0 B1 S1 S2 S3 B3 S0, inner loop S4 M2 S5 S6 S7 S4; the curved leg of turnout 1 leads from the outer to
/// the inner loop, that of turnout 3 to a siding with sensor S8 that ends at X.
pub(crate) fn two_loops() -> Layout {
    let sensor = |number: u16| Place::Sensor {
        names: [format!("S{number}"), format!("R{number}")],
        sensors: [SensorId(2 * number), SensorId(2 * number + 1)],
    };
    let turnout = |number: u16| Place::Turnout {
        names: [format!("B{number}"), format!("M{number}")],
        turnout: TurnoutId(number),
    };
    let end = |node: &str, leg| RailEnd { node: node.to_owned(), leg };
    let stretch = |from: (&str, Option<Leg>), to: (&str, Option<Leg>), mm: f64| Stretch {
        from: end(from.0, from.1),
        to: end(to.0, to.1),
        length: Length::from_mm(mm).into(),
    };
    let (straight, curved) = (Some(Leg::Straight), Some(Leg::Curved));
    let places = (0..9)
        .map(sensor)
        .chain((1..=3).map(turnout))
        .chain([Place::End { names: ["E".to_owned(), "X".to_owned()] }])
        .collect();
    let stretches = vec![
        stretch(("S0", None), ("B1", None), 300.0),
        stretch(("B1", straight), ("S1", None), 400.0),
        stretch(("S1", None), ("S2", None), 900.0),
        stretch(("S2", None), ("S3", None), 800.0),
        stretch(("S3", None), ("B3", None), 500.0),
        stretch(("B3", straight), ("S0", None), 700.0),
        stretch(("B3", curved), ("S8", None), 400.0),
        stretch(("S8", None), ("X", None), 600.0),
        stretch(("S4", None), ("M2", straight), 350.0),
        stretch(("B1", curved), ("M2", curved), 300.0),
        stretch(("M2", None), ("S5", None), 400.0),
        stretch(("S5", None), ("S6", None), 800.0),
        stretch(("S6", None), ("S7", None), 700.0),
        stretch(("S7", None), ("S4", None), 800.0),
    ];
    Layout::build(&LayoutPlan {
        name: "two loops".to_owned(),
        survey: Survey::taped(Length::from_mm(10.0), "chosen".to_owned()),
        places,
        stretches,
        never_both_curved: Vec::new(),
        zones: Vec::new(),
        blocks: Vec::new(),
    })
    .unwrap()
}

/// A faultless layout with surveyed rails, all turnouts straight, without trains.
fn calm(layout: &Layout) -> LivingLayout<'_> {
    let calm = LivingSwitches { true_rails: false, stale_detections: false, ..LivingSwitches::faultless() };
    let mut world = LivingLayout::without_trains(layout, 7, &calm);
    (1..=3).for_each(|number| world.lay(TurnoutId(number), Leg::Straight));
    world
}

/// The same with one train 100 mm behind S0 that leads with an end.
pub(crate) fn one_train(layout: &Layout, leads: End) -> LivingLayout<'_> {
    let mut world = calm(layout);
    world.add(TRAIN, Train::draw(24, LawFamily::Constant), 1.0);
    let node = |name| layout.node_named(name).unwrap();
    let edge = layout.edge_between(node("S0"), node("B1")).unwrap();
    world.place(TRAIN, Position { edge, offset: Length::from_mm(100.0) }, leads).unwrap();
    world
}

/// How far that train has run, in mm.
pub(crate) fn odometer(world: &LivingLayout<'_>) -> f64 {
    world.truth().train(TRAIN).unwrap().odometer.as_mm()
}

/// A station before such a layout without trains.
pub(crate) fn empty(layout: &Layout, switches: StationSwitches) -> VirtualStation<'_> {
    VirtualStation::new(calm(layout), 7, switches)
}

/// A train with a law of its own on an edge between two nodes, so far from its beginning.
pub(crate) fn put(station: &mut VirtualStation<'_>, train: TrainId, from: &str, to: &str, mm: f64) {
    let layout = station.world.layout();
    let node = |name| layout.node_named(name).unwrap();
    let edge = layout.edge_between(node(from), node(to)).unwrap();
    station.world.add(train, Train::draw(u64::from(train.0), LawFamily::Constant), 1.0);
    let at = Position { edge, offset: Length::from_mm(mm) };
    station.world.place(train, at, End::Nose).unwrap();
}

/// Sends bytes as a program does that waits for the station, and drops what comes back.
pub(crate) fn say(station: &mut VirtualStation<'_>, bytes: &[u8]) {
    for byte in bytes {
        station.write(*byte);
        let patience = station.now() + TimeSpan::from_ms(50);
        while station.advance(patience) != Some(FromStation::Cts(true)) {
            assert!(station.now() < patience, "the station never became ready");
        }
    }
}

/// Asks and returns all bytes of the answer.
pub(crate) fn ask(station: &mut VirtualStation<'_>, request: u8, count: usize) -> Vec<u8> {
    station.write(request);
    let patience = station.now() + TimeSpan::from_ms(400);
    let mut bytes = Vec::new();
    while bytes.len() < count && station.now() < patience {
        if let Some(FromStation::Byte(byte)) = station.advance(patience) {
            bytes.push(byte);
        }
    }
    // Until it is ready again.
    let ready = station.now() + TimeSpan::from_ms(5);
    while station.advance(ready).is_some() {}
    bytes
}

/// Lets time pass.
pub(crate) fn wait(station: &mut VirtualStation<'_>, seconds: f64) {
    let until = station.now() + TimeSpan::from_s(seconds);
    while station.advance(until).is_some() {}
}
