//! Volume, centre of mass and inertia of homogeneous bodies.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use super::bounds::Bounds;
use super::exact::twice_area;
use super::polyhedron::Polyhedron;
use crate::ledger::Sum;

/// What a body of density 1 kg/m³ weighs and how it resists turning; all but the centre in proportion to the density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Volume (m³), also the mass (kg).
    pub volume: f64,
    /// Centre of mass (m).
    pub centre: DVec3,
    /// Inertia tensor about the centre of mass (kg m²), along the axes of the body's own frame.
    pub inertia: DMat3,
}

impl MassProperties {
    /// Of a body centred at the origin with these moments per unit of mass (m²).
    fn centred(volume: f64, moments: DVec3) -> Self {
        Self { volume, centre: DVec3::ZERO, inertia: DMat3::from_diagonal(volume * moments) }
    }

    /// A ball: I/m = 2 r²/5.
    pub fn ball(radius: f64) -> Self {
        Self::ellipsoid(DVec3::splat(radius))
    }

    /// An ellipsoid with semi-axes a, b, c: I/m = (b² + c², c² + a², a² + b²)/5.
    pub fn ellipsoid(semi_axes: DVec3) -> Self {
        let square = semi_axes * semi_axes;
        let moments = DVec3::new(square.y + square.z, square.z + square.x, square.x + square.y) / 5.0;
        Self::centred(4.0 / 3.0 * PI * semi_axes.element_product(), moments)
    }

    /// A cylinder along z of radius r from −h to h: I/m = (r²/4 + h²/3, …, r²/2).
    pub fn cylinder(radius: f64, half_length: f64) -> Self {
        let (r2, h2) = (radius * radius, half_length * half_length);
        let across = r2 / 4.0 + h2 / 3.0;
        Self::centred(2.0 * PI * r2 * half_length, DVec3::new(across, across, r2 / 2.0))
    }

    /// A capsule along z: a cylinder from −h to h with half a ball on each end, whose own moments 2 r²/5 are shifted by
    /// h² + 3 h r/4 (the centre of mass of half a ball is 3 r/8 from its centre).
    pub fn capsule(radius: f64, half_length: f64) -> Self {
        let (r, h) = (radius, half_length);
        let (tube, ball) = (2.0 * PI * r * r * h, 4.0 / 3.0 * PI * r * r * r);
        let volume = tube + ball;
        let across = tube * (r * r / 4.0 + h * h / 3.0) + ball * (0.4 * r * r + h * h + 0.75 * h * r);
        let along = tube * (r * r / 2.0) + ball * (0.4 * r * r);
        Self::centred(volume, DVec3::new(across, across, along) / volume)
    }

    /// A polyhedron, by the tetrahedra between its faces and a point inside (Blow and Binstock, "How to find the
    /// inertia tensor of a 3D solid body", 2004; the same integrals as Mirtich, J. Graphics Tools 1 (1996) 31). Seen
    /// from inside a convex body all of them are positive, so that nothing cancels, however far from the origin the
    /// body is.
    pub fn polyhedron(body: &Polyhedron) -> Self {
        let middle = Bounds::around(body.vertices.iter().copied()).middle();
        // The first time roughly, to have the centre of mass itself as the point inside.
        let first = Moments::about(body, middle);
        let inside = middle + first.mean();
        let moments = Moments::about(body, inside);
        let shift = moments.mean();
        let volume = moments.volume.value();
        let covariance = moments.covariance() - outer(shift, shift) * volume;
        Self { volume, centre: inside + shift, inertia: inertia_from(covariance) }
    }

    /// Several bodies together, each with its frame (position (m), and axes as columns) in the common one, by the
    /// theorem of parallel axes. Where they overlap, mass counts twice: the sum is of the parts as they are given.
    pub fn together(parts: &[(Self, DVec3, DMat3)]) -> Self {
        let (mut volume, mut first) = (Sum::default(), [Sum::default(); 3]);
        // From the first part's position, so that no digits are lost far from the origin.
        let origin = parts.first().map_or(DVec3::ZERO, |&(_, position, _)| position);
        let centres: Vec<DVec3> = parts.iter().map(|(part, at, axes)| (*at - origin) + *axes * part.centre).collect();
        for ((part, ..), centre) in parts.iter().zip(&centres) {
            volume.add(part.volume);
            (0..3).for_each(|axis| first[axis].add(part.volume * centre[axis]));
        }
        let volume = volume.value();
        let centre = DVec3::from_array(first.map(Sum::value)) / volume;
        let mut inertia = DMat3::ZERO;
        for ((part, _, axes), at) in parts.iter().zip(&centres) {
            let arm = *at - centre;
            inertia += *axes * part.inertia * axes.transpose();
            inertia += (DMat3::from_diagonal(DVec3::splat(arm.length_squared())) - outer(arm, arm)) * part.volume;
        }
        Self { volume, centre: origin + centre, inertia: symmetric(inertia) }
    }
}

/// Sums over tetrahedra, about a point.
#[derive(Default)]
struct Moments {
    /// ∫ dV.
    volume: Sum,
    /// ∫ x dV.
    first: [Sum; 3],
    /// ∫ x xᵀ dV: xx, yy, zz, xy, yz, zx.
    second: [Sum; 6],
}

impl Moments {
    fn about(body: &Polyhedron, point: DVec3) -> Self {
        let mut moments = Self::default();
        for face in &body.faces {
            let corner = |k: usize| body.vertices[face.vertices[k] as usize];
            for k in 1..face.vertices.len() - 1 {
                let [a, b, c] = [corner(0), corner(k), corner(k + 1)];
                // Six times the volume of the tetrahedron.
                let determinant = twice_area(a, b, c).dot(a - point);
                moments.add(determinant, [a - point, b - point, c - point]);
            }
        }
        moments
    }

    /// A tetrahedron with one corner at the point: ∫ dV = d/6, ∫ x dV = d s/24, ∫ x xᵀ dV = d (a aᵀ + b bᵀ + c cᵀ + s
    /// sᵀ)/120, where s = a + b + c.
    fn add(&mut self, d: f64, [a, b, c]: [DVec3; 3]) {
        let s = a + b + c;
        self.volume.add(d / 6.0);
        for axis in 0..3 {
            self.first[axis].add(d * s[axis] / 24.0);
        }
        for (sum, (i, j)) in self.second.iter_mut().zip([(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]) {
            sum.add(d * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j]) / 120.0);
        }
    }

    fn mean(&self) -> DVec3 {
        DVec3::from_array(self.first.map(Sum::value)) / self.volume.value()
    }

    fn covariance(&self) -> DMat3 {
        let [xx, yy, zz, xy, yz, zx] = self.second.map(Sum::value);
        DMat3::from_cols(DVec3::new(xx, xy, zx), DVec3::new(xy, yy, yz), DVec3::new(zx, yz, zz))
    }
}

/// a bᵀ.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// The inertia tensor tr(C) − C of a mass distribution with second moments C = ∫ x xᵀ dm. The sums of two are taken one
/// by one, not as a trace less the third, which would cancel for needles.
fn inertia_from(covariance: DMat3) -> DMat3 {
    let c = covariance.to_cols_array_2d();
    let moments = DVec3::new(c[1][1] + c[2][2], c[2][2] + c[0][0], c[0][0] + c[1][1]);
    let products = DMat3::from_cols(
        DVec3::new(0.0, c[0][1], c[0][2]),
        DVec3::new(c[1][0], 0.0, c[1][2]),
        DVec3::new(c[2][0], c[2][1], 0.0),
    );
    DMat3::from_diagonal(moments) - products
}

/// The mean of a matrix and its transpose.
fn symmetric(matrix: DMat3) -> DMat3 {
    (matrix + matrix.transpose()) * 0.5
}
