//! How much longer than the survey the way from contact to contact is for a train.
//!
//! Surveyed lengths are good to about a centimetre, contacts close at slightly different places, and a train
//! takes curves slower; all three make a hop of the track longer or shorter than drawn. Both directions of a
//! hop are one section and share the correction.

use alloc::vec;
use alloc::vec::Vec;

use crate::track::{HopId, Layout};
use crate::units::Length;

/// How much a train's own correction (curves taken slower, shoe) differs from that of other trains on the
/// same section: 8 mm over ten sections and five published trains.
const OWN_DEVIATION_M: f64 = 0.008;

/// Which section each hop of a layout lies on; a hop and its way back are one.
#[derive(Debug, Clone)]
pub struct SectionIndex {
    of_hop: Vec<u32>,
    /// By section, surveyed length (m) and the variance of its survey (m²).
    surveyed: Vec<(f64, f64)>,
}

impl SectionIndex {
    /// The sections of a layout.
    #[must_use]
    pub fn of(layout: &Layout) -> Self {
        let hops: Vec<_> = layout.hops().collect();
        let mut of_hop = vec![u32::MAX; hops.len()];
        let mut surveyed: Vec<(f64, f64)> = Vec::new();
        let edge_variance = layout.survey().uncertainty.as_m() * layout.survey().uncertainty.as_m();
        for hop in &hops {
            let back = layout.hops_from(hop.to.reverse()).find(|other| {
                other.edges.len() == hop.edges.len()
                    && other.edges.iter().rev().zip(hop.edges).all(|(one, twin)| one.twin() == *twin)
            });
            let known =
                back.and_then(|back| of_hop.get(back.id.index()).copied()).filter(|known| *known != u32::MAX);
            let section = known.unwrap_or_else(|| {
                // Every edge was measured apart; one of no length was not measured at all.
                let lengths = hop.edges.iter().filter_map(|edge| layout.edge(*edge)).map(|edge| edge.length);
                let measured = lengths.filter(|length| *length > Length::ZERO).count().max(1);
                surveyed.push((hop.length.as_m(), edge_variance * measured as f64));
                surveyed.len() as u32 - 1
            });
            if let Some(slot) = of_hop.get_mut(hop.id.index()) {
                *slot = section;
            }
        }
        Self { of_hop, surveyed }
    }

    /// The section of a hop.
    #[inline]
    #[must_use]
    pub fn section(&self, hop: HopId) -> Option<usize> {
        self.of_hop.get(hop.index()).map(|section| *section as usize)
    }

    /// How many sections there are.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.surveyed.len()
    }

    /// Whether the layout has no hops.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.surveyed.is_empty()
    }

    /// Variance of the surveyed length of a section (m²).
    #[inline]
    #[must_use]
    pub fn survey_variance(&self, section: usize) -> f64 {
        self.surveyed.get(section).map_or(0.0, |(_, variance)| *variance)
    }

    /// Surveyed length of a section (m).
    #[inline]
    #[must_use]
    pub fn surveyed_length(&self, section: usize) -> f64 {
        self.surveyed.get(section).map_or(0.0, |(length, _)| *length)
    }

    /// How well the survey knows the way over some sections as a whole: variance of its logarithm. No timing
    /// of trains can narrow it, so every speed found on these sections shares it.
    #[must_use]
    pub fn scale_variance(&self, sections: impl Iterator<Item = usize>) -> f64 {
        let known = sections.filter_map(|section| self.surveyed.get(section));
        let (length, variance) =
            known.fold((0.0, 0.0), |(l, v), (length, variance)| (l + length, v + variance));
        if length > 0.0 { variance / (length * length) } else { 0.0 }
    }
}

/// The corrections of one train, by section.
#[derive(Debug, Clone, Default)]
pub struct LengthTable {
    entries: Vec<Option<Entry>>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Entry {
    /// Correction (m).
    by: f64,
    /// Its variance (m²).
    variance: f64,
}

impl LengthTable {
    /// Correction and variance of a section in m and m²; `None` where the train never was.
    #[inline]
    #[must_use]
    pub fn get(&self, section: usize) -> Option<(f64, f64)> {
        self.entries.get(section).copied().flatten().map(|entry| (entry.by, entry.variance))
    }

    /// The sections on which the train was.
    pub fn known(&self) -> impl Iterator<Item = usize> + '_ {
        self.entries.iter().enumerate().filter_map(|(section, entry)| entry.map(|_| section))
    }

    /// Keeps a correction (m) and its variance (m²).
    #[inline]
    pub fn set(&mut self, section: usize, by: f64, variance: f64) {
        if self.entries.len() <= section {
            self.entries.resize(section + 1, None);
        }
        if let Some(slot) = self.entries.get_mut(section) {
            *slot = Some(Entry { by, variance });
        }
    }

    /// What to expect of a section where a train never was: the survey, and what other trains found there.
    /// Each other train tells of the section only as well as trains are alike.
    #[must_use]
    pub fn pooled<'t>(
        others: impl Iterator<Item = &'t Self>,
        section: usize,
        survey_variance: f64,
    ) -> (f64, f64) {
        let own = OWN_DEVIATION_M * OWN_DEVIATION_M;
        let (mut weight, mut sum) = (1.0 / survey_variance.max(1e-12), 0.0);
        for (by, variance) in others.filter_map(|other| other.get(section)) {
            weight += 1.0 / (variance + own);
            sum += by / (variance + own);
        }
        (sum / weight, 1.0 / weight + own)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_trains_narrow_what_is_expected_but_not_below_their_difference() {
        let mut others = vec![LengthTable::default(); 50];
        for other in &mut others {
            other.set(3, 0.02, 1e-8);
        }
        let survey = 0.010 * 0.010;
        let alone = LengthTable::pooled(core::iter::empty(), 3, survey);
        assert_eq!(alone.0, 0.0);
        assert!((libm::sqrt(alone.1) - 0.0128).abs() < 1e-4);
        let pooled = LengthTable::pooled(others.iter(), 3, survey);
        assert!((pooled.0 - 0.02).abs() < 1e-3 && pooled.1 > 0.008 * 0.008);
    }
}
