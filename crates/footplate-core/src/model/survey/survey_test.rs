//! Whether the lengths of a layout are those that a train ran over.
//!
//! A train feels all lengths longer or shorter by one factor that no timing tells, so lengths are compared with each other:
//! with `m` a surveyed length, `l` what the train makes of it and `k` the median of all `l/m`, a section is off by
//! `l − k m`, and that over its standard deviation (survey, what trains feel of curves, the train's own) is its `z`. Where
//! many are off by more than the survey says of itself, the survey is worse than it says; where single ones are, they are
//! wrong. Medians see either as long as the other half is right.

use alloc::vec::Vec;

use super::section_index::SectionIndex;
use crate::model::PATH_LENGTH_SPREAD;

/// Fewer sections cannot tell which of them is wrong.
const FEWEST: usize = 4;

/// Beyond this many standard deviations a length is not that of the layout: chance alone does it once in 15 000 sections.
const ODD: f64 = 4.0;

/// A survey is doubted as a whole if it is off by so many times what it says of itself, ...
const DOUBTED: f64 = 1.8;

/// ... and of `n` sections by `1.36 + 11.2/n`: chance alone does that once in a thousand layouts (quantiles of 20 000 draws each of 4
/// to 50 sections).
const DOUBTED_BY_CHANCE: [f64; 2] = [1.36, 11.2];

/// As many lengths as one in so many may be wrong each by itself.
const PARTS: usize = 4;

/// Rounds after which it is settled which lengths agree: each adds or removes some of the few that are farthest off.
const ROUNDS: usize = 4;

/// Of a normal distribution, one standard deviation over the median of the sizes.
pub(in crate::model) const PER_MEDIAN: f64 = 1.4826;

/// A section whose surveyed length contradicts what a train made of it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct OddSection {
    /// By its number in the [`SectionIndex`].
    pub section: usize,
    /// Its length by the survey (m).
    pub surveyed: f64,
    /// Its length by the train, as a tape would have it if the survey is right about half of the sections (m).
    pub path_length: f64,
}

/// How a survey compares with what a train ran over.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SurveyTest {
    /// Sections whose lengths contradict, the farthest off first.
    pub odd: Vec<OddSection>,
    /// How many times farther than it says of itself the survey is off; 1 if it is not.
    pub factor: f64,
    /// One standard deviation of the factor that all lengths may have in common, as a part, if the survey is worse than it
    /// says: it may be off in common by as much as its lengths are off each by itself beyond chance. Else zero.
    pub scale: f64,
}

impl Default for SurveyTest {
    /// Nothing was compared.
    fn default() -> Self {
        Self { odd: Vec::new(), factor: 1.0, scale: 0.0 }
    }
}

impl SurveyTest {
    /// Compares the lengths of a survey with a train's: by section, by how much it feels it longer (m), with the variance.
    pub fn of(sections: &SectionIndex, path_length: impl Iterator<Item = (usize, f64, f64)>) -> Self {
        let fits = Self::default();
        let known: Vec<Compared> = compared(sections, path_length);
        if known.len() < FEWEST {
            return fits;
        }
        let Some(usual) = Usual::agreed(&known) else { return fits };
        let [of_many, of_one] = DOUBTED_BY_CHANCE;
        let doubted = DOUBTED.max(of_many + of_one / known.len() as f64);
        let is_doubted = usual.factor > doubted;
        let part =
            PER_MEDIAN * median(known.iter().map(|one| usual.off(one).abs() / one.surveyed)).unwrap_or(0.0);
        // What chance may do is no sign of anything in common: the scale is as sure as before at that limit.
        let chance = doubted / usual.factor;
        let scale = if is_doubted { part * libm::sqrt(1.0 - chance * chance) } else { 0.0 };
        let mut odd: Vec<&Compared> = known.iter().filter(|one| !usual.agrees(one)).collect();
        odd.sort_by(|one, other| usual.z(other).total_cmp(&usual.z(one)));
        let odd = odd.into_iter().map(|one| OddSection {
            section: one.section,
            surveyed: one.surveyed,
            path_length: one.path_length / usual.ratio,
        });
        Self { odd: odd.collect(), factor: if is_doubted { usual.factor } else { 1.0 }, scale }
    }

    /// Whether nothing speaks against the survey.
    pub fn is_passed(&self) -> bool {
        self.odd.is_empty() && self.factor <= 1.0
    }

    /// The sections with what the survey is worth after this: what is off counts for no more than that.
    pub fn applied_to(&self, sections: &SectionIndex) -> SectionIndex {
        sections.doubted(self.factor * self.factor, self.scale, |section| {
            let odd = self.odd.iter().find(|odd| odd.section == section);
            odd.map_or(0.0, |odd| (odd.path_length - odd.surveyed) * (odd.path_length - odd.surveyed))
        })
    }
}

/// What most sections have in common.
struct Usual {
    /// Path length over surveyed length.
    ratio: f64,
    /// By how many of their standard deviations they are off, at least 1.
    factor: f64,
}

impl Usual {
    fn of(sections: &[&Compared]) -> Option<Self> {
        let ratio =
            median(sections.iter().map(|one| one.path_length / one.surveyed)).filter(|ratio| *ratio > 0.0)?;
        let mut usual = Self { ratio, factor: 1.0 };
        usual.factor = (PER_MEDIAN * median(sections.iter().map(|one| usual.z(one)))?).max(1.0);
        Some(usual)
    }

    /// Of those sections that agree with each other. Wrong lengths make the right ones look off: the few that are farthest off
    /// count only once the others agree with them.
    fn agreed(known: &[Compared]) -> Option<Self> {
        let mut near: Vec<&Compared> = known.iter().collect();
        let mut usual = Self::of(&near)?;
        near.sort_by(|one, other| usual.z(one).total_cmp(&usual.z(other)));
        near.truncate(known.len() - known.len() / PARTS);
        for _ in 0..ROUNDS {
            usual = Self::of(&near)?;
            let before = near.len();
            near = known.iter().filter(|one| usual.agrees(one)).collect();
            if near.len() == before {
                break;
            }
        }
        Some(usual)
    }

    /// Whether chance explains by how much a section is off.
    fn agrees(&self, one: &Compared) -> bool {
        self.z(one) <= ODD * self.factor
    }

    /// By how much a section is longer than surveyed (m).
    fn off(&self, one: &Compared) -> f64 {
        one.path_length / self.ratio - one.surveyed
    }

    /// The same in standard deviations, without its sign.
    fn z(&self, one: &Compared) -> f64 {
        self.off(one).abs() / libm::sqrt(one.variance)
    }
}

/// A section that a train ran over (m, m²).
struct Compared {
    section: usize,
    surveyed: f64,
    path_length: f64,
    variance: f64,
}

fn compared(sections: &SectionIndex, path_length: impl Iterator<Item = (usize, f64, f64)>) -> Vec<Compared> {
    let run_over: Vec<(usize, f64, f64)> =
        path_length.filter(|(section, ..)| sections.surveyed_length(*section) > 0.0).collect();
    // What a train does not know of the scale all its lengths share: it is no part of how they differ.
    let part = |section: usize, variance: f64| {
        let length = sections.surveyed_length(section);
        variance / (length * length)
    };
    let shared =
        run_over.iter().map(|(section, _, variance)| part(*section, *variance)).fold(f64::INFINITY, f64::min);
    run_over
        .into_iter()
        .map(|(section, longer, variance)| {
            let surveyed = sections.surveyed_length(section);
            let feels = PATH_LENGTH_SPREAD * surveyed;
            let own = (part(section, variance) - shared) * surveyed * surveyed;
            Compared {
                section,
                surveyed,
                path_length: surveyed + longer,
                variance: sections.survey_variance(section) + feels * feels + own,
            }
        })
        .collect()
}

/// The median; the upper one of the two middle values of an even number.
pub(in crate::model) fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::example::oval;

    /// By how much a train may feel a section longer than surveyed (m), one standard deviation.
    fn sd(sections: &SectionIndex, section: usize) -> f64 {
        let feels = PATH_LENGTH_SPREAD * sections.surveyed_length(section);
        libm::sqrt(sections.survey_variance(section) + feels * feels)
    }

    /// Ten values as a normal distribution of deviation 1 has them.
    const NORMAL: [f64; 10] = [0.13, -0.39, 0.67, -1.04, 1.64, -0.13, 0.39, -0.67, 1.04, -1.64];

    /// A train that feels the sections of the oval longer or shorter by so many standard deviations of the survey.
    fn off_by(deviations: f64) -> SurveyTest {
        let sections = SectionIndex::of(&oval());
        let off = |(section, normal)| (section, deviations * normal * sd(&sections, section), 0.0);
        SurveyTest::of(&sections, NORMAL.into_iter().enumerate().map(off))
    }

    #[test]
    fn the_common_scale_is_as_unsure_as_the_lengths_are_off_beyond_chance() {
        assert_eq!((off_by(2.0).factor, off_by(2.0).scale), (1.0, 0.0));
        // Of ten sections the limit is 2.48: the scale is as sure as before there, and as unsure as the lengths where they are far off.
        for (by, factor, scale) in [(2.2, 2.501, 0.0085), (2.5, 2.840, 0.0365), (8.0, 8.946, 0.2270)] {
            let test = off_by(by);
            assert!(
                (test.factor - factor).abs() < 0.001 && (test.scale - scale).abs() < 0.0001,
                "{by}: {test:?}"
            );
        }
    }

    #[test]
    fn chance_alone_fails_one_survey_in_a_thousand_however_few_sections_there_are() {
        let sections = SectionIndex::of(&oval());
        let mut draws = 1_u64;
        // The sum of twelve uniform values has deviation 1 (Knuth's generator MMIX).
        let mut normal = || {
            let mut uniform = || {
                draws = draws.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (draws >> 11) as f64 / (1_u64 << 53) as f64
            };
            (0..12).map(|_| uniform()).sum::<f64>() - 6.0
        };
        for known in FEWEST..=sections.len() {
            let mut doubted = 0;
            for _ in 0..2_000 {
                let lengths: Vec<_> =
                    (0..known).map(|section| (section, normal() * sd(&sections, section), 0.0)).collect();
                doubted += u32::from(SurveyTest::of(&sections, lengths.into_iter()).factor > 1.0);
            }
            assert!(doubted <= 8, "{doubted} of 2000 with {known} sections");
        }
    }
}
