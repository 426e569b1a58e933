//! How the angular momentum wanders in the body, and how unevenly the body goes round it meanwhile: sums of theta
//! functions.
//!
//! Axes here are those of the wobble: the first two are the other axis and the middle one, the third is the pole, the
//! principal axis (of the largest or the smallest moment) about which the angular momentum circulates in the body,
//! pointing to its side of it. With u growing in proportion to time, the direction of the angular momentum is
//!
//!   n = (A₁ cn u, ± A₂ sn u, A₃ dn u),
//!
//! of modulus k and quarter period K. Each of the three is a quotient of two theta functions of v = π u / 2K. The body
//! is turned about the angular momentum by an angle that grows evenly but for a part of the period of dn. Half of that
//! part is the argument of ϑ₄(v ∓ iα) of the nome q², where q is that of k: so its sine and cosine, which an
//! orientation needs, come without an inverse function, and no sign is lost. (Jacobi, Crelle 39, 1850, 293, has this
//! for the direction cosines; van Zon and Schofield, J. Comput. Phys. 225, 2007, 145, for matrices. It is this simple
//! because the angle is measured not from the nodes but from where the smallest rotation that brings n to the pole
//! leaves the body; then it also has a meaning when n is at the pole.)
//!
//! Two sums give the same: one in powers of q, which circular functions multiply, and, near the separatrix, where q
//! nears 1, Jacobi's transform of it in powers of Q, ln q ln Q = π², which hyperbolic functions multiply. They meet at
//! q = e⁻², Q = 0.0072. What is left out of either is below 3e-17.

use std::f64::consts::PI;

use glam::DVec3;

use super::turns::{nearest, sine_cosine};

/// The nome up to which circular functions are summed, e⁻²: beyond, the other sum takes fewer terms.
const LARGEST_NOME: f64 = 0.135_335_283_236_612_7;

/// The stretch of a wobble whose K is infinite; that of any other is at least π².
const OPEN: f64 = 1.0;

/// What a wobble consists of, once an impact.
pub struct Elements {
    /// The amplitudes A₁, ± A₂, A₃ of n.
    pub amplitudes: DVec3,
    /// π / 2K: the arithmetic-geometric mean of 1 and k′.
    pub mean: f64,
    /// π / 2K′: the arithmetic-geometric mean of 1 and k. 0 if k is.
    pub complementary_mean: f64,
    /// The incomplete integral of the first kind η of the modulus k′, of which α = π (K′ - η) / 2K; infinite
    /// if k is 0.
    pub eta: f64,
}

/// A wobble, ready to be evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wobble {
    /// k = 0: the angular momentum goes round the axis of a symmetric top.
    Circular {
        /// n is (A₁ cos v, A₂ sin v, A₃).
        amplitudes: DVec3,
    },
    /// The sums in powers of q.
    Trigonometric {
        /// Factors of the theta functions in n.
        amplitudes: DVec3,
        /// q.
        nome: f64,
        /// q² e^(2α), at most q.
        near: f64,
        /// q² e^(-2α), at most q².
        far: f64,
    },
    /// The sums in powers of Q.
    Hyperbolic {
        /// Factors of the theta functions in n.
        amplitudes: DVec3,
        /// Q.
        nome: f64,
        /// How much w = π u / 2K′ grows in a turn of v; 1 where K is infinite, and v stands for w itself.
        stretch: f64,
        /// Cosine and sine of β = π (K′ - η) / 4K′.
        beta: [f64; 2],
        /// (K′ - η) / K′ / 2; 0 where K is infinite.
        lag: f64,
    },
}

/// What a wobble is at a point of its period.
pub struct Point {
    /// Direction n of the angular momentum.
    pub direction: DVec3,
    /// Cosine and sine, times any positive number, of half of the uneven part of the angle about the angular momentum.
    pub uneven: [f64; 2],
    /// What is to be added to half of the even part (turns).
    pub lead: f64,
}

impl Wobble {
    /// From the integrals to the sums.
    pub fn new(elements: &Elements) -> Self {
        let Elements { amplitudes, mean, complementary_mean, eta } = *elements;
        if complementary_mean == 0.0 {
            return Self::Circular { amplitudes };
        }
        // ln q = -π K′/K, ln Q = -π K/K′.
        let nome = libm::exp(-PI * mean / complementary_mean);
        if nome <= LARGEST_NOME {
            let q_e2alpha = libm::exp(-2.0 * mean * eta);
            if nome == 0.0 || q_e2alpha == 0.0 {
                return Self::Circular { amplitudes };
            }
            Self::trigonometric(amplitudes, nome, q_e2alpha)
        } else {
            let from_end = 1.0 - eta * complementary_mean / (0.5 * PI);
            Self::hyperbolic(amplitudes, PI * complementary_mean / mean, from_end)
        }
    }

    /// `q_e2alpha` is q e^(2α), between q and 1.
    fn trigonometric(amplitudes: DVec3, nome: f64, q_e2alpha: f64) -> Self {
        let powers = Powers::of(nome);
        // ϑ₂ (over 2 q^(1/4)), ϑ₃ and ϑ₄ at v = 0, where cn = dn = 1; at v = π/2, where sn = 1, ϑ₁ is ϑ₂ and ϑ₄ is ϑ₃
        // of 0.
        let second = 1.0 + powers.second + powers.sixth + powers.twelfth;
        let even = 2.0 * (powers.fourth + powers.sixteenth);
        let odd = 2.0 * (nome + powers.ninth);
        let (third, fourth) = (1.0 + even + odd, 1.0 + even - odd);
        Self::Trigonometric {
            amplitudes: amplitudes * DVec3::new(fourth / second, third / second, fourth / third),
            nome,
            near: nome * q_e2alpha,
            far: powers.second * (nome / q_e2alpha),
        }
    }

    /// `length` is π K/K′, infinite on the separatrix; `from_end` is (K′ - η) / K′.
    fn hyperbolic(amplitudes: DVec3, length: f64, from_end: f64) -> Self {
        let nome = libm::exp(-length);
        let square = nome * nome;
        // ϑ₂ (over 2 Q^(1/4)), ϑ₃ and ϑ₄ of the nome Q at w = 0, where cn = dn = 1; sn is ϑ₃(0) ϑ₁(w) / ϑ₄(0) ϑ₂(w).
        let second = 1.0 + square + square * square * square;
        let (third, fourth) = (1.0 + 2.0 * (nome + square * square), 1.0 - 2.0 * (nome - square * square));
        let open = length == f64::INFINITY;
        // β <= π/4 is an eighth of a turn.
        let (sine, cosine) = sine_cosine(0.125 * from_end);
        Self::Hyperbolic {
            amplitudes: amplitudes * DVec3::new(second / fourth, third / fourth, second / third),
            nome,
            stretch: if open { OPEN } else { 2.0 * length },
            beta: [cosine, sine],
            lag: if open { 0.0 } else { 0.5 * from_end },
        }
    }

    /// Whether K is infinite: the state is on the separatrix, and the body turns over once and never again.
    #[inline(always)]
    pub fn is_open(&self) -> bool {
        matches!(self, Self::Hyperbolic { stretch, .. } if *stretch == OPEN)
    }

    /// The wobble `turns` (of v) from where the middle component is 0 and the other one positive.
    #[inline(always)]
    pub fn at(&self, turns: f64) -> Point {
        match *self {
            Self::Circular { amplitudes } => {
                let (sine, cosine) = sine_cosine(turns);
                Point { direction: amplitudes * DVec3::new(cosine, sine, 1.0), uneven: [1.0, 0.0], lead: 0.0 }
            }
            Self::Trigonometric { amplitudes, nome, near, far } => {
                let angles = Multiples::of(turns);
                let powers = Powers::of(nome);
                Point {
                    direction: amplitudes * direction(&angles, &powers),
                    uneven: uneven(&angles, &powers, near, far),
                    lead: 0.0,
                }
            }
            Self::Hyperbolic { amplitudes, nome, stretch, beta, lag } => {
                // Half a turn on, the first two components change their signs.
                let halves = if stretch == OPEN { 0.0 } else { nearest(2.0 * turns) };
                let turns = turns - 0.5 * halves;
                let sign = 1.0 - 2.0 * (halves as i64 & 1) as f64;
                let w = stretch * turns;
                let decays = Decays::of(w.abs(), nome);
                let side = if w < 0.0 { -1.0 } else { 1.0 };
                let [real, imaginary] = decays.uneven(beta);
                Point {
                    direction: amplitudes * decays.direction() * DVec3::new(sign, sign * side, 1.0),
                    uneven: [real, -side * imaginary],
                    lead: lag * turns,
                }
            }
        }
    }
}

/// Powers of the nome q.
struct Powers {
    first: f64,
    second: f64,
    fourth: f64,
    sixth: f64,
    ninth: f64,
    twelfth: f64,
    sixteenth: f64,
}

impl Powers {
    #[inline(always)]
    fn of(nome: f64) -> Self {
        let second = nome * nome;
        let fourth = second * second;
        let eighth = fourth * fourth;
        Self {
            first: nome,
            second,
            fourth,
            sixth: second * fourth,
            ninth: eighth * nome,
            twelfth: eighth * fourth,
            sixteenth: eighth * eighth,
        }
    }
}

/// Cosines and sines of v to 8 v, as far as they are needed.
struct Multiples {
    cosine: [f64; 9],
    sine: [f64; 8],
}

impl Multiples {
    #[inline(always)]
    fn of(turns: f64) -> Self {
        let (s1, c1) = sine_cosine(turns);
        let (s2, c2) = (2.0 * s1 * c1, (c1 - s1) * (c1 + s1));
        let (s4, c4) = (2.0 * s2 * c2, (c2 - s2) * (c2 + s2));
        let (s3, c3) = (s2 * c1 + c2 * s1, c2 * c1 - s2 * s1);
        let (s5, c5) = (s4 * c1 + c4 * s1, c4 * c1 - s4 * s1);
        let (s6, c6) = (s4 * c2 + c4 * s2, c4 * c2 - s4 * s2);
        let (s7, c7) = (s4 * c3 + c4 * s3, c4 * c3 - s4 * s3);
        Self {
            cosine: [1.0, c1, c2, c3, c4, c5, c6, c7, (c4 - s4) * (c4 + s4)],
            sine: [0.0, s1, s2, s3, s4, s5, s6, s7],
        }
    }
}

/// (ϑ₂, ϑ₁, ϑ₃) / ϑ₄, the first two without 2 q^(1/4).
#[inline(always)]
fn direction(angles: &Multiples, q: &Powers) -> DVec3 {
    let (c, s) = (&angles.cosine, &angles.sine);
    let first = s[1] - q.second * s[3] + q.sixth * s[5] - q.twelfth * s[7];
    let second = c[1] + q.second * c[3] + q.sixth * c[5] + q.twelfth * c[7];
    let even = 2.0 * (q.fourth * c[4] + q.sixteenth * c[8]);
    let odd = 2.0 * (q.first * c[2] + q.ninth * c[6]);
    let inverse = 1.0 / (1.0 + even - odd);
    DVec3::new(second * inverse, first * inverse, (1.0 + even + odd) * inverse)
}

/// ϑ₄(v - iα) of the nome q²: 1 + Σ (-1)^n q^(2n(n-1)) (near^n e^(2inv) + far^n e^(-2inv)).
#[inline(always)]
fn uneven(angles: &Multiples, q: &Powers, near: f64, far: f64) -> [f64; 2] {
    let (c, s) = (&angles.cosine, &angles.sine);
    let (near2, far2) = (near * near * q.fourth, far * far * q.fourth);
    let (near3, far3) = (near * near * near * q.twelfth, far * far * far * q.twelfth);
    [
        1.0 - (near + far) * c[2] + (near2 + far2) * c[4] - (near3 + far3) * c[6],
        (far - near) * s[2] + (near2 - far2) * s[4] - (near3 - far3) * s[6],
    ]
}

/// Powers of x = e^(-w) and y = Q e^w, for 0 <= w <= ½ ln (1/Q): both decay, x from the middle of the half period, y
/// from its end.
struct Decays {
    x: f64,
    y: f64,
    nome: f64,
}

impl Decays {
    #[inline(always)]
    fn of(w: f64, nome: f64) -> Self {
        let x = libm::exp(-w);
        // On the separatrix Q is 0, and x too far from the middle.
        let y = if nome > 0.0 { nome / x } else { 0.0 };
        Self { x, y, nome }
    }

    /// (ϑ₄, ϑ₁ / i, ϑ₃) / ϑ₂ at iw of the nome Q, ϑ₁ and ϑ₂ without 2 Q^(1/4): those two times 2 e^(-w) are 1 ∓ x² ∓ …,
    /// the others times e^(-w) are x ∓ y ∓ ….
    #[inline(always)]
    fn direction(&self) -> DVec3 {
        let Self { x, y, nome: q } = *self;
        let (x2, y2, q2) = (x * x, y * y, q * q);
        let (x4, y4) = (x2 * x2, y2 * y2);
        let even = 1.0 + y4 * q2;
        let (plus, minus) = (y2 + q2 * x4, y2 - q2 * x4);
        let tail = x2 + q2 * q2 * q2 * x2 * x4;
        let inverse = 1.0 / (even + tail + plus);
        let odd_terms = y + q * x * x2 + y * y4 * q2 * q2;
        let even_terms = x + q * (y * y2 + q2 * q * x * x4);
        DVec3::new(
            2.0 * (even_terms - odd_terms) * inverse,
            (even - tail - minus) * inverse,
            2.0 * (even_terms + odd_terms) * inverse,
        )
    }

    /// ϑ₂(β - iw/2) of the nome √Q, times a positive number:
    /// Σ cos (2n+1)β (Q^(n(n-1)/2) y^n + Q^(n(n+1)/2) x^(n+1)), and i times the sum of sines and differences.
    #[inline(always)]
    fn uneven(&self, [c1, s1]: [f64; 2]) -> [f64; 2] {
        let Self { x, y, nome: q } = *self;
        let (x2, y2, q3) = (x * x, y * y, q * q * q);
        let up = [1.0, y, y2 * q, y * y2 * q3];
        let down = [x, q * x2, q3 * x * x2, q3 * q3 * x2 * x2];
        let doubled = 2.0 * (c1 - s1) * (c1 + s1);
        let (c3, s3) = (c1 * (doubled - 1.0), s1 * (doubled + 1.0));
        let (c5, s5) = (doubled * c3 - c1, doubled * s3 - s1);
        let (c7, s7) = (doubled * c5 - c3, doubled * s5 - s3);
        [
            c1 * (up[0] + down[0]) + c3 * (up[1] + down[1]) + c5 * (up[2] + down[2]) + c7 * (up[3] + down[3]),
            s1 * (up[0] - down[0]) + s3 * (up[1] - down[1]) + s5 * (up[2] - down[2]) + s7 * (up[3] - down[3]),
        ]
    }
}
