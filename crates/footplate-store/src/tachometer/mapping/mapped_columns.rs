//! What stands in each column of a file, by its header and a mapping.

use super::column_mapping::ColumnMapping;
use super::target::{Target, TimeForm};
use crate::table::shown;
use crate::tachometer::columns::{Quantity, Slot, TachometerColumns};
use crate::tachometer::error::TachometerError;
use crate::tachometer::note::TachometerOddity;

/// What is missing without any wheelset.
const A_WHEELSET: &str =
    "a wheelset (speed_1_km_h, speed_1_m_s, rpm_1, pulses_1, counter_1 or the same of 2)";
const A_TIME: &str = "a time (t_s, t_ms, t_us, sample, date_time or time_of_day)";

/// A name may have one wrong letter in so many and still be meant.
const MOST_WRONG_IN: usize = 3;

/// What stands in each column, from left to right.
#[derive(Debug, Clone)]
pub(super) struct MappedColumns {
    /// Our name and what it means, where a column is used.
    pub(super) targets: Vec<Option<(&'static str, Target)>>,
    /// The column of the time, and how it is written.
    pub(super) time: usize,
    pub(super) form: TimeForm,
    /// The columns of the day and of the run.
    pub(super) date: Option<usize>,
    pub(super) run: Option<usize>,
}

impl MappedColumns {
    /// Finds every mapped column; columns that have our names already need no mapping.
    pub(super) fn of_header(
        file: &str,
        names: &[String],
        mapping: &ColumnMapping,
    ) -> Result<Self, TachometerError> {
        let conflict = |problem: String| TachometerError::Mapping { file: file.to_owned(), problem };
        let mut targets: Vec<Option<(&'static str, Target)>> = vec![None; names.len()];
        for (ours, target, theirs) in &mapping.pairs {
            let Some(at) = names.iter().position(|name| name == theirs) else {
                return Err(conflict(no_column(ours, theirs, names)));
            };
            if let Some((other, _)) = targets.get(at).copied().flatten() {
                let advice = if target.wheel().is_some() {
                    "; one sensor is one wheelset: leave the other one out"
                } else {
                    ""
                };
                let theirs = shown(theirs);
                return Err(conflict(format!("`{theirs}` is mapped to both {other} and {ours}{advice}")));
            }
            if let Some(at) = targets.get_mut(at) {
                *at = Some((*ours, *target));
            }
        }
        if let Some((one, other)) = contradiction(&targets) {
            return Err(conflict(format!("{one} and {other} say the same; map only one of them")));
        }
        for (at, name) in names.iter().enumerate() {
            let Some(own) = Target::named(name) else { continue };
            let said = targets.iter().flatten().any(|(_, target)| same(*target, own.1));
            if let Some(free @ None) = targets.get_mut(at).filter(|_| !said) {
                *free = Some(own);
            }
        }
        Self::checked(file, names, targets)
    }

    fn checked(
        file: &str,
        names: &[String],
        targets: Vec<Option<(&'static str, Target)>>,
    ) -> Result<Self, TachometerError> {
        let at = |wanted: &dyn Fn(Target) -> bool| {
            targets.iter().position(|target| target.is_some_and(|(_, target)| wanted(target)))
        };
        let date = at(&|target| target == Target::Time(TimeForm::Date));
        let time = at(&|target| matches!(target, Target::Time(_)) && target != Target::Time(TimeForm::Date));
        let run = at(&|target| target == Target::Own(Slot::Run));
        let mut missing = Vec::new();
        if time.is_none() {
            missing.push(A_TIME);
        }
        if !targets.iter().flatten().any(|(_, target)| target.wheel().is_some()) {
            missing.push(A_WHEELSET);
        }
        let form = |at: usize| match targets.get(at).copied().flatten() {
            Some((_, Target::Time(form))) => Some(form),
            _ => None,
        };
        match time.and_then(|time| Some((time, form(time)?))) {
            Some((time, form)) if missing.is_empty() => Ok(Self { targets, time, form, date, run }),
            _ => Err(TachometerError::MappedColumns {
                file: file.to_owned(),
                found: shown(&names.join(", ")),
                missing,
            }),
        }
    }

    /// How the wheelset of a column turns in place of pulses, its direction and times of pulses mean nothing.
    pub(super) fn turns(&self, wheel: usize) -> bool {
        let is_turning = |target: &Option<(&str, Target)>| matches!(target, Some((_, Target::Turning { wheel: of, .. })) if *of == wheel);
        self.targets.iter().any(is_turning)
    }

    /// The columns that come out of it, and what in the header is not used.
    pub(super) fn ours(&self, names: Vec<String>) -> (TachometerColumns, Vec<TachometerOddity>) {
        let slot = |target: &Option<(&'static str, Target)>| match target {
            None | Some((_, Target::Time(TimeForm::Date))) => Slot::Unused,
            Some((_, Target::Time(_))) => Slot::Time,
            Some((_, Target::Turning { wheel, .. })) => Slot::Pulses(*wheel),
            Some((_, Target::TrueSpeed(_))) => Slot::Number(Quantity::TrueSpeed),
            Some((_, Target::Own(slot))) => *slot,
        };
        let slots = self.targets.iter().map(slot).collect();
        let unknown = names.iter().zip(&self.targets).filter(|(_, target)| target.is_none());
        let unknown: Vec<String> = unknown.map(|(name, _)| shown(name)).collect();
        let mut oddities = Vec::new();
        if !unknown.is_empty() {
            oddities.push(TachometerOddity::UnknownColumns(unknown));
        }
        if [0, 1].into_iter().any(|wheel| self.turns(wheel)) {
            oddities.push(TachometerOddity::SpeedsAddedUp);
        }
        (TachometerColumns { slots, names }, oddities)
    }
}

/// Whether two targets cannot both be mapped.
fn same(one: Target, other: Target) -> bool {
    match (one, other) {
        (Target::Time(TimeForm::Date), _) | (_, Target::Time(TimeForm::Date)) => one == other,
        (Target::Time(_), Target::Time(_)) => true,
        (Target::TrueSpeed(_), Target::TrueSpeed(_)) => true,
        (Target::TrueSpeed(_), Target::Own(slot)) | (Target::Own(slot), Target::TrueSpeed(_)) => {
            slot == Slot::Number(Quantity::TrueSpeed)
        }
        _ => one == other || one.wheel().is_some_and(|wheel| other.wheel() == Some(wheel)),
    }
}

fn contradiction(targets: &[Option<(&'static str, Target)>]) -> Option<(&'static str, &'static str)> {
    let mapped: Vec<(&'static str, Target)> = targets.iter().flatten().copied().collect();
    mapped.iter().enumerate().find_map(|(at, (name, target))| {
        let later = mapped.get(at + 1..).unwrap_or_default();
        later.iter().find(|(_, other)| same(*target, *other)).map(|(other, _)| (*name, *other))
    })
}

fn no_column(ours: &str, theirs: &str, names: &[String]) -> String {
    let near = names.iter().min_by_key(|name| strsim::damerau_levenshtein(name, theirs));
    let near = near
        .filter(|name| strsim::damerau_levenshtein(name, theirs) <= theirs.chars().count() / MOST_WRONG_IN);
    let advice = near.map_or_else(
        || format!("it names {}", shown(&names.join(", "))),
        |near| format!("did you mean `{}`?", shown(near)),
    );
    format!("{ours} is mapped to `{}`, which the header does not name; {advice}", shown(theirs))
}
