//! A brake cylinder: how the force of a brake follows what is asked of it.

/// How long the cylinder takes to fill by 63 % (s).
const FILL_S: f64 = 0.4;
/// How long it takes to empty by 63 % through the driver's valve, and how long through the wider valve of the wheel
/// slide protection (s).
const EMPTY_S: f64 = 0.3;
const DUMP_S: f64 = 0.12;

/// What the valve of the wheel slide protection does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Valve {
    /// It is open: the cylinder follows the driver.
    #[default]
    Apply,
    /// It is closed: the pressure stays.
    Hold,
    /// It lets the air out.
    Release,
}

/// The pressure of a cylinder, as part of that of a full brake.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct BrakeCylinder {
    pressure: f64,
}

impl BrakeCylinder {
    /// A cylinder that has followed a constant demand for long.
    pub(crate) const fn settled(pressure: f64) -> Self {
        Self { pressure }
    }

    /// Follows the demand for `dt` seconds and returns the pressure then.
    pub(crate) fn step(&mut self, dt: f64, demand: f64, valve: Valve) -> f64 {
        let (target, constant) = match valve {
            Valve::Apply if demand >= self.pressure => (demand, FILL_S),
            Valve::Apply => (demand, EMPTY_S),
            Valve::Hold => (self.pressure, FILL_S),
            Valve::Release => (0.0, DUMP_S),
        };
        // Implicit, so that no step is too long.
        self.pressure += (target - self.pressure) * dt / (constant + dt);
        self.pressure
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_fills_slowly_and_lets_go_fast() {
        let after = |demand, valve, start, time: f64| {
            let mut cylinder = BrakeCylinder::settled(start);
            for _ in 0..(time / 0.001).round() as usize {
                cylinder.step(0.001, demand, valve);
            }
            cylinder.pressure
        };
        let gone = 1.0 - libm::exp(-1.0);
        assert!((after(1.0, Valve::Apply, 0.0, FILL_S) - gone).abs() < 2e-3);
        assert!((after(1.0, Valve::Release, 1.0, DUMP_S) - (1.0 - gone)).abs() < 4e-3);
        assert_eq!(after(1.0, Valve::Hold, 0.4, 1.0), 0.4);
    }
}
