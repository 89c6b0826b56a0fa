//! How hard a train can pull at each speed: a table, or a force limited by power.

use footplate_core::Speed;

/// The largest force that traction gives, by speed.
#[derive(Debug, Clone, PartialEq)]
pub enum TractiveEffort {
    /// Speeds and forces (N), speeds rising; straight lines between them, the nearest force beyond them.
    Table(Vec<(Speed, f64)>),
    /// min(F, P / v): what adhesion or the motors allow, and what the power supply gives.
    ForceAndPower {
        /// The force at low speed (N).
        force_n: f64,
        /// The power at the wheel rim (W).
        power_w: f64,
    },
}

impl TractiveEffort {
    /// The force (N) at a speed; the sign of the speed does not matter.
    pub fn at(&self, speed: Speed) -> f64 {
        let speed = speed.abs();
        match self {
            Self::Table(points) => {
                let next = points.partition_point(|(from, _)| *from <= speed);
                match (next.checked_sub(1).and_then(|below| points.get(below)), points.get(next)) {
                    (Some(&(v0, f0)), Some(&(v1, f1))) => f0 + (f1 - f0) * ((speed - v0) / (v1 - v0)),
                    (Some(&(_, force)), None) | (None, Some(&(_, force))) => force,
                    (None, None) => 0.0,
                }
            }
            Self::ForceAndPower { force_n, power_w } => force_n.min(power_w / speed.as_m_per_s()),
        }
    }

    /// The largest force (N) at any speed.
    pub fn largest(&self) -> f64 {
        match self {
            Self::Table(points) => points.iter().map(|(_, force)| *force).fold(0.0, f64::max),
            Self::ForceAndPower { force_n, .. } => *force_n,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(effort: &TractiveEffort, m_per_s: f64) -> f64 {
        effort.at(Speed::from_m_per_s(m_per_s))
    }

    #[test]
    fn a_table_is_read_between_its_points_and_held_beyond_them() {
        let points = [(1.0, 100.0), (2.0, 60.0), (4.0, 20.0)];
        let table = TractiveEffort::Table(points.map(|(v, f)| (Speed::from_m_per_s(v), f)).into());
        let read = [0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0, -3.0].map(|v| at(&table, v));
        assert_eq!(read, [100.0, 100.0, 80.0, 60.0, 40.0, 20.0, 20.0, 40.0]);
        assert_eq!(table.largest(), 100.0);
    }

    #[test]
    fn power_takes_over_where_force_times_speed_reaches_it() {
        // 200 kN and 2600 kW meet at 13 m/s.
        let motor = TractiveEffort::ForceAndPower { force_n: 200e3, power_w: 2.6e6 };
        assert_eq!(at(&motor, 0.0), 200e3);
        assert_eq!(at(&motor, 13.0), 200e3);
        assert_eq!(at(&motor, 26.0), 100e3);
        assert_eq!(motor.largest(), 200e3);
    }
}
