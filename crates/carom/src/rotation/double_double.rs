//! Numbers of twice the precision: an unevaluated sum of two doubles, about 32 digits.
//!
//! After Dekker (Numer. Math. 18, 1971, 224) and Joldes, Muller and Popescu (ACM Trans. Math. Softw. 44, 2017, 15). The
//! product's error comes from splitting the factors, not from a fused multiply-add, so that every machine gives the
//! same bits. Relative errors are a few 2^-104. Nothing here is meant for numbers whose squares leave the range of a
//! double.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// `high + low`, where `high` is the double nearest to the sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoubleDouble {
    /// The nearest double.
    pub high: f64,
    /// What it leaves out.
    pub low: f64,
}

/// a + b and its rounding error (Knuth).
#[inline(always)]
pub fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let part = sum - a;
    (sum, (a - (sum - part)) + (b - part))
}

/// The same where |a| >= |b| or a = 0 (Dekker).
#[inline(always)]
fn quick_two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    (sum, b - (sum - a))
}

/// Halves of 26 bits whose sum is x (Veltkamp).
#[inline(always)]
fn split(x: f64) -> (f64, f64) {
    let scaled = 134_217_729.0 * x;
    let high = scaled - (scaled - x);
    (high, x - high)
}

/// a b and its rounding error (Dekker).
#[inline(always)]
pub fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    let (a_high, a_low) = split(a);
    let (b_high, b_low) = split(b);
    (product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low)
}

impl DoubleDouble {
    /// Zero.
    pub const ZERO: Self = Self { high: 0.0, low: 0.0 };
    /// One.
    pub const ONE: Self = Self { high: 1.0, low: 0.0 };
    /// 1 / 2π.
    pub const INVERSE_TWO_PI: Self = Self { high: 0.15915494309189535, low: -9.839338337591243e-18 };

    /// The product of two doubles, exactly.
    #[inline(always)]
    pub fn product(a: f64, b: f64) -> Self {
        let (high, low) = two_product(a, b);
        Self { high, low }
    }

    /// The difference of two doubles, exactly.
    #[inline(always)]
    pub fn difference(a: f64, b: f64) -> Self {
        let (high, low) = two_sum(a, -b);
        Self { high, low }
    }

    /// Times a power of two.
    #[inline(always)]
    pub fn scaled(self, power: f64) -> Self {
        Self { high: self.high * power, low: self.low * power }
    }

    /// The square.
    #[inline(always)]
    pub fn squared(self) -> Self {
        self * self
    }

    /// The magnitude.
    #[inline(always)]
    pub fn abs(self) -> Self {
        if self.high < 0.0 { -self } else { self }
    }

    /// The square root of a number of at least 0: one step of Newton's from that of the nearest double.
    #[inline]
    pub fn sqrt(self) -> Self {
        if self.high <= 0.0 {
            return Self::ZERO;
        }
        let root = self.high.sqrt();
        let rest = self - Self::product(root, root);
        let (high, low) = quick_two_sum(root, rest.high / (2.0 * root));
        Self { high, low }
    }
}

impl From<f64> for DoubleDouble {
    fn from(x: f64) -> Self {
        Self { high: x, low: 0.0 }
    }
}

impl Neg for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Add for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (sum, error) = two_sum(self.high, other.high);
        let (low_sum, low_error) = two_sum(self.low, other.low);
        let (sum, error) = quick_two_sum(sum, error + low_sum);
        let (high, low) = quick_two_sum(sum, low_error + error);
        Self { high, low }
    }
}

impl Sub for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (product, error) = two_product(self.high, other.high);
        let (high, low) = quick_two_sum(product, error + (self.high * other.low + self.low * other.high));
        Self { high, low }
    }
}

impl Mul<f64> for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        let (product, error) = two_product(self.high, other);
        let (high, low) = quick_two_sum(product, error + self.low * other);
        Self { high, low }
    }
}

impl Div for DoubleDouble {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let quotient = self.high / other.high;
        let rest = self - other * quotient;
        let (high, low) = quick_two_sum(quotient, rest.high / other.high);
        Self { high, low }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_and_quotients_undo_each_other() {
        let x = DoubleDouble { high: 0.1, low: -3.1e-18 };
        let y = DoubleDouble { high: 7.3, low: 2.2e-16 };
        for (found, expected) in [(x * y / y, x), (x + y - y, x), (x.squared().sqrt(), x), ((x / y) * y, x)] {
            let error = found - expected;
            // A few 2^-104 of the largest number on the way (7.3).
            assert!(error.high.abs() <= 16.0 * 7.3 / (1u128 << 104) as f64, "{error:?}");
        }
    }

    #[test]
    fn the_error_of_a_product_is_exact() {
        let a = 1.0 + f64::EPSILON;
        // (1 + ε)² = 1 + 2ε + ε²
        assert_eq!(two_product(a, a), (1.0 + 2.0 * f64::EPSILON, f64::EPSILON * f64::EPSILON));
        assert_eq!(two_sum(1.0, 1e-30), (1.0, 1e-30));
    }
}
