//! Eight numbers, in the registers of AVX-512.

use super::four::{matches_eight, within_eight};
use super::{Lanes, by_register};
use crate::flight::Flight;

type Four = std::arch::x86_64::__m256d;
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
    fn least_of_each(self, a: Self::Numbers, b: Self::Numbers) -> [f64; 2] {
        let f = self.avx512f;
        // From here on, a's are in the lower half, b's in the upper.
        let halves =
            f._mm512_min_pd(f._mm512_shuffle_f64x2::<0b0100_0100>(a, b), f._mm512_shuffle_f64x2::<0b1110_1110>(a, b));
        let quarters = f._mm512_min_pd(halves, f._mm512_shuffle_f64x2::<0b1011_0001>(halves, halves));
        let eighths = f._mm512_min_pd(quarters, f._mm512_permute_pd::<0b0101_0101>(quarters));
        let [of_a, _, _, _, of_b, ..]: [f64; 8] = pulp::cast(eighths);
        [of_a, of_b]
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
        let [low_ac, high_ac] = two_lines(self, &flights[p[0] as usize], &flights[p[2] as usize]);
        let [low_bd, high_bd] = two_lines(self, &flights[p[1] as usize], &flights[p[3] as usize]);
        let [low_eg, high_eg] = two_lines(self, &flights[p[4] as usize], &flights[p[6] as usize]);
        let [low_fh, high_fh] = two_lines(self, &flights[p[5] as usize], &flights[p[7] as usize]);
        let [x0, x1, x2, x3] = turned(self, low_ac, low_bd, low_eg, low_fh);
        let [x4, x5, x6, x7] = turned(self, high_ac, high_bd, high_eg, high_fh);
        [x0, x1, x2, x3, x4, x5, x6, x7]
    }
}

/// The first halves of two lines side by side, and their second halves: put together as they come from memory, which asks
/// nothing of what turns registers.
#[inline(always)]
fn two_lines(registers: pulp::x86::V4, a: &Flight, c: &Flight) -> [Eight; 2] {
    let f = registers.avx512f;
    let (a, c): ([Four; 2], [Four; 2]) = (pulp::cast(a.line()), pulp::cast(c.line()));
    [
        f._mm512_insertf64x4::<1>(f._mm512_castpd256_pd512(a[0]), c[0]),
        f._mm512_insertf64x4::<1>(f._mm512_castpd256_pd512(a[1]), c[1]),
    ]
}

/// Of the same halves of eight lines, each of the four columns.
#[inline(always)]
fn turned(registers: pulp::x86::V4, ac: Eight, bd: Eight, eg: Eight, fh: Eight) -> [Eight; 4] {
    let f = registers.avx512f;
    let (even_low, even_high) = (f._mm512_unpacklo_pd(ac, bd), f._mm512_unpacklo_pd(eg, fh));
    let (odd_low, odd_high) = (f._mm512_unpackhi_pd(ac, bd), f._mm512_unpackhi_pd(eg, fh));
    [
        f._mm512_shuffle_f64x2::<0x88>(even_low, even_high),
        f._mm512_shuffle_f64x2::<0x88>(odd_low, odd_high),
        f._mm512_shuffle_f64x2::<0xdd>(even_low, even_high),
        f._mm512_shuffle_f64x2::<0xdd>(odd_low, odd_high),
    ]
}
