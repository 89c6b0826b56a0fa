//! The recent trips of a train, and the model that fits them best.
//!
//! One chain of trips: a trip begins where the one before came to rest. With `p` the place where a trip began, counted
//! from the sensor passed last before it, `F(t)` the distance run by the laws and `W` the path length to a sensor as the
//! train measures it, every sensor passed at `t` says `p + F(t) − W = 0`, and every stop that the next trip's `p′` is where
//! this one ended, give or take the scatter of stops. All numbers are found together (Gauss and Newton); the derivatives are
//! numerical. The numbers of single trips, and the places between them, are taken out of the equations trip by trip, and trips
//! of the past for good ([`MarginalPrior`]): a fit costs as much after ten thousand stops as after sixty.
//!
//! A stop and the run to the next sensor are measured as one sum: if the stop is longer, the start may be shorter. The
//! covariance contains that; sensors passed while braking, tapes, and starts to other speeds separate the two. Large residuals
//! count little ([`robust`](super::robust)): one outlier costs one outlier.

mod refit;

use alloc::vec::Vec;

pub use refit::Refit;

use super::chain::Chain;
use super::marginal_prior::MarginalPrior;
use super::rows::{Linear, Point, Source, TripAt};
use super::steady_passes::SteadyPasses;
use super::trip::{Own, Trip};
use super::unknowns::Columns;
use crate::event::{Event, EventKind};
use crate::ids::{SensorId, SpeedStep, TrainId};
use crate::linalg::{Eliminated, NormalEquations};
use crate::model::BlockRelease;
use crate::model::motion_model::{MotionModel, StepUse};
use crate::model::parameters::{START_NODES, STOP_NODES};
use crate::model::priors::{independent_nodes, section_variance};
use crate::model::rescaled::ChangedNumbers;
use crate::model::scatter::{Scatter, ScatterSums, WATCHED_FROM};
use crate::model::survey::{SectionIndex, SurveyTest};
use crate::time::Timestamp;
use crate::track::{Layout, TurnoutStates};

/// After this many steps the iteration ends where it is.
const MOST_ITERATIONS: usize = 15;
/// After this many halvings of a step the point counts as the best.
const MOST_HALVINGS: usize = 6;
/// Longest step of ln speed: beyond it the laws are not linear enough.
const LONGEST_STEP: f64 = 0.6;
/// A step that changes no number by more than this (in its unit) was the last.
const SETTLED: f64 = 2e-4;
/// In this many iterations all rows count in full: at first, large residuals are mostly not outliers.
const ALL_ACCEPTED: usize = 3;
/// How well the total of all sections passed counts as surveyed (m), ...
const TOTAL: f64 = 0.001;
/// ... where lengths of their own make that known to this part at least.
const WELL_SURVEYED: f64 = 0.03;
/// When this many trips are kept, the oldest become part of the prior, ...
const MOST_TRIPS: usize = 60;
/// ... except for this many.
const KEPT_TRIPS: usize = 30;

/// Collects what one train does and fits its [`MotionModel`] to all of it.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotionFit {
    pub(super) model: MotionModel,
    pub(super) prior: MarginalPrior,
    chain: Chain,
    #[cfg_attr(feature = "serde", serde(default))]
    steady: SteadyPasses,
    /// Follows from the layout; made when first needed.
    #[cfg_attr(feature = "serde", serde(skip))]
    sections: Option<SectionIndex>,
    /// How the lengths of the layout compare with what trains ran over; they count for no more than that in a fit.
    #[cfg_attr(feature = "serde", serde(default))]
    survey_test: SurveyTest,
    date: Timestamp,
}

/// A point of the search: the lasting numbers, and those of each kept trip.
#[derive(Debug, Clone)]
struct Values {
    lasting: Vec<f64>,
    trips: Vec<Own>,
}

/// The equations of all that is kept, the numbers of single trips taken out.
#[derive(Debug, Clone)]
struct Reduced {
    /// Of the lasting numbers and the place at which a next trip would begin.
    equations: NormalEquations,
    /// What was taken out, trip by trip, in the order in which it was.
    trips: Vec<Vec<Eliminated>>,
}

/// A sum of unknowns, with its prior mean and variance.
type SurveyRow = (Vec<(usize, f64)>, [f64; 2]);

/// Priors whose widths a fit learns or the layout gives: lengths of sections, stop offsets, and what laws leave over.
///
/// Speeds and lengths could all be longer by the same part, and no timing would tell: where the survey's scale is known, give
/// or take a deviation, its total is the measure. All that is asked of a model, where a train comes to rest, is the same in
/// any.
#[derive(Debug, Clone)]
struct Survey {
    /// Sums of what sections and stops are longer that are nothing, with their variance (m²).
    rows: Vec<SurveyRow>,
    scale: Option<f64>,
}

/// Equations of the lasting numbers alone.
#[derive(Debug, Clone)]
struct Closed {
    equations: NormalEquations,
    /// The place at which a next trip would begin.
    next_place: Eliminated,
    trips: Vec<Vec<Eliminated>>,
}

impl MotionFit {
    /// A fit without data.
    pub fn new(train: TrainId, highest: SpeedStep) -> Self {
        Self {
            model: MotionModel::unknown(train, highest),
            prior: MarginalPrior::new(usize::from(highest.get())),
            chain: Chain::default(),
            steady: SteadyPasses::default(),
            sections: None,
            survey_test: SurveyTest::default(),
            date: Timestamp::ZERO,
        }
    }

    /// Takes the next entry about this train: a command that was sent to it, or a report that data association assigned to it.
    /// The turnouts as they lay at that time.
    pub fn take(&mut self, layout: &Layout, turnouts: &TurnoutStates, event: &Event) {
        match event.kind {
            EventKind::Sensor(report) => {
                let sections = self.sections.get_or_insert_with(|| SectionIndex::of(layout));
                if self.chain.pass(layout, sections, turnouts, event, &self.model.answers()) {
                    self.note_steady_pass(report.sensor);
                }
            }
            EventKind::Speed { train, step } if train == self.model.train() => {
                self.chain.command(event.time, step, &self.model.answers());
                self.steady.interrupt();
            }
            EventKind::Reverse { train } if train == self.model.train() => self.interrupt(),
            EventKind::Stopped { train, landmark, offset } if train == self.model.train() => {
                let sections = self.sections.get_or_insert_with(|| SectionIndex::of(layout));
                self.chain.measure_rest(layout, sections, turnouts, landmark, offset);
            }
            _ => return,
        }
        self.date = event.time;
    }

    /// The scatter of sensors shows where the train runs steadily.
    fn note_steady_pass(&mut self, sensor: SensorId) {
        let Some((detection, step)) = self.chain.steady_pass(&self.model.answers()) else {
            return self.steady.interrupt();
        };
        self.steady.pass(sensor, step, detection);
    }

    /// Begins a run: the train has been running steadily at `step`, or is at rest at step 0. The run has its own clock.
    pub fn begin_run(&mut self, step: SpeedStep) {
        self.steady.interrupt();
        self.chain.begin_run(step);
    }

    /// Begins another session with the train at rest. Train, track and voltage may have changed a little since the last one, so
    /// older measurements count for less. Takes as long as a fit.
    pub fn begin_session(&mut self, sections: &SectionIndex) {
        self.begin_run(SpeedStep::STAND);
        if self.chain.trips.is_empty() {
            return;
        }
        self.refit(sections);
        self.condense(self.chain.trips.len());
        self.prior.begin_session(&self.model.values, self.highest());
        self.refit(sections);
    }

    /// The train was measured again and has changed: what was learnt of it before counts for as much as that leaves of it, and what
    /// was learnt of the track counts as before. Costs a small part of a fit.
    pub fn change(&mut self, numbers: &ChangedNumbers) {
        self.interrupt();
        self.condense(self.chain.trips.len());
        self.prior.change(&self.model.values, numbers);
        self.model = self.model.with_numbers(numbers);
    }

    /// Breaks the chain: the train was lifted, pushed, stalled or lost. Earlier trips still count.
    pub fn interrupt(&mut self) {
        self.steady.interrupt();
        self.chain.interrupt();
    }

    /// The position of the train no longer follows from earlier ones, but it moves as commanded: a train whose place was unknown
    /// was located.
    pub fn lose_place(&mut self) {
        self.steady.interrupt();
        self.chain.lose_place();
    }

    /// Records whether a step moved the train.
    pub fn note_use(&mut self, step: SpeedStep, found: StepUse) {
        self.model.note_use(step, found);
    }

    fn highest(&self) -> usize {
        usize::from(self.model.highest().get())
    }

    fn point<'p>(&'p self, columns: &'p Columns, lasting: &'p [f64]) -> Point<'p> {
        Point {
            columns,
            lasting,
            highest: self.highest(),
            scatter: self.model.scatter,
            sensors: &self.model.sensor_variances,
            stop_offset_variance: self.model.stop_offsets.variance(),
            stop_shape_error: self.model.stop_shape_error(),
        }
    }

    /// Marginalises the oldest trips into the prior.
    fn condense(&mut self, count: usize) {
        let columns = self.prior.columns();
        let values = self.start(&columns);
        let Some(Reduced { equations, .. }) = self.reduced(&columns, &values, false, count) else { return };
        self.prior.scatter = self.scatter_of(&columns, &values, count).with_promises_of(&self.prior.scatter);
        self.prior.equations = equations;
        let old: Vec<Trip> = self.chain.trips.drain(..count.min(self.chain.trips.len())).collect();
        for trip in &old {
            super::learn::count(&mut self.prior.counts, trip);
        }
        if let Some(last) = old.last() {
            self.prior.age(&self.model.values, self.highest(), last.begins);
        }
    }

    /// The start of the search: the last fit, and for new trips the predicted places where they began.
    fn start(&self, columns: &Columns) -> Values {
        let mut lasting = self.model.values.clone();
        lasting.resize(columns.lasting, 0.0);
        for (section, column) in &columns.sections {
            if let (Some(slot), Some((by, _))) = (lasting.get_mut(*column), self.model.section(*section)) {
                *slot = by;
            }
        }
        for (edge, column) in &columns.stop_offsets {
            if let Some(slot) = lasting.get_mut(*column) {
                *slot = self.model.stop_offsets.of(*edge).mean;
            }
        }
        let point = self.point(columns, &lasting);
        let mut trips: Vec<Own> = Vec::with_capacity(self.chain.trips.len());
        let mut next_place = 0.0;
        for trip in &self.chain.trips {
            let mut own = trip.start();
            let (rest, first) = point.reach(trip, &own);
            if trip.own.is_none() {
                let surveyed = trip.detections.first().map_or(0.0, |detection| detection.length);
                own.place = if trip.continues { next_place } else { surveyed - first.unwrap_or(surveyed) };
            }
            next_place =
                own.place + rest - trip.detections.iter().map(|detection| detection.length).sum::<f64>();
            trips.push(own);
        }
        Values { lasting, trips }
    }

    fn trip_at<'t>(&'t self, values: &'t Values, place: usize) -> Option<TripAt<'t>> {
        let next = self.chain.trips.get(place + 1).filter(|next| next.continues);
        let next_place = next.and_then(|_| values.trips.get(place + 1)).map(|own| own.place);
        Some(TripAt { trip: self.chain.trips.get(place)?, own: values.trips.get(place)?, next_place })
    }

    /// The equations of the first so many trips, the trips' own numbers taken out.
    fn reduced(
        &self,
        columns: &Columns,
        values: &Values,
        believes_all: bool,
        count: usize,
    ) -> Option<Reduced> {
        let point = self.point(columns, &values.lasting);
        let mut equations = self.prior.equations.clone();
        let mut trips = Vec::with_capacity(count);
        for place in 0..count {
            let at = self.trip_at(values, place)?;
            let own = at.own.count();
            equations.append(1 + own);
            let here = values.columns_of(place);
            for row in point.rows(at, true) {
                // The row is about the step from here; its terms are about the numbers themselves.
                let now: f64 = row.terms.iter().map(|(column, slope)| slope * here(*column)).sum();
                let variance = row.variance / row.weight(believes_all);
                equations.add(&row.terms, now - row.residual, variance);
            }
            let mut eliminated = Vec::with_capacity(own + 1);
            for _ in 0..own {
                eliminated.push(equations.eliminate_last()?);
            }
            equations.swap_last_two();
            eliminated.push(equations.eliminate_last()?);
            trips.push(eliminated);
        }
        Some(Reduced { equations, trips })
    }

    /// The cost of a point.
    fn cost(&self, columns: &Columns, values: &Values, believes_all: bool) -> f64 {
        let point = self.point(columns, &values.lasting);
        let mut known = values.lasting.clone();
        known.push(values.trips.first().map_or(0.0, |own| own.place));
        let rows = (0..values.trips.len())
            .filter_map(|place| self.trip_at(values, place))
            .flat_map(|at| point.rows(at, false));
        self.prior.equations.cost(&known) + rows.map(|row| row.cost(believes_all)).sum::<f64>()
    }

    /// Compares the first sensor after each new stop with its prediction from before the fit.
    fn compare_promises(&mut self, columns: &Columns, values: &Values) {
        if self.model.stops() < WATCHED_FROM {
            return;
        }
        let point = self.point(columns, &values.lasting);
        let mut scatter = self.prior.scatter;
        for (place, pair) in self.chain.trips.windows(2).enumerate() {
            let [before, after] = pair else { continue };
            // A fit has determined where the stop began, but no fit has seen the following start.
            let is_new = before.own.is_some() && after.own.is_none() && after.continues;
            let Some(next) = self.trip_at(values, place + 1).filter(|_| is_new) else { continue };
            let Some(foreseen) =
                self.trip_at(values, place).and_then(|last| point.foreseen(&self.model, last, next))
            else {
                continue;
            };
            let stop_speed =
                before.commanded.iter().rev().nth(1).map_or(0.0, |commanded| point.speed(commanded.to));
            // Residuals of a young fit scatter too little: it has many parameters to explain them.
            let stops = self.model.scatter.stops.max(1.0);
            let usual = Scatter { stops, ..self.model.scatter }.of_stop_alone(stop_speed);
            let explained = foreseen.variance + usual * usual;
            scatter.take_promise(stop_speed, foreseen.residual * foreseen.residual, explained);
        }
        self.prior.scatter = scatter;
    }

    /// The scatter of stops and starts, by the first `count` kept trips and those before.
    ///
    /// One step of expectation and maximisation (Dempster, Laird and Rubin, 1977). A sensor measures the sum of a stop and the
    /// next start, of which the fit gives each its likely part. That part is smaller than the error itself; the square that is
    /// expected is its square plus the variance that remains.
    fn scatter_of(&self, columns: &Columns, values: &Values, count: usize) -> ScatterSums {
        let mut sums = self.prior.scatter;
        let point = self.point(columns, &values.lasting);
        let mut stop_before = None;
        for place in 0..=count {
            let Some(at) = self.trip_at(values, place) else { break };
            let rows = point.rows(at, false);
            let of = |source| rows.iter().rev().find(|row| row.source == source);
            // Only a stop that the next trip goes on from is measured; what is unknown of its track is measured with it.
            let stopped =
                of(Source::Rest).zip(of(Source::Stop)).map(|(rest, stop)| (stop.clone(), rest.unknown_track));
            let Some((stop, free)) = core::mem::replace(&mut stop_before, stopped) else { continue };
            let Some(start) = of(Source::Start) else { continue };
            let Some(first) = point.first_sensor(at) else { continue };
            let expected = |row: &Linear, own: f64, other: f64| {
                row.residual * row.residual + own * other / (own + other)
            };
            let late = first.speed * first.speed * start.variance;
            let found = expected(&stop, stop.variance, first.variance + late + free);
            // The train's own scatter is this share of the variance of a stop; the floor and late beginnings are the rest.
            let share = stop.once / stop.variance;
            let own = share * found / stop.variance + 1.0 - share;
            sums.stops.take(own * point.scatter.stops * point.scatter.stops);
            let other = (first.variance + stop.variance + free) / (first.speed * first.speed);
            let found = expected(start, start.variance, other);
            sums.starts.take(found / start.variance * point.scatter.starts * point.scatter.starts);
        }
        sums
    }

    /// Takes the release of a block behind the train. Returns whether it agrees with those before.
    pub fn take_release(&mut self, release: &BlockRelease) -> bool {
        self.model.take_release(release)
    }

    /// Keeps the train's length if another copy of its model has measured it later.
    pub const fn keep_length(&mut self, of: &MotionModel) {
        self.model.keep_length(of);
    }

    /// The model as of the last fit.
    pub const fn model(&self) -> &MotionModel {
        &self.model
    }
}

impl Survey {
    fn of(columns: &Columns, index: &SectionIndex, model: &MotionModel) -> Self {
        let mut rows: Vec<SurveyRow> = columns
            .sections
            .iter()
            .map(|(section, column)| (alloc::vec![(*column, 1.0)], [0.0, section_variance(index, *section)]))
            .collect();
        let offsets = columns.stop_offsets.values();
        let offset_variance = model.stop_offsets.variance();
        rows.extend(offsets.map(|column| (alloc::vec![(*column, 1.0)], [0.0, offset_variance])));
        for (first, scale) in [STOP_NODES, START_NODES].into_iter().zip(model.residual_scales) {
            rows.extend(independent_nodes(first).map(|(sum, mean)| (sum, [mean, scale * scale])));
        }
        let of_total = index.scale_variance(columns.sections.keys().copied());
        // What all lengths have in common does not keep their total from being a measure.
        let of_lengths = of_total - index.scale() * index.scale();
        let is_measure = !rows.is_empty() && of_lengths <= WELL_SURVEYED * WELL_SURVEYED;
        let scale = is_measure.then(|| libm::sqrt(of_total));
        if scale.is_some() {
            rows.push((
                columns.sections.values().map(|column| (*column, 1.0)).collect(),
                [0.0, TOTAL * TOTAL],
            ));
        }
        Self { rows, scale }
    }

    fn cost(&self, lasting: &[f64]) -> f64 {
        let sum = |terms: &[(usize, f64)]| -> f64 {
            terms.iter().filter_map(|(column, slope)| Some(slope * lasting.get(*column)?)).sum()
        };
        let square = |by: f64| by * by;
        self.rows.iter().map(|(terms, [mean, variance])| square(sum(terms) - mean) / variance).sum()
    }
}

impl Values {
    /// A part of the step to another point.
    fn towards(&self, other: &Self, part: f64) -> Self {
        let step = |from: &f64, to: &f64| from + part * (to - from);
        Self {
            lasting: self.lasting.iter().zip(&other.lasting).map(|(from, to)| step(from, to)).collect(),
            trips: self.trips.iter().zip(&other.trips).map(|(from, to)| from.with(to, step)).collect(),
        }
    }

    /// The value of each column of the equations with one trip's.
    fn columns_of(&self, place: usize) -> impl Fn(usize) -> f64 + '_ {
        let own = self.trips.get(place).map(Own::flat).unwrap_or_default();
        let next = self.trips.get(place + 1).map_or(0.0, |own| own.place);
        move |column| {
            let Some(behind) = column.checked_sub(self.lasting.len()) else {
                return self.lasting.get(column).copied().unwrap_or(0.0);
            };
            match behind {
                0 => own.first().copied().unwrap_or(0.0),
                1 => next,
                _ => own.get(behind - 1).copied().unwrap_or(0.0),
            }
        }
    }
}

impl Reduced {
    /// Takes out the last place, too, and adds what the survey says.
    fn closed(self, survey: &Survey) -> Option<Closed> {
        let Self { mut equations, trips } = self;
        let next_place = equations.eliminate_last()?;
        for (terms, [mean, variance]) in &survey.rows {
            equations.add(terms, *mean, *variance);
        }
        Some(Closed { equations, next_place, trips })
    }
}

impl Closed {
    /// The best values of all unknowns.
    fn solved(&self, columns: &Columns, trips: &[Trip]) -> Option<Values> {
        let lasting = self.equations.values()?;
        let mut next_place = self.next_place.value(&lasting);
        let mut found: Vec<Own> = Vec::with_capacity(trips.len());
        for (trip, eliminated) in trips.iter().zip(&self.trips).rev() {
            let (place, own) = eliminated.split_last()?;
            // The place was taken out last, when the next one stood before it.
            let mut known = lasting.clone();
            known.push(next_place);
            let place = place.value(&known);
            known.insert(lasting.len(), place);
            for one in own.iter().rev() {
                let value = one.value(&known);
                known.push(value);
            }
            found.push(columns.own(trip, &known));
            next_place = place;
        }
        found.reverse();
        Some(Values { lasting, trips: found })
    }
}
