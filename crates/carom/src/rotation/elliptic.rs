//! Elliptic integrals that the constants of a free rotation need, once an impact.

use super::double_double::DoubleDouble;

/// The part of themselves (pure number) by which two numbers may differ so that the square of it, a sixteenth of which the next
/// mean would change, is half a rounding.
const NEARLY_EQUAL: f64 = 1e-8;

/// The arithmetic-geometric mean of two numbers that are not negative; 0 if one of them is 0. It converges
/// quadratically.
pub fn arithmetic_geometric_mean(mut a: f64, mut b: f64) -> f64 {
    if a == 0.0 || b == 0.0 {
        return 0.0;
    }
    loop {
        let (mean, product) = (0.5 * (a + b), a * b);
        // The next mean differs from this one by (a - b)² / 16 a.
        if !((a - b).abs() > NEARLY_EQUAL * a) {
            return mean - (a - b) * (a - b) / (16.0 * mean);
        }
        (a, b) = (mean, product.sqrt());
    }
}

/// Carlson's symmetric integral of the first kind, R_F(x, y, z) = ½ ∫₀^∞ dt / √((t + x)(t + y)(t + z)), of numbers that
/// are not negative, at most one of them 0: by duplication until they are nearly equal, then a series (Carlson, Numer.
/// Algorithms 10, 1995, 13; DLMF 19.36.1). Nothing cancels, so a small argument keeps its meaning however small it is.
pub fn carlson_first_kind(mut x: f64, mut y: f64, mut z: f64) -> f64 {
    loop {
        let mean = (x + y + z) / 3.0;
        let (dx, dy) = (1.0 - x / mean, 1.0 - y / mean);
        let dz = -(dx + dy);
        // What the series leaves out is of the eighth order in these differences.
        if !(dx.abs().max(dy.abs()).max(dz.abs()) >= 0.01) {
            let second = dx * dy - dz * dz;
            let third = dx * dy * dz;
            let series = second * (-1.0 / 10.0 + second * (1.0 / 24.0 - second * (5.0 / 208.0)))
                + third * (1.0 / 14.0 - second * (3.0 / 44.0) + third * (3.0 / 104.0) + second * second / 16.0);
            return (1.0 + series) / mean.sqrt();
        }
        let (root_x, root_y, root_z) = (x.sqrt(), y.sqrt(), z.sqrt());
        let shift = root_x * (root_y + root_z) + root_y * root_z;
        (x, y, z) = (0.25 * (x + shift), 0.25 * (y + shift), 0.25 * (z + shift));
    }
}

/// Two means over a quarter period, with 32 digits.
pub struct QuarterMeans {
    /// The arithmetic-geometric mean of 1 and k′, which is π / 2K.
    pub mean: DoubleDouble,
    /// The mean over u of cn² / (cn² + p sn²): a complete integral of the third kind over one of the first.
    pub share: DoubleDouble,
}

/// For a complementary modulus 0 < k′ <= 1 and p >= 1, by Bulirsch's transformation (Numer. Math. 13, 1969, 305, cel),
/// of which every term is positive. The differences halve their digits' distance each round: five rounds where k′ is
/// not small, ten for k′ = 1e-15.
pub fn quarter_means(complementary_modulus: DoubleDouble, p: DoubleDouble) -> QuarterMeans {
    let mut geometric = complementary_modulus;
    let mut arithmetic = DoubleDouble::ONE;
    let mut product = complementary_modulus;
    let mut p = p.sqrt();
    let (mut a, mut b) = (DoubleDouble::ONE, DoubleDouble::ZERO);
    let mut power = 1.0;
    loop {
        let inverse = DoubleDouble::ONE / p;
        let g = product * inverse;
        (a, b) = (a + b * inverse, (b + a * g).scaled(2.0));
        p = p + g;
        // With 32 digits: the nearest doubles of two equal numbers may differ by a unit, and would for ever.
        let difference = (arithmetic - geometric).high.abs();
        let before = arithmetic.high;
        arithmetic = arithmetic + geometric;
        power *= 0.5;
        // The error left is of the order of the square of this difference. It ends, whatever it is given.
        if !(difference > 1e-15 * before && power > f64::EPSILON) {
            break;
        }
        geometric = product.sqrt().scaled(2.0);
        product = geometric * arithmetic;
    }
    let mean = arithmetic.scaled(power);
    QuarterMeans { mean, share: mean * (b + a * arithmetic) / (arithmetic * (arithmetic + p)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_integrals() {
        // Gauss's constant, 1 / agm(1, √2), and R_F(0, 1, 2) = K(1/√2) / √2 (DLMF 19.36).
        let close = |a: f64, b: f64| assert!((a - b).abs() <= 4e-16 * b, "{a} {b}");
        close(1.0 / arithmetic_geometric_mean(1.0, 2.0_f64.sqrt()), 0.834_626_841_674_073_2);
        close(carlson_first_kind(0.0, 1.0, 2.0), 1.311_028_777_146_059_9);
        close(carlson_first_kind(2.0, 3.0, 4.0), 0.584_082_841_677_151_7);
        // R_F(x, x, 1) for small x is that of an inverse hyperbolic function: ln(2 / √x).
        close(carlson_first_kind(1e-200, 1e-200, 1.0), (2.0e100_f64).ln());
        // Of k = 0 the share is 1 / (1 + √p); the other one by quadrature with 30 digits.
        let means = quarter_means(DoubleDouble::ONE, DoubleDouble::from(4.0));
        assert_eq!(means.mean, DoubleDouble::ONE);
        assert!((means.share - DoubleDouble::ONE / DoubleDouble::from(3.0)).high.abs() < 1e-31);
        let means = quarter_means(DoubleDouble::from(0.25), DoubleDouble::from(3.0));
        close(means.mean.high, 0.560_757_145_071_900_6);
        close(means.share.high, 0.234_966_092_876_138_56);
    }
}
