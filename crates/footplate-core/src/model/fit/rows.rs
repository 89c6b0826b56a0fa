//! Linear equations of a trip about a point: of each sensor passed, each stop and each tape.
#![expect(clippy::indexing_slicing, reason = "columns are counted before the vectors are made by that count")]

use alloc::vec;
use alloc::vec::Vec;

use super::course::{Course, Outcome, Passage};
use super::robust::RobustWeight;
use super::trip::{Own, Trip};
use super::unknowns::Columns;
use crate::model::parameters::{
    Answers, NODES, Read, SHAPES, START_NODES, STOP_NODES, count, hysteresis_at, knots_about, nodes_about,
    shape_at, speed_at,
};
use crate::model::priors::SHAPE_ERROR;
use crate::model::priors::{PATH_LENGTH_SPREAD, TRIP_DEVIATION, WANDER, change_error};
use crate::model::scatter::Scatter;
use crate::model::segment::Segment;
use crate::model::sensor_scatter::SensorVariances;
use crate::model::stop_offset::{StopEffect, stop_offset_share};

/// A tape read to the centimetre beside a train: one standard deviation (m).
const TAPE: f64 = 0.005;
/// Standard deviation of a place of rest after the train has settled (m).
const REST_SCATTER: f64 = 0.0005;
/// Factor on the error of a law's shape in changes between two speeds: some ten changes of the kind are kept and have the same
/// error, which does not average out (√10).
const SYSTEMATIC: f64 = 3.2;
/// Standard deviation of where a chain begins (m).
const ANYWHERE: f64 = 10.0;

/// The source of an equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    /// A sensor passed, or a tape.
    Sensor,
    /// The prior of by how much a stop is longer or shorter than usual.
    Stop,
    /// Of a stop: the next trip begins where this one came to rest.
    Rest,
    /// The prior of a start from rest.
    Start,
    /// The prior of a trip's other numbers.
    Usual,
}

/// One linear equation: `residual + Σ slope·Δ = 0`, give or take.
#[derive(Debug, Clone)]
pub(super) struct Linear {
    pub(super) terms: Vec<(usize, f64)>,
    pub(super) residual: f64,
    pub(super) variance: f64,
    /// Variance of one such measurement alone: of a sensor without the factor for common errors of a law's shape, of a stop
    /// the train's own scatter.
    pub(super) once: f64,
    /// The part of the variance (m²) that comes from unknown track; only where a train came to rest.
    pub(super) unknown_track: f64,
    pub(super) source: Source,
}

impl Linear {
    fn new(terms: Vec<(usize, f64)>, residual: f64, variance: f64, source: Source) -> Self {
        Self { terms, residual, variance, once: variance, unknown_track: 0.0, source }
    }

    fn size(&self) -> f64 {
        self.residual.abs() / libm::sqrt(self.variance)
    }

    /// Its robust weight; priors count in full.
    fn robust_weight(&self, believes_all: bool) -> Option<RobustWeight> {
        match self.source {
            _ if believes_all => None,
            Source::Usual | Source::Rest => None,
            Source::Sensor => Some(RobustWeight::SENSORS),
            Source::Stop | Source::Start => Some(RobustWeight::STOPS),
        }
    }

    /// Its weight.
    pub(super) fn weight(&self, believes_all: bool) -> f64 {
        self.robust_weight(believes_all).map_or(1.0, |robust| robust.weight(self.size()))
    }

    /// Its cost.
    pub(super) fn cost(&self, believes_all: bool) -> f64 {
        let size = self.size();
        self.robust_weight(believes_all).map_or(size * size, |robust| robust.cost(size))
    }
}

/// Step of the numerical derivatives, in the unit of each number: small against its uncertainty.
const STEP: f64 = 1e-4;

fn outcome(trip: &Trip, answers: &Answers<'_>, own: &Own, segments: &mut Vec<Segment>) -> Outcome {
    trip.segments(answers, own, segments);
    Course::new(trip, segments).outcome(own)
}

/// The point of a fit about which its trips are linearised.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point<'p> {
    pub(super) columns: &'p Columns,
    /// The lasting numbers.
    pub(super) lasting: &'p [f64],
    pub(super) highest: usize,
    /// The scatter of stops and starts.
    pub(super) scatter: Scatter,
    /// The scatter of sensors.
    pub(super) sensors: &'p SensorVariances,
    /// Prior variance of stop offsets (m²).
    pub(super) stop_offset_variance: f64,
    /// Standard deviation of a stop's shape in its middle, as part of its displacement.
    pub(super) stop_shape_error: f64,
}

/// The first sensor of a trip, as a measurement of where the stop before ended and of how late the start was.
#[derive(Debug, Clone, Copy)]
pub(super) struct FirstSensor {
    /// Speed there (m/s): by so much a late start moves the train back, per second.
    pub(super) speed: f64,
    /// Variance of the train's place there (m²), if place and time of the start were known.
    pub(super) variance: f64,
}

/// A trip with its own numbers, and where the next one begins if it continues there.
#[derive(Debug, Clone, Copy)]
pub(super) struct TripAt<'t> {
    pub(super) trip: &'t Trip,
    pub(super) own: &'t Own,
    pub(super) next_place: Option<f64>,
}

impl Point<'_> {
    /// Steady speed (m/s) of a step from below.
    pub(super) fn speed(&self, step: u8) -> f64 {
        let step = usize::from(step).min(self.highest);
        if step == 0 { 0.0 } else { libm::exp(Answers::new(self.lasting, self.highest).ln_speed(step)) }
    }

    /// A trip's distance to rest from where it began (m), and to the first sensor.
    pub(super) fn reach(&self, trip: &Trip, own: &Own) -> (f64, Option<f64>) {
        let mut segments = Vec::new();
        let outcome = outcome(trip, &Answers::new(self.lasting, self.highest), own, &mut segments);
        (outcome.rest, outcome.at.first().copied())
    }

    /// By how much path length exceeds surveyed length over the sections passed (m), with its terms.
    fn longer<'s>(&self, sections: impl Iterator<Item = &'s usize>) -> (f64, Vec<(usize, f64)>) {
        let mut terms: Vec<(usize, f64)> = Vec::new();
        for column in sections.filter_map(|section| self.columns.sections.get(section)) {
            add_term(&mut terms, *column, 1.0);
        }
        (terms.iter().map(|(column, slope)| slope * self.lasting[*column]).sum(), terms)
    }

    /// What the first sensor of a trip says of the sum of the stop before and its start.
    pub(super) fn first_sensor(&self, at: TripAt<'_>) -> Option<FirstSensor> {
        let TripAt { trip, own, .. } = at;
        let detection = trip.detections.first()?;
        let mut segments = Vec::new();
        trip.segments(&Answers::new(self.lasting, self.highest), own, &mut segments);
        let course = Course::new(trip, &segments);
        let Error { speed, law, .. } = self.error(trip, &course.passages(own).next()?);
        let run = course.outcome(own).at.first()? * TRIP_DEVIATION;
        let timing = speed * speed * detection.variance + self.sensors.of(detection.sensor);
        Some(FirstSensor { speed, variance: timing + law * law + run * run })
    }

    /// The equations of a trip; without slopes only the residuals are set.
    pub(super) fn rows(&self, at: TripAt<'_>, with_slopes: bool) -> Vec<Linear> {
        let TripAt { trip, own, next_place } = at;
        let columns = self.columns;
        let (mut segments, read) = (Vec::new(), Read::nothing());
        trip.segments(&Answers::noting(self.lasting, self.highest, &read), own, &mut segments);
        let mut rows = self.usual(trip, own, &segments);
        let course = Course::new(trip, &segments);
        let here = course.outcome(own);
        let errors: Vec<Error> = course.passages(own).map(|passage| self.error(trip, &passage)).collect();
        let stop_speed = segments.last().map_or(0.0, |segment| segment.from.speed);
        let stop_distance = segments.last().map_or(0.0, Segment::distance_to_rest);
        let stop_step = trip.step_of(segments.len().saturating_sub(1));
        let slopes = if with_slopes { self.slopes(trip, own, &course, &read) } else { Vec::new() };
        let terms_of = |of: &dyn Fn(&Outcome) -> f64| {
            let mut terms = vec![(columns.place(), 1.0)];
            terms.extend(
                slopes
                    .iter()
                    .map(|(column, other)| (*column, (of(other) - of(&here)) / STEP))
                    .filter(|(_, slope)| *slope != 0.0),
            );
            terms
        };
        let row = Linear::new;
        let mut surveyed = 0.0;
        for (index, detection) in trip.detections.iter().enumerate() {
            surveyed += detection.length;
            let passed = trip.detections.iter().take(index + 1).flat_map(|detection| &detection.sections);
            let (longer, sections) = self.longer(passed);
            let mut terms = terms_of(&|outcome| outcome.at[index]);
            subtract(&mut terms, &sections);
            let Error { speed, law, systematic, step } = errors[index];
            let own = speed * speed * detection.variance + self.sensors.of(detection.sensor);
            let variance = own + systematic * systematic * law * law;
            let residual = at.own.place + here.at[index] - surveyed - longer;
            if with_slopes {
                self.scaled(&mut terms, residual, step);
            }
            rows.push(Linear { once: own + law * law, ..row(terms, residual, variance, Source::Sensor) });
        }
        let (longer, sections) =
            self.longer(trip.detections.iter().flat_map(|detection| &detection.sections));
        let beyond_last = own.place + here.rest - surveyed - longer;
        let next_place = next_place.filter(|_| trip.came_to_rest);
        if let Some(next_place) = next_place {
            let mut terms = terms_of(&|outcome| outcome.rest);
            subtract(&mut terms, &sections);
            terms.push((columns.next_place(), -1.0));
            let effect = StopEffect { speed: stop_speed, distance: stop_distance };
            let (offsets, free) = self.stop_offsets(trip, effect, next_place);
            let longer: f64 = offsets.iter().map(|(column, share)| share * self.lasting[*column]).sum();
            terms.extend(offsets);
            let residual = beyond_last + longer - next_place;
            if with_slopes {
                self.scaled(&mut terms, residual, stop_step);
            }
            let variance = REST_SCATTER * REST_SCATTER + free;
            rows.push(Linear { unknown_track: free, ..row(terms, residual, variance, Source::Rest) });
        }
        if let Some(rest) = &trip.measured {
            let counted = || trip.detections.iter().take(rest.detections);
            let taped = counted().map(|detection| detection.length).sum::<f64>() + rest.beyond;
            let passed = counted().flat_map(|detection| &detection.sections).chain(&rest.sections);
            let (taped_longer, taped_sections) = self.longer(passed);
            let tape = TAPE * TAPE + PATH_LENGTH_SPREAD * PATH_LENGTH_SPREAD * rest.beyond * rest.beyond;
            // With a next trip the tape measures its beginning.
            let (mut terms, at_rest) = match next_place {
                Some(place) => {
                    let mut terms = sections;
                    terms.push((columns.next_place(), 1.0));
                    (terms, place + surveyed + longer)
                }
                None => (terms_of(&|outcome| outcome.rest), own.place + here.rest),
            };
            subtract(&mut terms, &taped_sections);
            terms.retain(|(_, slope)| *slope != 0.0);
            rows.push(row(terms, at_rest - taped - taped_longer, tape, Source::Sensor));
        }
        rows
    }

    /// The columns of the stop offsets of a trip that came to rest at a place, with their slopes, and the variance (m²) of what
    /// comes from unknown track.
    fn stop_offsets(&self, trip: &Trip, effect: StopEffect, rest: f64) -> (Vec<(usize, f64)>, f64) {
        let share = stop_offset_share(effect.speed);
        let (mut offsets, mut left): (Vec<(usize, f64)>, f64) = (Vec::new(), 1.0);
        for stop in &trip.stop_edges {
            let part = stop.part_of(effect, rest);
            if let Some(column) = self.columns.stop_offsets.get(&stop.edge).filter(|_| part > 0.0) {
                add_term(&mut offsets, *column, share * part);
                left -= part;
            }
        }
        let left = share * left.max(0.0);
        (offsets, left * left * self.stop_offset_variance)
    }

    /// Timing noise makes residuals in metres that grow with the speed; their slope in ln speed is no error of speed. Without this
    /// correction, smaller speeds and lengths would fit better by least squares.
    fn scaled(&self, terms: &mut Vec<(usize, f64)>, residual: f64, step: u8) {
        if (1..=self.highest).contains(&usize::from(step)) {
            for (knot, weight) in knots_about(usize::from(step), self.highest) {
                if weight > 0.0 {
                    add_term(terms, speed_at(knot), -residual * weight);
                }
            }
        }
    }

    /// Priors of a trip's own numbers.
    fn usual(&self, trip: &Trip, own: &Own, segments: &[Segment]) -> Vec<Linear> {
        let columns = self.columns;
        let mut rows = Vec::new();
        if !trip.continues {
            rows.push(prior(columns.place(), own.place, ANYWHERE, Source::Usual));
        }
        rows.push(prior(columns.late_start(), own.late_start, self.scatter.of_start(), Source::Start));
        for (piece, deviation) in own.deviations.iter().enumerate() {
            let column = columns.deviation(piece);
            match piece.checked_sub(1) {
                None => rows.push(prior(column, *deviation, TRIP_DEVIATION, Source::Usual)),
                Some(before) => {
                    let residual = deviation - own.deviations[before];
                    let mut wander = prior(column, residual, WANDER, Source::Usual);
                    wander.terms.push((columns.deviation(before), -1.0));
                    rows.push(wander);
                }
            }
        }
        for (index, commanded) in trip.commanded.iter().enumerate() {
            let (column, residual) = (columns.change(trip, index), own.changes[index]);
            if commanded.to == 0 {
                // A sensor passed while braking sees the part of the stop's own scatter that has come about by then.
                let speed = segments.get(index + 1).map_or(0.0, |stop| stop.from.speed);
                let (alone, all) = (self.scatter.of_stop_alone(speed), self.scatter.of_stop(speed));
                let stop = prior(column, residual, libm::hypot(all, change_error(0.0)), Source::Stop);
                rows.push(Linear { once: alone * alone, ..stop });
            } else {
                // Starts have residuals of their own, by speed.
                let (from, to) = (self.speed(commanded.from), self.speed(commanded.to));
                let change = if commanded.at_rest { 0.0 } else { to - from };
                rows.push(prior(column, residual, change_error(change), Source::Usual));
            }
        }
        rows
    }

    /// The uncertainty of the place of a trip's train at a sensor.
    fn error(&self, trip: &Trip, at: &Passage<'_>) -> Error {
        let shape_error = if at.segment.is_stop() { self.stop_shape_error } else { SHAPE_ERROR };
        let law = shape_error * at.in_change() * at.segment.displacement().abs();
        // The common errors of starts and of stops are learnt: see `Answers::shape`.
        let change = at.nth.checked_sub(1).and_then(|place| trip.commanded.get(place));
        let is_end = change.is_some_and(|change| change.to == 0 || change.at_rest);
        let systematic = if is_end { 1.0 } else { SYSTEMATIC };
        Error { speed: at.speed(), law, systematic, step: trip.step_of(at.nth) }
    }

    /// The trip simulated with each number on which it can depend changed by one step.
    fn slopes(&self, trip: &Trip, own: &Own, course: &Course<'_>, read: &Read) -> Vec<(usize, Outcome)> {
        let columns = self.columns;
        let mut slopes: Vec<(usize, Outcome)> = Vec::new();
        let mut moved_segments = Vec::new();
        let mut numbers = self.lasting.to_vec();
        let involved = involved(trip, course.segments(), self.highest);
        for column in involved.into_iter().filter(|column| read.contains(*column)) {
            numbers[column] += STEP;
            let answers = Answers::new(&numbers, self.highest);
            slopes.push((column, outcome(trip, &answers, own, &mut moved_segments)));
            numbers[column] = self.lasting[column];
        }
        let mut moved = own.clone();
        if trip.commanded.first().is_some_and(|commanded| commanded.at_rest) {
            let answers = Answers::new(self.lasting, self.highest);
            moved.late_start += STEP;
            slopes.push((columns.late_start(), outcome(trip, &answers, &moved, &mut moved_segments)));
            moved.late_start = own.late_start;
        }
        let mut add = |moved: &Own, column| slopes.push((column, course.outcome(moved)));
        for piece in 0..own.deviations.len() {
            moved.deviations[piece] += STEP;
            add(&moved, columns.deviation(piece));
            moved.deviations[piece] = own.deviations[piece];
        }
        for change in 0..own.changes.len() {
            moved.changes[change] += STEP;
            add(&moved, columns.change(trip, change));
            moved.changes[change] = own.changes[change];
        }
        slopes
    }
}

/// The prior of a number that is about zero.
fn prior(column: usize, residual: f64, deviation: f64, source: Source) -> Linear {
    let variance = deviation * deviation;
    Linear::new(vec![(column, 1.0)], residual, variance, source)
}

pub(super) fn add_term(terms: &mut Vec<(usize, f64)>, column: usize, by: f64) {
    match terms.iter_mut().find(|(known, _)| *known == column) {
        Some((_, slope)) => *slope += by,
        None => terms.push((column, by)),
    }
}

fn subtract(terms: &mut Vec<(usize, f64)>, others: &[(usize, f64)]) {
    for (column, slope) in others {
        add_term(terms, *column, -slope);
    }
}

/// Uncertainty of the place of the train at a sensor.
struct Error {
    /// Speed there (m/s).
    speed: f64,
    /// Standard deviation of the law's shape there (m), ...
    law: f64,
    /// ... and the factor on it for errors that changes of the kind have in common.
    systematic: f64,
    /// The step of that speed.
    step: u8,
}

/// The columns of the train's own numbers on which a trip can depend.
fn involved(trip: &Trip, segments: &[Segment], highest: usize) -> Vec<usize> {
    let mut columns: Vec<usize> = (0..STOP_NODES).collect();
    let mut add = |column: usize| {
        if !columns.contains(&column) {
            columns.push(column);
        }
    };
    for (commanded, segment) in trip.commanded.iter().zip(segments.iter().skip(1)) {
        let nodes = if commanded.to == 0 {
            Some((STOP_NODES, segment.from.set))
        } else {
            commanded.at_rest.then_some((START_NODES, segment.to))
        };
        for (node, weight) in nodes.into_iter().flat_map(|(first, speed)| {
            nodes_about(speed).into_iter().map(move |(node, weight)| (first + node.min(NODES - 1), weight))
        }) {
            if weight != 0.0 {
                add(node);
            }
        }
    }
    let steps = trip.commanded.iter().flat_map(|commanded| [commanded.from, commanded.to]);
    for step in steps.chain(trip.running.map(|(step, _)| step)).map(usize::from) {
        if (1..=highest).contains(&step) {
            for (knot, _) in knots_about(step, highest).into_iter().filter(|(_, weight)| *weight > 0.0) {
                add(speed_at(knot));
                add(hysteresis_at(knot, highest));
            }
        }
    }
    for up in [false, true] {
        let changes = trip.commanded.iter().filter(|change| if up { change.at_rest } else { change.to == 0 });
        if changes.count() > 0 {
            (0..SHAPES).for_each(|nth| add(shape_at(up, highest) + nth));
        }
    }
    debug_assert!(columns.iter().all(|column| *column < count(highest)));
    columns
}
