//! Several numbers side by side, for which the compiler uses whatever vector registers the target has. Each lane is
//! computed as it would be alone, so the bits do not depend on the width.

use std::ops::{Add, Mul, Neg, Sub};

/// Numbers side by side.
#[derive(Clone, Copy, Debug)]
pub struct Lanes(pub [f64; Self::COUNT]);

impl Lanes {
    /// How many.
    pub const COUNT: usize = 2;

    /// The same number in all.
    #[inline(always)]
    pub fn all(x: f64) -> Self {
        Self([x; Self::COUNT])
    }

    /// The larger of each and 0.
    #[inline(always)]
    pub fn max_zero(self) -> Self {
        Self(std::array::from_fn(|lane| if self.0[lane] > 0.0 { self.0[lane] } else { 0.0 }))
    }

    /// Which are less than those of `other`.
    #[inline(always)]
    pub fn below(self, other: Self) -> [bool; Self::COUNT] {
        std::array::from_fn(|lane| self.0[lane] < other.0[lane])
    }
}

macro_rules! by_lane {
    ($operation:ident, $method:ident, $sign:tt) => {
        impl $operation for Lanes {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(std::array::from_fn(|lane| self.0[lane] $sign other.0[lane]))
            }
        }
    };
}

by_lane!(Add, add, +);
by_lane!(Sub, sub, -);
by_lane!(Mul, mul, *);

impl Neg for Lanes {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|x| -x))
    }
}
