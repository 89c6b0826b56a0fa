//! The tracks of a panel: which place follows which, and what each block is.

use std::collections::{BTreeMap, BTreeSet};

use footplate_core::track::{LayoutPlan, Leg, Place, PlannedBlock, RailEnd, Stretch, StretchLength};
use footplate_core::{Length, SensorId, TurnoutId};
use roxmltree::Node;

use super::super::import::ImportContext;
use super::{PanelError, children, descendants, text_of};

/// The longest name of a place, less what is added to it.
const LONGEST_NAME: usize = 28;
/// `continuing`: the leg B is the one of a closed turnout, as everywhere unless somebody changed it.
pub(super) const CLOSED: &str = "2";

/// A block of the panel.
#[derive(Debug, Clone, Default)]
struct PanelBlock {
    /// The number of its detector.
    detector: Option<SensorId>,
    length_mm: f64,
}

/// A connection of a place: how rails leave the place through it, and how they arrive.
#[derive(Debug, Clone)]
pub(super) struct Port {
    leaving: RailEnd,
    arriving: RailEnd,
}

impl Port {
    pub(super) fn of(leaving: &str, arriving: &str, leg: Option<Leg>) -> Self {
        let end = |node: &str| RailEnd { node: node.to_owned(), leg };
        Self { leaving: end(leaving), arriving: end(arriving) }
    }
}

/// The tracks of a panel while they are read.
pub(super) struct Tracks<'a, 'i> {
    blocks: BTreeMap<String, PanelBlock>,
    /// System names of turnouts, by the names that a user gave them.
    turnout_names: BTreeMap<String, String>,
    pub(super) editor: Node<'a, 'i>,
    segments: BTreeMap<&'a str, Node<'a, 'i>>,
    /// The places, and where they are drawn, by the name of their first node.
    pub(super) places: Vec<Place>,
    pub(super) drawn: Vec<(String, [f64; 2])>,
    /// The connections of places: by the object and which of its connections.
    ports: BTreeMap<(String, String), Port>,
    /// Anchors and tracks of level crossings that are no places, and the segments that they join.
    joined: BTreeMap<String, [String; 2]>,
    /// Edges, each with the blocks that it runs through.
    pub(super) stretches: Vec<(Stretch, BTreeSet<String>)>,
    /// What is joined on each edge, in order, by the number of the edge.
    pub(super) passed: BTreeMap<usize, Vec<String>>,
    /// Edges without length, between the turnouts of a slip.
    pub(super) in_one_place: BTreeSet<usize>,
    /// Blocks that turnouts lie in.
    pub(super) with_turnouts: BTreeSet<String>,
    pub(super) left_out: Vec<String>,
}

impl<'a, 'i> Tracks<'a, 'i> {
    pub(super) fn new(root: Node<'a, 'i>, editor: Node<'a, 'i>) -> Self {
        let mut left_out = Vec::new();
        let sensors = system_names(root, "sensors", "sensor");
        let mut blocks: BTreeMap<String, PanelBlock> = BTreeMap::new();
        let own =
            descendants(root, "blocks", "block").chain(descendants(root, "layoutblocks", "layoutblock"));
        for block in own {
            let Some(name) = text_of(block, "userName").or_else(|| block.attribute("systemName")) else {
                continue;
            };
            let sensor = text_of(block, "occupancysensor").or_else(|| block.attribute("occupancysensor"));
            let number =
                sensor.map(|sensor| sensors.get(sensor).map_or(sensor, String::as_str)).map(number_of);
            let known = blocks.entry(name.to_owned()).or_default();
            match number {
                // The first input of a station is 1, and Footplate counts from 0.
                Some(Some(number)) if number > 0 => known.detector = Some(SensorId(number - 1)),
                Some(_) => left_out.push(format!(
                    "the detector of block `{name}`: its sensor `{}` does not end with a number from 1 on",
                    sensor.unwrap_or_default()
                )),
                None => {}
            }
            if let Some(length) = block.attribute("length").and_then(|length| length.parse::<f64>().ok()) {
                known.length_mm = length;
            }
        }
        let segments = children(editor, "tracksegment");
        let segments = segments.filter_map(|segment| Some((segment.attribute("ident")?, segment))).collect();
        for one in children(editor, "layoutturntable") {
            let ident = one.attribute("ident").unwrap_or_default();
            left_out.push(format!("the turntable {ident}: tracks end at it"));
        }
        Self {
            blocks,
            turnout_names: system_names(root, "turnouts", "turnout"),
            editor,
            segments,
            places: Vec::new(),
            drawn: Vec::new(),
            ports: BTreeMap::new(),
            joined: BTreeMap::new(),
            stretches: Vec::new(),
            passed: BTreeMap::new(),
            in_one_place: BTreeSet::new(),
            with_turnouts: BTreeSet::new(),
            left_out,
        }
    }

    /// The block with a detector that an object lies in.
    pub(super) fn detected(&self, object: Node<'_, '_>) -> Option<String> {
        let name = object.attribute("blockname")?;
        self.blocks.get(name)?.detector?;
        Some(name.to_owned())
    }

    pub(super) fn read_turnouts(
        &mut self,
        no_number: impl Fn(Node<'_, '_>, &str, &str) -> PanelError,
    ) -> Result<(), PanelError> {
        for turnout in children(self.editor, "layoutturnout") {
            let Some(ident) = turnout.attribute("ident") else { continue };
            if !matches!(
                turnout.attribute("type"),
                Some("RH_TURNOUT" | "LH_TURNOUT" | "WYE_TURNOUT" | "1" | "2" | "3")
            ) {
                self.left_out
                    .push(format!("{ident}: neither a left, a right nor a wye turnout; tracks end at it"));
                continue;
            }
            let name = self.system_name(turnout.attribute("turnoutname").unwrap_or_default());
            let number = number_of(name).ok_or_else(|| no_number(turnout, ident, name))?;
            let names = [format!("BR{number}"), format!("MR{number}")];
            let [branch, merge] = &names;
            let goes_on = if turnout.attribute("continuing").unwrap_or(CLOSED) == CLOSED {
                [Leg::Straight, Leg::Curved]
            } else {
                [Leg::Curved, Leg::Straight]
            };
            let legs = goes_on.map(|leg| Port::of(branch, merge, Some(leg)));
            let [b, c] = legs;
            self.draw(&names, turnout, ["xcen", "ycen"]);
            let lies_in = self.detected(turnout);
            self.with_turnouts.extend(turnout.attribute("blockname").map(str::to_owned));
            for (letter, port) in [("A", Port::of(merge, branch, None)), ("B", b), ("C", c)] {
                self.connect(turnout, ident, letter, port, lies_in.clone());
            }
            self.places.push(Place::Turnout { names, turnout: TurnoutId(number) });
        }
        Ok(())
    }

    /// The system name of a turnout that is called by it or by the name that a user gave it.
    pub(super) fn system_name<'n>(&'n self, name: &'n str) -> &'n str {
        self.turnout_names.get(name).map_or(name, String::as_str)
    }

    /// The segment at a connection of an object.
    pub(super) fn segment_at(&self, object: Node<'a, '_>, letter: &str) -> Option<(&'a str, Node<'a, 'i>)> {
        let ident = object.attribute(format!("connect{}name", letter.to_ascii_lowercase()).as_str())?;
        self.segments.get_key_value(ident).map(|(ident, segment)| (*ident, *segment))
    }

    /// Connects a turnout that lies in a block: with a boundary where the segment is in another block, or with an end where
    /// there is none.
    pub(super) fn connect(
        &mut self,
        turnout: Node<'a, '_>,
        ident: &str,
        letter: &str,
        port: Port,
        lies_in: Option<String>,
    ) {
        let place = format!("{ident}{letter}");
        let Some((_, segment)) = self.segment_at(turnout, letter) else {
            self.left_out
                .push(format!("leg {letter} of turnout {ident}: nothing is connected; an end was put there"));
            self.end(&place, Some(port));
            return;
        };
        let leads_to = self.detected(segment);
        let port = if leads_to == lies_in {
            port
        } else {
            let [inner, outer] = self.boundary(&place, [lies_in, leads_to]);
            self.stretches.push((stretch(&port, &inner), BTreeSet::new()));
            outer
        };
        self.ports.insert((ident.to_owned(), letter.to_owned()), port);
    }

    /// Joins the segments on either side of a level crossing, or puts a boundary there where they are in different blocks.
    pub(super) fn join_over(&mut self, ident: &str, letters: [&str; 2], segments: [(&str, Node<'_, '_>); 2]) {
        let track = ident.to_owned() + &letters.concat();
        let blocks = segments.map(|(_, segment)| self.detected(segment));
        if blocks[0] == blocks[1] {
            self.joined.insert(track, segments.map(|(name, _)| name.to_owned()));
            return;
        }
        for (letter, port) in letters.into_iter().zip(self.boundary(&track, blocks)) {
            self.ports.insert((ident.to_owned(), letter.to_owned()), port);
        }
    }

    pub(super) fn read_points(&mut self) {
        for point in children(self.editor, "positionablepoint") {
            let Some(ident) = point.attribute("ident") else { continue };
            if ["eastboundsensor", "westboundsensor"].iter().any(|name| point.has_attribute(*name)) {
                self.left_out.push(format!(
                    "the sensors at {ident}: add them as `sensors` if they are devices at the track"
                ));
            }
            let at = ["connect1name", "connect2name"].map(|name| point.attribute(name));
            let found = at.map(|name| self.segments.get(name?).copied());
            match (point.attribute("type"), found, at) {
                (Some("ANCHOR" | "1"), [Some(one), Some(other)], [Some(first), Some(second)]) => {
                    let blocks = [one, other].map(|segment| self.detected(segment));
                    if blocks[0] == blocks[1] {
                        self.joined.insert(ident.to_owned(), [first, second].map(str::to_owned));
                        continue;
                    }
                    let ports = self.boundary(ident, blocks);
                    for (segment, port) in [first, second].into_iter().zip(ports) {
                        self.ports.insert((ident.to_owned(), segment.to_owned()), port);
                    }
                }
                (kind, ..) => {
                    if !matches!(kind, Some("END_BUMPER" | "2")) {
                        self.left_out
                            .push(format!("what follows {ident}: the track ends there on this panel"));
                    }
                    let port = self.end(ident, None);
                    for segment in at.into_iter().flatten() {
                        self.ports.insert((ident.to_owned(), segment.to_owned()), port.clone());
                    }
                }
            }
            let first = self.places.last().map(|place| place.names().clone());
            if let Some(names) = first {
                self.draw(&names, point, ["x", "y"]);
            }
        }
    }

    /// Follows the segments from place to place.
    pub(super) fn join(&mut self) {
        let mut seen: BTreeSet<&str> = BTreeSet::new();
        let segments: Vec<(&'a str, Node<'a, 'i>)> =
            self.segments.iter().map(|(ident, node)| (*ident, *node)).collect();
        for (first, segment) in &segments {
            for side in [1, 2] {
                let Some(from) = self.port_at(first, *segment, side) else { continue };
                if seen.contains(first) {
                    continue;
                }
                let (mut ident, mut segment, mut side) = (*first, *segment, side);
                let (mut blocks, mut passed) = (BTreeSet::new(), Vec::new());
                let to = loop {
                    if !seen.insert(ident) {
                        break None;
                    }
                    blocks.extend(segment.attribute("blockname").map(str::to_owned));
                    let far = 3 - side;
                    if let Some(port) = self.port_at(ident, segment, far) {
                        break Some(port);
                    }
                    let joint = joint_at(segment, far);
                    let next =
                        self.joined.get(&joint).and_then(|both| both.iter().find(|other| *other != ident));
                    let Some((name, next)) = next.and_then(|next| self.segments.get_key_value(next.as_str()))
                    else {
                        break None;
                    };
                    side = if joint_at(*next, 1) == joint { 1 } else { 2 };
                    (ident, segment) = (*name, *next);
                    passed.push(joint);
                };
                let to = to.unwrap_or_else(|| {
                    self.left_out.push(format!("what follows track segment {ident}: an end was put there"));
                    self.end(ident, None)
                });
                self.passed.insert(self.stretches.len(), passed);
                self.stretches.push((stretch(&from, &to), blocks));
            }
        }
        let lost = segments.iter().filter(|(ident, _)| !seen.contains(ident)).count();
        if lost > 0 {
            self.left_out.push(format!(
                "track segments that lead to no turnout, boundary of detectors or end: {lost}"
            ));
        }
    }

    /// The connection of a place at one end of a segment.
    fn port_at(&self, ident: &str, segment: Node<'_, '_>, side: u8) -> Option<Port> {
        let object = segment.attribute(format!("connect{side}name").as_str())?;
        let connection = connection(segment, side).unwrap_or(ident);
        self.ports.get(&(object.to_owned(), connection.to_owned())).cloned()
    }

    /// Adds a boundary; returns its connections to the first of the two blocks and to the second.
    pub(super) fn boundary(&mut self, ident: &str, [first, second]: [Option<String>; 2]) -> [Port; 2] {
        let names = ["a", "b"].map(|direction| name_of(ident) + direction);
        let ports = [Port::of(&names[1], &names[0], None), Port::of(&names[0], &names[1], None)];
        self.places.push(Place::Boundary { names, enters: [second, first] });
        ports
    }

    /// Adds the end of a track, with the rails to it where a connection is left open.
    pub(super) fn end(&mut self, ident: &str, open: Option<Port>) -> Port {
        let names = ["EN_", "EX_"].map(|kind| kind.to_owned() + &name_of(ident));
        let port = Port::of(&names[0], &names[1], None);
        self.places.push(Place::End { names });
        if let Some(open) = open {
            self.stretches.push((stretch(&open, &port), BTreeSet::new()));
        }
        port
    }

    pub(super) fn draw(&mut self, names: &[String; 2], object: Node<'_, '_>, keys: [&str; 2]) {
        let [x, y] = keys.map(|key| object.attribute(key).and_then(|number| number.parse::<f64>().ok()));
        if let (Some(x), Some(y)) = (x, y) {
            self.drawn.push((names[0].clone(), [x, y]));
        }
    }

    pub(super) fn plan(&mut self, context: &ImportContext) -> LayoutPlan {
        let mut uses: BTreeMap<&String, usize> = BTreeMap::new();
        self.stretches
            .iter()
            .flat_map(|(_, blocks)| blocks)
            .for_each(|block| *uses.entry(block).or_default() += 1);
        let measured = |blocks: &BTreeSet<String>| {
            let of_block = |block: &String| {
                let is_alone = uses.get(block) == Some(&1) && !self.with_turnouts.contains(block);
                let mm = self.blocks.get(block).map_or(0.0, |block| block.length_mm);
                (is_alone && mm > 0.0).then_some(mm)
            };
            let mm: Option<Vec<f64>> = blocks.iter().map(of_block).collect();
            mm.filter(|mm| !mm.is_empty()).map(|mm| mm.iter().sum::<f64>())
        };
        let stretches = self.stretches.iter().enumerate().map(|(number, (stretch, blocks))| {
            let mm = if self.in_one_place.contains(&number) { Some(0.0) } else { measured(blocks) };
            let length = mm.map_or(StretchLength::Unknown, |mm| Length::from_mm(mm).into());
            Stretch { length, ..stretch.clone() }
        });
        let stretches: Vec<Stretch> = stretches.collect();
        let unknown = stretches.iter().filter(|stretch| stretch.length == StretchLength::Unknown).count();
        if unknown > 0 {
            let all = stretches.len();
            self.left_out.push(format!("the lengths of {unknown} of {all} edges: measure one with a tape, and trains measure the others"));
        }
        let entered = |block: &String| {
            let enters = |place: &Place| matches!(place, Place::Boundary { enters, .. } if enters.iter().flatten().any(|one| one == block));
            self.places.iter().any(enters)
        };
        let blocks = self.blocks.iter().filter(|(name, _)| entered(name));
        let blocks = blocks
            .filter_map(|(name, block)| Some(PlannedBlock { name: name.clone(), detector: block.detector? }));
        LayoutPlan {
            name: context.name.clone(),
            survey: context.survey.clone(),
            places: self.places.clone(),
            stretches,
            never_both_curved: context.never_both_curved.clone(),
            zones: Vec::new(),
            blocks: blocks.collect(),
        }
    }
}

/// The connection of an object at one end of a segment, by its letter; `None` if the object is a point.
fn connection(segment: Node<'_, '_>, side: u8) -> Option<&'static str> {
    Some(match segment.attribute(format!("type{side}").as_str())? {
        "TURNOUT_A" | "2" | "LEVEL_XING_A" | "6" | "SLIP_A" | "21" => "A",
        "TURNOUT_B" | "3" | "LEVEL_XING_B" | "7" | "SLIP_B" | "22" => "B",
        "TURNOUT_C" | "4" | "LEVEL_XING_C" | "8" | "SLIP_C" | "23" => "C",
        "TURNOUT_D" | "5" | "LEVEL_XING_D" | "9" | "SLIP_D" | "24" => "D",
        _ => return None,
    })
}

/// What one end of a segment is joined at: an anchor, or one of the two tracks of a level crossing.
fn joint_at(segment: Node<'_, '_>, side: u8) -> String {
    let object = segment.attribute(format!("connect{side}name").as_str()).unwrap_or_default();
    let track = connection(segment, side).map(|letter| if matches!(letter, "A" | "C") { "AC" } else { "BD" });
    object.to_owned() + track.unwrap_or_default()
}

pub(super) fn stretch(from: &Port, to: &Port) -> Stretch {
    Stretch { from: from.leaving.clone(), to: to.arriving.clone(), length: StretchLength::Unknown }
}

/// A name in a panel with what layouts do not allow in names left out.
pub(super) fn name_of(ident: &str) -> String {
    ident
        .chars()
        .filter(|letter| letter.is_ascii_alphanumeric() || "_.".contains(*letter))
        .take(LONGEST_NAME)
        .collect()
}

/// The number at the end of a system name: LS17 is input 17, LT5 turnout 5.
pub(super) fn number_of(name: &str) -> Option<u16> {
    let digits = name.len() - name.bytes().rev().take_while(u8::is_ascii_digit).count();
    name.get(digits..)?.parse().ok()
}

/// System names by user names, of one kind of thing.
fn system_names(root: Node<'_, '_>, table: &str, element: &str) -> BTreeMap<String, String> {
    let both = |one| Some((text_of(one, "userName")?.to_owned(), text_of(one, "systemName")?.to_owned()));
    descendants(root, table, element).filter_map(both).collect()
}
