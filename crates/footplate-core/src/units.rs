//! Quantities with units as types: adding a speed to a length does not compile.
//!
//! Values are `f64` in SI units; constructors and getters name the unit. Meaningful products and quotients are one
//! line each at the end of the file.

use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use crate::time::TimeSpan;

/// Defines a newtype over `f64` in SI units with constructors, getters and the operations of every quantity.
macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident { $($(#[$unit_doc:meta])* $from:ident, $as:ident, $scale:expr;)+ }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(transparent))]
        pub struct $name(f64);

        impl $name {
            /// Zero.
            pub const ZERO: Self = Self(0.0);

            $(
                $(#[$unit_doc])*
                #[inline]
                #[must_use]
                pub const fn $from(value: f64) -> Self {
                    Self(value * $scale)
                }

                /// The number in the unit of the name.
                #[inline]
                #[must_use]
                pub const fn $as(self) -> f64 {
                    self.0 / $scale
                }
            )+

            /// The absolute value.
            #[inline]
            #[must_use]
            pub const fn abs(self) -> Self {
                Self(self.0.abs())
            }

            /// The smaller of the two; a NaN loses.
            #[inline]
            #[must_use]
            pub const fn min(self, other: Self) -> Self {
                Self(self.0.min(other.0))
            }

            /// The larger of the two; a NaN loses.
            #[inline]
            #[must_use]
            pub const fn max(self, other: Self) -> Self {
                Self(self.0.max(other.0))
            }

            /// Neither NaN nor infinite.
            #[inline]
            #[must_use]
            pub const fn is_finite(self) -> bool {
                self.0.is_finite()
            }
        }

        impl Add for $name {
            type Output = Self;
            #[inline]
            fn add(self, other: Self) -> Self {
                Self(self.0 + other.0)
            }
        }
        impl Sub for $name {
            type Output = Self;
            #[inline]
            fn sub(self, other: Self) -> Self {
                Self(self.0 - other.0)
            }
        }
        impl AddAssign for $name {
            #[inline]
            fn add_assign(&mut self, other: Self) {
                self.0 += other.0;
            }
        }
        impl SubAssign for $name {
            #[inline]
            fn sub_assign(&mut self, other: Self) {
                self.0 -= other.0;
            }
        }
        impl Neg for $name {
            type Output = Self;
            #[inline]
            fn neg(self) -> Self {
                Self(-self.0)
            }
        }
        impl Mul<f64> for $name {
            type Output = Self;
            #[inline]
            fn mul(self, factor: f64) -> Self {
                Self(self.0 * factor)
            }
        }
        impl Mul<$name> for f64 {
            type Output = $name;
            #[inline]
            fn mul(self, quantity: $name) -> $name {
                $name(self * quantity.0)
            }
        }
        impl Div<f64> for $name {
            type Output = Self;
            #[inline]
            fn div(self, divisor: f64) -> Self {
                Self(self.0 / divisor)
            }
        }
        impl Div for $name {
            type Output = f64;
            #[inline]
            fn div(self, other: Self) -> f64 {
                self.0 / other.0
            }
        }
        impl core::iter::Sum for $name {
            fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
                all.fold(Self::ZERO, |total, next| total + next)
            }
        }
    };
}

quantity!(
    /// A length, a distance or an offset.
    Length {
        /// From metres.
        from_m, as_m, 1.0;
        /// From millimetres.
        from_mm, as_mm, 1e-3;
    }
);
quantity!(
    /// A signed speed.
    Speed {
        /// From metres per second.
        from_m_per_s, as_m_per_s, 1.0;
        /// From millimetres per second.
        from_mm_per_s, as_mm_per_s, 1e-3;
    }
);
quantity!(
    /// A signed acceleration.
    Acceleration {
        /// From metres per second squared.
        from_m_per_s2, as_m_per_s2, 1.0;
        /// From millimetres per second squared.
        from_mm_per_s2, as_mm_per_s2, 1e-3;
    }
);
quantity!(
    /// A signed jerk, the rate of change of acceleration.
    Jerk {
        /// From metres per second cubed.
        from_m_per_s3, as_m_per_s3, 1.0;
        /// From millimetres per second cubed.
        from_mm_per_s3, as_mm_per_s3, 1e-3;
    }
);
quantity!(
    /// A number without a unit, such as a factor or a creepage.
    Ratio {
        /// From the plain number; 1 is 100 %.
        from_parts, as_parts, 1.0;
        /// From per cent.
        from_percent, as_percent, 1e-2;
    }
);

/// `$left * $right = $product`, in either order, and `$product / $left = $right`.
macro_rules! product {
    ($left:ident * $right:ident = $product:ident) => {
        impl Mul<$right> for $left {
            type Output = $product;
            #[inline]
            fn mul(self, right: $right) -> $product {
                $product(self.0 * right.si())
            }
        }
        impl Mul<$left> for $right {
            type Output = $product;
            #[inline]
            fn mul(self, left: $left) -> $product {
                $product(self.si() * left.0)
            }
        }
        impl Div<$right> for $product {
            type Output = $left;
            #[inline]
            fn div(self, right: $right) -> $left {
                $left(self.0 / right.si())
            }
        }
        impl Div<$left> for $product {
            type Output = $right;
            #[inline]
            fn div(self, left: $left) -> $right {
                $right::from_si(self.0 / left.0)
            }
        }
    };
}

impl TimeSpan {
    const fn si(self) -> f64 {
        self.as_s()
    }
    const fn from_si(seconds: f64) -> Self {
        Self::from_s(seconds)
    }
}

product!(Speed * TimeSpan = Length);
product!(Acceleration * TimeSpan = Speed);
product!(Jerk * TimeSpan = Acceleration);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_carry_units() {
        let reached = Speed::from_mm_per_s(412.0) * TimeSpan::from_ms(250);
        assert!((reached.as_mm() - 103.0).abs() < 1e-9);
        assert_eq!(Length::from_m(2.0) / Speed::from_m_per_s(0.5), TimeSpan::from_s(4.0));
        assert_eq!(Length::from_m(2.0) / TimeSpan::from_s(4.0), Speed::from_m_per_s(0.5));
        assert_eq!(Length::from_m(3.0) / Length::from_m(2.0), 1.5);
    }

    #[test]
    fn millimetres_and_metres_are_the_same_length() {
        assert!((Length::from_mm(875.0).as_m() - 0.875).abs() < 1e-15);
        assert_eq!(Ratio::from_percent(50.0).as_parts(), 0.5);
    }
}
