//! A phase of a profile, counted from its slow end, and the time that a train takes in it to a given distance.
//!
//! A stop is counted back from standstill, not forward from its initial speed. This keeps precision where the train is
//! slow: speed and remaining distance go to zero together, without a difference of large numbers. Counted from its slow
//! end, forwards when the train speeds up and backwards when it slows down, every phase of every law is a polynomial
//!
//! ```text
//! d(t) = v t + h t² + k t³ + q t⁴        v ≥ 0, and d″ ≥ 0 throughout the phase
//! ```
//!
//! whose slope never falls, so one root-finder serves all of them: an initial value within 11 % of the root, then two
//! steps of Halley's method (third order), which leave less than 3e-12 of the time. The amount of work does not depend on
//! the numbers, so the processor overlaps neighbouring calls.

/// Distance, speed and acceleration in m, m/s and m/s².
pub(super) type Triple = (f64, f64, f64);

/// Multiplication is faster than division by six.
pub(super) const SIXTH: f64 = 1.0 / 6.0;

/// Motion of constant jerk, as a polynomial in the time from its slow end: its beginning if the train speeds up or
/// cruises, its end if it slows down.
///
/// Fields are in the order in which sampling a profile uses them; SI units.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Phase {
    /// Time of the slow end.
    pub(super) time: f64,
    /// Distance of the slow end.
    pub(super) distance: f64,
    /// Speed at the slow end.
    pub(super) speed: f64,
    /// Half the acceleration at the slow end.
    pub(super) half_acceleration: f64,
    /// A sixth of the jerk.
    pub(super) sixth_jerk: f64,
}

impl Phase {
    /// The state at a time within the phase.
    #[inline(always)]
    pub(super) fn state_at(&self, time: f64) -> Triple {
        let t = time - self.time;
        let bent = t * self.sixth_jerk;
        let gained = t * (2.0 * self.half_acceleration + 3.0 * bent);
        (
            self.distance + t * (self.speed + t * (self.half_acceleration + bent)),
            self.speed + gained,
            2.0 * self.half_acceleration + 6.0 * bent,
        )
    }

    /// The time at a distance within the phase, whose duration is `longest`.
    #[inline(always)]
    pub(super) fn time_at(&self, distance: f64, longest: f64) -> f64 {
        let distance = distance - self.distance;
        let end = SlowEnd {
            speed: self.speed,
            half_acceleration: self.half_acceleration.abs(),
            sixth_jerk: self.sixth_jerk,
            quartic: 0.0,
        };
        self.time + end.time_to_cover(distance.abs(), longest).copysign(distance)
    }
}

/// The polynomial of a phase, counted from its slow end.
#[derive(Debug, Clone, Copy)]
pub(super) struct SlowEnd {
    /// `v`, the speed at the slow end in m/s, not negative.
    pub(super) speed: f64,
    /// `h`, half the acceleration there in m/s², not negative.
    pub(super) half_acceleration: f64,
    /// `k`, a sixth of the jerk there in m/s³, of either sign.
    pub(super) sixth_jerk: f64,
    /// `q` in m/s⁴, not positive; zero while the jerk is constant.
    pub(super) quartic: f64,
}

impl SlowEnd {
    /// The time (s) to move by `distance` metres within a phase of `longest` seconds; 0 for no distance.
    //
    // Always inlined: an argument passed through memory would be written in halves and read as a whole, so the
    // processor would finish one call before it begins the next.
    #[inline(always)]
    pub(super) fn time_to_cover(&self, distance: f64, longest: f64) -> f64 {
        let Self { speed: v, half_acceleration: h, sixth_jerk: k, quartic: q } = *self;
        // Where the cubic term grows, it alone gives an initial value; where it fades, the square term does.
        let growing = k > 0.0;
        let ratio = distance / if growing { k } else { h };
        let first = least(if growing { rough_cube_root(ratio) } else { rough_square_root(ratio) }, longest);
        // The higher powers at that value add to an effective square term: one quadratic equation.
        let square = h + first * (k + first * q);
        let mut time = least(2.0 * distance / (v + libm::sqrt(v * v + 4.0 * distance * square)), longest);
        for _ in 0..2 {
            let t2 = time * time;
            let excess = time * ((v + time * h) + t2 * (k + time * q)) - distance;
            let slope = (v + time * (2.0 * h)) + t2 * (3.0 * k + time * (4.0 * q));
            let half_bend = (h + time * (3.0 * k)) + t2 * (6.0 * q);
            time -= excess * slope / (slope * slope - excess * half_bend);
        }
        if distance > 0.0 { least(time, longest) } else { 0.0 }
    }

    /// The same within 11 %, for an unbounded phase whose acceleration only grows.
    #[inline(always)]
    pub(super) fn rough_time_to_cover(&self, distance: f64) -> f64 {
        let Self { speed: v, half_acceleration: h, sixth_jerk: k, .. } = *self;
        let square = h + k * rough_cube_root(distance / k);
        if distance > 0.0 { 2.0 * distance / (v + libm::sqrt(v * v + 4.0 * distance * square)) } else { 0.0 }
    }
}

/// Seconds from the slow end of a phase of constant acceleration to a point `off` metres away, before it (negative)
/// or beyond it.
#[inline(always)]
pub(super) fn even_time(off: f64, speed: f64, acceleration: f64) -> f64 {
    // v t + a t²/2 = d has no cancellation as t = 2d / (v + √(v² + 2ad)).
    let distance = off.abs();
    let sum = speed + libm::sqrt(speed * speed + 2.0 * acceleration.abs() * distance);
    if distance > 0.0 { 2.0 * off / sum } else { 0.0 }
}

/// The smaller of two, or the second if the first is not a number: one instruction, unlike `f64::min`.
#[inline(always)]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Cube root of a positive number to 3 % by dividing its exponent by three (Kahan's cube root).
#[inline]
fn rough_cube_root(x: f64) -> f64 {
    /// Two thirds of the exponent bias, less the correction that balances the error over an octave.
    const OFFSET: u64 = 0x2A9F_7893_782D_A1CE;
    f64::from_bits(x.to_bits() / 3 + OFFSET)
}

/// Square root of a positive number to 4 % by halving its exponent.
#[inline]
fn rough_square_root(x: f64) -> f64 {
    /// Half of the exponent bias, less the correction that balances the error over an octave.
    const OFFSET: u64 = 0x1FF7_A3BE_A91D_9B1B;
    f64::from_bits((x.to_bits() >> 1) + OFFSET)
}

/// Cube root of a number that is not negative, to two units in the last place.
///
/// `libm`'s is correct to the last digit, but uses fused multiply-add, which is slow on targets without that
/// instruction.
#[inline]
pub(super) fn cube_root(x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let mut root = rough_cube_root(x);
    // Halley's method turns 3 % into 2e-5 and that into 5e-15; Newton's takes the rest.
    for _ in 0..2 {
        let cube = root * root * root;
        root *= (cube + 2.0 * x) / (2.0 * cube + x);
    }
    root - (root - x / (root * root)) / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_root_is_right_to_two_units_in_the_last_place() {
        for exponent in -300..300 {
            for part in 0..100 {
                let x = (1.0 + 0.09 * f64::from(part)) * 10.0_f64.powi(exponent);
                let (found, right) = (cube_root(x), x.cbrt());
                assert!((found - right).abs() <= 2.0 * f64::EPSILON * right, "{x}: {found} and not {right}");
            }
        }
        assert_eq!(cube_root(0.0), 0.0);
    }

    /// Phases of 1 s and 1 m, of every kind: shares of a steady speed, of an acceleration that fades, and of one
    /// that grows.
    fn phases() -> impl Iterator<Item = SlowEnd> {
        let shares = [0.0, 1e-12, 1e-6, 1e-3, 0.01, 0.1, 0.3, 1.0, 3.0, 100.0];
        let all = shares.into_iter().flat_map(move |a| {
            shares.into_iter().flat_map(move |b| shares.into_iter().map(move |c| (a, b, c)))
        });
        all.filter(|(a, b, c)| a + b + c > 0.0).map(|(steady, fading, growing)| {
            let whole = steady + fading + growing;
            let [steady, fading, growing] = [steady / whole, fading / whole, growing / whole];
            let (half_acceleration, sixth_jerk) = (1.5 * fading, growing - 0.5 * fading);
            SlowEnd { speed: steady, half_acceleration, sixth_jerk, quartic: 0.0 }
        })
    }

    fn distance(end: &SlowEnd, t: f64) -> f64 {
        t * (end.speed + t * (end.half_acceleration + t * (end.sixth_jerk + t * end.quartic)))
    }

    #[test]
    fn the_time_to_cover_a_distance_is_found_on_every_kind_of_phase() {
        let quartics = (0..100).map(|percent| {
            let share = 0.01 * f64::from(percent);
            SlowEnd { speed: 1.0 - share, half_acceleration: 0.0, sixth_jerk: 2.0 * share, quartic: -share }
        });
        for end in phases().chain(quartics) {
            for step in 0..400 {
                // Every order of magnitude down to 1e-4 of the phase, and both ends.
                let time = 10.0_f64.powf(-0.01 * f64::from(step));
                let found = end.time_to_cover(distance(&end, time), 1.0);
                assert!((found - time).abs() <= 1e-11 * time + 1e-15, "{end:?}: {found} and not {time}");
            }
            assert_eq!(end.time_to_cover(0.0, 1.0), 0.0);
        }
    }
}
