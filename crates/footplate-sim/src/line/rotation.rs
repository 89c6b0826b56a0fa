//! A wheelset that turns under drive, brake and the force of the rail.
//!
//! ```text
//! J domega/dt = drive - brake - r F(r omega, v)
//! ```
//!
//! Steel on clean steel is so stiff that the wheel finds its creepage within a fraction of a millisecond. The step is
//! therefore semi-implicit: the force is the stiffness at the beginning of the step times the creepage at its end. The
//! chord from the origin is taken and not the tangent: from beyond the peak of the curve, tangents jump from one side
//! of the train's speed to the other for ever. What acts on the train is the same force, so that what the wheelset
//! gains the train loses, to the last bit of arithmetic.

use super::creep_force::Film;

/// One wheelset: its inertia and how it turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rotation {
    /// Moment of inertia, gear and motor included (kg m²).
    pub(crate) inertia: f64,
    /// Radius of the tread (m).
    pub(crate) radius: f64,
    /// Vertical load of the wheelset (N).
    pub(crate) load: f64,
    /// How far it has turned since the beginning (rad).
    pub(crate) angle: f64,
    /// How fast it turns (rad/s).
    pub(crate) omega: f64,
}

/// What acts on the axle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Torques {
    /// Of the motor, forward positive (N m).
    pub(crate) drive: f64,
    /// How much of it goes away with each rad/s more (N m s): large for a motor with speed control.
    pub(crate) drive_stiffness: f64,
    /// What the brake can hold (N m); it acts against the rotation and never turns the wheel.
    pub(crate) brake: f64,
}

/// What a step did.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Step {
    /// The force of the rail on the train through this wheelset (N).
    pub(crate) force: f64,
    /// The torque that the brake really used, against the rotation positive (N m).
    pub(crate) braked: f64,
    /// The torque that the motor really gave (N m).
    pub(crate) driven: f64,
}

impl Rotation {
    /// The speed of the tread (m/s).
    pub(crate) fn speed(&self) -> f64 {
        self.radius * self.omega
    }

    /// Turns for `dt` seconds under a train that moves at `train` (m/s).
    pub(crate) fn step(&mut self, dt: f64, train: f64, film: &Film, torques: Torques) -> Step {
        let (r, before) = (self.radius, self.omega);
        let rail = film.creep_force(0.5 * self.load, r * before, train);
        // Two wheels.
        let (force, stiffness) = (2.0 * rail.force, 2.0 * rail.stiffness);
        let per_torque = dt / (self.inertia + dt * (stiffness * r * r + torques.drive_stiffness));
        let free = before + per_torque * (torques.drive - r * force);
        // Friction in the brake: it takes rotation away until none is left, then it holds.
        let most = per_torque * torques.brake;
        let after = if free.abs() > most { free - most.copysign(free) } else { 0.0 };
        self.omega = after;
        self.angle += 0.5 * dt * (before + after);
        Step {
            force: force + stiffness * r * (after - before),
            braked: (free - after) / per_torque,
            driven: torques.drive - torques.drive_stiffness * (after - before),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.0005;

    fn wheelset(inertia: f64, speed: f64) -> Rotation {
        Rotation { inertia, radius: 0.43, load: 140e3, angle: 0.0, omega: speed / 0.43 }
    }

    fn braked(decelerated: f64) -> Torques {
        // What it takes to decelerate the mass that the wheelset carries.
        Torques { brake: 140e3 / 9.81 * decelerated * 0.43, ..Torques::default() }
    }

    #[test]
    fn momentum_goes_to_the_rail_and_nowhere_else() {
        let mut wheel = wheelset(90.0, 20.0);
        let torques = Torques { drive: 2000.0, ..Torques::default() };
        for _ in 0..1000 {
            let before = wheel.omega;
            let step = wheel.step(DT, 20.0, &Film::WET, torques);
            let gained = 90.0 * (wheel.omega - before) / DT;
            assert!((gained - (step.driven - step.braked - 0.43 * step.force)).abs() < 1e-6);
        }
    }

    #[test]
    fn creepage_settles_where_the_rail_carries_the_torque() {
        for dt in [0.0005, 0.005] {
            let mut wheel = wheelset(90.0, 20.0);
            for _ in 0..(1.0 / dt) as usize {
                wheel.step(dt, 20.0, &Film::DRY, braked(0.7));
            }
            // 10 kN of 140: linear within a few percent, with the stiffness per wheel of the curve.
            let stiffness = 1.4 * 8.4e10 * 6.6e-3 * 6.0e-3 * 4.3 / 2.0;
            let expected = -140e3 / 9.81 * 0.7 / (2.0 * stiffness);
            let creepage = wheel.speed() / 20.0 - 1.0;
            assert!((creepage / expected - 1.0).abs() < 0.1, "{creepage} {expected}");
        }
    }

    #[test]
    fn a_wheel_that_lags_comes_back_to_the_train_and_stays() {
        for dt in [0.0005, 0.005] {
            let mut wheel = wheelset(200.0, 0.9);
            let mut last = 0.1;
            for _ in 0..(2.0 / dt) as usize {
                wheel.step(dt, 1.0, &Film::DRY, Torques::default());
                let lag = 1.0 - wheel.speed();
                assert!((0.0..=last).contains(&lag), "never beyond the train");
                last = lag;
            }
            assert!(last < 1e-6, "{last}");
        }
    }

    /// The mean deceleration of a wheelset that is braked with 1 m/s² from `speed` until it stands, and how long.
    fn lock_up(film: Film, speed: f64) -> (f64, f64) {
        let mut wheel = wheelset(100.0, speed);
        let mut time = 0.0;
        while wheel.omega > 0.0 && time < 5.0 {
            wheel.step(DT, speed, &film, braked(1.0));
            time += DT;
        }
        (speed / time, time)
    }

    #[test]
    fn a_wheelset_locks_as_fast_as_its_inertia_allows() {
        // (brake - mu N) r^2 / J with J = 100 kg m²: 13 m/s² on 0.05 and 19 m/s² on 0.025, with the creep force on its
        // fall from the peak in between.
        let (hard, time) = lock_up(Film::LOW.with_friction(0.05), 20.0 / 3.6);
        assert!((11.0..17.0).contains(&hard), "{hard}");
        assert!((0.3..0.55).contains(&time), "{time}");
        let (harder, time) = lock_up(Film::LEAVES.with_friction(0.025), 20.0 / 3.6);
        assert!((17.0..23.0).contains(&harder), "{harder}");
        assert!((0.2..0.4).contains(&time), "{time}");
    }

    #[test]
    fn a_brake_holds_and_never_turns_the_wheel_back() {
        let mut wheel = wheelset(100.0, 3.0);
        for _ in 0..4000 {
            wheel.step(DT, 3.0, &Film::LEAVES, braked(1.2));
            assert!(wheel.omega >= 0.0);
        }
        assert_eq!(wheel.omega, 0.0);
        // And spins up again when it is released.
        for _ in 0..4000 {
            wheel.step(DT, 3.0, &Film::LEAVES, Torques::default());
        }
        assert!((wheel.speed() - 3.0).abs() < 0.01);
    }
}
