//! One number for each hypothesis, so that a formula written once is calculated for all of them.
//!
//! Every operation works element by element and without a branch. A processor with wide registers calculates several
//! elements at a time and gets the same bits as a scalar one.

use core::array;
use core::ops::{Add, AddAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::odometry::wheels::{larger, smaller};

/// The number of hypotheses.
pub(super) const WIDTH: usize = 8;

/// One number for each hypothesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lanes(pub(super) [f64; WIDTH]);

macro_rules! entry_by_entry {
    ($($name:ident, $method:ident, $assign:ident, $assigned:ident, $op:tt);+) => {$(
        impl $name for Lanes {
            type Output = Self;
            #[inline]
            #[expect(clippy::indexing_slicing, reason = "below the width of both")]
            fn $method(self, other: Self) -> Self {
                Self(array::from_fn(|lane| self.0[lane] $op other.0[lane]))
            }
        }
        impl $name<f64> for Lanes {
            type Output = Self;
            #[inline]
            fn $method(self, other: f64) -> Self {
                Self(self.0.map(|value| value $op other))
            }
        }
        impl $assign for Lanes {
            #[inline]
            fn $assigned(&mut self, other: Self) {
                *self = *self $op other;
            }
        }
    )+};
}

entry_by_entry!(Add, add, AddAssign, add_assign, +; Sub, sub, SubAssign, sub_assign, -; Mul, mul, MulAssign, mul_assign, *);

impl Neg for Lanes {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self(self.0.map(|value| -value))
    }
}

impl Lanes {
    /// The same number for all hypotheses.
    #[inline]
    pub(super) const fn all(value: f64) -> Self {
        Self([value; WIDTH])
    }

    /// Element by element, the larger of the number and `least`.
    #[inline]
    pub(super) fn at_least(self, least: f64) -> Self {
        Self(self.0.map(|value| larger(value, least)))
    }

    /// Element by element, the smaller of the number and `most`.
    #[inline]
    pub(super) fn at_most(self, most: f64) -> Self {
        Self(self.0.map(|value| smaller(value, most)))
    }

    /// Element by element, the larger of both numbers.
    #[inline]
    #[expect(clippy::indexing_slicing, reason = "below the width of both")]
    pub(super) fn or_if_larger(self, other: Self) -> Self {
        Self(array::from_fn(|lane| larger(self.0[lane], other.0[lane])))
    }

    /// The reciprocals.
    #[inline]
    pub(super) fn inverse(self) -> Self {
        Self(self.0.map(|value| 1.0 / value))
    }

    /// Their sum, added in pairs.
    #[inline]
    pub(super) fn sum(self) -> f64 {
        let [a, b, c, d, e, f, g, h] = self.0;
        ((a + b) + (c + d)) + ((e + f) + (g + h))
    }

    /// The largest.
    #[inline]
    pub(super) fn largest(self) -> f64 {
        let [a, b, c, d, e, f, g, h] = self.0;
        larger(larger(larger(a, b), larger(c, d)), larger(larger(e, f), larger(g, h)))
    }
}

/// The exponential of a logarithm that is at most 0; one below −25 counts as −25. The error is 5e-4 near 0 and a quarter
/// at −25, where it does not matter. Ten squarings need no branch and no table.
#[inline(always)]
pub(super) fn likelihood(logarithm: f64) -> f64 {
    const SQUARINGS: u32 = 10;
    const STEPS: f64 = 1024.0;
    let mut power = larger(logarithm, -25.0) * (1.0 / STEPS) + 1.0;
    for _ in 0..SQUARINGS {
        power *= power;
    }
    power
}

/// The natural logarithm of a positive number, to 2e-11. Without a branch and without a table, so that several are calculated at
/// a time.
///
/// The number is `z 2^k` with `z` between √½ and √2, and `ln z` is the series of `2 artanh s` with `s = (z - 1) / (z + 1)`, of which
/// the first term that is left out is `2 s¹³ / 13`.
#[inline(always)]
pub(super) fn ln(number: f64) -> f64 {
    /// The bits of √½, of 1, and of the exponent; of 2⁵², whose last bits are a whole number.
    const ROOT: u64 = 0x3FE6_A09E_667F_3BCD;
    const ONE: u64 = 0x3FF0_0000_0000_0000;
    const EXPONENT: u64 = 0xFFF0_0000_0000_0000;
    const WHOLE: u64 = 0x4330_0000_0000_0000;
    /// 2⁵² and what exponents are kept too large by.
    const OFFSET: f64 = 4_503_599_627_370_496.0 + 1023.0;
    let bits = number.to_bits();
    let shifted = bits.wrapping_sub(ROOT).wrapping_add(ONE);
    let k = f64::from_bits((shifted >> 52) | WHOLE) - OFFSET;
    let z = f64::from_bits(bits.wrapping_sub((shifted & EXPONENT).wrapping_sub(ONE)));
    let s = (z - 1.0) / (z + 1.0);
    let q = s * s;
    let series = q * (1.0 / 9.0 + q * (1.0 / 11.0));
    let series = 1.0 + q * (1.0 / 3.0 + q * (1.0 / 5.0 + q * (1.0 / 7.0 + series)));
    k * core::f64::consts::LN_2 + 2.0 * s * series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithms_are_those_of_the_library() {
        for step in -6000..6000 {
            let number = libm::exp(f64::from(step) * 0.01);
            assert!((ln(number) - libm::log(number)).abs() < 2e-11, "{number}");
        }
        assert_eq!(ln(1.0), 0.0);
    }

    #[test]
    fn operations_work_element_by_element() {
        let counted = Lanes([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        let squares = counted * counted - counted * 0.5;
        assert_eq!(squares.0[5], 22.5);
        assert_eq!((counted.sum(), counted.largest()), (28.0, 7.0));
        assert_eq!(counted.at_least(2.5).at_most(6.0).0, [2.5, 2.5, 2.5, 3.0, 4.0, 5.0, 6.0, 6.0]);
    }
}
