//! Reads a layout from TOML.

use std::path::Path;

use footplate_core::track::{
    Layout, LayoutError, LayoutPlan, Leg, Place, PlanEntry, PlannedBlock, PlannedZone, Position, RailEnd,
    Stretch, StretchLength, Survey, SurveyedDistance, Zone,
};
use footplate_core::{EdgeId, Length, SensorId, Speed, StretchId, TurnoutId};
use serde::Deserialize;
use toml::Spanned;

use super::drawing::{Drawing, LayoutFile};
use super::error::{LayoutFileError, LayoutProblem};
use crate::sensor_names::{ModuleLetters, SensorNames};
use crate::text_file::{TextFile, TextPlace};

/// The largest layout file, in bytes: a hundred times a built-in layout.
pub const LARGEST_LAYOUT: usize = 1024 * 1024;

const LAYOUT: TextFile = TextFile { kind: "a layout", largest: LARGEST_LAYOUT };

/// The version of the format.
pub(super) const FORMAT: i64 = 1;

/// The largest drawing coordinate: far beyond any plan, and exact in `f64`.
pub(super) const LARGEST_COORDINATE: f64 = 1e6;

/// Reads the layout file at `path`.
///
/// # Errors
/// The first error, with file, line and column.
pub fn read_layout(path: &Path) -> Result<LayoutFile, LayoutFileError> {
    let file = path.display().to_string();
    parse_layout(&file, &LAYOUT.read(path)?)
}

/// Reads a layout from the bytes of a file. `file` is its name in messages.
///
/// # Errors
/// As [`read_layout`].
pub fn parse_layout(file: &str, bytes: &[u8]) -> Result<LayoutFile, LayoutFileError> {
    LAYOUT.check_size(file, bytes)?;
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let before = &bytes[..error.valid_up_to()];
        let line_start = before.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        LayoutFileError::NotText {
            file: file.to_owned(),
            line: before.iter().filter(|byte| **byte == b'\n').count() + 1,
            byte: before.len() - line_start + 1,
        }
    })?;
    read_text(text).map_err(|(byte, problem)| LayoutFileError::Wrong {
        place: TextPlace::of_byte(file, text, byte),
        problem,
    })
}

/// The byte of an error, and the error.
type Fault = (usize, LayoutProblem);

fn read_text(text: &str) -> Result<LayoutFile, Fault> {
    let written: Written = toml::from_str(text).map_err(|error| {
        let byte = error.span().map_or(0, |span| span.start);
        (byte, LayoutProblem::Toml(in_words(error.message())))
    })?;
    let found = *written.format.get_ref();
    if found != FORMAT {
        return Err((written.format.span().start, LayoutProblem::Format { found, known: FORMAT }));
    }
    let plan = written.plan()?;
    let layout = Layout::build(&plan).map_err(|error| (written.place_of(&error), error.into()))?;
    let layout = written.cross(layout)?;
    let mut drawing = Drawing::default();
    for (place, at) in plan.places.iter().zip(written.points()) {
        let Some(at) = at else { continue };
        let [x, y] = *at.get_ref();
        // The comparison also rejects NaN.
        if !(x.abs() <= LARGEST_COORDINATE && y.abs() <= LARGEST_COORDINATE) {
            return Err((at.span().start, LayoutProblem::Point { x, y, limit: LARGEST_COORDINATE }));
        }
        if let Some(node) = layout.node_named(&place.names()[0]) {
            drawing.set(node, [x, y]);
        }
    }
    Ok(LayoutFile { layout, about: written.about.trim().to_owned(), drawing })
}

/// A message of the TOML reader on one line, without Rust type names.
fn in_words(message: &str) -> String {
    let line = message.trim_end().replace('\n', "; ");
    line.replace("expected f64", "expected a number")
        .replace("expected u16", "expected a whole number from 0 to 65535")
        .replace("expected i64", "expected a whole number")
}

/// The content of the file, as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    format: Spanned<i64>,
    name: String,
    #[serde(default)]
    about: String,
    length_uncertainty_mm: Spanned<f64>,
    length_origin: String,
    length_scale_uncertainty_percent: Option<Spanned<f64>>,
    #[serde(default)]
    sensors: Vec<Spanned<WrittenSensor>>,
    #[serde(default)]
    turnouts: Vec<Spanned<WrittenTurnout>>,
    #[serde(default)]
    never_both_curved: Vec<Spanned<[u16; 2]>>,
    #[serde(default)]
    ends: Vec<Spanned<WrittenEnd>>,
    #[serde(default)]
    zones: Vec<Spanned<WrittenZone>>,
    #[serde(default)]
    blocks: Vec<Spanned<WrittenBlock>>,
    #[serde(default)]
    boundaries: Vec<Spanned<WrittenBoundary>>,
    edges: Vec<Spanned<WrittenEdge>>,
    #[serde(default)]
    crossings: Vec<Spanned<WrittenCrossing>>,
    #[serde(default)]
    distances: Vec<Spanned<WrittenDistance>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenSensor {
    names: [String; 2],
    numbers: Option<[u16; 2]>,
    /// Of a sensor that reports the same number for both directions.
    number: Option<u16>,
    at: Option<Spanned<[f64; 2]>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenBlock {
    name: String,
    number: u16,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenBoundary {
    names: [String; 2],
    /// An empty name stands for track without a detector.
    enters: [String; 2],
    at: Option<Spanned<[f64; 2]>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenTurnout {
    number: u16,
    names: [String; 2],
    at: Option<Spanned<[f64; 2]>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenEnd {
    names: [String; 2],
    at: Option<Spanned<[f64; 2]>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenEdge {
    from: Spanned<String>,
    to: Spanned<String>,
    mm: Option<Spanned<f64>>,
    uncertainty_mm: Option<Spanned<f64>>,
    zone: Option<Spanned<String>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenCrossing {
    tracks: [WrittenSpot; 2],
}

/// A place on an edge, which is named as in `edges`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenSpot {
    from: String,
    to: String,
    mm: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenDistance {
    from: String,
    to: String,
    mm: f64,
    uncertainty_mm: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenZone {
    name: String,
    max_mm_s: Spanned<f64>,
}

impl Written {
    /// The plan of the layout, with its places in the order sensors, turnouts, ends, boundaries.
    fn plan(&self) -> Result<LayoutPlan, Fault> {
        let sensors = self.sensors.iter().map(|sensor| sensor.get_ref().place(sensor.span().start));
        let turnouts = self.turnouts.iter().map(|turnout| {
            let WrittenTurnout { number, names, .. } = turnout.get_ref();
            Ok(Place::Turnout { names: names.clone(), turnout: TurnoutId(*number) })
        });
        let ends = self.ends.iter().map(|end| Ok(Place::End { names: end.get_ref().names.clone() }));
        let boundaries = self.boundaries.iter().map(|boundary| {
            let WrittenBoundary { names, enters, .. } = boundary.get_ref();
            let enters = enters.clone().map(|block| (!block.is_empty()).then_some(block));
            Ok(Place::Boundary { names: names.clone(), enters })
        });
        let blocks = self.blocks.iter().map(|block| {
            let WrittenBlock { name, number } = block.get_ref();
            PlannedBlock { name: name.clone(), detector: SensorId(*number) }
        });
        let stretches = self.edges.iter().map(|edge| {
            let WrittenEdge { from, to, .. } = edge.get_ref();
            Ok(Stretch { from: rail_end(from)?, to: rail_end(to)?, length: edge.get_ref().length()? })
        });
        Ok(LayoutPlan {
            name: self.name.clone(),
            survey: Survey {
                uncertainty: Length::from_mm(*self.length_uncertainty_mm.get_ref()),
                origin: self.length_origin.clone(),
                scale: self
                    .length_scale_uncertainty_percent
                    .as_ref()
                    .map_or(0.0, |part| part.get_ref() / 100.0),
                distances: self.distances.iter().map(|distance| distance.get_ref().planned()).collect(),
            },
            places: sensors.chain(turnouts).chain(ends).chain(boundaries).collect::<Result<_, _>>()?,
            stretches: stretches.collect::<Result<_, _>>()?,
            never_both_curved: self
                .never_both_curved
                .iter()
                .map(|pair| pair.get_ref().map(TurnoutId))
                .collect(),
            zones: self.zones()?,
            blocks: blocks.collect(),
        })
    }

    /// The speed restrictions, each with its edges.
    fn zones(&self) -> Result<Vec<PlannedZone>, Fault> {
        let restricted = || {
            let edges = (0_u16..).zip(&self.edges);
            edges.filter_map(|(number, edge)| Some((StretchId(number), edge.get_ref().zone.as_ref()?)))
        };
        let is_known = |name: &str| self.zones.iter().any(|zone| zone.get_ref().name == name);
        if let Some((_, unknown)) = restricted().find(|(_, zone)| !is_known(zone.get_ref())) {
            let found = unknown.get_ref().escape_debug().to_string();
            return Err((unknown.span().start, LayoutProblem::UnknownZone(found)));
        }
        let zones = self.zones.iter().map(|zone| {
            let WrittenZone { name, max_mm_s } = zone.get_ref();
            let edges = restricted().filter(|(_, of)| of.get_ref() == name);
            PlannedZone {
                zone: Zone { name: name.clone(), limit: Speed::from_mm_per_s(*max_mm_s.get_ref()) },
                stretches: edges.map(|(stretch, _)| stretch).collect(),
            }
        });
        Ok(zones.collect())
    }

    /// Adds the level crossings to a layout.
    fn cross(&self, mut layout: Layout) -> Result<Layout, Fault> {
        for crossing in &self.crossings {
            let fault = |problem| (crossing.span().start, problem);
            let position = |WrittenSpot { from, to, mm }: &WrittenSpot| {
                let is_named = |edge: &Spanned<WrittenEdge>| {
                    edge.get_ref().from.get_ref() == from && edge.get_ref().to.get_ref() == to
                };
                let unknown = || fault(LayoutProblem::UnknownEdge { from: from.clone(), to: to.clone() });
                let number = self.edges.iter().position(is_named).ok_or_else(unknown)?;
                // Layouts number their edges by `u16`, two to a written one.
                Ok(Position { edge: EdgeId(2 * number as u16), offset: Length::from_mm(*mm) })
            };
            let [one, other] = &crossing.get_ref().tracks;
            let tracks = [position(one)?, position(other)?];
            layout = layout.with_crossing(tracks).ok_or_else(|| fault(LayoutProblem::CrossingOffEdge))?;
        }
        Ok(layout)
    }

    /// The points of all places, in the order of the plan.
    fn points(&self) -> impl Iterator<Item = Option<&Spanned<[f64; 2]>>> {
        let sensors = self.sensors.iter().map(|sensor| sensor.get_ref().at.as_ref());
        let turnouts = self.turnouts.iter().map(|turnout| turnout.get_ref().at.as_ref());
        let ends = self.ends.iter().map(|end| end.get_ref().at.as_ref());
        let boundaries = self.boundaries.iter().map(|boundary| boundary.get_ref().at.as_ref());
        sensors.chain(turnouts).chain(ends).chain(boundaries)
    }

    /// The byte that an error of the layout refers to.
    fn place_of(&self, error: &LayoutError) -> usize {
        let mut places = (self.sensors.iter().map(|sensor| sensor.span().start))
            .chain(self.turnouts.iter().map(|turnout| turnout.span().start))
            .chain(self.ends.iter().map(|end| end.span().start))
            .chain(self.boundaries.iter().map(|boundary| boundary.span().start));
        let start = match error.entry() {
            PlanEntry::Place(place) => places.nth(place),
            PlanEntry::Stretch(stretch) => self.edges.get(stretch).map(|edge| edge.get_ref().place_of(error)),
            PlanEntry::Pair(pair) => self.never_both_curved.get(pair).map(|pair| pair.span().start),
            PlanEntry::Zone(zone) => self.zones.get(zone).map(|zone| match error {
                LayoutError::IllegalZoneLimit { .. } => zone.get_ref().max_mm_s.span().start,
                _ => zone.span().start,
            }),
            PlanEntry::Survey => match (error, &self.length_scale_uncertainty_percent) {
                (LayoutError::IllegalScale { .. }, Some(scale)) => Some(scale.span().start),
                _ => Some(self.length_uncertainty_mm.span().start),
            },
            PlanEntry::Distance(distance) => {
                self.distances.get(distance).map(|distance| distance.span().start)
            }
            PlanEntry::Block(block) => self.blocks.get(block).map(|block| block.span().start),
            PlanEntry::Plan => None,
        };
        start.unwrap_or(0)
    }
}

impl WrittenSensor {
    fn place(&self, start: usize) -> Result<Place, Fault> {
        let [one, other] = &self.names;
        let number_in = |name: &String| {
            let unknown = || (start, LayoutProblem::SensorNumber(name.clone()));
            ModuleLetters.sensor_named(name).ok_or_else(unknown)
        };
        let names = self.names.clone();
        let sensors = match (self.number, self.numbers) {
            (Some(_), Some(_)) => return Err((start, LayoutProblem::NumberAndNumbers(one.clone()))),
            (Some(number), None) => {
                return Ok(Place::UndirectedSensor { names, sensor: SensorId(number) });
            }
            (None, Some([one, other])) if one == other => {
                return Err((start, LayoutProblem::EqualNumbers(one)));
            }
            (None, Some(numbers)) => numbers.map(SensorId),
            (None, None) => [number_in(one)?, number_in(other)?],
        };
        Ok(Place::Sensor { names, sensors })
    }
}

impl WrittenDistance {
    fn planned(&self) -> SurveyedDistance {
        let Self { from, to, mm, uncertainty_mm } = self;
        SurveyedDistance {
            from: from.clone(),
            to: to.clone(),
            length: Length::from_mm(*mm),
            uncertainty: Length::from_mm(*uncertainty_mm),
        }
    }
}

impl WrittenEdge {
    /// The length of the edge, as far as it is stated.
    fn length(&self) -> Result<StretchLength, Fault> {
        let mm = |number: &Spanned<f64>| Length::from_mm(*number.get_ref());
        match (&self.mm, &self.uncertainty_mm) {
            (Some(length), None) => Ok(mm(length).into()),
            (Some(length), Some(own)) => {
                Ok(StretchLength::Estimated { length: mm(length), uncertainty: mm(own) })
            }
            (None, None) => Ok(StretchLength::Unknown),
            (None, Some(own)) => Err((own.span().start, LayoutProblem::UncertaintyOfNothing)),
        }
    }

    /// The byte that an error in this edge refers to.
    fn place_of(&self, error: &LayoutError) -> usize {
        let start = |number: &Option<Spanned<f64>>| number.as_ref().map_or(0, |number| number.span().start);
        let at_fault = match error {
            LayoutError::IllegalLength { .. } => return start(&self.mm),
            LayoutError::IllegalLengthUncertainty { .. } => return start(&self.uncertainty_mm),
            LayoutError::UnknownNode { node, .. }
            | LayoutError::LegMissing { node, .. }
            | LayoutError::LegWithoutTurnout { node, .. }
            | LayoutError::BeyondTrackEnd { node, .. } => node,
            _ => return self.from.span().start,
        };
        let is_from = self.from.get_ref().split_whitespace().next() == Some(at_fault);
        if is_from { self.from.span().start } else { self.to.span().start }
    }
}

/// Parses `C13`, `BR6 straight` or `BR6 curved`.
fn rail_end(text: &Spanned<String>) -> Result<RailEnd, Fault> {
    let mut words = text.get_ref().split_whitespace();
    let node = words.next().map(ToOwned::to_owned);
    let leg = match words.next() {
        None => Some(None),
        Some("straight") => Some(Some(Leg::Straight)),
        Some("curved") => Some(Some(Leg::Curved)),
        Some(_) => None,
    };
    match (node, leg, words.next()) {
        (Some(node), Some(leg), None) => Ok(RailEnd { node, leg }),
        _ => Err((text.span().start, LayoutProblem::RailEnd(text.get_ref().escape_debug().to_string()))),
    }
}
