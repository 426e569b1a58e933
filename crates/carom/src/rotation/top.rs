//! The constants of a wobble, from the principal moments and the angular momentum right after an impact.
//!
//! Indices 1, 2, 3 stand for the other axis, the middle one and the pole; L₁, L₂, L₃ are the components of the angular
//! momentum. With
//!
//!   A = I₂ |I₃ - I₁|,  B = I₁ |I₃ - I₂|,  G = I₃ |I₂ - I₁| = A - B,  V = I₁ I₂ I₃,
//!   P = A L₃² + G L₂²,  O = A L₁² + B L₂²,  D = B L₃² - G L₁²,
//!
//! Jacobi's solution has τ² = B P / V², k² = G O / B P and k′² = A D / B P, and the squares of the amplitudes are O/A,
//! O/B, P/A. Only D is a difference, by which |L² - 2 E I₂| = D / I₁ I₃: it vanishes on the separatrix. Neither
//! symmetry nor the separatrix makes any of them 0/0.

use std::f64::consts::TAU;

use glam::DVec3;

use super::double_double::DoubleDouble;
use super::elliptic::{QuarterMeans, arithmetic_geometric_mean, carlson_first_kind, quarter_means};
use super::wobble::Elements;

/// Which principal axes are those of the wobble, with signs that leave them right-handed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WobbleAxes {
    /// The body's axes that are the other axis, the middle one and the pole.
    index: [u8; 3],
    /// 1 or -1 each: of the other axis and of the pole, the side on which the angular momentum is at the start.
    sign: DVec3,
}

impl WobbleAxes {
    fn new(index: [usize; 3], momentum: [DoubleDouble; 3]) -> Self {
        let side = |i: usize| if momentum[index[i]].high < 0.0 { -1.0 } else { 1.0 };
        let parity = if (index[0] + 1) % 3 == index[1] { 1.0 } else { -1.0 };
        let (other, pole) = (side(0), side(2));
        Self { index: index.map(|i| i as u8), sign: DVec3::new(other, parity * other * pole, pole) }
    }

    /// From components along the axes of the wobble to those along the body's.
    #[inline(always)]
    pub fn to_body(self, vector: DVec3) -> DVec3 {
        let signed = vector * self.sign;
        let mut result = [0.0; 4];
        result[usize::from(self.index[0] & 3)] = signed.x;
        result[usize::from(self.index[1] & 3)] = signed.y;
        result[usize::from(self.index[2] & 3)] = signed.z;
        DVec3::new(result[0], result[1], result[2])
    }
}

/// A state whose angular momentum wanders in the body.
pub struct Top {
    /// Where the axes of the wobble are.
    pub axes: WobbleAxes,
    /// 1 if the pole is the axis of the largest moment, -1 if that of the smallest.
    pub sense: f64,
    /// L.
    pub size: DoubleDouble,
    moments: [f64; 3],
    squares: [DoubleDouble; 3],
    /// Whether L₂ is positive in the direction in which it grows at L₁ > 0.
    is_rising: bool,
    /// V, A, B, G, P, O, D.
    volume: DoubleDouble,
    other_pole: DoubleDouble,
    middle_pole: DoubleDouble,
    other_middle: DoubleDouble,
    pole_part: DoubleDouble,
    other_part: DoubleDouble,
    separation: DoubleDouble,
}

impl Top {
    /// Of moments of which not all are equal, the angular momentum along the body's axes, and its magnitude.
    pub fn new(moments: [f64; 3], momentum: [DoubleDouble; 3], size: DoubleDouble) -> Self {
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| moments[i].total_cmp(&moments[j]));
        let [low, middle, high] = order;
        let round_high = Self::about([low, middle, high], moments, momentum, size, 1.0);
        // On the separatrix itself either will do, unless the body is symmetric: then it is its own axis.
        let is_high = round_high.separation.high > 0.0
            || (round_high.separation.high == 0.0 && round_high.middle_pole.high >= round_high.other_middle.high);
        if is_high { round_high } else { Self::about([high, middle, low], moments, momentum, size, -1.0) }
    }

    fn about(
        index: [usize; 3],
        moments: [f64; 3],
        momentum: [DoubleDouble; 3],
        size: DoubleDouble,
        sense: f64,
    ) -> Self {
        let axes = WobbleAxes::new(index, momentum);
        let moments = index.map(|i| moments[i]);
        let squares = index.map(|i| momentum[i].squared());
        let [i1, i2, i3] = moments;
        let gap = |a: f64, b: f64, factor: f64| DoubleDouble::difference(a, b).abs() * factor;
        let (other_pole, middle_pole, other_middle) = (gap(i3, i1, i2), gap(i3, i2, i1), gap(i2, i1, i3));
        Self {
            axes,
            sense,
            size,
            moments,
            squares,
            is_rising: momentum[index[1]].high * axes.sign.y * sense > 0.0,
            volume: DoubleDouble::product(i1, i2) * i3,
            other_pole,
            middle_pole,
            other_middle,
            pole_part: other_pole * squares[2] + other_middle * squares[1],
            other_part: other_pole * squares[0] + middle_pole * squares[1],
            separation: middle_pole * squares[2] - other_middle * squares[0],
        }
    }

    /// τ = du/dt, 32 digits: the phase of the wobble grows by it.
    pub fn tau(&self) -> DoubleDouble {
        (self.middle_pole * self.pole_part).sqrt() / self.volume
    }

    /// π / 2K, and the part of a period's mean that belongs to the other axis rather than the middle one; both 0 on the
    /// separatrix.
    pub fn quarter_means(&self) -> QuarterMeans {
        if self.other_middle == DoubleDouble::ZERO {
            // A symmetric top: k = 0, and there is no difference to share.
            return QuarterMeans { mean: DoubleDouble::ONE, share: DoubleDouble::ZERO };
        }
        let square = self.other_pole * self.separation / (self.middle_pole * self.pole_part);
        // It is so, too, where k′² underflows: the body would turn over after more than 700 time constants.
        if !(square.high > 0.0) {
            return QuarterMeans { mean: DoubleDouble::ZERO, share: DoubleDouble::ZERO };
        }
        quarter_means(square.sqrt(), self.other_pole / self.middle_pole)
    }

    /// The rate (rad/s) at which the body turns about the angular momentum L on average, 32 digits. The pole goes round
    /// L by L (L₁²/I₁ + L₂²/I₂) / (L₁² + L₂²), that is L/I₂ and `share` of L/I₁ - L/I₂ (Landau and Lifshitz, section
    /// 37); the turn is counted from where the smallest rotation leaves the body, which meanwhile goes round the pole
    /// with the `frequency` of the wobble.
    pub fn turn_rate(&self, frequency: DoubleDouble, share: DoubleDouble) -> DoubleDouble {
        let excess = self.size * self.other_middle * share / self.volume - frequency;
        self.size / DoubleDouble::from(self.moments[1]) + excess * self.sense
    }

    /// L over each moment (rad/s).
    pub fn rates(&self) -> DVec3 {
        self.size.high / DVec3::from_array(self.moments)
    }

    /// What the sums of the wobble are made from; `mean` is π / 2K.
    pub fn elements(&self, mean: f64) -> Elements {
        let modulus_square =
            self.other_middle.high * self.other_part.high / (self.middle_pole.high * self.pole_part.high);
        let [other, middle, pole] = self.square_amplitudes();
        let complementary_mean = arithmetic_geometric_mean(1.0, modulus_square.sqrt());
        // dn(iη′) = 1/A₃ where the turn has its poles; η, the rest of iK′, has sn = A₃, cn = A₁, dn² = A₁² + k² A₃².
        let eta = || pole.sqrt() * carlson_first_kind(other, other + modulus_square * pole, 1.0);
        let eta = if modulus_square > 0.0 { eta() } else { f64::INFINITY };
        let amplitudes = DVec3::new(other.sqrt(), self.sense * middle.sqrt(), pole.sqrt());
        Elements { amplitudes, mean, complementary_mean, eta }
    }

    /// v at the start in turns, v = u π / 2K; u itself if the wobble is open. u = sn R_F(cn², dn², 1) (DLMF 19.25.5).
    pub fn phase_at_start(&self, is_open: bool, mean: f64) -> f64 {
        let [first, second, third] = self.squares.map(|square| square.high);
        let cn2 = self.other_pole.high * first / self.other_part.high;
        let sn2 = self.middle_pole.high * second / self.other_part.high;
        let dn2 = self.other_pole.high * third / self.pole_part.high;
        let u = sn2.sqrt() * carlson_first_kind(cn2, dn2, 1.0);
        let phase = if is_open { u } else { u * mean / TAU };
        if self.is_rising { phase } else { -phase }
    }

    /// The squares of the amplitudes of L₁, L₂, L₃, over L².
    fn square_amplitudes(&self) -> [f64; 3] {
        let (other, pole, square) = (self.other_part.high, self.pole_part.high, self.square());
        [
            other / self.other_pole.high / square,
            other / self.middle_pole.high / square,
            pole / self.other_pole.high / square,
        ]
    }

    /// L₃² / L² where it is smallest, at sn = 1: that of the pole times k′².
    fn pole_at_end(&self) -> f64 {
        self.separation.high.max(0.0) / self.middle_pole.high / self.square()
    }

    fn square(&self) -> f64 {
        self.size.high * self.size.high
    }

    /// The largest |ω| of the motion (rad/s), rounded up. |ω|² = Σ (L_i/I_i)², and the squares of all three components
    /// of L are linear functions of sn² u; so the largest is at sn = 0 or at sn = 1.
    pub fn fastest(&self) -> f64 {
        let [other, middle, pole] = self.square_amplitudes();
        let pole_at_end = self.pole_at_end();
        let squares = self.rates() * self.rates();
        let at_other = squares.x * other + squares.z * pole;
        let at_middle = squares.y * middle + squares.z * pole_at_end;
        at_other.max(at_middle).sqrt() * ROUND_UP
    }

    /// The largest |dω/dt| of the motion (rad/s²), rounded up. Euler's equations, dω₁/dt = L₂ L₃ (1/I₃ - 1/I₂) / I₁ and
    /// so on, give
    ///
    ///   |dω/dt|² = p z (1 - k² z) + r (1 - k² z)(1 - z) + s z (1 - z),  z = sn² u,
    ///
    /// with p, r, s >= 0: a parabola in z, whose largest value in [0, 1] is at an end or at its vertex. At z = ½ it is
    /// at least (p + r + s)/4, so that the rounding of its coefficients is that of its largest value.
    pub fn fastest_change(&self) -> f64 {
        let [other, middle, pole] = self.square_amplitudes();
        let pole_at_end = self.pole_at_end();
        let volume = self.volume.high / self.size.high;
        let gaps = DVec3::new(self.middle_pole.high, self.other_pole.high, self.other_middle.high) / volume;
        let rates = self.rates();
        let factors = rates * rates * gaps * gaps;
        // The pole's square is `pole` at z = 0 and falls by `fall` to z = 1.
        let fall = pole - pole_at_end;
        let (first, second, third) = (factors.x * middle, factors.y * other, factors.z * other * middle);
        let value = |z: f64| (first * z + second * (1.0 - z)) * (pole - fall * z) + third * z * (1.0 - z);
        let slope = (first - second) * pole - second * fall + third;
        let curvature = (second - first) * fall - third;
        let vertex = -0.5 * slope / curvature;
        let inside = if curvature < 0.0 && vertex > 0.0 && vertex < 1.0 { value(vertex) } else { 0.0 };
        value(0.0).max(value(1.0)).max(inside).sqrt() * ROUND_UP
    }
}

/// More than all roundings of the bounds together, about ten of half an ulp under a root.
const ROUND_UP: f64 = 1.0 + 4.0 * f64::EPSILON;
