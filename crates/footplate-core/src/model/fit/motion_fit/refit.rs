//! A fit in parts of milliseconds each, so that it can run between two reports.
//!
//! A part is one Gauss-Newton step. The fit works on a copy: the train may run on meanwhile, and new entries are part of the next
//! fit.

use super::{
    ALL_ACCEPTED, Closed, KEPT_TRIPS, LONGEST_STEP, MOST_HALVINGS, MOST_ITERATIONS, MOST_TRIPS, MotionFit,
    SETTLED, Survey, Values,
};
use crate::model::fit::unknowns::Columns;
use crate::model::parameters::{SPEEDS, knots};
use crate::model::survey::{SectionIndex, SurveyTest};

/// A fit in progress; see [`MotionFit::begin_refit`].
#[derive(Debug, Clone)]
pub struct Refit {
    fit: MotionFit,
    columns: Columns,
    values: Values,
    survey: Survey,
    closed: Option<Closed>,
    iteration: usize,
    /// Trips that have become part of the prior.
    condensed: usize,
    is_over: bool,
}

impl MotionFit {
    /// Begins a fit to all entries so far, with the sections of the layout.
    pub fn begin_refit(&self, sections: &SectionIndex) -> Refit {
        let mut fit = self.clone();
        let passed = fit.chain.trips.iter().flat_map(|trip| &trip.detections);
        fit.prior.meet(passed.flat_map(|detection| &detection.sections));
        let stops = fit.chain.trips.iter().flat_map(|trip| &trip.stop_edges);
        fit.prior.meet_stops(stops.map(|stop| stop.edge));
        let columns = fit.prior.columns();
        let values = fit.start(&columns);
        fit.compare_promises(&columns, &values);
        let doubted = (!fit.survey_test.is_passed()).then(|| fit.survey_test.applied_to(sections));
        let survey = Survey::of(&columns, doubted.as_ref().unwrap_or(sections), &fit.model);
        Refit { fit, columns, values, survey, closed: None, iteration: 0, condensed: 0, is_over: false }
    }

    /// Takes over the result of a fit that was begun here. Newer entries stay and are part of the next fit.
    pub fn adopt(&mut self, refit: Refit) {
        let Refit { mut fit, condensed, .. } = refit;
        fit.model.train_length = self.model.train_length;
        self.chain.trips.drain(..condensed.min(self.chain.trips.len()));
        let own = fit.chain.trips.into_iter().map(|trip| trip.own);
        for (trip, own) in self.chain.trips.iter_mut().zip(own) {
            trip.own = own;
        }
        self.prior = fit.prior;
        self.model = fit.model;
    }

    /// From the next fit on, the lengths of the layout count for no more than a comparison with path lengths leaves of them.
    pub fn widen_by_lengths(&mut self, test: SurveyTest) {
        self.survey_test = test;
    }

    /// The comparison by which the lengths of the layout count.
    pub const fn survey_test(&self) -> &SurveyTest {
        &self.survey_test
    }

    /// Fits to all entries so far, at once. Takes milliseconds: not between two reports.
    pub fn refit(&mut self, sections: &SectionIndex) {
        let mut refit = self.begin_refit(sections);
        while !refit.is_over() {
            refit.go_on();
        }
        self.adopt(refit);
    }
}

impl Refit {
    /// Whether the fit is complete.
    pub const fn is_over(&self) -> bool {
        self.is_over
    }

    /// Does the next part.
    pub fn go_on(&mut self) {
        if self.is_over {
            return;
        }
        if self.iteration >= MOST_ITERATIONS {
            self.conclude();
        } else if self.step() {
            self.iteration += 1;
        } else {
            self.iteration = MOST_ITERATIONS;
        }
    }

    /// One step of the search; `false` where it was the last.
    fn step(&mut self) -> bool {
        let Self { fit, columns, values, survey, .. } = self;
        let accepts_all = self.iteration < ALL_ACCEPTED;
        let now = fit.reduced(columns, values, accepts_all, fit.chain.trips.len());
        let Some(now) = now.and_then(|now| now.closed(survey)) else { return false };
        let Some(next) = now.solved(columns, &fit.chain.trips) else { return false };
        let before = fit.cost(columns, values, accepts_all) + survey.cost(&values.lasting);
        let logarithms = SPEEDS..SPEEDS + knots(fit.highest());
        let longest = values.lasting.get(logarithms.clone()).unwrap_or_default().iter();
        let longest = longest.zip(next.lasting.get(logarithms).unwrap_or_default());
        let longest = longest.map(|(from, to)| (to - from).abs()).fold(0.0, f64::max);
        let mut part = if longest > LONGEST_STEP { LONGEST_STEP / longest } else { 1.0 };
        let mut moved = 0.0_f64;
        for _ in 0..MOST_HALVINGS {
            let tried = values.towards(&next, part);
            if fit.cost(columns, &tried, accepts_all) + survey.cost(&tried.lasting) < before {
                let lasting = values.lasting.iter().zip(&tried.lasting);
                moved = lasting.map(|(from, to)| (to - from).abs()).fold(0.0, f64::max);
                *values = tried;
                break;
            }
            part *= 0.5;
        }
        self.closed = Some(now);
        accepts_all || moved >= SETTLED
    }

    /// Updates the model, and moves the oldest trips into the prior.
    fn conclude(&mut self) {
        self.is_over = true;
        let Self { fit, columns, values, survey, .. } = self;
        // The last equations are those of a point less than a step away.
        let Some(solution) = self.closed.take().and_then(|closed| closed.equations.solve()) else { return };
        for (trip, own) in fit.chain.trips.iter_mut().zip(&values.trips) {
            trip.own = Some(own.clone());
        }
        let trips = fit.chain.trips.len();
        let scatter = fit.scatter_of(columns, values, trips);
        fit.model.learn(columns, &values.lasting, &solution, survey.scale, scatter, fit.date);
        fit.model.sensor_variances = fit.steady.variances();
        fit.model.recount(&fit.prior.counts, &fit.chain.trips);
        if trips >= MOST_TRIPS {
            fit.condense(trips - KEPT_TRIPS);
            self.condensed = trips - fit.chain.trips.len();
        }
    }
}
