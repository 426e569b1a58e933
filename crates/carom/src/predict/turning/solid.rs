//! A shape as the prediction sees it: a core and a rounding radius, known by the core's support points.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::climb::{Climb, FEW_CORNERS};
use crate::shape::{Fold, Part, Polyhedron, Shape, TriangleMesh};

/// Corners of a polyhedron, laid out for the search of the farthest.
#[derive(Clone, Debug)]
pub enum Corners {
    /// Those of a box, by the signs of x, y and z: bits 0, 1 and 2 of the place; the indices there.
    Box([u32; 8]),
    /// Any, by coordinate, filled up with copies of the first to whole fours.
    Any(Vec<[[f64; LANES]; 3]>),
    /// Many.
    Many(Box<Climb>),
}

/// Corners that are looked at together.
const LANES: usize = 4;

impl Corners {
    /// Of a polyhedron, in its order.
    pub fn new(polyhedron: &Polyhedron) -> Self {
        let points = &polyhedron.vertices[..];
        if points.len() > FEW_CORNERS {
            return Self::Many(Box::new(Climb::new(polyhedron)));
        }
        if let Some(indices) = box_corners(points) {
            return Self::Box(indices);
        }
        let at = |row: usize, k: usize| points.get(row * LANES + k).unwrap_or(&points[0]).to_array();
        let rows = (0..points.len().div_ceil(LANES))
            .map(|row| std::array::from_fn(|coordinate| std::array::from_fn(|k| at(row, k)[coordinate])));
        Self::Any(rows.collect())
    }

    /// The index of the corner farthest along `direction`; among equals the choice depends on the direction alone.
    #[inline(always)]
    fn farthest(&self, direction: DVec3) -> u32 {
        match self {
            Self::Box(indices) => {
                let bit = |x: f64| usize::from(x >= 0.0);
                indices[bit(direction.x) | bit(direction.y) << 1 | bit(direction.z) << 2]
            }
            Self::Any(rows) => farthest_of(rows, direction),
            Self::Many(climb) => climb.farthest(direction),
        }
    }
}

#[inline(always)]
fn farthest_of(rows: &[[[f64; LANES]; 3]], direction: DVec3) -> u32 {
    let mut best = [f64::NEG_INFINITY; LANES];
    let mut at = [0.0; LANES];
    let mut number = 0.0;
    for [x, y, z] in rows {
        for k in 0..LANES {
            let height = x[k] * direction.x + y[k] * direction.y + z[k] * direction.z;
            let higher = height > best[k];
            best[k] = if higher { height } else { best[k] };
            at[k] = if higher { number } else { at[k] };
        }
        number += 1.0;
    }
    let first = usize::from(best[1] > best[0]);
    let second = 2 + usize::from(best[3] > best[2]);
    let lane = if best[second] > best[first] { second } else { first };
    at[lane] as u32 * LANES as u32 + lane as u32
}

/// The indices of the corners of a box along the axes, by their signs; nothing if it is none.
fn box_corners(points: &[DVec3]) -> Option<[u32; 8]> {
    let half = points.first()?.abs();
    let mut indices = [u32::MAX; 8];
    if points.len() != 8 || half.min_element() <= 0.0 {
        return None;
    }
    for (index, point) in points.iter().enumerate() {
        if point.abs() != half {
            return None;
        }
        let bit = |x: f64| usize::from(x >= 0.0);
        indices[bit(point.x) | bit(point.y) << 1 | bit(point.z) << 2] = index as u32;
    }
    (!indices.contains(&u32::MAX)).then_some(indices)
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
    /// A triangle of a mesh, which can be touched from both sides.
    Triangle(Triangle),
    /// A core that stands elsewhere in the body than its own frame: of a part of a compound.
    Placed(Box<Placed>),
}

/// A triangle of a mesh, taken by itself.
#[derive(Clone, Debug)]
pub struct Triangle {
    /// Its corners (m), frame of the body.
    pub corners: [DVec3; 3],
    /// The mesh; its axes are those of the body, its origin may be elsewhere.
    pub mesh: Arc<TriangleMesh>,
    /// Which of its triangles.
    pub index: u32,
}

impl Triangle {
    /// Unit normal to the front, frame of the body.
    pub fn normal(&self) -> DVec3 {
        self.mesh.triangles[self.index as usize].normal
    }

    /// Whether the surface goes on in the same plane beyond the edge from corner `k` to the next.
    pub fn goes_on_flat(&self, k: usize) -> bool {
        let edge = self.mesh.triangles[self.index as usize].edges[k];
        self.mesh.edges[edge as usize].fold == Fold::Flat
    }

    fn farthest(&self, direction: DVec3) -> u32 {
        let [a, b, c] = self.corners.map(|corner| corner.dot(direction));
        if c > a.max(b) { 2 } else { u32::from(b > a) }
    }
}

/// A core with its place in a body.
#[derive(Clone, Debug)]
pub struct Placed {
    /// The solid, without its rounding, in its own frame.
    pub solid: Solid,
    /// Where the origin of that frame is (m), frame of the body.
    pub position: DVec3,
    /// Its axes, frame of the body.
    pub axes: DMat3,
}

impl Placed {
    /// A direction of the body in the frame of the solid.
    pub fn to_solid(&self, direction: DVec3) -> DVec3 {
        self.axes.transpose() * direction
    }

    /// A point (m) of the solid in the frame of the body.
    pub fn to_body(&self, point: DVec3) -> DVec3 {
        self.position + self.axes * point
    }

    fn placed(&self, support: SupportPoint) -> SupportPoint {
        SupportPoint { point: self.to_body(support.point), ..support }
    }
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
    /// The convex parts of a shape.
    pub fn parts(shape: &Shape) -> Vec<Self> {
        match shape {
            Shape::Compound(compound) => compound.parts.iter().filter_map(Self::placed).collect(),
            _ => Self::new(shape).into_iter().collect(),
        }
    }

    /// A part of a compound, in the frame of the body; nothing for one that is not convex.
    fn placed(part: &Part) -> Option<Self> {
        if let Shape::Polyhedron(polyhedron) = &part.shape {
            let moved =
                Polyhedron::seen_from(polyhedron, -(part.axes().transpose() * part.position), part.axes().transpose());
            return Self::new(&Shape::from(moved));
        }
        let solid = Self::new(&part.shape)?;
        let (rounding, core_reach) = (solid.rounding, part.position.length() + solid.core_reach);
        let placed = Placed { solid, position: part.position, axes: part.axes() };
        Some(Self { core: Core::Placed(Box::new(placed)), rounding, core_reach })
    }

    /// A ball of this radius (m).
    #[inline(always)]
    pub fn ball(radius: f64) -> Self {
        Self { core: Core::Point, rounding: radius, core_reach: 0.0 }
    }

    /// Of a convex shape; nothing for one that is not, whose parts are solids of their own.
    pub fn new(shape: &Shape) -> Option<Self> {
        Some(match shape {
            Shape::Ball { radius } => Self { core: Core::Point, rounding: *radius, core_reach: 0.0 },
            Shape::Capsule { radius, half_length } => {
                Self { core: Core::Segment(*half_length), rounding: *radius, core_reach: *half_length }
            }
            Shape::Polyhedron(polyhedron) => Self {
                core: Core::Polyhedron(Corners::new(polyhedron), polyhedron.clone()),
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
            Shape::Compound(_) => return None,
        })
    }

    /// A triangle of a mesh in a body whose origin is at `origin` (m, frame of the mesh).
    pub fn triangle(mesh: &Arc<TriangleMesh>, index: u32, origin: DVec3) -> Self {
        let corners = mesh.corners(index).map(|corner| corner - origin);
        let core_reach = corners.iter().map(|corner| corner.length()).fold(0.0, f64::max);
        let core = Core::Triangle(Triangle { corners, mesh: Arc::clone(mesh), index });
        Self { core, rounding: 0.0, core_reach }
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
        match &self.core {
            Core::Cylinder { .. } | Core::Ellipsoid(_) => true,
            Core::Placed(placed) => placed.solid.is_curved(),
            _ => false,
        }
    }

    /// Whether the surface has neither corners nor edges.
    pub fn is_smooth(&self) -> bool {
        match &self.core {
            Core::Ellipsoid(_) => true,
            Core::Placed(placed) => self.rounding > 0.0 || placed.solid.is_smooth(),
            _ => self.rounding > 0.0,
        }
    }

    /// Whether turning about the z axis of the body changes nothing.
    #[inline(always)]
    pub fn is_round_about_z(&self) -> bool {
        match &self.core {
            Core::Segment(_) | Core::Cylinder { .. } => true,
            Core::Ellipsoid(axes) => axes.x == axes.y,
            _ => false,
        }
    }

    /// Distance (m) of the farthest point from the centre of mass.
    #[inline(always)]
    pub fn reach(&self) -> f64 {
        self.core_reach + self.rounding
    }

    /// The smallest radius of curvature (m) of the smooth surface; ∞ if it has corners and flats only.
    pub fn sharpest(&self) -> f64 {
        match &self.core {
            Core::Polyhedron(..) | Core::HalfSpace | Core::Triangle(_) => f64::INFINITY,
            Core::Point | Core::Segment(_) => self.rounding,
            Core::Cylinder { radius, .. } => *radius,
            Core::Ellipsoid(axes) => axes.min_element() * axes.min_element() / axes.max_element(),
            Core::Placed(placed) => placed.solid.sharpest(),
        }
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
            Core::Polyhedron(corners, polyhedron) => {
                let index = corners.farthest(direction);
                SupportPoint { point: polyhedron.vertices[index as usize], index }
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
            Core::Triangle(triangle) => {
                let index = triangle.farthest(direction);
                SupportPoint { point: triangle.corners[index as usize], index }
            }
            Core::Placed(placed) => placed.placed(placed.solid.support(placed.to_solid(direction))),
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
            Core::Polyhedron(_, polyhedron) => SupportPoint { point: polyhedron.vertices[index as usize], index },
            Core::Triangle(triangle) => SupportPoint { point: triangle.corners[index as usize], index },
            Core::Cylinder { radius, half_length } => rim(*radius, *half_length, direction, index == 1),
            Core::Ellipsoid(_) => self.support(direction),
            Core::Placed(placed) => placed.placed(placed.solid.support_on(index, placed.to_solid(direction))),
        }
    }

    /// Whether two points (m) of one smooth part are one moving point; far apart on a rim they are corners of the cap.
    #[inline]
    pub fn near_on_piece(&self, p: DVec3, q: DVec3) -> bool {
        match &self.core {
            Core::Cylinder { radius, .. } => (p - q).length() <= SAME_SPOT * radius,
            Core::Placed(placed) => placed.solid.near_on_piece(p, q),
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
            Core::Placed(placed) => {
                let [direction, point, change] =
                    [direction, point - placed.position, change].map(|v| placed.to_solid(v));
                placed.axes * placed.solid.curvature(direction, point, change)
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
