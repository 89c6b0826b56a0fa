//! A small layout for the tests of this folder: an oval with a passing siding, and a track apart from it.
//!
//! ```text
//!          +-- 200 -- B1 -- 200 --+
//! A1 -100- 1                      2 -100- D1 --- 500 --- A1        EN1 -30- E1 -40- EX2
//!          +-- 220 -- C1 -- 150 --+
//! ```

use alloc::format;
use alloc::string::String;
use alloc::vec;

use crate::ids::{SensorId, TurnoutId};
use crate::track::{Layout, LayoutPlan, Leg, Place, PlannedBlock, RailEnd, Stretch, Survey};
use crate::units::Length;

pub(crate) fn oval() -> Layout {
    Layout::build(&oval_plan()).unwrap()
}

pub(crate) fn oval_plan() -> LayoutPlan {
    let sensor = |name: &str, number| Place::Sensor {
        names: [format!("{name}1"), format!("{name}2")],
        sensors: [SensorId(number), SensorId(number + 1)],
    };
    LayoutPlan {
        name: "oval".into(),
        survey: Survey::taped(Length::from_mm(2.0), "made up".into()),
        places: vec![
            sensor("A", 0),
            sensor("B", 2),
            sensor("C", 4),
            sensor("D", 6),
            turnout(1),
            turnout(2),
            sensor("E", 8),
            end(1),
            end(2),
        ],
        stretches: vec![
            stretch("A1", "BR1", 100.0),
            stretch("BR1 straight", "B1", 200.0),
            stretch("BR1 curved", "C1", 220.0),
            stretch("B1", "MR2 straight", 200.0),
            stretch("C1", "MR2 curved", 150.0),
            stretch("MR2", "D1", 100.0),
            stretch("D1", "A1", 500.0),
            stretch("EN1", "E1", 30.0),
            stretch("E1", "EX2", 40.0),
        ],
        never_both_curved: vec![],
        zones: vec![],
        blocks: vec![],
    }
}

/// The oval with sensors that do not report the direction.
pub(crate) fn undirected_oval() -> Layout {
    let mut plan = oval_plan();
    for place in &mut plan.places {
        if let Place::Sensor { names, sensors: [sensor, _] } = place {
            *place = Place::UndirectedSensor { names: names.clone(), sensor: *sensor };
        }
    }
    Layout::build(&plan).unwrap()
}

/// An oval with a turnout in its station, and a siding that joins the main line without a detector.
///
/// ```text
///              +-- 200 -- S3 ---- 800 ---- S7 -- 200 -+
/// S1 -- 300 -- 1                                      2 -- 100 -- S1
///              +-- 200 -- S5 - 300 - S9 --- 1000 -----+
/// ```
pub(crate) fn oval_of_blocks() -> Layout {
    Layout::build(&oval_of_blocks_plan()).unwrap()
}

pub(crate) fn oval_of_blocks_plan() -> LayoutPlan {
    let boundary = |first: u8, enters: [Option<&str>; 2]| Place::Boundary {
        names: [format!("S{first}"), format!("S{}", first + 1)],
        enters: enters.map(|name| name.map(Into::into)),
    };
    let block = |name: &str, number| PlannedBlock { name: name.into(), detector: SensorId(number) };
    LayoutPlan {
        name: "oval of blocks".into(),
        survey: Survey::taped(Length::from_mm(2.0), "made up".into()),
        places: vec![
            boundary(1, [Some("station"), None]),
            boundary(3, [Some("main"), Some("station")]),
            boundary(5, [Some("siding"), Some("station")]),
            boundary(7, [None, Some("main")]),
            boundary(9, [None, Some("siding")]),
            turnout(1),
            turnout(2),
        ],
        stretches: vec![
            stretch("S1", "BR1", 300.0),
            stretch("BR1 straight", "S3", 200.0),
            stretch("BR1 curved", "S5", 200.0),
            stretch("S3", "S7", 800.0),
            stretch("S7", "MR2 straight", 200.0),
            stretch("S5", "S9", 300.0),
            stretch("S9", "MR2 curved", 1_000.0),
            stretch("MR2", "S1", 100.0),
        ],
        never_both_curved: vec![],
        zones: vec![],
        blocks: vec![block("station", 1), block("main", 2), block("siding", 3)],
    }
}

pub(crate) fn turnout(number: u16) -> Place {
    Place::Turnout { names: [format!("BR{number}"), format!("MR{number}")], turnout: TurnoutId(number) }
}

pub(crate) fn end(number: u16) -> Place {
    Place::End { names: [format!("EN{number}"), format!("EX{number}")] }
}

pub(crate) fn stretch(from: &str, to: &str, mm: f64) -> Stretch {
    Stretch { from: rail_end(from), to: rail_end(to), length: Length::from_mm(mm).into() }
}

fn rail_end(text: &str) -> RailEnd {
    let (node, leg) = match text.split_once(' ') {
        Some((node, "straight")) => (node, Some(Leg::Straight)),
        Some((node, "curved")) => (node, Some(Leg::Curved)),
        _ => (text, None),
    };
    RailEnd { node: String::from(node), leg }
}
