//! A pair of registers.

use super::Lanes;
use crate::flight::Flight;

/// Two registers as if they were one twice as wide: what is done with both goes on side by side, and neither waits for the
/// other's roots and quotients.
#[derive(Clone, Copy, Debug)]
pub struct Twice<L>(pub L);

macro_rules! by_half {
    ($($name:ident: $result:ident;)*) => {
        $(#[inline(always)]
        fn $name(self, a: Self::Numbers, b: Self::Numbers) -> Self::$result {
            [self.0.$name(a[0], b[0]), self.0.$name(a[1], b[1])]
        })*
    };
}

impl<L: Lanes> Lanes for Twice<L> {
    const COUNT: usize = 2 * L::COUNT;
    type Numbers = [L::Numbers; 2];
    type Mask = [L::Mask; 2];

    by_half! {
        add: Numbers;
        sub: Numbers;
        mul: Numbers;
        near_quotient: Numbers;
        min: Numbers;
        max: Numbers;
        below: Mask;
        equal: Mask;
    }

    #[inline(always)]
    fn all(self, x: f64) -> Self::Numbers {
        [self.0.all(x); 2]
    }

    #[inline(always)]
    fn gather(self, from: &[f64], places: &[u32]) -> Self::Numbers {
        let (low, high) = places.split_at(L::COUNT);
        [self.0.gather(from, low), self.0.gather(from, high)]
    }

    #[inline(always)]
    fn put(self, numbers: Self::Numbers, to: &mut [f64]) {
        let (low, high) = to.split_at_mut(L::COUNT);
        self.0.put(numbers[0], low);
        self.0.put(numbers[1], high);
    }

    #[inline(always)]
    fn near_add_product(self, c: Self::Numbers, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        [self.0.near_add_product(c[0], a[0], b[0]), self.0.near_add_product(c[1], a[1], b[1])]
    }

    #[inline(always)]
    fn near_sub_product(self, c: Self::Numbers, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        [self.0.near_sub_product(c[0], a[0], b[0]), self.0.near_sub_product(c[1], a[1], b[1])]
    }

    #[inline(always)]
    fn near_sqrt(self, a: Self::Numbers) -> Self::Numbers {
        [self.0.near_sqrt(a[0]), self.0.near_sqrt(a[1])]
    }

    #[inline(always)]
    fn both(self, a: Self::Mask, b: Self::Mask) -> Self::Mask {
        [self.0.both(a[0], b[0]), self.0.both(a[1], b[1])]
    }

    #[inline(always)]
    fn either(self, a: Self::Mask, b: Self::Mask) -> Self::Mask {
        [self.0.either(a[0], b[0]), self.0.either(a[1], b[1])]
    }

    #[inline(always)]
    fn bits(self, mask: Self::Mask) -> u32 {
        self.0.bits(mask[0]) | self.0.bits(mask[1]) << L::COUNT
    }

    #[inline(always)]
    fn least(self, a: Self::Numbers) -> f64 {
        self.0.least(self.0.min(a[0], a[1]))
    }

    #[inline(always)]
    fn least_of_each(self, a: Self::Numbers, b: Self::Numbers) -> [f64; 2] {
        self.0.least_of_each(self.0.min(a[0], a[1]), self.0.min(b[0], b[1]))
    }

    #[inline(always)]
    fn select(self, mask: Self::Mask, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        [self.0.select(mask[0], a[0], b[0]), self.0.select(mask[1], a[1], b[1])]
    }

    #[inline(always)]
    fn nth(self, numbers: Self::Numbers, lane: usize) -> f64 {
        self.0.nth_of_two(numbers, lane)
    }

    #[inline(always)]
    fn nth_of_two(self, numbers: [Self::Numbers; 2], lane: usize) -> f64 {
        self.nth(numbers[lane / Self::COUNT], lane % Self::COUNT)
    }

    #[inline(always)]
    fn within(self, at: &[[u8; 8]; 3], from: [f32; 3], within: f32) -> u32 {
        self.0.within(at, from, within)
    }

    #[inline(always)]
    fn matches(self, rows: &[u32; 8], row: u32) -> u32 {
        self.0.matches(rows, row)
    }

    #[inline(always)]
    fn compressed(self, rows: &[u32; 8], bits: u32) -> [u32; 8] {
        self.0.compressed(rows, bits)
    }

    #[inline(always)]
    fn columns(self, flights: &[Flight], places: &[u32]) -> [Self::Numbers; 8] {
        let (low, high) = places.split_at(L::COUNT);
        let (low, high) = (self.0.columns(flights, low), self.0.columns(flights, high));
        [
            [low[0], high[0]],
            [low[1], high[1]],
            [low[2], high[2]],
            [low[3], high[3]],
            [low[4], high[4]],
            [low[5], high[5]],
            [low[6], high[6]],
            [low[7], high[7]],
        ]
    }
}
