//! One Gaussian that holds the prior and everything learnt from trips that are no longer kept.
//!
//! Marginalising a trip (Schur complement, at the point and with the weights of the last fit) leaves its information on the
//! lasting numbers and on where the next trip begins. The cost of a fit therefore does not grow with the age of a train.
//! Old measurements still count; process noise reduces their weight as the train may have changed since.

use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;

use super::unknowns::Columns;
use crate::linalg::NormalEquations;
use crate::model::motion_model::Counts;
use crate::model::parameters::{SPEEDS, STOP_NODES};
use crate::model::priors::prior;
use crate::model::rescaled::ChangedNumbers;
use crate::model::scatter::ScatterSums;
use crate::model::variation::Variation;

/// No place is farther than this from the sensor passed last (m). Any measurement outweighs this bound.
const BOUND: f64 = 100.0;

/// No law leaves over more than this (m).
const NODE_BOUND: f64 = 10.0;

/// A number that belongs to a place on the layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(untagged))]
enum Local {
    /// By how much a section is longer than surveyed.
    Section(usize),
    /// By how much stops that run over an edge are longer.
    StopOffset {
        /// The edge.
        #[cfg_attr(feature = "serde", serde(alias = "hop"))]
        edge: usize,
    },
}

/// Columns: the numbers of the train, those of places in order of first use, and the place at which the first kept trip begins.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct MarginalPrior {
    pub(super) equations: NormalEquations,
    /// The numbers that belong to places, in the order of the columns.
    #[cfg_attr(feature = "serde", serde(rename = "sections"))]
    local: Vec<Local>,
    /// Counts of the trips that are no longer kept.
    pub(super) counts: Vec<[Counts; 2]>,
    pub(super) scatter: ScatterSums,
    /// Until when (s) it includes the process noise of time.
    widened: f64,
}

impl MarginalPrior {
    /// The prior of any train.
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

    /// Adds columns for sections that are run over for the first time. Surveyed lengths are not part of the prior, because a
    /// survey may be rejected later.
    pub(super) fn meet<'s>(&mut self, passed: impl Iterator<Item = &'s usize>) {
        for section in passed {
            self.meet_local(Local::Section(*section));
        }
    }

    /// Adds columns for edges that a stop ran over for the first time.
    pub(super) fn meet_stops(&mut self, edges: impl Iterator<Item = usize>) {
        for edge in edges {
            self.meet_local(Local::StopOffset { edge });
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
                Local::StopOffset { edge } => stop_offsets.insert(edge, column),
            };
        }
        Columns { sections, stop_offsets, lasting: self.equations.unknowns() - 1 }
    }

    /// Adds the process noise of time: trains get warm, rails get dirty.
    pub(super) fn age(&mut self, values: &[f64], highest: usize, until: f64) {
        let hours = (until - self.widened).max(0.0) / 3600.0;
        self.widened = until;
        self.widen(values, highest, &Variation::per_hour().over(hours));
    }

    /// Adds the process noise between two sessions: train, track and voltage are a little different.
    pub(super) fn begin_session(&mut self, values: &[f64], highest: usize) {
        self.widen(values, highest, &Variation::between_sessions());
    }

    /// The train was measured again and has changed; the track has not. `old` is what the train's numbers were: all lengths
    /// and speeds here may be longer by the same part, which the survey decides later.
    pub(super) fn change(&mut self, old: &[f64], numbers: &ChangedNumbers) {
        self.bound();
        let side = self.equations.unknowns();
        self.equations.change(|values, covariance| {
            for (place, (value, old)) in values.iter_mut().zip(old).enumerate() {
                *value = numbers.value(place, *value - old);
            }
            let places = (0..side).flat_map(|one| (0..=one).map(move |other| (one, other)));
            for (slot, (one, other)) in covariance.iter_mut().zip(places) {
                *slot = numbers.covariance(one, other, *slot);
            }
        });
    }

    /// Gives every number a bound.
    fn bound(&mut self) {
        let side = self.equations.unknowns();
        // The first place, a section or an offset may have no information yet; a covariance needs a bound.
        for free in side - 1 - self.local.len()..side {
            self.equations.add(&[(free, 1.0)], 0.0, BOUND * BOUND);
        }
        for node in STOP_NODES..SPEEDS {
            self.equations.add(&[(node, 1.0)], 0.0, NODE_BOUND * NODE_BOUND);
        }
    }

    fn widen(&mut self, values: &[f64], highest: usize, by: &Variation) {
        self.bound();
        let side = self.equations.unknowns();
        let mut more = vec![0.0; side * (side + 1) / 2];
        let mut add = |one: usize, other: usize, variance: f64| {
            let (low, high) = (one.min(other), one.max(other));
            if let Some(slot) = more.get_mut(high * (high + 1) / 2 + low) {
                *slot += variance;
            }
        };
        by.each(values, highest, &mut add);
        self.equations.widen(&more);
    }
}
