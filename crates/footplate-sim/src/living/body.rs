//! A train's body on the rails: what lies under it, and what its shoe comes to.
//!
//! Places are counted in mm along the train's own path, with the sign of travel; reversing turns the count
//! around. The leading end of the shoe is the train's place. The path always reaches from the rear end to the edge
//! that the front end is on, so that turnouts decide when the front end comes to them.

use std::collections::VecDeque;

use footplate_core::track::{Crossing, Leg, Position};
use footplate_core::{EdgeId, SensorId, TurnoutId};

use crate::circuit::FOULING_MM;
use crate::draws::Draws;
use crate::living::rails::{Ahead, Rail, Rails};
use crate::load::DIRTY_MM;
use crate::path::Point;

/// Blades of a turnout reach so far from its toe into its legs (chosen: Märklin K and C track, a third of 17 cm).
const BLADES_MM: f64 = 60.0;
/// No path leads over more edges at one point (chosen: beyond that the layout has edges without length in a ring).
const MOST_EDGES_AT_ONCE: usize = 64;

/// An edge under the train or ahead of it.
#[derive(Debug, Clone, Copy)]
struct Under {
    edge: EdgeId,
    begins: f64,
    ends: f64,
    factor: f64,
    grade: f64,
}

/// A sensor ahead of the shoe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Coming {
    /// Where it closes this time.
    pub(crate) sensor: Point<SensorId>,
    /// Where it closes on average.
    pub(crate) usual_mm: f64,
}

/// How this train closes sensors a little before or behind where they usually close.
#[derive(Debug, Clone)]
struct Scatter {
    draws: Draws,
    shoe_mm: f64,
}

/// What the train comes to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Met {
    /// The shoe touches a sensor.
    Touches(Coming),
    /// The shoe leaves a sensor that it holds.
    Leaves(Point<SensorId>),
    /// The last axle that a detector senses leaves its block.
    Vacates(Point<SensorId>),
    /// The shoe is on dirt.
    Dirt,
    /// The front end comes onto another edge, or the rear end leaves one.
    OtherEdges,
    /// The front end comes to a pair of turnouts in one place that both lie curved.
    IllegalPair(TurnoutId),
    /// The front end comes to where the track ends.
    End,
}

/// A train's body.
#[derive(Debug, Clone)]
pub(crate) struct Body {
    path: VecDeque<Under>,
    /// The leading end of the shoe.
    pub(crate) lead: f64,
    /// From there to the front end, the length of the shoe, and from its other end to the rear end.
    ahead: f64,
    shoe: f64,
    behind: f64,
    /// From the leading end of the shoe to the first and back to the last part of the train that detectors sense.
    sensed: [f64; 2],
    /// Where blocks end that the train is in or comes to, in order.
    block_ends: VecDeque<Point<SensorId>>,
    /// Sensors and dirty spots that the shoe has not come to, in order.
    sensors: VecDeque<Coming>,
    dirt: VecDeque<f64>,
    /// Sensors that the shoe holds closed.
    held: VecDeque<Point<SensorId>>,
    /// Which of the path's edges the lead is on.
    under: usize,
    /// What the rails there make of a speed, and their gradient.
    pub(crate) factor: f64,
    pub(crate) grade: f64,
    scatter: Option<Scatter>,
    /// Where the last dirty spot ends.
    pub(crate) dirty_until: f64,
    /// Nothing happens before the lead is here.
    pub(crate) next: f64,
}

impl Body {
    /// A train with the leading end of its shoe on an edge; `None` where track or layout ends within the train.
    pub(crate) fn put(
        rails: &Rails<'_>,
        lies: &impl Fn(TurnoutId) -> Option<Leg>,
        edge: EdgeId,
        offset: f64,
        [ahead, shoe, behind]: [f64; 3],
        sensed: [f64; 2],
    ) -> Option<Self> {
        let length = rails.rail(edge)?.length_mm;
        let lead = offset.clamp(0.0, length);
        let mut body = Self {
            path: VecDeque::new(),
            lead,
            ahead,
            shoe,
            behind,
            sensed,
            block_ends: VecDeque::new(),
            sensors: VecDeque::new(),
            dirt: VecDeque::new(),
            held: VecDeque::new(),
            under: 0,
            factor: 1.0,
            grade: 0.0,
            scatter: None,
            dirty_until: f64::NEG_INFINITY,
            next: f64::INFINITY,
        };
        body.path.push_back(Under { edge, begins: 0.0, ends: length, factor: 1.0, grade: 0.0 });
        // Backwards is forwards in the opposite direction.
        for _ in 0..MOST_EDGES_AT_ONCE {
            let first = *body.path.front()?;
            if first.begins <= body.rear() {
                break;
            }
            let before = after(rails, lies, first.edge.twin())?.twin();
            let begins = first.begins - rails.rail(before)?.length_mm;
            body.path.push_front(Under { edge: before, begins, ends: first.begins, factor: 1.0, grade: 0.0 });
        }
        for under in &mut body.path {
            let rail = rails.rail(under.edge)?;
            (under.factor, under.grade) = (rail.factor, rail.grade);
        }
        while body.path.back()?.ends < body.front() {
            let next = after(rails, lies, body.path.back()?.edge)?;
            body.append(rails, next);
        }
        body.look_ahead(rails);
        Some(body)
    }

    pub(crate) fn front(&self) -> f64 {
        self.lead + self.ahead
    }

    pub(crate) fn rear(&self) -> f64 {
        self.lead - self.shoe - self.behind
    }

    /// The edges under the train, each with the part of it that is.
    pub(crate) fn under(&self) -> impl Iterator<Item = (EdgeId, [f64; 2])> {
        self.path.iter().filter_map(|under| {
            let (from, to) = (self.rear().max(under.begins), self.front().min(under.ends));
            (from < to).then_some((under.edge, [from - under.begins, to - under.begins]))
        })
    }

    /// The edge under the leading end of the shoe, and how far along it that is.
    pub(crate) fn place(&self) -> Option<(EdgeId, f64)> {
        let under = self.path.get(self.under)?;
        Some((under.edge, self.lead - under.begins))
    }

    /// The next thing that the train came to on its path so far; ask until `None`.
    pub(crate) fn meet(
        &mut self,
        rails: &Rails<'_>,
        lies: &impl Fn(TurnoutId) -> Option<Leg>,
    ) -> Option<Met> {
        let met = self.meet_one(rails, lies);
        if met.is_none() {
            self.find_next();
        }
        met
    }

    fn meet_one(&mut self, rails: &Rails<'_>, lies: &impl Fn(TurnoutId) -> Option<Leg>) -> Option<Met> {
        let lead = self.lead;
        if let Some(held) = self.held.pop_front_if(|held| held.at_mm + self.shoe <= lead) {
            return Some(Met::Leaves(held));
        }
        let last = lead - self.sensed[1];
        if let Some(end) = self.block_ends.pop_front_if(|end| end.at_mm <= last) {
            return Some(Met::Vacates(Point { at_mm: end.at_mm + self.sensed[1], ..end }));
        }
        if let Some(sensor) = self.sensors.pop_front_if(|coming| coming.sensor.at_mm <= lead) {
            return Some(Met::Touches(sensor));
        }
        if let Some(spot) = self.dirt.pop_front_if(|spot| *spot <= lead) {
            self.dirty_until = spot + DIRTY_MM;
            return Some(Met::Dirt);
        }
        while self.path.get(self.under).is_some_and(|under| under.ends <= lead)
            && self.under + 1 < self.path.len()
        {
            self.under += 1;
            self.feel_rail();
        }
        let last = *self.path.back()?;
        if last.ends <= self.front() {
            let Some(next) = after(rails, lies, last.edge) else { return Some(Met::End) };
            if let Some(turnout) = illegal_pair(rails, lies, next) {
                return Some(Met::IllegalPair(turnout));
            }
            self.append(rails, next);
            return Some(Met::OtherEdges);
        }
        if self.under > 0 && self.path.front().is_some_and(|first| first.ends <= self.rear()) {
            self.path.pop_front();
            self.under -= 1;
            return Some(Met::OtherEdges);
        }
        None
    }

    /// A sensor that closed is held until the shoe has passed.
    pub(crate) fn hold(&mut self, sensor: Point<SensorId>) {
        self.held.push_back(sensor);
    }

    /// All sensors that the shoe holds, which it lets go.
    pub(crate) fn let_go(&mut self) -> impl Iterator<Item = SensorId> + '_ {
        self.held.drain(..).map(|held| held.what)
    }

    /// The detectors of the blocks under the train, once for each time that it is in one.
    pub(crate) fn blocks(&self, rails: &Rails<'_>) -> Vec<SensorId> {
        let (first, last) = (self.lead + self.sensed[0], self.lead - self.sensed[1]);
        let mut blocks = Vec::new();
        for under in self.path.iter().filter(|under| under.ends > last && under.begins < first) {
            let Some(rail) = rails.rail(under.edge) else { continue };
            // Several edges of one block count once.
            let is_new = under.begins <= last || rails.is_boundary(under.edge);
            blocks.extend(rail.block.filter(|_| is_new));
        }
        blocks
    }

    /// Reverses it where it stands.
    pub(crate) fn turn(&mut self, rails: &Rails<'_>) {
        let turned = self.path.iter().rev().filter_map(|under| {
            let edge = under.edge.twin();
            let Rail { factor, grade, .. } = *rails.rail(edge)?;
            Some(Under { edge, begins: -under.ends, ends: -under.begins, factor, grade })
        });
        self.path = turned.collect();
        self.lead = self.shoe - self.lead;
        std::mem::swap(&mut self.ahead, &mut self.behind);
        self.sensed = [self.sensed[1] - self.shoe, self.sensed[0] + self.shoe];
        self.held = self.held.iter().rev().map(|held| Point { at_mm: -held.at_mm, ..*held }).collect();
        self.dirty_until = f64::NEG_INFINITY;
        self.look_ahead(rails);
    }

    /// Where on a stretch the train is, in mm from the start of its first edge; `None` if it is not on it.
    fn reach_on(&self, edge: EdgeId) -> Option<[f64; 2]> {
        let under = self.path.iter().find(|under| under.edge.stretch() == edge.stretch())?;
        let (from, to) = (self.rear().max(under.begins), self.front().min(under.ends));
        let along = if under.edge < under.edge.twin() {
            [from - under.begins, to - under.begins]
        } else {
            [under.ends - to, under.ends - from]
        };
        (from < to).then_some(along)
    }

    /// Whether two trains could touch: they share rails, the legs of a turnout or a crossing.
    pub(crate) fn is_near(&self, rails: &Rails<'_>, other: &Self) -> bool {
        let runs_over = |body: &Self, at: Position| {
            body.path.iter().any(|under| under.edge.stretch() == at.edge.stretch())
        };
        let share_turnout = |mine: &Under, theirs: &Under| {
            legs(rails, mine.edge)
                .any(|(turnout, _)| legs(rails, theirs.edge).any(|(number, _)| number == turnout))
        };
        let is_beside = |mine: &Under| {
            let mut others = other.path.iter();
            others.any(|theirs| mine.edge.stretch() == theirs.edge.stretch() || share_turnout(mine, theirs))
        };
        self.crosses(rails, other, runs_over) || self.path.iter().any(is_beside)
    }

    /// Whether two trains satisfy a condition on the two tracks of a level crossing.
    fn crosses(&self, rails: &Rails<'_>, other: &Self, is_so: impl Fn(&Self, Position) -> bool) -> bool {
        rails.layout.crossings().iter().any(|Crossing { tracks: [one, two] }| {
            is_so(self, *one) && is_so(other, *two) || is_so(self, *two) && is_so(other, *one)
        })
    }

    /// Whether two trains touch.
    pub(crate) fn touches(&self, rails: &Rails<'_>, other: &Self) -> bool {
        let fouls_crossing = |body: &Self, at: Position| {
            let spot = at.offset.as_mm();
            body.reach_on(at.edge).is_some_and(|[from, to]| (from - spot).max(spot - to) < FOULING_MM)
        };
        self.crosses(rails, other, fouls_crossing)
            || self.path.iter().any(|mine| self.touches_on(rails, mine, other))
    }

    /// Whether the part of the train on one edge touches another train: there, or on the other leg of a turnout.
    fn touches_on(&self, rails: &Rails<'_>, mine: &Under, other: &Self) -> bool {
        let Some([from, to]) = self.reach_on(mine.edge) else { return false };
        let shares = other.reach_on(mine.edge).is_some_and(|[begins, ends]| begins < to && from < ends);
        let fouls = |body: &Self, under: &Under, turnout: TurnoutId| {
            body.distance_from_toe(rails, under, turnout) < FOULING_MM
        };
        let mut own = legs(rails, mine.edge).filter(|(turnout, _)| fouls(self, mine, *turnout));
        shares
            || own.any(|(turnout, leg)| {
                let is_other_leg = |theirs: &Under| {
                    legs(rails, theirs.edge).any(|(number, by)| number == turnout && by != leg)
                };
                other.path.iter().any(|theirs| is_other_leg(theirs) && fouls(other, theirs, turnout))
            })
    }

    /// Whether points that have just moved moved under the train.
    pub(crate) fn is_on_blades(&self, rails: &Rails<'_>, turnout: TurnoutId) -> bool {
        let is_leg = |under: &&Under| legs(rails, under.edge).any(|(number, _)| number == turnout);
        self.path.iter().filter(is_leg).any(|under| self.distance_from_toe(rails, under, turnout) < BLADES_MM)
    }

    /// A turnout that lies wrong for a train which has one part before and one behind its toe.
    pub(crate) fn splits(
        &self,
        rails: &Rails<'_>,
        lies: &impl Fn(TurnoutId) -> Option<Leg>,
    ) -> Option<TurnoutId> {
        self.path.iter().find_map(|under| {
            let (turnout, leg) = rails.rail(under.edge)?.leaves?;
            let is_across = self.rear() < under.begins && under.begins < self.front();
            (is_across && lies(turnout) != Some(leg)).then_some(turnout)
        })
    }

    /// The turnouts whose toes are under the train, each with the leg that it is on.
    pub(crate) fn straddled(&self, rails: &Rails<'_>) -> Vec<(TurnoutId, Leg)> {
        let is_under = |toe: f64| self.rear() < toe && toe < self.front();
        let of = |under: &Under| {
            let rail = rails.rail(under.edge)?;
            let left = rail.leaves.filter(|_| is_under(under.begins));
            left.or(rail.enters.filter(|_| is_under(under.ends)))
        };
        self.path.iter().filter_map(of).collect()
    }

    /// How far the nearest part of the train on a leg is from the toe of its turnout; infinite if none is on it.
    fn distance_from_toe(&self, rails: &Rails<'_>, under: &Under, turnout: TurnoutId) -> f64 {
        let (from, to) = (self.rear().max(under.begins), self.front().min(under.ends));
        let Some(rail) = rails.rail(under.edge).filter(|_| from < to) else { return f64::INFINITY };
        match (rail.leaves, rail.enters) {
            (Some((number, _)), _) if number == turnout => from - under.begins,
            _ => under.ends - to,
        }
    }

    fn append(&mut self, rails: &Rails<'_>, edge: EdgeId) {
        let Some((begins, rail)) = self.path.back().map(|last| last.ends).zip(rails.rail(edge)) else {
            return;
        };
        let Rail { length_mm, factor, grade, .. } = *rail;
        self.path.push_back(Under { edge, begins, ends: begins + length_mm, factor, grade });
        let coming = coming(&mut self.scatter, rails, rail, [begins, self.sensed[0]]);
        self.sensors.extend(coming);
        self.sort_sensors();
        self.block_ends.extend(rail.ends_block.map(|what| Point { at_mm: begins, what }));
        self.dirt.extend(rail.dirty.iter().map(|at| begins + at));
    }

    /// Blocks are sensed further ahead than sensors where carriages lead.
    fn sort_sensors(&mut self) {
        if self.sensed[0] > 0.0 {
            let by_place = |one: &Coming, other: &Coming| one.sensor.at_mm.total_cmp(&other.sensor.at_mm);
            self.sensors.make_contiguous().sort_by(by_place);
        }
    }

    /// Finds everything ahead of the shoe anew.
    fn look_ahead(&mut self, rails: &Rails<'_>) {
        self.block_ends.clear();
        let last = self.lead - self.sensed[1];
        for under in self.path.iter().filter(|under| under.begins > last) {
            let ended = rails.rail(under.edge).and_then(|rail| rail.ends_block);
            self.block_ends.extend(ended.map(|what| Point { at_mm: under.begins, what }));
        }
        self.sensors.clear();
        self.dirt.clear();
        for under in &self.path {
            let Some(rail) = rails.rail(under.edge) else { continue };
            let coming = coming(&mut self.scatter, rails, rail, [under.begins, self.sensed[0]]);
            self.sensors.extend(coming.into_iter().filter(|coming| coming.sensor.at_mm > self.lead));
            self.dirt.extend(rail.dirty.iter().map(|at| under.begins + at).filter(|at| *at > self.lead));
        }
        self.sort_sensors();
        self.under = self.path.iter().position(|under| self.lead < under.ends).unwrap_or(0);
        self.feel_rail();
        self.find_next();
    }

    /// Closes sensors a little before or behind where they usually close.
    pub(crate) fn scatter(&mut self, rails: &Rails<'_>, draws: Draws, shoe_mm: f64) {
        self.scatter = Some(Scatter { draws, shoe_mm });
        self.look_ahead(rails);
    }

    fn feel_rail(&mut self) {
        let under = self.path.get(self.under);
        (self.factor, self.grade) = under.map_or((1.0, 0.0), |under| (under.factor, under.grade));
    }

    fn find_next(&mut self) {
        let sensor = self.sensors.front().map_or(f64::INFINITY, |coming| coming.sensor.at_mm);
        let left = self.held.front().map_or(f64::INFINITY, |held| held.at_mm + self.shoe);
        let dirt = self.dirt.front().copied().unwrap_or(f64::INFINITY);
        let edge = self.path.get(self.under).map_or(f64::INFINITY, |under| under.ends);
        let front = self.path.back().map_or(f64::INFINITY, |last| last.ends - self.ahead);
        let rear = self.path.front().map_or(f64::INFINITY, |first| first.ends + self.shoe + self.behind);
        let block = self.block_ends.front().map_or(f64::INFINITY, |end| end.at_mm + self.sensed[1]);
        self.next = sensor.min(left).min(dirt).min(edge).min(front).min(rear).min(block);
    }
}

/// The sensors and entries of blocks of an edge that begins at a place, where the shoe is when they close this time.
/// Detectors sense a train so far ahead of its shoe.
fn coming(
    scatter: &mut Option<Scatter>,
    rails: &Rails<'_>,
    rail: &Rail,
    [begins, sensed_ahead]: [f64; 2],
) -> Vec<Coming> {
    let sensors = rail.sensors.iter().map(|(at, what)| {
        let is_entry = rails.layout.block_of_entry(*what).is_some();
        let usual_mm = begins + at - if is_entry { sensed_ahead } else { 0.0 };
        let by = scatter.as_mut().map_or(0.0, |scatter| {
            let sd = libm::hypot(rails.scatter_mm(*what), scatter.shoe_mm);
            scatter.draws.normal_within(0.0, sd, 2.5)
        });
        Coming { sensor: Point { at_mm: usual_mm + by, what: *what }, usual_mm }
    });
    sensors.collect()
}

/// The edge after an edge while turnouts lie as they do.
pub(crate) fn after(
    rails: &Rails<'_>,
    lies: &impl Fn(TurnoutId) -> Option<Leg>,
    edge: EdgeId,
) -> Option<EdgeId> {
    match rails.rail(edge)?.ahead {
        Ahead::Edge(next) => Some(next),
        Ahead::Points { turnout, straight, curved } => {
            Some(if lies(turnout) == Some(Leg::Curved) { curved } else { straight })
        }
        Ahead::End => None,
    }
}

/// The turnout by whose curved leg an edge leaves although its partner lies curved, too.
fn illegal_pair(
    rails: &Rails<'_>,
    lies: &impl Fn(TurnoutId) -> Option<Leg>,
    edge: EdgeId,
) -> Option<TurnoutId> {
    let (turnout, _) = rails.rail(edge)?.leaves.filter(|(_, leg)| *leg == Leg::Curved)?;
    let partner = rails.layout.never_curved_with(turnout)?;
    (lies(partner) == Some(Leg::Curved)).then_some(turnout)
}

/// The turnouts of which an edge is a leg, and which.
fn legs(rails: &Rails<'_>, edge: EdgeId) -> impl Iterator<Item = (TurnoutId, Leg)> {
    let rail = rails.rail(edge);
    rail.into_iter().flat_map(|rail| rail.leaves.into_iter().chain(rail.enters))
}
