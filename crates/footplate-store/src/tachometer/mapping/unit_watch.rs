//! Whether speeds and times can be in the units that a mapping says.
//!
//! Wheels may spin, so a single row says nothing. A second in which every wheelset turns a quarter faster than the train can run
//! is another unit; so are times whose steps no odometry period has, while in another unit they would be one.

use footplate_core::Timestamp;

use super::target::{Target, TimeForm, TurningUnit, all};

/// Faster than the top speed by this part is no wrong top speed and no worn wheel.
const TOO_FAST: f64 = 1.25;
/// So long and so many rows have to be too fast in a row (s).
const LASTING_S: f64 = 1.0;
const LASTING_ROWS: u32 = 5;
/// The steps of time that are looked at, of which the middle one counts.
const STEPS: usize = 15;
/// An odometry period lasts between these (s): a recorder of one row in two seconds, and a sensor read 1000 times a second.
const PERIODS_S: [f64; 2] = [1e-3, 2.0];

/// Watches the first wheelset that has a speed, and the times.
#[derive(Debug, Clone)]
pub(super) struct UnitWatch {
    top: f64,
    fast: Option<(Timestamp, u32)>,
    latest: Option<Timestamp>,
    steps: Vec<f64>,
}

impl UnitWatch {
    /// For a train that runs at most so fast (m/s).
    pub(super) fn new(top: f64) -> Self {
        Self { top, fast: None, latest: None, steps: Vec::with_capacity(STEPS) }
    }

    /// Takes in a row with the speeds of all wheelsets that are recorded as speeds; whether they are too fast to be true.
    pub(super) fn too_fast(&mut self, time: Timestamp, speeds: [Option<f64>; 2]) -> bool {
        let known = || speeds.iter().flatten();
        if known().next().is_none() {
            return false;
        }
        if known().any(|speed| speed.abs() <= TOO_FAST * self.top) {
            self.fast = None;
            return false;
        }
        let (since, rows) = self.fast.get_or_insert((time, 0));
        *rows += 1;
        *rows >= LASTING_ROWS && (time - *since).as_s() >= LASTING_S
    }

    /// What to map a column as instead, when this stands in it and is too fast.
    pub(super) fn cure(&self, target: Target, value: f64) -> String {
        let Target::Turning { wheel, unit } = target else { return String::new() };
        let fits = |other: f64| (value * other).abs() <= self.top;
        let units = all().filter_map(|(name, target)| match target {
            Target::Turning { wheel: of, unit: TurningUnit::Speed(other) } if of == wheel && fits(other) => {
                (target != Target::Turning { wheel, unit }).then_some(name)
            }
            _ => None,
        });
        let units: Vec<&str> = units.collect();
        match (unit, units.as_slice()) {
            (TurningUnit::Rpm, []) | (TurningUnit::Speed(_), []) => {
                "check max_speed_m_s and diameter_m of the vehicle".to_owned()
            }
            (_, units) => format!("map it as {}, or check max_speed_m_s of the vehicle", units.join(" or ")),
        }
    }

    /// Takes in the time of a row of the first run; the usual step (s) and the name of the unit in which it would be a period,
    /// if it is none in this one.
    pub(super) fn other_unit(&mut self, form: TimeForm, time: Timestamp) -> Option<(f64, &'static str)> {
        let TimeForm::Number { decimals } = form else { return None };
        if self.steps.len() >= STEPS {
            return None;
        }
        let before = self.latest.replace(time)?;
        self.steps.push((time - before).as_s());
        if self.steps.len() < STEPS {
            return None;
        }
        let mut steps = self.steps.clone();
        steps.sort_by(f64::total_cmp);
        let step = steps.get(STEPS / 2).copied()?;
        let [shortest, longest] = PERIODS_S;
        let fits = |step: f64| (shortest..=longest).contains(&step);
        if fits(step) || step <= 0.0 {
            return None;
        }
        [("t_s", 9), ("t_ms", 6), ("t_us", 3)].into_iter().find_map(|(name, other)| {
            let scaled = step * 10_f64.powi(other - i32::try_from(decimals).unwrap_or(other));
            fits(scaled).then_some((step, name))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KM_H_AS_M_S: Target = Target::Turning { wheel: 0, unit: TurningUnit::Speed(1.0) };

    #[test]
    fn a_second_too_fast_is_another_unit_and_a_spike_is_none() {
        let mut watch = UnitWatch::new(40.0);
        let mut told = |n: i64, speeds| watch.too_fast(Timestamp::from_ns(100_000_000 * n), speeds);
        for n in 0..5 {
            assert!(!told(n, [Some(300.0), Some(20.0)]), "one wheelset may spin");
        }
        for n in 5..15 {
            assert!(!told(n, [Some(90.0), Some(90.0)]), "{n}");
        }
        assert!(told(15, [Some(90.0), None]));
        let cure = watch.cure(KM_H_AS_M_S, 90.0);
        assert_eq!(cure, "map it as speed_1_km_h, or check max_speed_m_s of the vehicle");
        assert!(watch.cure(KM_H_AS_M_S, 1e6).contains("check max_speed_m_s and diameter_m"));
    }

    #[test]
    fn milliseconds_read_as_seconds_are_known_by_their_steps() {
        let steps = |form, ns: i64| {
            let mut watch = UnitWatch::new(40.0);
            (0..40).find_map(|n| watch.other_unit(form, Timestamp::from_ns(n * ns)))
        };
        let seconds = TimeForm::Number { decimals: 9 };
        assert_eq!(steps(seconds, 50_000_000_000), Some((50.0, "t_ms")));
        assert_eq!(steps(seconds, 50_000_000), None);
        assert_eq!(steps(TimeForm::Number { decimals: 6 }, 50_000), Some((5e-5, "t_s")));
        assert_eq!(steps(TimeForm::Sample, 50_000), None);
    }
}
