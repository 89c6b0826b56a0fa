//! What trips that are no longer kept say of a train, and what was known before the first: one Gaussian.
//!
//! Taking a trip out of the equations leaves what it says of the numbers that last and of where the next trip begins
//! (Schur complement), at the point and with the weights of the last fit. So the cost of a fit does not grow with the
//! age of a train, and old measurements still count: as much as is right after what may have changed since.

use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;

use super::unknowns::Columns;
use crate::linalg::NormalEquations;
use crate::model::motion_model::Counts;
use crate::model::priors::prior;
use crate::model::scatter::ScatterSums;
use crate::model::variation::Variation;

/// No place is farther (m) from the sensor passed last: what this adds to knowledge is nothing beside any measurement.
const BOUND: f64 = 100.0;

/// A number that belongs to a place on the layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(untagged))]
enum Local {
    /// By how much a section is longer than surveyed.
    Section(usize),
    /// By how much stops that end on a hop are longer.
    StopOffset {
        /// The hop.
        hop: usize,
    },
}

/// The numbers of a train, then those of places in the order in which they were met, then the place at which the first kept
/// trip begins.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct MarginalPrior {
    pub(super) equations: NormalEquations,
    /// What belongs to places, in the order of the columns.
    #[cfg_attr(feature = "serde", serde(rename = "sections"))]
    local: Vec<Local>,
    /// What was counted of the trips that are no longer kept.
    pub(super) counts: Vec<[Counts; 2]>,
    pub(super) scatter: ScatterSums,
    /// Until when (s) variation with time is in it.
    widened: f64,
}

impl MarginalPrior {
    /// What is known of any train.
    pub(super) fn new(highest: usize) -> Self {
        let mut equations = prior(highest);
        equations.append(1);
        Self {
            equations,
            local: Vec::new(),
            counts: vec![[Counts::default(); 2]; highest + 1],
            scatter: ScatterSums::default(),
            widened: 0.0,
        }
    }

    /// Sections are run over, perhaps for the first time. What a survey says of them is not in it: a survey may be doubted
    /// later.
    pub(super) fn meet<'s>(&mut self, passed: impl Iterator<Item = &'s usize>) {
        for section in passed {
            self.meet_local(Local::Section(*section));
        }
    }

    /// Stops ended on hops, perhaps for the first time.
    pub(super) fn meet_stops(&mut self, hops: impl Iterator<Item = usize>) {
        for hop in hops {
            self.meet_local(Local::StopOffset { hop });
        }
    }

    fn meet_local(&mut self, local: Local) {
        if self.local.contains(&local) {
            return;
        }
        self.local.push(local);
        self.equations.append(1);
        self.equations.swap_last_two();
    }

    /// The columns of a fit.
    pub(super) fn columns(&self) -> Columns {
        let first = self.equations.unknowns() - 1 - self.local.len();
        let (mut sections, mut stop_offsets) = (BTreeMap::new(), BTreeMap::new());
        for (column, local) in (first..).zip(&self.local) {
            match *local {
                Local::Section(section) => sections.insert(section, column),
                Local::StopOffset { hop } => stop_offsets.insert(hop, column),
            };
        }
        Columns { sections, stop_offsets, lasting: self.equations.unknowns() - 1 }
    }

    /// Time has passed on a chain that goes on: trains get warm, rails get dirty.
    pub(super) fn age(&mut self, highest: usize, until: f64) {
        let hours = (until - self.widened).max(0.0) / 3600.0;
        self.widened = until;
        self.widen(highest, &Variation::per_hour().over(hours));
    }

    /// A session is over: by the next the train, the track and the voltage are a little different.
    pub(super) fn begin_session(&mut self, highest: usize) {
        self.widen(highest, &Variation::between_sessions());
    }

    fn widen(&mut self, highest: usize, by: &Variation) {
        let side = self.equations.unknowns();
        // Where the first kept trip begins may not be known at all, nor a section or an offset; a covariance needs a bound.
        for free in side - 1 - self.local.len()..side {
            self.equations.add(&[(free, 1.0)], 0.0, BOUND * BOUND);
        }
        let mut more = vec![0.0; side * (side + 1) / 2];
        let mut add = |one: usize, other: usize, variance: f64| {
            let (low, high) = (one.min(other), one.max(other));
            if let Some(slot) = more.get_mut(high * (high + 1) / 2 + low) {
                *slot += variance;
            }
        };
        by.each(highest, &mut add);
        self.equations.widen(&more);
    }
}
