//! Eight numbers, in the registers of AVX-512.

use super::four::{matches_eight, within_eight};
use super::{Lanes, by_register};
use crate::flight::Flight;

type Eight = std::arch::x86_64::__m512d;

impl Lanes for pulp::x86::V4 {
    const COUNT: usize = 8;
    type Numbers = Eight;
    type Mask = u8;

    by_register! {
        avx512f: add = _mm512_add_pd;
        sub = _mm512_sub_pd;
        mul = _mm512_mul_pd;
        min = _mm512_min_pd;
        max = _mm512_max_pd;
    }

    #[inline(always)]
    fn all(self, x: f64) -> Self::Numbers {
        self.avx512f._mm512_set1_pd(x)
    }

    #[inline(always)]
    fn gather(self, from: &[f64], p: &[u32]) -> Self::Numbers {
        let (a, b) = (from[p[0] as usize], from[p[1] as usize]);
        let (c, d) = (from[p[2] as usize], from[p[3] as usize]);
        let (e, f) = (from[p[4] as usize], from[p[5] as usize]);
        let (g, h) = (from[p[6] as usize], from[p[7] as usize]);
        self.avx512f._mm512_setr_pd(a, b, c, d, e, f, g, h)
    }

    #[inline(always)]
    fn put(self, numbers: Self::Numbers, to: &mut [f64]) {
        let numbers: [f64; 8] = pulp::cast(numbers);
        to[..8].copy_from_slice(&numbers);
    }

    #[inline(always)]
    fn near_add_product(self, c: Self::Numbers, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        self.avx512f._mm512_fmadd_pd(a, b, c)
    }

    #[inline(always)]
    fn near_sub_product(self, c: Self::Numbers, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        self.avx512f._mm512_fnmadd_pd(a, b, c)
    }

    #[inline(always)]
    fn near_sqrt(self, a: Self::Numbers) -> Self::Numbers {
        // To 2^-14.
        self.avx512f._mm512_mul_pd(a, self.avx512f._mm512_rsqrt14_pd(a))
    }

    #[inline(always)]
    fn near_quotient(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        self.avx512f._mm512_mul_pd(a, self.avx512f._mm512_rcp14_pd(b))
    }

    #[inline(always)]
    fn below(self, a: Self::Numbers, b: Self::Numbers) -> u8 {
        self.avx512f._mm512_cmp_pd_mask::<{ std::arch::x86_64::_CMP_LT_OQ }>(a, b)
    }

    #[inline(always)]
    fn both(self, a: u8, b: u8) -> u8 {
        a & b
    }

    #[inline(always)]
    fn either(self, a: u8, b: u8) -> u8 {
        a | b
    }

    #[inline(always)]
    fn bits(self, mask: u8) -> u32 {
        u32::from(mask)
    }

    #[inline(always)]
    fn equal(self, a: Self::Numbers, b: Self::Numbers) -> u8 {
        self.avx512f._mm512_cmp_pd_mask::<{ std::arch::x86_64::_CMP_EQ_OQ }>(a, b)
    }

    #[inline(always)]
    fn least(self, a: Self::Numbers) -> f64 {
        let f = self.avx512f;
        let halves = f._mm512_min_pd(a, f._mm512_shuffle_f64x2::<0b0100_1110>(a, a));
        let quarters = f._mm512_min_pd(halves, f._mm512_shuffle_f64x2::<0b1011_0001>(halves, halves));
        let eighths = f._mm512_min_pd(quarters, f._mm512_permute_pd::<0b0101_0101>(quarters));
        let [least, ..]: [f64; 8] = pulp::cast(eighths);
        least
    }

    #[inline(always)]
    fn select(self, mask: u8, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        self.avx512f._mm512_mask_blend_pd(mask, b, a)
    }

    #[inline(always)]
    fn nth(self, numbers: Self::Numbers, lane: usize) -> f64 {
        let place = self.avx512f._mm512_set1_epi64(lane as i64);
        let [nth, ..]: [f64; 8] = pulp::cast(self.avx512f._mm512_permutexvar_pd(place, numbers));
        nth
    }

    #[inline(always)]
    fn nth_of_two(self, [low, high]: [Self::Numbers; 2], lane: usize) -> f64 {
        let place = self.avx512f._mm512_set1_epi64(lane as i64);
        let [nth, ..]: [f64; 8] = pulp::cast(self.avx512f._mm512_permutex2var_pd(low, place, high));
        nth
    }

    #[inline(always)]
    fn within(self, at: &[[u8; 8]; 3], from: [f32; 3], within: f32) -> u32 {
        within_eight(self.avx, self.avx2, at, from, within)
    }

    #[inline(always)]
    fn matches(self, rows: &[u32; 8], row: u32) -> u32 {
        matches_eight(self.avx, self.avx2, rows, row)
    }

    #[inline(always)]
    fn compressed(self, rows: &[u32; 8], bits: u32) -> [u32; 8] {
        let rows: std::arch::x86_64::__m256i = pulp::cast(*rows);
        pulp::cast(self.avx512vl._mm256_maskz_compress_epi32(bits as u8, rows))
    }

    #[inline(always)]
    fn columns(self, flights: &[Flight], p: &[u32]) -> [Self::Numbers; 8] {
        let [even_ab, odd_ab] = two_lines(self, &flights[p[0] as usize], &flights[p[1] as usize]);
        let [even_cd, odd_cd] = two_lines(self, &flights[p[2] as usize], &flights[p[3] as usize]);
        let [even_ef, odd_ef] = two_lines(self, &flights[p[4] as usize], &flights[p[5] as usize]);
        let [even_gh, odd_gh] = two_lines(self, &flights[p[6] as usize], &flights[p[7] as usize]);
        let [x0, x2, x4, x6] = turned_pairs(self, even_ab, even_cd, even_ef, even_gh);
        let [x1, x3, x5, x7] = turned_pairs(self, odd_ab, odd_cd, odd_ef, odd_gh);
        [x0, x1, x2, x3, x4, x5, x6, x7]
    }
}

/// Columns 0, 2, 4, 6 of two lines side by side, and columns 1, 3, 5, 7.
#[inline(always)]
fn two_lines(registers: pulp::x86::V4, a: &Flight, b: &Flight) -> [Eight; 2] {
    let (a, b): (Eight, Eight) = (pulp::cast(a.line()), pulp::cast(b.line()));
    [registers.avx512f._mm512_unpacklo_pd(a, b), registers.avx512f._mm512_unpackhi_pd(a, b)]
}

/// Of the same four columns of four times two lines, each column of all eight.
#[inline(always)]
fn turned_pairs(registers: pulp::x86::V4, ab: Eight, cd: Eight, ef: Eight, gh: Eight) -> [Eight; 4] {
    let f = registers.avx512f;
    let (outer_low, outer_high) = (f._mm512_shuffle_f64x2::<0x88>(ab, cd), f._mm512_shuffle_f64x2::<0x88>(ef, gh));
    let (inner_low, inner_high) = (f._mm512_shuffle_f64x2::<0xdd>(ab, cd), f._mm512_shuffle_f64x2::<0xdd>(ef, gh));
    [
        f._mm512_shuffle_f64x2::<0x88>(outer_low, outer_high),
        f._mm512_shuffle_f64x2::<0x88>(inner_low, inner_high),
        f._mm512_shuffle_f64x2::<0xdd>(outer_low, outer_high),
        f._mm512_shuffle_f64x2::<0xdd>(inner_low, inner_high),
    ]
}
