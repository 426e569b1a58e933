//! Angles in turns (1 turn = 2π rad): whole turns are taken off without rounding, however many there were.

use super::double_double::{DoubleDouble, two_product, two_sum};

/// A rate in turns a second, of twice the precision: after 1e12 turns its own rounding is still far below that of the
/// angle within the last turn. In a plain double it would be half a unit in the last place of the whole angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnRate(DoubleDouble);

impl TurnRate {
    /// Of what stands still.
    pub const NONE: Self = Self(DoubleDouble { high: 0.0, low: 0.0 });

    /// The rate of so many rad/s.
    pub fn from_radians(rate: DoubleDouble) -> Self {
        Self(rate * DoubleDouble::INVERSE_TWO_PI)
    }

    /// Of a motion that does not come round: `rate` a second of whatever the phase is counted in.
    pub fn open(rate: DoubleDouble) -> Self {
        Self(rate)
    }

    /// Turns a second.
    pub fn turns_per_second(self) -> f64 {
        self.0.high
    }

    /// Times a power of two.
    pub fn scaled(self, power: f64) -> Self {
        Self(self.0.scaled(power))
    }

    /// Where one is after `seconds` from `start` (turns, in [-1/2, 1/2]) on, in turns but for whole ones.
    #[inline(always)]
    pub fn after(self, seconds: f64, start: f64) -> f64 {
        // The product is exact but for low · seconds, 2^-106 of it, and to take off what is whole is exact.
        let (turns, error) = two_product(self.0.high, seconds);
        let error = error + self.0.low * seconds;
        let (sum, rest) = two_sum(turns - nearest(turns), start);
        (sum - nearest(sum)) + (rest + (error - nearest(error)))
    }
}

/// The integer nearest to x; of two, the even one.
#[inline(always)]
pub fn nearest(x: f64) -> f64 {
    // Doubles from 2^52 to 2^53 are the integers, so to add 1.5 · 2^52 rounds to one.
    const SHIFT: f64 = 6_755_399_441_055_744.0;
    if x.abs() < 2_251_799_813_685_248.0 { (x + SHIFT) - SHIFT } else { x.round_ties_even() }
}

/// (2π)^(2k+1) / (2k+1)! with alternating signs, from k = 1 on: the next term is 1e-19 of the sine at an eighth of a
/// turn.
const SINE: [f64; 8] = [
    -41.34170224039976,
    81.60524927607506,
    -76.70585975306139,
    42.058693944897655,
    -15.09464257682299,
    3.819952584848282,
    -0.7181223017785006,
    0.10422916220813984,
];

/// (2π)^(2k) / (2k)! with alternating signs, from k = 1 on: the next term is 2e-18.
const COSINE: [f64; 8] = [
    -19.739208802178716,
    64.9393940226683,
    -85.45681720669373,
    60.24464137187666,
    -26.4262567833744,
    7.903536371318469,
    -1.714390711088672,
    0.28200596845579123,
];

/// Σ c_k x^k, in pairs, which a processor adds up in half the time.
#[inline(always)]
fn polynomial(c: &[f64; 8], x: f64) -> f64 {
    let square = x * x;
    let fourth = square * square;
    let low = (c[0] + c[1] * x) + (c[2] + c[3] * x) * square;
    let high = (c[4] + c[5] * x) + (c[6] + c[7] * x) * square;
    low + high * fourth
}

/// Sine and cosine of an angle in turns, |turns| < 2^50, each to within about a unit in the last place of the larger of
/// the two.
#[inline(always)]
pub fn sine_cosine(turns: f64) -> (f64, f64) {
    /// 2π and what the double leaves out of it.
    const TWO_PI: (f64, f64) = (std::f64::consts::TAU, 2.4492935982947064e-16);
    let quarters = nearest(4.0 * turns);
    let x = turns - 0.25 * quarters;
    let square = x * x;
    let sine = x * TWO_PI.0 + x * (TWO_PI.1 + square * polynomial(&SINE, square));
    let cosine = 1.0 + square * polynomial(&COSINE, square);
    // No branch: which quarter it is cannot be foreseen.
    let quarter = quarters as i64;
    let (a, b) = if quarter & 1 == 0 { (sine, cosine) } else { (cosine, sine) };
    (with_sign(a, quarter), with_sign(b, quarter + 1))
}

/// x, or -x if the second bit of `quarter` is set.
#[inline(always)]
fn with_sign(x: f64, quarter: i64) -> f64 {
    f64::from_bits(x.to_bits() ^ ((quarter as u64 & 2) << 62))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_agree_with_the_library() {
        for k in -4000..4000 {
            let turns = f64::from(k) / 4096.0;
            // The angle in rad is rounded, by up to half a unit in the last place of 6.2 rad.
            let (sine, cosine) = libm::sincos(turns * std::f64::consts::TAU);
            let (s, c) = sine_cosine(turns);
            let allowed = 3e-16 * (1.0 + turns.abs() * 3.0);
            assert!((s - sine).abs() < allowed && (c - cosine).abs() < allowed, "{turns}: {s} {sine} {c} {cosine}");
            assert!((s * s + c * c - 1.0).abs() < 5e-16);
        }
        assert_eq!(sine_cosine(0.25), (1.0, 0.0));
        assert_eq!(sine_cosine(-0.5).1, -1.0);
    }

    #[test]
    fn whole_turns_cost_nothing() {
        let third = TurnRate(DoubleDouble::ONE / DoubleDouble::from(3.0));
        // 3e15 + 1 seconds are 1e15 turns and a third.
        assert!((third.after(3e15 + 1.0, 0.0) - 1.0 / 3.0).abs() < 1e-16);
        assert!((third.after(-3e15 - 1.0, 0.1) - (0.1 - 1.0 / 3.0)).abs() < 1e-16);
        assert_eq!(third.after(1.5, 0.25), -0.25);
    }
}
