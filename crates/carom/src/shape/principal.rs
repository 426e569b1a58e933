//! Principal axes and moments of inertia.

use glam::{DMat3, DVec3};

use super::error::ShapeError;
use crate::tolerance::TRIANGLE_INEQUALITY;

/// Moments of inertia about principal axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Principal {
    /// The moments (in the units of the tensor).
    pub moments: DVec3,
    /// The axes as columns; right-handed. Each is the one nearest to the x, y or z axis of the tensor's own frame.
    pub axes: DMat3,
}

/// Jacobi's iteration halves the digits that are left with each sweep; six suffice, and this many are never reached.
const MOST_SWEEPS: usize = 32;

/// The principal axes of a symmetric tensor. Moments and products within `tolerance` (m² kg) of each other, or of zero,
/// are equal, or zero: a tensor that is diagonal keeps its axes, bit by bit; three equal moments keep them too; with
/// two equal moments the frame is turned only as far as the third axis needs.
pub(super) fn principal(tensor: DMat3, tolerance: f64) -> Principal {
    let products = [tensor.y_axis.x, tensor.z_axis.x, tensor.z_axis.y];
    if products.iter().all(|product| product.abs() <= tolerance) {
        let diagonal = DVec3::new(tensor.x_axis.x, tensor.y_axis.y, tensor.z_axis.z);
        return Principal { moments: equalised(diagonal, tolerance), axes: DMat3::IDENTITY };
    }
    let (moments, axes) = jacobi(tensor);
    match equal_axes(moments, tolerance) {
        Equal::All => Principal { moments: equalised(moments, tolerance), axes: DMat3::IDENTITY },
        Equal::AllBut(third) => about_one_axis(equalised(moments, tolerance), third, axes.col(third)),
        Equal::None => nearest_to_own(moments, axes),
    }
}

/// Eigenvalues and eigenvectors (columns) of a symmetric matrix by cyclic Jacobi rotations (Golub and Van Loan, Matrix
/// Computations, 8.5), which find even small eigenvalues to full precision.
fn jacobi(matrix: DMat3) -> (DVec3, DMat3) {
    let mut a = matrix.to_cols_array_2d();
    let mut v = DMat3::IDENTITY.to_cols_array_2d();
    for _ in 0..MOST_SWEEPS {
        let mut rotated = false;
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            // What does not change the two moments by rounding is zero.
            if a[p][q].abs() <= 0.25 * f64::EPSILON * (a[p][p].abs().sqrt() * a[q][q].abs().sqrt()) {
                (a[p][q], a[q][p]) = (0.0, 0.0);
                continue;
            }
            rotated = true;
            rotate(&mut a, &mut v, p, q);
        }
        if !rotated {
            break;
        }
    }
    (DVec3::new(a[0][0], a[1][1], a[2][2]), DMat3::from_cols_array_2d(&v))
}

/// The rotation in the plane of p and q that makes a[p][q] zero. `v` holds the axes as columns.
fn rotate(a: &mut [[f64; 3]; 3], v: &mut [[f64; 3]; 3], p: usize, q: usize) {
    let slope = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let tangent = slope.signum() / (slope.abs() + (1.0 + slope * slope).sqrt());
    let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
    let sine = tangent * cosine;
    let change = tangent * a[p][q];
    a[p][p] -= change;
    a[q][q] += change;
    (a[p][q], a[q][p]) = (0.0, 0.0);
    let r = 3 - p - q;
    let (rp, rq) = (a[r][p], a[r][q]);
    (a[r][p], a[r][q]) = (cosine * rp - sine * rq, sine * rp + cosine * rq);
    (a[p][r], a[q][r]) = (a[r][p], a[r][q]);
    let (vp, vq) = (v[p], v[q]);
    v[p] = std::array::from_fn(|row| cosine * vp[row] - sine * vq[row]);
    v[q] = std::array::from_fn(|row| sine * vp[row] + cosine * vq[row]);
}

/// Which moments are equal.
enum Equal {
    All,
    /// The two others.
    AllBut(usize),
    None,
}

fn equal_axes(moments: DVec3, tolerance: f64) -> Equal {
    if moments.max_element() - moments.min_element() <= tolerance {
        return Equal::All;
    }
    let equal = |third: &usize| (moments[(third + 1) % 3] - moments[(third + 2) % 3]).abs() <= tolerance;
    [2, 0, 1].into_iter().find(equal).map_or(Equal::None, Equal::AllBut)
}

/// Moments within `tolerance` of each other become exactly equal, by their mean.
fn equalised(moments: DVec3, tolerance: f64) -> DVec3 {
    match equal_axes(moments, tolerance) {
        Equal::All => DVec3::splat((moments.x + moments.y + moments.z) / 3.0),
        Equal::AllBut(third) => {
            let mean = 0.5 * (moments[(third + 1) % 3] + moments[(third + 2) % 3]);
            let mut equal = DVec3::splat(mean);
            equal[third] = moments[third];
            equal
        }
        Equal::None => moments,
    }
}

/// The frame with one given axis, the two others being free: its own, turned on the shortest way that takes the nearest
/// of its own axes onto the given one.
fn about_one_axis(moments: DVec3, third: usize, axis: DVec3) -> Principal {
    let nearest = axis.abs().max_position();
    let along = if axis[nearest] < 0.0 { -axis } else { axis }.normalize();
    let mut sorted = DVec3::splat(moments[(third + 1) % 3]);
    sorted[nearest] = moments[third];
    Principal { moments: sorted, axes: shortest_turn(DMat3::IDENTITY.col(nearest), along) }
}

const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// The axes in the order and with the signs that turn the frame least: the first of the orders with the largest sum of
/// |cosines|; each axis pointing along its own; right-handed by the sign of the axis that is farthest from its own.
fn nearest_to_own(moments: DVec3, axes: DMat3) -> Principal {
    let closeness = |order: [usize; 3]| (0..3).map(|k| axes.col(order[k])[k].abs()).sum::<f64>();
    let closer = |best, order| if closeness(order) > closeness(best) { order } else { best };
    let order = ORDERS.into_iter().fold(ORDERS[0], closer);
    let mut columns = order.map(|k| axes.col(k).normalize());
    for (k, column) in columns.iter_mut().enumerate() {
        if column[k] < 0.0 {
            *column = -*column;
        }
    }
    let [x, y, z] = columns;
    if x.cross(y).dot(z) < 0.0 {
        let farthest = DVec3::new(x.x, y.y, z.z).min_position();
        columns[farthest] = -columns[farthest];
    }
    Principal {
        moments: DVec3::from_array(order.map(|k| moments[k])),
        axes: DMat3::from_cols_array_2d(&columns.map(|c| c.to_array())),
    }
}

/// The rotation about from × to that takes one unit vector to another, at most a right angle away: 1 + [w] + [w]²/(1 +
/// c), where w = from × to, c = from·to.
fn shortest_turn(from: DVec3, to: DVec3) -> DMat3 {
    let w = from.cross(to);
    let cross = DMat3::from_cols(DVec3::new(0.0, w.z, -w.y), DVec3::new(-w.z, 0.0, w.x), DVec3::new(w.y, -w.x, 0.0));
    DMat3::IDENTITY + cross + cross * cross * (1.0 / (1.0 + from.dot(to)))
}

/// Checks moments of inertia (kg m²) about principal axes that were given from outside.
///
/// # Errors
/// A moment that is not positive and finite, or that is larger than the sum of the two others ([`TRIANGLE_INEQUALITY`]
/// allowed).
pub fn check_inertia(moments: DVec3) -> Result<(), ShapeError> {
    for axis in 0..3 {
        let value = moments[axis];
        if !(value > 0.0 && value.is_finite()) {
            return Err(ShapeError::Moment { axis, value });
        }
    }
    for axis in 0..3 {
        let others = moments[(axis + 1) % 3] + moments[(axis + 2) % 3];
        if moments[axis] > others * (1.0 + TRIANGLE_INEQUALITY) {
            return Err(ShapeError::TriangleInequality { axis, moments });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames of random turns from products of three plane rotations with rational cosines.
    fn turned(tensor: DMat3, k: u32) -> (DMat3, DMat3) {
        let about = |axis: usize, t: f64| {
            let (c, s) = ((1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t));
            let mut columns = [DVec3::X, DVec3::Y, DVec3::Z];
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            (columns[i], columns[j]) = (c * columns[i] + s * columns[j], c * columns[j] - s * columns[i]);
            DMat3::from_cols(columns[0], columns[1], columns[2])
        };
        let t = f64::from(k) * 0.37;
        let turn = about(0, t % 1.1) * about(1, t % 0.7) * about(2, t % 1.9);
        let tensor = turn * tensor * turn.transpose();
        ((tensor + tensor.transpose()) * 0.5, turn)
    }

    #[test]
    fn moments_and_axes_come_back() {
        let moments = DVec3::new(1.0, 2.5, 3.0);
        for k in 1..200 {
            let (tensor, _) = turned(DMat3::from_diagonal(moments), k);
            let found = principal(tensor, 1e-14);
            // Each rotation and product rounds by about ε of the largest moment.
            assert!((found.axes.transpose() * found.axes - DMat3::IDENTITY).abs_diff_eq(DMat3::ZERO, 1e-15));
            assert!((found.axes.determinant() - 1.0).abs() < 1e-15);
            let again = found.axes * DMat3::from_diagonal(found.moments) * found.axes.transpose();
            assert!(again.abs_diff_eq(tensor, 1e-14), "{again} {tensor}");
            let mut sorted = found.moments.to_array();
            sorted.sort_by(f64::total_cmp);
            assert!((DVec3::from_array(sorted) - moments).length() < 1e-14);
        }
    }

    #[test]
    fn equal_moments_keep_their_own_axes() {
        for k in 1..200 {
            let (tensor, _) = turned(DMat3::from_diagonal(DVec3::splat(2.0)), k);
            let found = principal(tensor, 64.0 * f64::EPSILON * 2.0);
            assert_eq!(found.axes, DMat3::IDENTITY);
            assert!(found.moments.x == found.moments.y && found.moments.y == found.moments.z);
            let (tensor, turn) = turned(DMat3::from_diagonal(DVec3::new(2.0, 2.0, 5.0)), k);
            let found = principal(tensor, 64.0 * f64::EPSILON * 5.0);
            let third = found.moments.max_position();
            assert_eq!(found.moments[(third + 1) % 3], found.moments[(third + 2) % 3]);
            // The axis, to rounding over the gap between the moments.
            assert!(found.axes.col(third).cross(turn.col(2)).length() < 1e-14);
            assert!((found.axes.determinant() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn small_moments_are_as_right_as_large_ones() {
        let (tensor, _) = turned(DMat3::from_diagonal(DVec3::new(1.0, 1.0, 1e-8)), 3);
        let found = principal(tensor, 64.0 * f64::EPSILON);
        // The tensor itself was rounded to ε of its largest entry.
        assert!((found.moments.min_element() - 1e-8).abs() < 4.0 * f64::EPSILON);
    }
}
