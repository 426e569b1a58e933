//! Arithmetic that loses nothing: signs of determinants, and products kept in two numbers.
//!
//! Sums and products of two numbers are exact as an unevaluated sum of two (Dekker, Numer. Math. 18 (1971) 224; Knuth's
//! two-sum). Signs are by Shewchuk's adaptive predicates (Discrete Comput. Geom. 18 (1997) 305) in the `robust` crate.

use glam::DVec3;
use robust::{Coord, Coord3D};

use crate::ledger::VectorSum;

/// On which side of the plane through `a`, `b`, `c` the point `d` lies: positive above, where the triangle is seen
/// counter-clockwise; 0 exactly in the plane. The sign is exact unless products of three coordinates underflow.
pub(super) fn side(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> f64 {
    let coordinates = |v: DVec3| Coord3D { x: v.x, y: v.y, z: v.z };
    -robust::orient3d(coordinates(a), coordinates(b), coordinates(c), coordinates(d))
}

/// Whether three points lie exactly on one line: their shadows along all three axes do.
pub(super) fn collinear(a: DVec3, b: DVec3, c: DVec3) -> bool {
    let area = |x: usize, y: usize| {
        let shadow = |v: DVec3| Coord { x: v[x], y: v[y] };
        robust::orient2d(shadow(a), shadow(b), shadow(c))
    };
    area(0, 1) == 0.0 && area(1, 2) == 0.0 && area(2, 0) == 0.0
}

/// A number as an unevaluated sum `high + low` with |low| at most half a unit in the last place of `high`.
#[derive(Clone, Copy)]
struct Pair {
    high: f64,
    low: f64,
}

/// a + b, exact.
fn sum(a: f64, b: f64) -> Pair {
    let high = a + b;
    let part = high - a;
    Pair { high, low: (a - (high - part)) + (b - part) }
}

/// x as two numbers of 26 bits.
fn halves(x: f64) -> (f64, f64) {
    let c = 134_217_729.0 * x; // 2^27 + 1
    let high = c - (c - x);
    (high, x - high)
}

/// a b, exact.
fn product(a: f64, b: f64) -> Pair {
    let high = a * b;
    let ((a1, a0), (b1, b0)) = (halves(a), halves(b));
    Pair { high, low: ((a1 * b1 - high) + a1 * b0 + a0 * b1) + a0 * b0 }
}

/// x y to about 2^-102.
fn times(x: Pair, y: Pair) -> Pair {
    let p = product(x.high, y.high);
    let low = p.low + (x.high * y.low + x.low * y.high);
    sum(p.high, low)
}

/// x − y rounded, with an error of about 2^-102 of the larger.
fn minus(x: Pair, y: Pair) -> f64 {
    let s = sum(x.high, -y.high);
    s.high + (s.low + (x.low - y.low))
}

/// (b − a) × (c − a), twice the area of a triangle along its normal (m²), right to rounding of the result however thin
/// the triangle is: differences are exact, products kept in two numbers.
pub(super) fn twice_area(a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    let difference = |u: DVec3, v: DVec3| [sum(u.x, -v.x), sum(u.y, -v.y), sum(u.z, -v.z)];
    let (p, q) = (difference(b, a), difference(c, a));
    let component = |i: usize, j: usize| minus(times(p[i], q[j]), times(p[j], q[i]));
    DVec3::new(component(1, 2), component(2, 0), component(0, 1))
}

/// Twice the area of a polygon along its normal (m²): the sum over the triangles at its first vertex.
pub(super) fn twice_polygon_area(points: &[DVec3]) -> DVec3 {
    let mut total = VectorSum::default();
    for pair in points[1..].windows(2) {
        total.add(twice_area(points[0], pair[0], pair[1]));
    }
    total.value()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Signs against 128-bit integers, over small coordinates where coplanar points are frequent, shifted far away.
    #[test]
    fn signs_are_exact() {
        let mut state = 1_u64;
        let mut draw = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 60) as i128 - 8
        };
        let mut zeros = 0;
        for round in 0..20_000 {
            let far = if round % 2 == 0 { 0 } else { 1_i128 << 48 };
            let p: Vec<[i128; 3]> = (0..4).map(|_| [far + draw(), draw() - far, draw()]).collect();
            let d = |k: usize, axis: usize| p[k][axis] - p[0][axis];
            let determinant = d(3, 0) * (d(1, 1) * d(2, 2) - d(1, 2) * d(2, 1))
                + d(3, 1) * (d(1, 2) * d(2, 0) - d(1, 0) * d(2, 2))
                + d(3, 2) * (d(1, 0) * d(2, 1) - d(1, 1) * d(2, 0));
            let v = |k: usize| DVec3::new(p[k][0] as f64, p[k][1] as f64, p[k][2] as f64);
            let sign = side(v(0), v(1), v(2), v(3));
            assert_eq!(determinant.signum(), if sign > 0.0 { 1 } else { -i128::from(sign < 0.0) });
            zeros += i32::from(sign == 0.0);
        }
        assert!(zeros > 100, "{zeros}");
    }

    /// A needle whose corners lie on one line but for the rounding of their coordinates, against 128-bit integers.
    #[test]
    fn the_area_of_a_needle_is_right() {
        let (slope, x) = (0.1_f64, 1.0 / 3.0_f64);
        let y = slope * x;
        let area = twice_area(DVec3::ZERO, DVec3::new(1.0, slope, 0.0), DVec3::new(x, y, 0.0));
        let digits = |v: f64, exponent: i32| (v * libm::exp2(f64::from(exponent))) as i128;
        let expected = digits(y, 57) * (1_i128 << 53) - digits(slope, 56) * digits(x, 54);
        assert!(expected != 0);
        let expected = expected as f64 * libm::exp2(-110.0);
        assert!((area.z - expected).abs() <= f64::EPSILON * expected.abs(), "{} {expected}", area.z);
        assert_eq!((area.x, area.y), (0.0, 0.0));
    }
}
