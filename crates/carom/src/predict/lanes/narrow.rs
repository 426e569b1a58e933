//! Two numbers, in whatever registers every machine has.

use super::Lanes;
use crate::flight::Flight;

/// Plain arrays, for which the compiler uses the registers that every machine has.
#[derive(Clone, Copy, Debug)]
pub struct Narrow;

macro_rules! by_lane {
    ($($name:ident = |$a:ident, $b:ident| $result:expr;)*) => {
        $(#[inline(always)]
        fn $name(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
            std::array::from_fn(|lane| {
                let ($a, $b) = (a[lane], b[lane]);
                $result
            })
        })*
    };
}

impl Lanes for Narrow {
    const COUNT: usize = 2;
    type Numbers = [f64; 2];
    type Mask = [bool; 2];

    by_lane! {
        add = |a, b| a + b;
        sub = |a, b| a - b;
        mul = |a, b| a * b;
        min = |a, b| if a < b { a } else { b };
        max = |a, b| if a > b { a } else { b };
    }

    #[inline(always)]
    fn all(self, x: f64) -> [f64; 2] {
        [x; 2]
    }

    #[inline(always)]
    fn gather(self, from: &[f64], places: &[u32]) -> [f64; 2] {
        [from[places[0] as usize], from[places[1] as usize]]
    }

    #[inline(always)]
    fn put(self, numbers: [f64; 2], to: &mut [f64]) {
        to[..2].copy_from_slice(&numbers);
    }

    #[inline(always)]
    fn near_add_product(self, c: [f64; 2], a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
        self.add(c, self.mul(a, b))
    }

    #[inline(always)]
    fn near_sub_product(self, c: [f64; 2], a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
        self.sub(c, self.mul(a, b))
    }

    #[inline(always)]
    fn near_sqrt(self, a: [f64; 2]) -> [f64; 2] {
        a.map(f64::sqrt)
    }

    #[inline(always)]
    fn near_quotient(self, a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|lane| a[lane] / b[lane])
    }

    #[inline(always)]
    fn below(self, a: [f64; 2], b: [f64; 2]) -> [bool; 2] {
        std::array::from_fn(|lane| a[lane] < b[lane])
    }

    #[inline(always)]
    fn both(self, a: [bool; 2], b: [bool; 2]) -> [bool; 2] {
        std::array::from_fn(|lane| a[lane] & b[lane])
    }

    #[inline(always)]
    fn either(self, a: [bool; 2], b: [bool; 2]) -> [bool; 2] {
        std::array::from_fn(|lane| a[lane] | b[lane])
    }

    #[inline(always)]
    fn bits(self, mask: [bool; 2]) -> u32 {
        u32::from(mask[0]) | u32::from(mask[1]) << 1
    }

    #[inline(always)]
    fn equal(self, a: [f64; 2], b: [f64; 2]) -> [bool; 2] {
        std::array::from_fn(|lane| a[lane] == b[lane])
    }

    #[inline(always)]
    fn least(self, a: [f64; 2]) -> f64 {
        if a[0] < a[1] { a[0] } else { a[1] }
    }

    #[inline(always)]
    fn select(self, mask: [bool; 2], a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|lane| if mask[lane] { a[lane] } else { b[lane] })
    }

    #[inline(always)]
    fn nth(self, numbers: [f64; 2], lane: usize) -> f64 {
        numbers[lane]
    }

    #[inline(always)]
    fn nth_of_two(self, numbers: [[f64; 2]; 2], lane: usize) -> f64 {
        numbers.as_flattened()[lane]
    }

    #[inline(always)]
    fn within(self, at: &[[u8; 8]; 3], from: [f32; 3], within: f32) -> u32 {
        let mut bits = 0;
        for (k, ((x, y), z)) in at[0].into_iter().zip(at[1]).zip(at[2]).enumerate() {
            let (x, y, z) = (f32::from(x) - from[0], f32::from(y) - from[1], f32::from(z) - from[2]);
            bits |= u32::from(x * x + y * y + z * z < within) << k;
        }
        bits
    }

    #[inline(always)]
    fn matches(self, rows: &[u32; 8], row: u32) -> u32 {
        let mut bits = 0;
        for (k, &other) in rows.iter().enumerate() {
            bits |= u32::from(other == row) << k;
        }
        bits
    }

    #[inline(always)]
    fn compressed(self, rows: &[u32; 8], bits: u32) -> [u32; 8] {
        compressed_one_by_one(rows, bits)
    }

    #[inline(always)]
    fn columns(self, flights: &[Flight], places: &[u32]) -> [[f64; 2]; 8] {
        let lines = [flights[places[0] as usize].line(), flights[places[1] as usize].line()];
        std::array::from_fn(|column| lines.map(|line| line[column]))
    }
}

/// Without a branch: each is written to the next place, and over if it does not count.
#[inline(always)]
fn compressed_one_by_one(rows: &[u32; 8], bits: u32) -> [u32; 8] {
    let mut front = [0; 8];
    let mut count = 0;
    for (k, &row) in rows.iter().enumerate() {
        front[count & 7] = row;
        count += (bits >> k & 1) as usize;
    }
    front
}
