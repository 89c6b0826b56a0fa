//! What a column of a foreign recording can be: our names for it, with the unit in the name.

use crate::tachometer::columns::{KNOWN, Slot};

/// What is in a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Target {
    /// A part of the time of a row.
    Time(TimeForm),
    /// How fast a wheelset turns.
    Turning { wheel: usize, unit: TurningUnit },
    /// The true speed in another unit than m/s, and how many m/s one of it is.
    TrueSpeed(f64),
    /// One of our own columns as it is.
    Own(Slot),
}

/// How the time of a row is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TimeForm {
    /// A number with so many decimals to the nanosecond: 9 for seconds, 6 for milliseconds, 3 for microseconds.
    Number { decimals: u32 },
    /// The number of the row's period, counted from anywhere.
    Sample,
    /// A day with a time.
    DateTime,
    /// A day alone, beside a time of day.
    Date,
    /// A time of day.
    TimeOfDay,
}

/// In what a wheel speed is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum TurningUnit {
    /// A speed of the circumference, and how many m/s one of it is.
    Speed(f64),
    /// Revolutions a minute.
    Rpm,
}

/// Metres a second in a kilometre an hour.
const KM_H: f64 = 1.0 / 3.6;
/// Metres a second in a mile an hour: 1609.344 m in 3600 s.
const MPH: f64 = 0.447_04;

const FOREIGN: [(&str, Target); 16] = [
    ("t_ms", Target::Time(TimeForm::Number { decimals: 6 })),
    ("t_us", Target::Time(TimeForm::Number { decimals: 3 })),
    ("sample", Target::Time(TimeForm::Sample)),
    ("date_time", Target::Time(TimeForm::DateTime)),
    ("date", Target::Time(TimeForm::Date)),
    ("time_of_day", Target::Time(TimeForm::TimeOfDay)),
    ("speed_1_m_s", speed(0, 1.0)),
    ("speed_2_m_s", speed(1, 1.0)),
    ("speed_1_km_h", speed(0, KM_H)),
    ("speed_2_km_h", speed(1, KM_H)),
    ("speed_1_mph", speed(0, MPH)),
    ("speed_2_mph", speed(1, MPH)),
    ("rpm_1", Target::Turning { wheel: 0, unit: TurningUnit::Rpm }),
    ("rpm_2", Target::Turning { wheel: 1, unit: TurningUnit::Rpm }),
    ("true_speed_km_h", Target::TrueSpeed(KM_H)),
    ("true_speed_mph", Target::TrueSpeed(MPH)),
];

/// How many letters may be wrong in a name that is taken for another.
const MOST_MISTAKES: usize = 4;

const fn speed(wheel: usize, m_per_s: f64) -> Target {
    Target::Turning { wheel, unit: TurningUnit::Speed(m_per_s) }
}

impl Target {
    /// What is called so.
    pub(super) fn named(name: &str) -> Option<(&'static str, Self)> {
        all().find(|(known, _)| *known == name)
    }

    /// What a name that is none may have meant.
    pub(super) fn near(name: &str) -> Option<&'static str> {
        let distance = |known: &str| strsim::damerau_levenshtein(known, name);
        let nearest = all().map(|(known, _)| known).min_by_key(|known| distance(known))?;
        (distance(nearest) <= MOST_MISTAKES.min(name.len() / 2)).then_some(nearest)
    }

    /// Which wheelset it counts.
    pub(super) fn wheel(self) -> Option<usize> {
        match self {
            Self::Turning { wheel, .. } | Self::Own(Slot::Pulses(wheel) | Slot::Counter(wheel)) => {
                Some(wheel)
            }
            _ => None,
        }
    }
}

/// All names, ours first.
pub(super) fn all() -> impl Iterator<Item = (&'static str, Target)> {
    let own = KNOWN.iter().map(|(name, slot)| match slot {
        Slot::Time => (*name, Target::Time(TimeForm::Number { decimals: 9 })),
        slot => (*name, Target::Own(*slot)),
    });
    own.chain(FOREIGN)
}
