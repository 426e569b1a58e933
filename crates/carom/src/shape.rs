//! The geometry of bodies that turn: shapes, their farthest points, and their mass.
//!
//! A [`Shape`] is given in the user's frame. [`BodyGeometry`] has it in its principal frame, with its moments of
//! inertia and the way back. Fixed surroundings are a [`TriangleMesh`].

mod bounding_tree;
mod bounds;
mod compound;
mod convex_mesh;
mod error;
mod exact;
mod flatten;
mod geometry;
mod hull;
mod mass;
mod normal_cone;
mod platonic;
mod polyhedron;
mod principal;
mod support;
mod surface;
mod triangle_mesh;

use std::sync::Arc;

use glam::DVec3;

pub use bounding_tree::BoundingTree;
pub use bounds::Bounds;
pub use compound::{Compound, Part};
pub use error::ShapeError;
pub use geometry::BodyGeometry;
pub use mass::MassProperties;
pub use normal_cone::Touchable;
pub use platonic::Platonic;
pub use polyhedron::{Edge, Face, Polyhedron};
pub use principal::check_inertia;
pub use triangle_mesh::{Fold, MeshEdge, MeshTriangle, TriangleMesh};

use polyhedron::check_length;

/// The shape of a body, in a frame fixed to it.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A ball about the origin.
    Ball {
        /// Radius (m).
        radius: f64,
    },
    /// A convex polyhedron.
    Polyhedron(Arc<Polyhedron>),
    /// The points within a distance of a segment of the z axis about the origin.
    Capsule {
        /// The distance (m).
        radius: f64,
        /// Half the length of the segment (m).
        half_length: f64,
    },
    /// A cylinder about the z axis and the origin.
    Cylinder {
        /// Radius (m).
        radius: f64,
        /// Half its length (m).
        half_length: f64,
    },
    /// An ellipsoid about the origin, along the axes.
    Ellipsoid {
        /// Semi-axes (m) along x, y, z.
        semi_axes: DVec3,
    },
    /// Several convex shapes together.
    Compound(Arc<Compound>),
}

impl Shape {
    /// A box of these edge lengths (m), centred.
    ///
    /// # Errors
    /// As [`Polyhedron::cuboid`].
    pub fn cuboid(size: DVec3) -> Result<Self, ShapeError> {
        Polyhedron::cuboid(size).map(Self::from)
    }

    /// Checks the lengths of a shape.
    ///
    /// # Errors
    /// A length that is not positive and finite or is outside [`SHAPE_LIMITS`](crate::tolerance::SHAPE_LIMITS).
    /// Polyhedra and compounds were checked when they were made.
    pub fn check(&self) -> Result<(), ShapeError> {
        match *self {
            Self::Ball { radius } => check_length("radius", radius),
            Self::Capsule { radius, half_length } | Self::Cylinder { radius, half_length } => {
                check_length("radius", radius)?;
                check_length("half_length", half_length)
            }
            Self::Ellipsoid { semi_axes } => {
                semi_axes.to_array().into_iter().try_for_each(|length| check_length("semi_axes", length))
            }
            Self::Polyhedron(_) | Self::Compound(_) => Ok(()),
        }
    }

    /// The point of the body (m) farthest along `direction` (any length but 0), to rounding. Of several, always the
    /// same one.
    pub fn support(&self, direction: DVec3) -> DVec3 {
        match self {
            Self::Ball { radius } => *radius * unit_or_zero(direction),
            Self::Polyhedron(body) => body.support(direction),
            Self::Capsule { radius, half_length } => *radius * unit_or_zero(direction) + end(*half_length, direction),
            Self::Cylinder { radius, half_length } => {
                *radius * unit_or_zero(direction.with_z(0.0)) + end(*half_length, direction)
            }
            Self::Ellipsoid { semi_axes } => *semi_axes * unit_or_zero(*semi_axes * direction),
            Self::Compound(body) => {
                let support = |part: &Part| {
                    let axes = part.axes();
                    part.position + axes * part.shape.support(axes.transpose() * direction)
                };
                farthest(body.parts.iter().map(support), |point| direction.dot(point))
            }
        }
    }

    /// Largest distance of a point of the body from the origin (m), the centre of mass in the principal frame. For an
    /// ellipsoid in a compound it is an upper bound: the distance of its centre plus its longest semi-axis.
    pub fn radius(&self) -> f64 {
        match self {
            Self::Polyhedron(body) => body.radius,
            _ => self.reach(DVec3::ZERO),
        }
    }

    /// Largest distance of a point of the body from `point` (m), with the exception of [`Self::radius`].
    pub fn reach(&self, point: DVec3) -> f64 {
        match self {
            Self::Ball { radius } => point.length() + radius,
            Self::Polyhedron(body) => body.vertices.iter().map(|v| (*v - point).length()).fold(0.0, f64::max),
            Self::Capsule { radius, half_length } => {
                DVec3::new(point.x, point.y, point.z.abs() + half_length).length() + radius
            }
            Self::Cylinder { radius, half_length } => {
                let across = point.with_z(0.0).length() + radius;
                DVec3::new(across, 0.0, point.z.abs() + half_length).length()
            }
            Self::Ellipsoid { semi_axes } => point.length() + semi_axes.max_element(),
            Self::Compound(body) => {
                let reach = |part: &Part| part.shape.reach(part.axes().transpose() * (point - part.position));
                body.parts.iter().map(reach).fold(0.0, f64::max)
            }
        }
    }

    /// Radius of a ball about the origin that is within the body (m), the largest but in a compound, where it is the
    /// largest within one of its parts; 0 if the origin is outside.
    pub fn in_radius(&self) -> f64 {
        self.depth(DVec3::ZERO).max(0.0)
    }

    /// The radius of a ball about `point` that is within the body (m); negative outside. The largest, but for an
    /// ellipsoid away from its centre and for a compound (see [`Self::in_radius`]), where it is a lower bound.
    pub fn depth(&self, point: DVec3) -> f64 {
        match self {
            Self::Ball { radius } => radius - point.length(),
            Self::Polyhedron(body) => body.depth(point),
            Self::Capsule { radius, half_length } => {
                radius - (point - point.with_x(0.0).with_y(0.0).clamp_length_max(*half_length)).length()
            }
            Self::Cylinder { radius, half_length } => {
                (radius - point.with_z(0.0).length()).min(half_length - point.z.abs())
            }
            // In units of the semi-axes the body is a unit ball; the shortest of them is the least that a unit can be.
            Self::Ellipsoid { semi_axes } => {
                let depth = 1.0 - (point / *semi_axes).length();
                depth * if depth > 0.0 { semi_axes.min_element() } else { semi_axes.max_element() }
            }
            Self::Compound(body) => {
                let depth = |part: &Part| part.shape.depth(part.axes().transpose() * (point - part.position));
                body.parts.iter().map(depth).fold(f64::NEG_INFINITY, f64::max)
            }
        }
    }

    /// The box along the world's axes around the body at the origin (m), turned by a unit quaternion (w, x, y, z), to
    /// rounding.
    pub fn bounds(&self, orientation: [f64; 4]) -> Bounds {
        let turn = compound::axes(orientation);
        let reach = |axis: DVec3| {
            let direction = turn.transpose() * axis;
            direction.dot(self.support(direction))
        };
        let all = |sign: f64| DVec3::new(reach(sign * DVec3::X), reach(sign * DVec3::Y), reach(sign * DVec3::Z));
        Bounds { low: -all(-1.0), high: all(1.0) }
    }

    /// Volume, centre of mass and inertia for a density of 1, in this frame. Of a compound it is the sum of its parts;
    /// where they overlap, mass counts twice.
    pub fn mass_properties(&self) -> MassProperties {
        match self {
            Self::Ball { radius } => MassProperties::ball(*radius),
            Self::Polyhedron(body) => MassProperties::polyhedron(body),
            Self::Capsule { radius, half_length } => MassProperties::capsule(*radius, *half_length),
            Self::Cylinder { radius, half_length } => MassProperties::cylinder(*radius, *half_length),
            Self::Ellipsoid { semi_axes } => MassProperties::ellipsoid(*semi_axes),
            Self::Compound(body) => body.mass_properties(),
        }
    }
}

impl From<Polyhedron> for Shape {
    fn from(body: Polyhedron) -> Self {
        Self::Polyhedron(Arc::new(body))
    }
}

impl From<Compound> for Shape {
    fn from(body: Compound) -> Self {
        Self::Compound(Arc::new(body))
    }
}

/// The direction with length 1; zero stays zero.
fn unit_or_zero(direction: DVec3) -> DVec3 {
    // First to about 1, so that no square under- or overflows.
    let largest = direction.abs().max_element();
    if largest > 0.0 { (direction / largest).normalize() } else { DVec3::ZERO }
}

/// The end of the segment from −half_length to half_length along z that is farther along a direction.
fn end(half_length: f64, direction: DVec3) -> DVec3 {
    DVec3::new(0.0, 0.0, if direction.z < 0.0 { -half_length } else { half_length })
}

/// The first of the points with the largest measure.
fn farthest(points: impl Iterator<Item = DVec3>, measure: impl Fn(DVec3) -> f64) -> DVec3 {
    let mut best = (f64::NEG_INFINITY, DVec3::ZERO);
    for point in points {
        let value = measure(point);
        if value > best.0 {
            best = (value, point);
        }
    }
    best.1
}
