//! A brake cylinder: how the force of a brake follows what is asked of it.

/// How long the cylinder takes to fill by 63 % (s).
const FILL_S: f64 = 0.4;
/// How long it takes to empty by 63 % through the driver's valve, and how long through the wider valve of the wheel
/// slide protection (s).
const EMPTY_S: f64 = 0.3;
const DUMP_S: f64 = 0.12;
/// A demand that is constant for so long is a new one when it changes (s).
const SETTLED_S: f64 = 0.2;

/// What the valve of the wheel slide protection does.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum Valve {
    /// It is open: the cylinder follows the driver.
    #[default]
    Apply,
    /// It is closed: the pressure stays.
    Hold,
    /// It lets the air out.
    Release,
    /// It lets pass this part of a full brake at most, as a proportional valve does.
    Limit(f64),
}

/// How fast brake and motors follow their command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BrakeTimes {
    /// Before its cylinders begin to fill, and before they begin to empty (s).
    pub(crate) dead: [f64; 2],
    /// Before motors answer (s).
    pub(crate) motors: f64,
    /// How long they take to fill and to empty by 63 % (s).
    pub(crate) fill: f64,
    pub(crate) empty: f64,
}

impl Default for BrakeTimes {
    /// An electrically controlled brake, as the trains of scenarios have.
    fn default() -> Self {
        Self { dead: [0.0; 2], motors: 0.0, fill: FILL_S, empty: EMPTY_S }
    }
}

/// What runs from the driver's handle to cylinders and motors: a command that comes late, to begin and to end.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct CommandLine {
    arrived: f64,
    /// Whether the pressure rises or falls towards the demand, if it does.
    follows: Option<bool>,
    /// How long another demand has waited, and how long there has been none (s).
    waited: f64,
    idle: f64,
}

impl CommandLine {
    /// A line on which a constant demand has arrived.
    pub(crate) const fn settled(demand: f64) -> Self {
        Self { arrived: demand, follows: None, waited: 0.0, idle: 0.0 }
    }

    /// What arrives after `dt` more seconds of a demand, which takes so long to begin and to end.
    pub(crate) fn step(&mut self, dt: f64, demand: f64, [on, off]: [f64; 2]) -> f64 {
        if demand == self.arrived {
            self.idle += dt;
            if self.idle > SETTLED_S {
                (self.follows, self.waited) = (None, 0.0);
            }
            return self.arrived;
        }
        self.idle = 0.0;
        let rises = demand > self.arrived;
        if self.follows != Some(rises) {
            self.waited += dt;
            if self.waited <= if rises { on } else { off } {
                return self.arrived;
            }
            (self.follows, self.waited) = (Some(rises), 0.0);
        }
        self.arrived = demand;
        self.arrived
    }
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
    pub(crate) fn step(&mut self, dt: f64, demand: f64, valve: Valve, times: &BrakeTimes) -> f64 {
        let (target, constant) = match valve {
            Valve::Apply if demand >= self.pressure => (demand, times.fill),
            Valve::Apply => (demand, times.empty),
            Valve::Hold => (self.pressure, times.fill),
            Valve::Release => (0.0, DUMP_S),
            Valve::Limit(most) if demand > most => (most, DUMP_S),
            Valve::Limit(_) if demand >= self.pressure => (demand, times.fill),
            Valve::Limit(_) => (demand, times.empty),
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
                cylinder.step(0.001, demand, valve, &BrakeTimes::default());
            }
            cylinder.pressure
        };
        let gone = 1.0 - libm::exp(-1.0);
        assert!((after(1.0, Valve::Apply, 0.0, FILL_S) - gone).abs() < 2e-3);
        assert!((after(1.0, Valve::Release, 1.0, DUMP_S) - (1.0 - gone)).abs() < 4e-3);
        assert_eq!(after(1.0, Valve::Hold, 0.4, 1.0), 0.4);
        // A proportional valve lets go as fast, and only of what is too much.
        assert!((after(1.0, Valve::Limit(0.2), 1.0, 2.0) - 0.2).abs() < 1e-6);
    }

    #[test]
    fn a_command_arrives_late_and_its_end_later() {
        let mut line = CommandLine::settled(0.0);
        // A ramp to 0.8 in 1 s, held until 5 s, then nothing: seconds at which it is there and gone.
        let (mut came, mut went) = (None, None);
        for step in 0..8000 {
            let time = 0.001 * f64::from(step);
            let demand = if time < 5.0 { (0.8 * time).min(0.8) } else { 0.0 };
            let arrived = line.step(0.001, demand, [0.5, 2.0]);
            came = came.or((arrived > 0.0).then_some(time));
            went = went.or((time > 5.0 && arrived == 0.0).then_some(time));
        }
        assert!(came.is_some_and(|came| (came - 0.5).abs() < 0.01), "{came:?}");
        assert!(went.is_some_and(|went| (went - 7.0).abs() < 0.01), "{went:?}");
    }
}
