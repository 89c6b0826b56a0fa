//! Slip control of a driven bogie: takes torque away while a wheelset spins.

/// A wheelset spins when it is faster than the reference by more than this (m/s) and this part of it.
const SPIN_M_PER_S: f64 = 0.8;
const SPIN_PART: f64 = 0.1;
/// How fast torque is taken away while it spins, and given back afterwards (parts of the demand per second).
const CUT_PER_S: f64 = 4.0;
const RESTORE_PER_S: f64 = 0.35;
/// How fast the reference rises at most (m/s²): no train of this kind accelerates more.
const REFERENCE_M_PER_S2: f64 = 1.3;
/// How long a spin has to last before the converter reacts (s).
const REACTION_S: f64 = 0.15;

/// The control of the two measured wheelsets.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SlipControl {
    reference: f64,
    spinning_for: [f64; 2],
    shares: [f64; 2],
}

impl SlipControl {
    /// A control that starts at a speed (m/s, in either direction).
    pub(crate) const fn new(speed: f64) -> Self {
        Self { reference: speed, spinning_for: [0.0; 2], shares: [1.0; 2] }
    }

    /// Whether torque is being held back.
    pub(crate) fn is_active(&self) -> bool {
        self.shares[0] < 1.0 || self.shares[1] < 1.0
    }

    /// Which part of the demand each wheelset gets after `dt` more seconds.
    pub(crate) fn step(&mut self, dt: f64, speeds: [f64; 2]) -> [f64; 2] {
        let speeds = speeds.map(f64::abs);
        let slowest = speeds[0].min(speeds[1]);
        self.reference = slowest.min(self.reference + REFERENCE_M_PER_S2 * dt);
        for ((share, lasted), speed) in self.shares.iter_mut().zip(&mut self.spinning_for).zip(speeds) {
            let ahead = speed - self.reference;
            let spins = ahead > SPIN_M_PER_S.max(SPIN_PART * self.reference);
            *lasted = if spins { *lasted + dt } else { 0.0 };
            let rate = if *lasted > REACTION_S { -CUT_PER_S } else { RESTORE_PER_S };
            *share = (*share + rate * dt).clamp(0.0, 1.0);
        }
        self.shares
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_goes_while_a_wheelset_spins_and_comes_back_gently() {
        let mut control = SlipControl::new(5.0);
        for _ in 0..100 {
            control.step(0.005, [8.0, 5.0]);
        }
        // Half a second, less the reaction of 0.15 s.
        assert_eq!(control.shares, [0.0, 1.0]);
        for _ in 0..200 {
            control.step(0.005, [5.0, 5.0]);
        }
        assert!((control.shares[0] - RESTORE_PER_S).abs() < 1e-9);
        assert!(control.is_active());
    }

    #[test]
    fn two_that_spin_together_are_noticed_by_what_no_train_can_do() {
        let mut control = SlipControl::new(0.0);
        let mut speed = 0.0;
        for _ in 0..200 {
            speed += 4.0 * 0.005;
            control.step(0.005, [speed; 2]);
        }
        assert!(control.shares.iter().all(|share| *share < 0.5));
    }
}
