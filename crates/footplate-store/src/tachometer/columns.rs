//! The columns of a tachometer recording: which there are, and which of them a file has.

use super::error::TachometerError;
use super::note::TachometerOddity;
use crate::table::shown;

/// A column of plain numbers that may be missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    Effort,
    Acceleration,
    Balise,
    BaliseDeviation,
    TrueSpeed,
    TrueDistance,
    TrueWheel1,
    TrueWheel2,
}

impl Quantity {
    pub(super) const COUNT: usize = 8;

    pub(super) const fn slot(self) -> usize {
        self as usize
    }

    /// What would be right where something else stands.
    pub(super) const fn expected(self) -> &'static str {
        match self {
            Self::Effort => {
                "a part of the full force from -1 (brake) to 1 (traction), or nothing where it is missing"
            }
            Self::Acceleration => "a finite number of m/s², or nothing where it is missing",
            Self::Balise | Self::TrueDistance => "a finite number of metres, or nothing where it is missing",
            Self::BaliseDeviation => "a standard deviation in metres above 0, or nothing where it is missing",
            Self::TrueSpeed | Self::TrueWheel1 | Self::TrueWheel2 => {
                "a finite number of m/s, or nothing where it is missing"
            }
        }
    }

    /// Whether it can have this value.
    #[inline]
    pub(super) fn fits(self, value: f64) -> bool {
        match self {
            Self::Effort => (-1.0..=1.0).contains(&value),
            Self::BaliseDeviation => value.is_finite() && value > 0.0,
            _ => value.is_finite(),
        }
    }
}

/// What stands in a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Slot {
    Time,
    /// Pulses in the period, of the first or second wheelset.
    Pulses(usize),
    /// A running counter.
    Counter(usize),
    Direction(usize),
    Edge(usize),
    Number(Quantity),
    Run,
    /// Not used.
    Unused,
}

/// What our columns are called.
pub(super) const KNOWN: [(&str, Slot); 18] = [
    ("t_s", Slot::Time),
    ("pulses_1", Slot::Pulses(0)),
    ("pulses_2", Slot::Pulses(1)),
    ("counter_1", Slot::Counter(0)),
    ("counter_2", Slot::Counter(1)),
    ("direction_1", Slot::Direction(0)),
    ("direction_2", Slot::Direction(1)),
    ("edge_1_s", Slot::Edge(0)),
    ("edge_2_s", Slot::Edge(1)),
    ("effort", Slot::Number(Quantity::Effort)),
    ("accel_m_s2", Slot::Number(Quantity::Acceleration)),
    ("balise_m", Slot::Number(Quantity::Balise)),
    ("balise_sd_m", Slot::Number(Quantity::BaliseDeviation)),
    ("run_id", Slot::Run),
    ("true_speed_m_s", Slot::Number(Quantity::TrueSpeed)),
    ("true_distance_m", Slot::Number(Quantity::TrueDistance)),
    ("true_wheel_1_m_s", Slot::Number(Quantity::TrueWheel1)),
    ("true_wheel_2_m_s", Slot::Number(Quantity::TrueWheel2)),
];

/// The columns that a recording has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TachometerColumns {
    /// What stands in each column of the file, from left to right.
    pub(super) slots: Vec<Slot>,
    /// What each column is called.
    pub(super) names: Vec<String>,
}

impl TachometerColumns {
    /// Reads a header, and says what in it is not used.
    pub(super) fn of_header(
        file: &str,
        names: Vec<String>,
    ) -> Result<(Self, Vec<TachometerOddity>), TachometerError> {
        let known = |name: &str| KNOWN.iter().find(|(known, _)| *known == name).map(|(_, slot)| *slot);
        let mut slots: Vec<Slot> = names.iter().map(|name| known(name).unwrap_or(Slot::Unused)).collect();
        let mut oddities = Vec::new();
        let unknown = names.iter().zip(&slots).filter(|(_, slot)| **slot == Slot::Unused);
        let unknown: Vec<String> = unknown.map(|(name, _)| shown(name)).collect();
        if !unknown.is_empty() {
            oddities.push(TachometerOddity::UnknownColumns(unknown));
        }
        let mut missing = Vec::new();
        if !slots.contains(&Slot::Time) {
            missing.push("t_s");
        }
        for (wheel, wanted) in ["pulses_1 (or counter_1)", "pulses_2 (or counter_2)"].into_iter().enumerate()
        {
            let pulses = slots.contains(&Slot::Pulses(wheel));
            let counter = slots.iter_mut().find(|slot| **slot == Slot::Counter(wheel));
            match (pulses, counter) {
                (true, Some(counter)) => {
                    *counter = Slot::Unused;
                    oddities.push(TachometerOddity::CountedTwice { wheelset: wheel + 1 });
                }
                (false, None) => missing.push(wanted),
                _ => {}
            }
        }
        if !missing.is_empty() {
            let found = shown(&names.join(", "));
            return Err(TachometerError::MissingColumns { file: file.to_owned(), found, missing });
        }
        Ok((Self { slots, names }, oddities))
    }

    /// Whether the recording says how fast the train really ran.
    pub fn has_true_speed(&self) -> bool {
        self.slots.contains(&Slot::Number(Quantity::TrueSpeed))
    }

    /// Whether the recording says how far the train really went.
    pub fn has_true_distance(&self) -> bool {
        self.slots.contains(&Slot::Number(Quantity::TrueDistance))
    }

    /// Whether the recording holds many runs, each with its name.
    pub fn has_run_ids(&self) -> bool {
        self.slots.contains(&Slot::Run)
    }

    /// Whether a wheelset is counted by a running counter instead of pulses a period.
    pub(super) fn is_counter(&self, wheel: usize) -> bool {
        self.slots.contains(&Slot::Counter(wheel))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(header: &str) -> Result<(TachometerColumns, Vec<TachometerOddity>), TachometerError> {
        TachometerColumns::of_header("run.csv", header.split(',').map(str::to_owned).collect())
    }

    #[test]
    fn pulses_and_counters_may_be_mixed_and_stand_anywhere() {
        let (columns, oddities) = of("counter_2,run_id,t_s,pulses_1").unwrap();
        assert_eq!(columns.slots, [Slot::Counter(1), Slot::Run, Slot::Time, Slot::Pulses(0)]);
        assert!(columns.is_counter(1) && !columns.is_counter(0) && columns.has_run_ids());
        assert!(oddities.is_empty() && !columns.has_true_speed());
    }

    #[test]
    fn all_that_is_missing_is_listed_at_once() {
        let message = of("time,pulses_1").unwrap_err().to_string();
        assert_eq!(
            message,
            "run.csv: missing columns: t_s, pulses_2 (or counter_2); the header names time, pulses_1 \
             (docs/formats/tachometer-recording.md)"
        );
    }

    #[test]
    fn what_is_not_used_is_said() {
        let (columns, oddities) = of("t_s,pulses_1,counter_1,pulses_2,wind").unwrap();
        assert_eq!(columns.slots[2], Slot::Unused);
        assert_eq!(
            oddities,
            [
                TachometerOddity::UnknownColumns(vec!["wind".to_owned()]),
                TachometerOddity::CountedTwice { wheelset: 1 },
            ]
        );
    }
}
