//! Several numbers side by side in the processor's vector registers, as wide as this machine has them.
//!
//! Only additions, subtractions, products, quotients, square roots and comparisons: IEEE 754 rounds each of them the same in
//! every lane and at every width, and none is fused with another, so the bits do not depend on the machine. What is called
//! near does; it serves for bounds alone.

mod twice;

use pulp::NullaryFnOnce;

pub use twice::Twice;

use crate::flight::Flight;

/// A width of vector registers, chosen once when a simulation starts.
pub trait Lanes: Copy {
    /// How many numbers lie side by side.
    const COUNT: usize;
    /// That many numbers.
    type Numbers: Copy;
    /// That many truths.
    type Mask: Copy;

    /// The same number in all.
    fn all(self, x: f64) -> Self::Numbers;
    /// Those that stand at some places of `from`.
    fn gather(self, from: &[f64], places: &[u32]) -> Self::Numbers;
    /// Writes them side by side.
    fn put(self, numbers: Self::Numbers, to: &mut [f64]);
    /// a + b.
    fn add(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// a - b.
    fn sub(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// a b.
    fn mul(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// a / b.
    fn div(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// √a.
    fn sqrt(self, a: Self::Numbers) -> Self::Numbers;
    /// c + a b, rounded once or twice: for bounds, whose bits nobody sees.
    fn near_add_product(self, c: Self::Numbers, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// c - a b, likewise.
    fn near_sub_product(self, c: Self::Numbers, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// √a to one part in [`NEAR`], for a from 1e-306 to 1e301: for bounds.
    fn near_sqrt(self, a: Self::Numbers) -> Self::Numbers;
    /// a / b to one part in [`NEAR`], for b from 1e-306 to 1e301: for bounds.
    fn near_quotient(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// The lesser; `b` where they are equal.
    fn min(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// The greater; `b` where they are equal.
    fn max(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// a < b.
    fn below(self, a: Self::Numbers, b: Self::Numbers) -> Self::Mask;
    /// Both.
    fn both(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Either.
    fn either(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Whether each is true, as bits, the first lane's lowest.
    fn bits(self, mask: Self::Mask) -> u32;
    /// a = b.
    fn equal(self, a: Self::Numbers, b: Self::Numbers) -> Self::Mask;
    /// The least of all.
    fn least(self, a: Self::Numbers) -> f64;
    /// `a` where true, `b` elsewhere.
    fn select(self, mask: Self::Mask, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// One of them.
    fn nth(self, numbers: Self::Numbers, lane: usize) -> f64;
    /// One of two times as many.
    fn nth_of_two(self, numbers: [Self::Numbers; 2], lane: usize) -> f64;
    /// Which of eight points of whole numbers are less than the root of `within` from `from`, as bits; in single precision.
    fn within(self, at: &[[u8; 8]; 3], from: [f32; 3], within: f32) -> u32;
    /// Which of eight rows are `row`, as bits.
    fn matches(self, rows: &[u32; 8], row: u32) -> u32;
    /// Those of eight rows whose bits are set, moved to the front.
    fn compressed(self, rows: &[u32; 8], bits: u32) -> [u32; 8];
    /// The lines of the flights at some places, turned into columns.
    fn columns(self, flights: &[Flight], places: &[u32]) -> [Self::Numbers; 8];
}

/// Work that is compiled once for each width of registers. It and whatever it calls has to be inlined to be compiled so;
/// closures are not.
pub trait Work {
    /// What comes of it.
    type Output;
    /// Does it.
    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

/// Work that waits for its registers.
struct Compiled<L, W> {
    lanes: L,
    work: W,
}

impl<L: Lanes, W: Work> NullaryFnOnce for Compiled<L, W> {
    type Output = W::Output;

    #[inline(always)]
    fn call(self) -> W::Output {
        self.work.run(self.lanes)
    }
}

/// As many lanes as any machine has.
pub const MOST: usize = 8;

/// What is near differs by less than one part in so many.
pub const NEAR: f64 = (1 << 13) as f64;

/// The places of numbers that stand side by side.
pub const IN_ORDER: [u32; MOST] = [0, 1, 2, 3, 4, 5, 6, 7];

/// The widest registers of this machine.
#[derive(Clone, Copy, Debug)]
pub enum Width {
    /// Whatever every machine of this architecture has.
    Narrow(Narrow),
    /// Four numbers (AVX2).
    #[cfg(target_arch = "x86_64")]
    Four(pulp::x86::V3),
    /// Eight numbers (AVX-512).
    #[cfg(target_arch = "x86_64")]
    Eight(pulp::x86::V4),
}

impl Width {
    /// The widest registers here.
    pub fn of_this_machine() -> Self {
        Self::at_most(MOST)
    }

    /// The widest registers here of no more than so many numbers.
    pub fn at_most(count: usize) -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if count >= 8
                && let Some(registers) = pulp::x86::V4::try_new()
            {
                return Self::Eight(registers);
            }
            if count >= 4
                && let Some(registers) = pulp::x86::V3::try_new()
            {
                return Self::Four(registers);
            }
        }
        Self::Narrow(Narrow)
    }

    /// Does work in these registers.
    #[inline(always)]
    pub fn run<W: Work>(self, work: W) -> W::Output {
        match self {
            Self::Narrow(lanes) => run_apart(Compiled { lanes, work }),
            #[cfg(target_arch = "x86_64")]
            Self::Four(lanes) => lanes.vectorize(Compiled { lanes, work }),
            #[cfg(target_arch = "x86_64")]
            Self::Eight(lanes) => lanes.vectorize(Compiled { lanes, work }),
        }
    }

    /// How many numbers lie side by side.
    pub fn count(self) -> usize {
        match self {
            Self::Narrow(_) => Narrow::COUNT,
            #[cfg(target_arch = "x86_64")]
            Self::Four(_) => pulp::x86::V3::COUNT,
            #[cfg(target_arch = "x86_64")]
            Self::Eight(_) => pulp::x86::V4::COUNT,
        }
    }
}

/// In a function of its own, as the wider registers have theirs: so the stack and the code of whoever asks stay small.
#[inline(never)]
fn run_apart<L: Lanes, W: Work>(compiled: Compiled<L, W>) -> W::Output {
    compiled.call()
}

#[cfg(target_arch = "x86_64")]
type Four = std::arch::x86_64::__m256d;
#[cfg(target_arch = "x86_64")]
type Eight = std::arch::x86_64::__m512d;

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
        div = |a, b| a / b;
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
    fn sqrt(self, a: [f64; 2]) -> [f64; 2] {
        a.map(f64::sqrt)
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
        self.sqrt(a)
    }

    #[inline(always)]
    fn near_quotient(self, a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
        self.div(a, b)
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

macro_rules! by_register {
    ($part:ident: $($name:ident = $instruction:ident;)*) => {
        $(#[inline(always)]
        fn $name(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
            self.$part.$instruction(a, b)
        })*
    };
}

#[cfg(target_arch = "x86_64")]
impl Lanes for pulp::x86::V3 {
    const COUNT: usize = 4;
    type Numbers = Four;
    type Mask = Four;

    by_register! {
        avx: add = _mm256_add_pd;
        sub = _mm256_sub_pd;
        mul = _mm256_mul_pd;
        div = _mm256_div_pd;
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
    fn sqrt(self, a: Self::Numbers) -> Self::Numbers {
        self.avx._mm256_sqrt_pd(a)
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
        self.sqrt(a)
    }

    #[inline(always)]
    fn near_quotient(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        self.div(a, b)
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
        let equal = self.avx2._mm256_cmpeq_epi32(pulp::cast(*rows), self.avx._mm256_set1_epi32(row as i32));
        self.avx._mm256_movemask_ps(pulp::cast(equal)) as u32
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
#[cfg(target_arch = "x86_64")]
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

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn within_eight(
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

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn eight_numbers(
    f: pulp::core_arch::x86::Avx,
    whole: pulp::core_arch::x86::Avx2,
    bytes: [u8; 8],
) -> std::arch::x86_64::__m256 {
    f._mm256_cvtepi32_ps(whole._mm256_cvtepu8_epi32(pulp::cast([u64::from_le_bytes(bytes), 0])))
}

/// Four lines of four numbers turned into columns.
#[cfg(target_arch = "x86_64")]
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

#[cfg(target_arch = "x86_64")]
impl Lanes for pulp::x86::V4 {
    const COUNT: usize = 8;
    type Numbers = Eight;
    type Mask = u8;

    by_register! {
        avx512f: add = _mm512_add_pd;
        sub = _mm512_sub_pd;
        mul = _mm512_mul_pd;
        div = _mm512_div_pd;
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
    fn sqrt(self, a: Self::Numbers) -> Self::Numbers {
        self.avx512f._mm512_sqrt_pd(a)
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
        let equal = self.avx2._mm256_cmpeq_epi32(pulp::cast(*rows), self.avx._mm256_set1_epi32(row as i32));
        self.avx._mm256_movemask_ps(pulp::cast(equal)) as u32
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
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn two_lines(registers: pulp::x86::V4, a: &Flight, b: &Flight) -> [Eight; 2] {
    let (a, b): (Eight, Eight) = (pulp::cast(a.line()), pulp::cast(b.line()));
    [registers.avx512f._mm512_unpacklo_pd(a, b), registers.avx512f._mm512_unpackhi_pd(a, b)]
}

/// Of the same four columns of four times two lines, each column of all eight.
#[cfg(target_arch = "x86_64")]
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

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::time::Time;

    fn check(lanes: impl Lanes) {
        let number = |lane: usize, column: usize| (10 * lane + column) as f64;
        let vector = |lane: usize, column: usize| {
            DVec3::new(number(lane, column), number(lane, column + 1), number(lane, column + 2))
        };
        let start = |lane: usize| Time { epoch: number(lane, 6), offset: number(lane, 7) };
        let flight = |lane: usize| Flight::new(vector(lane, 0), vector(lane, 3), start(lane));
        let flights: Vec<Flight> = (0..20).map(flight).collect();
        let places: [u32; 2 * MOST] = [3, 1, 4, 15, 9, 2, 6, 5, 0, 19, 7, 7, 12, 18, 10, 13];
        let count = stored(lanes, lanes.all(0.0)).len();
        for (column, numbers) in lanes.columns(&flights, &places[..count]).into_iter().enumerate() {
            for (lane, x) in stored(lanes, numbers).into_iter().enumerate() {
                assert_eq!(x, number(places[lane] as usize, column));
            }
        }
        let counted: Vec<f64> = (1..=count).map(|k| k as f64).collect();
        let in_order: Vec<u32> = (0..count as u32).collect();
        let (a, b) = (lanes.gather(&counted, &in_order), lanes.all(3.0));
        let results = [lanes.add(a, b), lanes.sub(a, b), lanes.mul(a, b), lanes.div(a, b), lanes.sqrt(a)];
        let more = [lanes.min(a, b), lanes.max(a, b), lanes.select(lanes.below(a, b), b, a)];
        for lane in 0..count {
            let x = 1.0 + lane as f64;
            let expected = [x + 3.0, x - 3.0, x * 3.0, x / 3.0, x.sqrt()];
            assert_eq!(results.map(|r| stored(lanes, r)[lane]), expected);
            let expected = [x.min(3.0), x.max(3.0), if x < 3.0 { 3.0 } else { x }];
            assert_eq!(more.map(|r| stored(lanes, r)[lane]), expected);
        }
        // From the least to the greatest numbers that what is near has to serve for.
        for exponent in -1016..=1000 {
            let scale = 2f64.powi(exponent);
            let x = lanes.mul(a, lanes.all(1.37 * scale / 16.0));
            let (root, quotient) = (lanes.near_sqrt(x), lanes.near_quotient(lanes.all(7.0), x));
            for lane in 0..count {
                let x = (1.0 + lane as f64) * (1.37 * scale / 16.0);
                let is_near = |a: f64, b: f64| (a / b - 1.0).abs() < 1.0 / NEAR;
                assert!(is_near(stored(lanes, root)[lane], x.sqrt()), "√{x}");
                assert!(is_near(stored(lanes, quotient)[lane], 7.0 / x), "7 / {x}");
            }
        }
        for (near, sign) in [(lanes.near_add_product(a, b, b), 1.0), (lanes.near_sub_product(a, b, b), -1.0)] {
            (0..count).for_each(|lane| assert_eq!(stored(lanes, near)[lane], 1.0 + lane as f64 + sign * 9.0));
        }
        let all = (1 << count) - 1;
        assert_eq!(lanes.bits(lanes.below(a, b)), 0b11);
        assert_eq!(lanes.bits(lanes.equal(a, b)), 0b100 & all);
        assert_eq!(lanes.bits(lanes.both(lanes.below(a, b), lanes.below(b, a))), 0);
        assert_eq!(lanes.bits(lanes.either(lanes.below(a, b), lanes.below(b, a))), !0b100 & all);
        assert_eq!(lanes.least(a), 1.0);
        let line = [0, 1, 2, 3, 4, 5, 6, 255];
        assert_eq!(lanes.within(&[line, line, line], [2.0, 2.0, 2.0], 3.5), 0b1110);
        assert_eq!(lanes.within(&[line, line, line], [254.5, 255.5, 255.0], 0.6), 0b1000_0000);
        assert_eq!(lanes.matches(&[9, 8, 7, 6, 9, 4, 3, 9], 9), 0b1001_0001);
        assert_eq!(lanes.compressed(&[9, 8, 7, 6, 5, 4, 3, 2], 0b1010_0001)[..3], [9, 4, 2]);
        // The least in each lane in turn.
        for lane in 0..count {
            let falling: Vec<f64> = (0..count).map(|k| if k == lane { 0.5 } else { 30.0 - k as f64 }).collect();
            assert_eq!(lanes.least(lanes.gather(&falling, &in_order)), 0.5);
        }
    }

    fn stored<L: Lanes>(lanes: L, numbers: L::Numbers) -> Vec<f64> {
        (0..L::COUNT).map(|lane| lanes.nth(numbers, lane)).collect()
    }

    struct Check;

    impl Work for Check {
        type Output = usize;

        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) -> usize {
            check(lanes);
            check(Twice(lanes));
            L::COUNT
        }
    }

    #[test]
    fn every_width_computes_the_same() {
        for most in [2, 4, 8] {
            let width = Width::at_most(most);
            assert_eq!(width.run(Check), width.count());
            assert!(width.count() <= most);
        }
    }
}
