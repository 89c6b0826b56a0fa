//! How long a train that leaves the slow end of a phase takes to get a given way off.
//!
//! Counted from its slow end, forwards when the train speeds up and backwards when it slows down, every
//! phase of every law is a polynomial
//!
//! ```text
//! d(t) = v t + h t² + k t³ + q t⁴        v ≥ 0, and d″ ≥ 0 throughout the phase
//! ```
//!
//! which grows ever faster, so that one root-finder serves all of them: a start within 11 % of the root,
//! then two steps of Halley's method (third order), which leave less than 3e-12 of the time. No branch
//! depends on the numbers, so the processor overlaps neighbouring calls.

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
    /// Seconds to get `way` metres off, within a phase of `longest` seconds; 0 for no way at all.
    #[inline]
    pub(super) fn time_to_cover(&self, way: f64, longest: f64) -> f64 {
        let Self { speed: v, half_acceleration: h, sixth_jerk: k, quartic: q } = *self;
        // Where the cubic term grows, it alone gives a first guess; where it fades, the square does.
        let growing = k > 0.0;
        let ratio = way / if growing { k } else { h };
        let first = if growing { rough_cube_root(ratio) } else { rough_square_root(ratio) }.min(longest);
        // The higher powers at that guess make up an effective square term: one quadratic equation.
        let square = h + first * (k + first * q);
        let mut time = (2.0 * way / (v + libm::sqrt(v * v + 4.0 * way * square))).min(longest);
        for _ in 0..2 {
            let excess = time * (v + time * (h + time * (k + time * q))) - way;
            let slope = v + time * (2.0 * h + time * (3.0 * k + time * (4.0 * q)));
            let bend = 2.0 * h + time * (6.0 * k + time * (12.0 * q));
            time -= 2.0 * excess * slope / (2.0 * slope * slope - excess * bend);
        }
        if way > 0.0 { time.min(longest) } else { 0.0 }
    }
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
/// Written here because the one of `libm` rounds correctly, which takes four times as long without hardware
/// that multiplies and adds in one step.
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
