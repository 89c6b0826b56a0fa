//! Sections of track: what lies between two neighbouring sensors, in both directions, and how well its length is surveyed.

use alloc::vec;
use alloc::vec::Vec;

use crate::track::{Hop, HopId, Layout, StretchLength};
use crate::units::Length;

/// Which section each hop of a layout lies on; a hop and its reverse are one.
#[derive(Debug, Clone)]
pub struct SectionIndex {
    of_hop: Vec<u32>,
    /// By section, surveyed length (m) and the variance of its survey (m²).
    surveyed: Vec<(f64, f64)>,
    /// By section, whether every edge of it was measured.
    measured: Vec<bool>,
    /// One standard deviation of what all surveyed lengths have in common, as a part.
    scale: f64,
}

impl SectionIndex {
    /// The sections of a layout.
    pub fn of(layout: &Layout) -> Self {
        let hops: Vec<_> = layout.hops().collect();
        let mut of_hop = vec![u32::MAX; hops.len()];
        let mut surveyed: Vec<(f64, f64)> = Vec::new();
        let mut measured: Vec<bool> = Vec::new();
        for hop in &hops {
            let back = layout.hops_from(hop.to.reverse()).find(|other| {
                other.edges.len() == hop.edges.len()
                    && other.edges.iter().rev().zip(hop.edges).all(|(one, twin)| one.twin() == *twin)
            });
            let known =
                back.and_then(|back| of_hop.get(back.id.index()).copied()).filter(|known| *known != u32::MAX);
            let section = known.unwrap_or_else(|| {
                let edges = hop.edges.iter().filter_map(|edge| layout.edge(*edge));
                measured.push(
                    edges.map(|edge| edge.known).all(|known| matches!(known, StretchLength::Measured(_))),
                );
                surveyed.push((hop.length.as_m(), survey_variance(layout, hop)));
                surveyed.len() as u32 - 1
            });
            if let Some(slot) = of_hop.get_mut(hop.id.index()) {
                *slot = section;
            }
        }
        Self { of_hop, surveyed, measured, scale: layout.survey().scale }
    }

    /// The section of a hop.
    #[inline]
    pub fn section(&self, hop: HopId) -> Option<usize> {
        self.of_hop.get(hop.index()).map(|section| *section as usize)
    }

    /// How many sections there are.
    pub const fn len(&self) -> usize {
        self.surveyed.len()
    }

    /// Whether the layout has no hops.
    pub const fn is_empty(&self) -> bool {
        self.surveyed.is_empty()
    }

    /// Variance of the surveyed length of a section (m²).
    #[inline]
    pub fn survey_variance(&self, section: usize) -> f64 {
        self.surveyed.get(section).map_or(0.0, |(_, variance)| *variance)
    }

    /// Surveyed length of a section (m).
    #[inline]
    pub fn surveyed_length(&self, section: usize) -> f64 {
        self.surveyed.get(section).map_or(0.0, |(length, _)| *length)
    }

    /// The same lengths, known worse: each to the variance of its survey times `factor` plus what `added` says of it (m²), and
    /// all of them in common to one standard deviation `scale`, as a part.
    #[must_use]
    pub(super) fn doubted(&self, factor: f64, scale: f64, added: impl Fn(usize) -> f64) -> Self {
        let known = self.surveyed.iter().enumerate();
        let surveyed = known.map(|(section, (length, v))| (*length, v * factor + added(section))).collect();
        Self { surveyed, scale: self.scale.max(scale), ..self.clone() }
    }

    /// Whether every edge of a hop was measured.
    pub fn is_measured(&self, hop: HopId) -> bool {
        self.section(hop).and_then(|section| self.measured.get(section)).copied().unwrap_or(false)
    }

    /// One standard deviation of the factor that all surveyed lengths have in common, as a part.
    pub const fn scale(&self) -> f64 {
        self.scale
    }

    /// How well the survey knows the path over some sections as a whole: variance of its logarithm. No timing
    /// of trains can narrow it, so every speed found on these sections shares it.
    pub fn scale_variance(&self, sections: impl Iterator<Item = usize>) -> f64 {
        let known = sections.filter_map(|section| self.surveyed.get(section));
        let (length, variance) =
            known.fold((0.0, 0.0), |(l, v), (length, variance)| (l + length, v + variance));
        let own = if length > 0.0 { variance / (length * length) } else { 0.0 };
        own + self.scale * self.scale
    }
}

/// Variance of the surveyed length of a hop (m²): every edge was measured apart, unless the whole was.
fn survey_variance(layout: &Layout, hop: &Hop<'_>) -> f64 {
    let squared = |length: Length| length.as_m() * length.as_m();
    if let Some(uncertainty) = layout.surveyed_distance(hop.id) {
        return squared(uncertainty);
    }
    let edges = || hop.edges.iter().filter_map(|edge| layout.edge(*edge));
    // A tape that was laid from turnout to turnout in one place measured nothing.
    let measured = edges().filter(|edge| edge.known != StretchLength::Measured(Length::ZERO));
    let variance: f64 = measured.map(|edge| squared(edge.known.estimate(layout.survey()).1)).sum();
    let is_all_measured = edges().all(|edge| matches!(edge.known, StretchLength::Measured(_)));
    if is_all_measured { variance.max(squared(layout.survey().uncertainty)) } else { variance }
}
