//! Four numbers, in the registers of AVX2.

use super::{Lanes, by_register};
use crate::flight::Flight;

type Four = std::arch::x86_64::__m256d;

impl Lanes for pulp::x86::V3 {
    const COUNT: usize = 4;
    type Numbers = Four;
    type Mask = Four;

    by_register! {
        avx: add = _mm256_add_pd;
        sub = _mm256_sub_pd;
        mul = _mm256_mul_pd;
        min = _mm256_min_pd;
        max = _mm256_max_pd;
        both = _mm256_and_pd;
        either = _mm256_or_pd;
    }

    #[inline(always)]
    fn all(self, x: f64) -> Self::Numbers {
        self.avx._mm256_set1_pd(x)
    }

    #[inline(always)]
    fn gather(self, from: &[f64], p: &[u32]) -> Self::Numbers {
        let (a, b) = (from[p[0] as usize], from[p[1] as usize]);
        let (c, d) = (from[p[2] as usize], from[p[3] as usize]);
        self.avx._mm256_setr_pd(a, b, c, d)
    }

    #[inline(always)]
    fn put(self, numbers: Self::Numbers, to: &mut [f64]) {
        let numbers: [f64; 4] = pulp::cast(numbers);
        to[..4].copy_from_slice(&numbers);
    }

    #[inline(always)]
    fn near_add_product(self, c: Self::Numbers, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        self.fma._mm256_fmadd_pd(a, b, c)
    }

    #[inline(always)]
    fn near_sub_product(self, c: Self::Numbers, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        self.fma._mm256_fnmadd_pd(a, b, c)
    }

    #[inline(always)]
    fn near_sqrt(self, a: Self::Numbers) -> Self::Numbers {
        self.avx._mm256_sqrt_pd(a)
    }

    #[inline(always)]
    fn near_quotient(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        self.avx._mm256_div_pd(a, b)
    }

    #[inline(always)]
    fn below(self, a: Self::Numbers, b: Self::Numbers) -> Self::Mask {
        self.avx._mm256_cmp_pd::<{ std::arch::x86_64::_CMP_LT_OQ }>(a, b)
    }

    #[inline(always)]
    fn bits(self, mask: Self::Mask) -> u32 {
        self.avx._mm256_movemask_pd(mask) as u32
    }

    #[inline(always)]
    fn equal(self, a: Self::Numbers, b: Self::Numbers) -> Self::Mask {
        self.avx._mm256_cmp_pd::<{ std::arch::x86_64::_CMP_EQ_OQ }>(a, b)
    }

    #[inline(always)]
    fn least(self, a: Self::Numbers) -> f64 {
        let halves = self.avx._mm256_min_pd(a, self.avx._mm256_permute2f128_pd::<0x01>(a, a));
        let quarters = self.avx._mm256_min_pd(halves, self.avx._mm256_permute_pd::<0b0101>(halves));
        self.avx2._mm256_cvtsd_f64(quarters)
    }

    #[inline(always)]
    fn select(self, mask: Self::Mask, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        self.avx._mm256_blendv_pd(b, a, mask)
    }

    #[inline(always)]
    fn nth(self, numbers: Self::Numbers, lane: usize) -> f64 {
        let numbers: [f64; 4] = pulp::cast(numbers);
        numbers[lane]
    }

    #[inline(always)]
    fn nth_of_two(self, numbers: [Self::Numbers; 2], lane: usize) -> f64 {
        let numbers: [f64; 8] = pulp::cast(numbers);
        numbers[lane]
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
        let places = pulp::cast([FRONT[bits as usize & 255], 0]);
        let rows = self.avx2._mm256_permutevar8x32_epi32(pulp::cast(*rows), self.avx2._mm256_cvtepu8_epi32(places));
        pulp::cast(rows)
    }

    #[inline(always)]
    fn columns(self, flights: &[Flight], p: &[u32]) -> [Self::Numbers; 8] {
        let a: [Self::Numbers; 2] = pulp::cast(flights[p[0] as usize].line());
        let b: [Self::Numbers; 2] = pulp::cast(flights[p[1] as usize].line());
        let c: [Self::Numbers; 2] = pulp::cast(flights[p[2] as usize].line());
        let d: [Self::Numbers; 2] = pulp::cast(flights[p[3] as usize].line());
        let [x0, x1, x2, x3] = turned_four(self, a[0], b[0], c[0], d[0]);
        let [x4, x5, x6, x7] = turned_four(self, a[1], b[1], c[1], d[1]);
        [x0, x1, x2, x3, x4, x5, x6, x7]
    }
}

/// For each pattern of eight bits: where those that are set stand, from the front on, one byte each.
const FRONT: [u64; 256] = {
    let mut table = [0; 256];
    let mut bits = 0;
    while bits < 256 {
        let (mut count, mut place) = (0, 0);
        while place < 8 {
            if bits >> place & 1 == 1 {
                table[bits] |= (place as u64) << (8 * count);
                count += 1;
            }
            place += 1;
        }
        bits += 1;
    }
    table
};

/// [`Lanes::matches`], in registers that hold all eight.
#[inline(always)]
pub(super) fn matches_eight(
    f: pulp::core_arch::x86::Avx,
    whole: pulp::core_arch::x86::Avx2,
    rows: &[u32; 8],
    row: u32,
) -> u32 {
    let equal = whole._mm256_cmpeq_epi32(pulp::cast(*rows), f._mm256_set1_epi32(row as i32));
    f._mm256_movemask_ps(pulp::cast(equal)) as u32
}

/// [`Lanes::within`], in registers that hold all eight.
#[inline(always)]
pub(super) fn within_eight(
    f: pulp::core_arch::x86::Avx,
    whole: pulp::core_arch::x86::Avx2,
    at: &[[u8; 8]; 3],
    from: [f32; 3],
    within: f32,
) -> u32 {
    let x = f._mm256_sub_ps(eight_numbers(f, whole, at[0]), f._mm256_set1_ps(from[0]));
    let y = f._mm256_sub_ps(eight_numbers(f, whole, at[1]), f._mm256_set1_ps(from[1]));
    let z = f._mm256_sub_ps(eight_numbers(f, whole, at[2]), f._mm256_set1_ps(from[2]));
    let plane = f._mm256_add_ps(f._mm256_mul_ps(x, x), f._mm256_mul_ps(y, y));
    let squared = f._mm256_add_ps(plane, f._mm256_mul_ps(z, z));
    let hits = f._mm256_cmp_ps::<{ std::arch::x86_64::_CMP_LT_OQ }>(squared, f._mm256_set1_ps(within));
    f._mm256_movemask_ps(hits) as u32
}

#[inline(always)]
fn eight_numbers(
    f: pulp::core_arch::x86::Avx,
    whole: pulp::core_arch::x86::Avx2,
    bytes: [u8; 8],
) -> std::arch::x86_64::__m256 {
    f._mm256_cvtepi32_ps(whole._mm256_cvtepu8_epi32(pulp::cast([u64::from_le_bytes(bytes), 0])))
}

/// Four lines of four numbers turned into columns.
#[inline(always)]
fn turned_four(registers: pulp::x86::V3, a: Four, b: Four, c: Four, d: Four) -> [Four; 4] {
    let f = registers.avx;
    let (even_ab, odd_ab) = (f._mm256_unpacklo_pd(a, b), f._mm256_unpackhi_pd(a, b));
    let (even_cd, odd_cd) = (f._mm256_unpacklo_pd(c, d), f._mm256_unpackhi_pd(c, d));
    [
        f._mm256_permute2f128_pd::<0x20>(even_ab, even_cd),
        f._mm256_permute2f128_pd::<0x20>(odd_ab, odd_cd),
        f._mm256_permute2f128_pd::<0x31>(even_ab, even_cd),
        f._mm256_permute2f128_pd::<0x31>(odd_ab, odd_cd),
    ]
}
