//! A shape as the prediction sees it: a core and a rounding radius, known by the core's support points.

use std::sync::Arc;

use glam::DVec3;

use crate::shape::{Polyhedron, Shape};

/// Corners of a polyhedron, by coordinate, filled up with copies of the first to whole [`LANES`].
#[derive(Clone, Debug)]
pub struct Corners {
    x: Vec<[f64; LANES]>,
    y: Vec<[f64; LANES]>,
    z: Vec<[f64; LANES]>,
}

/// Corners that are looked at together.
const LANES: usize = 4;

impl Corners {
    /// Of a polyhedron, in its order.
    pub fn new(points: &[DVec3]) -> Self {
        let rows = points.len().div_ceil(LANES);
        let lane = |row: usize, of: fn(&DVec3) -> f64| {
            std::array::from_fn(|k| of(points.get(row * LANES + k).unwrap_or(&points[0])))
        };
        Self {
            x: (0..rows).map(|row| lane(row, |p| p.x)).collect(),
            y: (0..rows).map(|row| lane(row, |p| p.y)).collect(),
            z: (0..rows).map(|row| lane(row, |p| p.z)).collect(),
        }
    }

    /// The corner (m) with an index.
    #[inline(always)]
    pub fn at(&self, index: u32) -> DVec3 {
        let (row, k) = (index as usize / LANES, index as usize % LANES);
        DVec3::new(self.x[row][k], self.y[row][k], self.z[row][k])
    }

    /// The corner farthest along `direction`; of several the one with the lowest lane, then index.
    #[inline(always)]
    fn farthest(&self, direction: DVec3) -> u32 {
        let mut best = [f64::NEG_INFINITY; LANES];
        let mut rows = [0u32; LANES];
        for (row, ((x, y), z)) in self.x.iter().zip(&self.y).zip(&self.z).enumerate() {
            for k in 0..LANES {
                let height = x[k] * direction.x + y[k] * direction.y + z[k] * direction.z;
                let higher = height > best[k];
                best[k] = if higher { height } else { best[k] };
                rows[k] = if higher { row as u32 } else { rows[k] };
            }
        }
        let first = if best[1] > best[0] { 1 } else { 0 };
        let second = if best[3] > best[2] { 3 } else { 2 };
        let lane = if best[second] > best[first] { second } else { first };
        rows[lane] * LANES as u32 + lane as u32
    }
}

/// What is left of a shape when its rounding is taken off. Frame of the body.
#[derive(Clone, Debug)]
pub enum Core {
    /// The origin: of a ball.
    Point,
    /// From -z to z: of a capsule. Half its length (m).
    Segment(f64),
    /// A polyhedron, which has no rounding.
    Polyhedron(Corners, Arc<Polyhedron>),
    /// A cylinder along z.
    Cylinder {
        /// Radius (m).
        radius: f64,
        /// Half the length (m).
        half_length: f64,
    },
    /// An ellipsoid; half its axes (m).
    Ellipsoid(DVec3),
    /// The half-space z ≤ 0 below a plane.
    HalfSpace,
}

/// The point of a core that is farthest in a direction.
#[derive(Clone, Copy, Debug, Default)]
pub struct SupportPoint {
    /// Where (m), in the frame of the body.
    pub point: DVec3,
    /// Which: the index of a corner, or of a smooth part of the surface (of a cylinder 0 for the lower, 1 for the upper rim).
    pub index: u32,
}

/// A convex shape ready for prediction: all points within `rounding` of a core.
#[derive(Clone, Debug)]
pub struct Solid {
    /// The core.
    pub core: Core,
    /// Radius (m) of the rounding.
    pub rounding: f64,
    /// Distance (m) of the core's farthest point from the origin; 0 for a half-space, whose plane is all that counts.
    pub core_reach: f64,
}

impl Solid {
    /// Of a convex shape.
    pub fn new(shape: &Shape) -> Self {
        match shape {
            Shape::Ball { radius } => Self { core: Core::Point, rounding: *radius, core_reach: 0.0 },
            Shape::Capsule { radius, half_length } => {
                Self { core: Core::Segment(*half_length), rounding: *radius, core_reach: *half_length }
            }
            Shape::Polyhedron(polyhedron) => Self {
                core: Core::Polyhedron(Corners::new(&polyhedron.vertices), polyhedron.clone()),
                rounding: 0.0,
                core_reach: polyhedron.radius,
            },
            Shape::Cylinder { radius, half_length } => Self {
                core: Core::Cylinder { radius: *radius, half_length: *half_length },
                rounding: 0.0,
                core_reach: (radius * radius + half_length * half_length).sqrt(),
            },
            Shape::Ellipsoid { semi_axes } => {
                Self { core: Core::Ellipsoid(*semi_axes), rounding: 0.0, core_reach: semi_axes.max_element() }
            }
        }
    }

    /// Everything below the plane z = 0 of its body.
    pub fn half_space() -> Self {
        Self { core: Core::HalfSpace, rounding: 0.0, core_reach: 0.0 }
    }

    /// Whether this is a half-space.
    #[inline(always)]
    pub fn is_half_space(&self) -> bool {
        matches!(self.core, Core::HalfSpace)
    }

    /// Whether support points move smoothly with the direction, so that no finite number of them is all.
    #[inline(always)]
    pub fn is_curved(&self) -> bool {
        matches!(self.core, Core::Cylinder { .. } | Core::Ellipsoid(_))
    }

    /// Distance (m) of the farthest point from the centre of mass.
    #[inline(always)]
    pub fn reach(&self) -> f64 {
        self.core_reach + self.rounding
    }

    /// The point of the core farthest along `direction` (any length; frame of the body).
    #[inline(always)]
    pub fn support(&self, direction: DVec3) -> SupportPoint {
        match &self.core {
            Core::Point | Core::HalfSpace => SupportPoint::default(),
            Core::Segment(half_length) => {
                let upper = direction.z > 0.0;
                let z = if upper { *half_length } else { -half_length };
                SupportPoint { point: DVec3::new(0.0, 0.0, z), index: u32::from(upper) }
            }
            Core::Polyhedron(corners, _) => {
                let index = corners.farthest(direction);
                SupportPoint { point: corners.at(index), index }
            }
            Core::Cylinder { radius, half_length } => {
                let upper = direction.z > 0.0;
                rim(*radius, *half_length, direction, upper)
            }
            Core::Ellipsoid(semi_axes) => {
                let scaled = *semi_axes * direction;
                let height = scaled.length();
                let point = if height > 0.0 { *semi_axes * scaled / height } else { DVec3::ZERO };
                SupportPoint { point, index: 0 }
            }
        }
    }

    /// As [`Self::support`], of the one corner or smooth part with an index.
    #[inline]
    pub fn support_on(&self, index: u32, direction: DVec3) -> SupportPoint {
        match &self.core {
            Core::Point | Core::HalfSpace => SupportPoint::default(),
            Core::Segment(half_length) => {
                let z = if index == 1 { *half_length } else { -half_length };
                SupportPoint { point: DVec3::new(0.0, 0.0, z), index }
            }
            Core::Polyhedron(corners, _) => SupportPoint { point: corners.at(index), index },
            Core::Cylinder { radius, half_length } => rim(*radius, *half_length, direction, index == 1),
            Core::Ellipsoid(_) => self.support(direction),
        }
    }

    /// Whether two points (m) of one smooth part are one moving point; far apart on a rim they are corners of the cap.
    #[inline]
    pub fn near_on_piece(&self, p: DVec3, q: DVec3) -> bool {
        match &self.core {
            Core::Cylinder { radius, .. } => (p - q).length() <= SAME_SPOT * radius,
            _ => true,
        }
    }

    /// How the support point near `point` moves with the direction: the tensor ∂p/∂d (m) at the unit vector `direction`,
    /// applied to `change`. Zero for corners. (Ellipsoid: h = |D d|, p = D² d / h, ∂p/∂d = (D² − p pᵀ) / h.)
    #[inline]
    pub fn curvature(&self, direction: DVec3, point: DVec3, change: DVec3) -> DVec3 {
        match &self.core {
            Core::Ellipsoid(semi_axes) => {
                let height = point.dot(direction);
                (*semi_axes * *semi_axes * change - point * point.dot(change)) / height
            }
            Core::Cylinder { radius, .. } => {
                let flat = (direction.x * direction.x + direction.y * direction.y).sqrt();
                if flat == 0.0 {
                    return DVec3::ZERO;
                }
                let tangent = DVec3::new(-direction.y, direction.x, 0.0) / flat;
                tangent * (radius / flat * tangent.dot(change))
            }
            _ => DVec3::ZERO,
        }
    }
}

/// Points of one rim closer than this fraction of its radius are one moving point.
const SAME_SPOT: f64 = 0.25;

/// The point of a cylinder's upper or lower rim farthest along `direction`; the middle if the direction is the axis.
#[inline(always)]
fn rim(radius: f64, half_length: f64, direction: DVec3, upper: bool) -> SupportPoint {
    let flat = (direction.x * direction.x + direction.y * direction.y).sqrt();
    let scale = if flat > 0.0 { radius / flat } else { 0.0 };
    let z = if upper { half_length } else { -half_length };
    SupportPoint { point: DVec3::new(direction.x * scale, direction.y * scale, z), index: u32::from(upper) }
}
