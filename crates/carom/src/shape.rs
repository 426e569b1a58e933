//! Shapes of bodies, in the frame of the body: centre of mass at the origin, lengths in m.

pub mod polyhedron;

use std::sync::Arc;

use glam::DVec3;

pub use polyhedron::{Edge, Face, Polyhedron};

/// The form of a body.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A ball.
    Ball {
        /// Radius (m).
        radius: f64,
    },
    /// A convex polyhedron.
    Polyhedron(Arc<Polyhedron>),
    /// All points within a radius of a segment along z.
    Capsule {
        /// Radius (m).
        radius: f64,
        /// Half the length (m) of the segment.
        half_length: f64,
    },
    /// A cylinder along z.
    Cylinder {
        /// Radius (m).
        radius: f64,
        /// Half the length (m).
        half_length: f64,
    },
    /// An ellipsoid with axes along x, y, z.
    Ellipsoid {
        /// Half the axes (m).
        semi_axes: DVec3,
    },
    /// Several convex shapes together.
    Compound(()),
}
