//! What each contact and each stop of a trip says of the numbers, as linear equations about a point.
#![expect(clippy::indexing_slicing, reason = "columns are counted before the vectors are made by that count")]

use alloc::vec::Vec;

use super::decoder_kind::SHAPE_ERROR;
use super::parameters::{Answers, SPEEDS, hysteresis_at, speed_at};
use super::scatter::usual_scatter;
use super::segment::Segment;
use super::trip::{Own, Trip, Walk};
use super::unknowns::Columns;

/// Contacts close a little earlier or later from one passage to the next (m).
const CONTACT_SCATTER: f64 = 0.0015;
/// What a tape or the train's own settling leaves of a place of rest (m).
const REST_SCATTER: f64 = 0.0005;

/// One linear equation: `residual + Σ slope·Δ = 0`, give or take.
#[derive(Debug, Clone)]
pub(super) struct Linear {
    pub(super) terms: Vec<(usize, f64)>,
    pub(super) residual: f64,
    pub(super) variance: f64,
    pub(super) is_stop: bool,
}

/// Residuals beyond this many standard deviations count linearly (Huber, 1964).
const HUBER: f64 = 2.5;

impl Linear {
    fn size(&self) -> f64 {
        self.residual.abs() / libm::sqrt(self.variance)
    }

    /// How much it counts.
    pub(super) fn weight(&self, believes_all: bool) -> f64 {
        if believes_all { 1.0 } else { (HUBER / self.size()).min(1.0) }
    }

    /// What its residual costs.
    pub(super) fn cost(&self, believes_all: bool) -> f64 {
        let size = self.size();
        if believes_all || size <= HUBER { size * size } else { HUBER * (2.0 * size - HUBER) }
    }
}

/// Steps of the numerical derivatives, in the unit of each number: small against its doubt.
fn step_of(column: usize) -> f64 {
    if column < SPEEDS { 1e-4 } else { 1e-5 }
}

/// What a trip comes to with some numbers: way (m) at each contact, and at rest; speed and doubt of the law besides.
struct Outcome {
    ways: Vec<f64>,
    rest: f64,
}

fn outcome(trip: &Trip, answers: &Answers<'_>, own: &Own, segments: &mut Vec<Segment>) -> Outcome {
    trip.segments(answers, own, segments);
    let mut walk = Walk::new(trip, own, segments);
    let ways = trip.contacts.iter().map(|contact| walk.way(contact.time)).collect();
    Outcome { ways, rest: walk.way_to_rest() }
}

/// A point about which equations are made straight.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point<'p> {
    pub(super) trips: &'p [Trip],
    pub(super) columns: &'p Columns,
    pub(super) x: &'p [f64],
    pub(super) highest: usize,
    /// How far stops scatter against what trains usually do.
    pub(super) scale: f64,
    /// Part of a stop's displacement by which its shape is not true in its middle.
    pub(super) stop_shape_error: f64,
}

impl Point<'_> {
    /// The equations of all trips; without slopes they only tell how far off the point is.
    pub(super) fn rows(&self, with_slopes: bool) -> Vec<Linear> {
        let mut rows = Vec::new();
        for place in 0..self.trips.len() {
            trip_rows(self, place, with_slopes, &mut rows);
        }
        rows
    }
}

/// Adds the equations of one trip.
fn trip_rows(point: &Point<'_>, place: usize, with_slopes: bool, rows: &mut Vec<Linear>) {
    let Point { trips, columns, x, highest, scale, stop_shape_error } = *point;
    let Some(trip) = trips.get(place) else { return };
    let own = columns.own(place, trip, x);
    let mut segments = Vec::new();
    let mut numbers = x[..columns.lasting].to_vec();
    let here = outcome(trip, &Answers::new(&numbers, highest), &own, &mut segments);
    let doubts = doubts(trip, &own, &segments, stop_shape_error);
    let stop_speed = segments.last().map_or(0.0, |segment| segment.from.speed);

    let mut slopes: Vec<(usize, Outcome)> = Vec::new();
    let involved = if with_slopes { involved(trip, highest) } else { Vec::new() };
    for column in involved {
        let step = step_of(column);
        numbers[column] += step;
        slopes.push((column, outcome(trip, &Answers::new(&numbers, highest), &own, &mut segments)));
        numbers[column] = x[column];
    }
    let answers = Answers::new(&numbers, highest);
    let mut moved = own.clone();
    let step = 1e-4;
    if with_slopes && trip.told.first().is_some_and(|told| told.at_rest) {
        moved.late_start += step;
        slopes.push((columns.late_start(place), outcome(trip, &answers, &moved, &mut segments)));
        moved.late_start = own.late_start;
    }
    let (pieces, told) = if with_slopes { (trip.pieces.len(), trip.told.len()) } else { (0, 0) };
    for piece in 0..pieces {
        moved.deviations[piece] += step;
        slopes.push((columns.deviation(place, piece), outcome(trip, &answers, &moved, &mut segments)));
        moved.deviations[piece] = own.deviations[piece];
    }
    for told in 0..told {
        moved.changes[told] += step;
        slopes.push((columns.change(place, trip, told), outcome(trip, &answers, &moved, &mut segments)));
        moved.changes[told] = own.changes[told];
    }
    let slope_step = |column: usize| if column < columns.lasting { step_of(column) } else { step };

    let began = columns.place(place);
    let (mut way, mut sections): (f64, Vec<(usize, f64)>) = (0.0, Vec::new());
    for (index, contact) in trip.contacts.iter().enumerate() {
        way += contact.way;
        for column in contact.sections.iter().filter_map(|section| columns.sections.get(section)) {
            add_term(&mut sections, *column, -1.0);
        }
        let felt: f64 = sections.iter().map(|(column, slope)| slope * x[*column]).sum();
        let mut terms = sections.clone();
        terms.push((began, 1.0));
        for (column, other) in &slopes {
            let slope = (other.ways[index] - here.ways[index]) / slope_step(*column);
            if slope != 0.0 {
                terms.push((*column, slope));
            }
        }
        let (speed, law) = doubts[index];
        let variance = speed * speed * contact.variance + law * law + CONTACT_SCATTER * CONTACT_SCATTER;
        let residual = x[began] + here.ways[index] - way + felt;
        rows.push(Linear { terms, residual, variance, is_stop: false });
    }
    if trips.get(place + 1).is_some_and(|next| next.continues) && trip.came_to_rest {
        let felt: f64 = sections.iter().map(|(column, slope)| slope * x[*column]).sum();
        let next = columns.place(place + 1);
        let mut terms = sections;
        terms.extend([(began, 1.0), (next, -1.0)]);
        for (column, other) in &slopes {
            let slope = (other.rest - here.rest) / slope_step(*column);
            if slope != 0.0 {
                terms.push((*column, slope));
            }
        }
        let scatter = scale * usual_scatter(stop_speed);
        let residual = x[began] + here.rest - way + felt - x[next];
        let variance = scatter * scatter + REST_SCATTER * REST_SCATTER;
        rows.push(Linear { terms, residual, variance, is_stop: true });
    }
}

fn add_term(terms: &mut Vec<(usize, f64)>, column: usize, by: f64) {
    match terms.iter_mut().find(|(known, _)| *known == column) {
        Some((_, slope)) => *slope += by,
        None => terms.push((column, by)),
    }
}

/// Speed (m/s) at each contact, and by how much the law's shape may be off there (m).
fn doubts(trip: &Trip, own: &Own, segments: &[Segment], stop_shape_error: f64) -> Vec<(f64, f64)> {
    let mut walk = Walk::new(trip, own, segments);
    trip.contacts
        .iter()
        .map(|contact| {
            walk.way(contact.time);
            let (middle, displacement) = walk.in_change(contact.time);
            let shape_error = if walk.is_stopping() { stop_shape_error } else { SHAPE_ERROR };
            (walk.speed(contact.time), shape_error * middle * displacement.abs())
        })
        .collect()
}

/// The columns of the train's own numbers on which a trip can depend.
fn involved(trip: &Trip, highest: usize) -> Vec<usize> {
    let mut columns: Vec<usize> = (0..SPEEDS).collect();
    let mut steps: Vec<u8> =
        trip.told.iter().map(|told| told.to).chain(trip.running.map(|(step, _)| step)).collect();
    steps.sort_unstable();
    steps.dedup();
    for step in steps.into_iter().map(usize::from).filter(|step| (1..=highest).contains(step)) {
        columns.push(speed_at(step));
        columns.push(hysteresis_at(step, highest));
    }
    columns
}
