//! Several numbers side by side in the processor's vector registers, as wide as this machine has them.
//!
//! Only additions, subtractions, products and comparisons: IEEE 754 rounds each of them the same in every lane and at every
//! width, and none is fused with another, so the bits do not depend on the machine. What is called near does; it serves for
//! bounds alone.

#[cfg(target_arch = "x86_64")]
mod eight;
#[cfg(target_arch = "x86_64")]
mod four;
mod narrow;
mod twice;

use pulp::NullaryFnOnce;

pub use narrow::Narrow;
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
    /// The least of all `a`, and of all `b`.
    fn least_of_each(self, a: Self::Numbers, b: Self::Numbers) -> [f64; 2] {
        [self.least(a), self.least(b)]
    }
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

/// Functions that are one instruction on two registers.
#[cfg(target_arch = "x86_64")]
macro_rules! by_register {
    ($part:ident: $($name:ident = $instruction:ident;)*) => {
        $(#[inline(always)]
        fn $name(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
            self.$part.$instruction(a, b)
        })*
    };
}
#[cfg(target_arch = "x86_64")]
use by_register;

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
        let results = [lanes.add(a, b), lanes.sub(a, b), lanes.mul(a, b)];
        let more = [lanes.min(a, b), lanes.max(a, b), lanes.select(lanes.below(a, b), b, a)];
        for lane in 0..count {
            let x = 1.0 + lane as f64;
            let expected = [x + 3.0, x - 3.0, x * 3.0];
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
            let falling = lanes.gather(&falling, &in_order);
            assert_eq!(lanes.least(falling), 0.5);
            assert_eq!(lanes.least_of_each(falling, lanes.add(falling, falling)), [0.5, 1.0]);
            assert_eq!(lanes.least_of_each(lanes.add(falling, falling), falling), [1.0, 0.5]);
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
