//! What can be wrong with a shape, in one sentence each.

use std::fmt;

use glam::DVec3;

use crate::tolerance::{MOST_POINTS, MOST_TRIANGLES, SHAPE_LIMITS};

/// Why a shape, or an inertia, is refused. Vertices and triangles are named by their index in the lists given, from 0.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapeError {
    /// There are no points or no triangles.
    Empty {
        /// "points" or "triangles".
        what: &'static str,
    },
    /// Fewer points than a body needs.
    TooFewPoints {
        /// How many different ones there are.
        count: usize,
    },
    /// More than `MOST_POINTS` points.
    TooManyPoints {
        /// How many there are.
        count: usize,
    },
    /// More than `MOST_TRIANGLES` triangles.
    TooManyTriangles {
        /// How many there are.
        count: usize,
    },
    /// A coordinate is infinite or not a number.
    NotFinite {
        /// Which vertex.
        vertex: usize,
        /// Where it is said to be (m).
        value: DVec3,
    },
    /// A coordinate is beyond what can be computed with.
    TooFar {
        /// Which vertex.
        vertex: usize,
        /// Where it is (m).
        value: DVec3,
    },
    /// A length is not positive, infinite, not a number, or too large or small to compute with.
    Length {
        /// Its name.
        field: &'static str,
        /// Its value (m).
        value: f64,
    },
    /// The points lie on one line.
    Collinear {
        /// How many there are.
        count: usize,
    },
    /// The points lie in one plane.
    Coplanar {
        /// How many there are.
        count: usize,
        /// The normal of the plane.
        normal: DVec3,
    },
    /// The body is so thin that its sides cannot be told apart.
    TooThin {
        /// Volume over surface (m).
        thickness: f64,
        /// Half the diagonal of the bounding box (m).
        size: f64,
    },
    /// Details are as fine as the tolerance for faces to be flat.
    TooFine {
        /// Where (m).
        point: DVec3,
        /// The tolerance (m).
        tolerance: f64,
    },
    /// A triangle names a vertex that does not exist.
    NoSuchVertex {
        /// Which triangle.
        triangle: usize,
        /// What it names.
        vertex: u32,
        /// How many vertices there are.
        count: usize,
    },
    /// A triangle has two corners at one place.
    RepeatedVertex {
        /// Which triangle.
        triangle: usize,
        /// Its vertices.
        vertices: [u32; 3],
    },
    /// A triangle has three different corners on one line.
    ZeroArea {
        /// Which triangle.
        triangle: usize,
        /// Its vertices.
        vertices: [u32; 3],
    },
    /// An edge belongs to one triangle only: there is a hole.
    Open {
        /// The two vertices.
        edge: [u32; 2],
        /// Which triangle.
        triangle: usize,
        /// How many such edges there are.
        count: usize,
    },
    /// Two triangles run along their common edge in the same direction: one of them is turned over.
    Orientation {
        /// The two vertices.
        edge: [u32; 2],
        /// Which triangles.
        triangles: [usize; 2],
    },
    /// More than two triangles share an edge.
    NonManifold {
        /// The two vertices.
        edge: [u32; 2],
        /// How many triangles do.
        count: usize,
    },
    /// A mesh falls apart into several.
    Pieces {
        /// How many.
        count: usize,
        /// A vertex of the first.
        first: u32,
        /// A vertex of the second.
        second: u32,
    },
    /// The triangles are clockwise seen from outside.
    Inverted {
        /// The volume, negative (m³).
        volume: f64,
    },
    /// A closed mesh bounds no volume.
    ZeroVolume {
        /// What rounding left of it (m³).
        volume: f64,
    },
    /// A vertex lies in a dent.
    DentedVertex {
        /// Which vertex.
        vertex: u32,
        /// How deep under the convex hull (m).
        depth: f64,
        /// Half the diagonal of the bounding box (m).
        size: f64,
    },
    /// An edge lies in a fold.
    DentedEdge {
        /// The two vertices.
        edge: [u32; 2],
        /// How deep its middle lies under the convex hull (m).
        depth: f64,
        /// Half the diagonal of the bounding box (m).
        size: f64,
    },
    /// A mesh has no dents, but not the volume of its hull: it winds around more than once, or cuts off a corner.
    NotItsHull {
        /// Volume of the mesh (m³).
        volume: f64,
        /// Volume of its convex hull (m³).
        hull: f64,
    },
    /// An orientation is not a unit quaternion.
    NotUnit {
        /// Which part of a compound, or which body.
        index: usize,
        /// The quaternion (w, x, y, z).
        value: [f64; 4],
    },
    /// A part of a compound is nowhere, or beyond what can be computed with.
    PartPosition {
        /// Which part.
        part: usize,
        /// Where it is said to be (m).
        value: DVec3,
    },
    /// A compound as part of a compound.
    Nested {
        /// Which part.
        part: usize,
    },
    /// A density or mass is not positive and finite.
    Amount {
        /// "mass" or "density".
        field: &'static str,
        /// Its value (kg or kg/m³).
        value: f64,
    },
    /// A moment of inertia is not positive and finite.
    Moment {
        /// Which axis: 0, 1, 2.
        axis: usize,
        /// Its value (kg m²).
        value: f64,
    },
    /// A moment of inertia is larger than the sum of the two others: no mass is distributed like that.
    TriangleInequality {
        /// Which axis: 0, 1, 2.
        axis: usize,
        /// The moments (kg m²).
        moments: DVec3,
    },
}

const AXES: [char; 3] = ['x', 'y', 'z'];

impl fmt::Display for ShapeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty { what } => write!(f, "there are no {what}"),
            Self::TooFewPoints { count } => {
                write!(f, "only {count} different points; a body in space needs at least 4")
            }
            Self::TooManyPoints { count } => write!(f, "{count} points are more than {MOST_POINTS}"),
            Self::TooManyTriangles { count } => write!(f, "{count} triangles are more than {MOST_TRIANGLES}"),
            Self::NotFinite { vertex, value } => {
                write!(f, "vertex {vertex} is at {value}, which is not finite")
            }
            Self::TooFar { vertex, value } => {
                write!(
                    f,
                    "vertex {vertex} is at {value}; coordinates up to {:e} m can be computed with",
                    SHAPE_LIMITS.end()
                )
            }
            Self::Length { field, value } => write!(
                f,
                "{field} = {value}: has to be a length between {:e} and {:e} m",
                SHAPE_LIMITS.start(),
                SHAPE_LIMITS.end()
            ),
            Self::Collinear { count } => write!(f, "all {count} points lie on one line; they bound no volume"),
            Self::Coplanar { count, normal } => {
                write!(f, "all {count} points lie in one plane (normal {normal}); they bound no volume")
            }
            Self::TooThin { thickness, size } => write!(
                f,
                "the body is too thin: its volume over its surface is {thickness:.3e} m, only {:.3e} of its size ({size:.3e} m)",
                thickness / size
            ),
            Self::TooFine { point, tolerance } => write!(
                f,
                "the surface near {point} has details as fine as the tolerance for faces to be flat ({tolerance:.1e} m); \
                 leave out points that are so close"
            ),
            Self::NoSuchVertex { triangle, vertex, count } => {
                write!(f, "triangle {triangle} names vertex {vertex}, but there are {count} vertices, from 0")
            }
            Self::RepeatedVertex { triangle, vertices: [a, b, c] } => {
                write!(f, "triangle {triangle} ({a}, {b}, {c}) is degenerate: two of its corners are the same point")
            }
            Self::ZeroArea { triangle, vertices: [a, b, c] } => {
                write!(f, "triangle {triangle} ({a}, {b}, {c}) is degenerate: its corners lie on one line")
            }
            Self::Open { edge: [a, b], triangle, count } => {
                write!(f, "the mesh is open: edge {a}–{b} belongs to triangle {triangle} only ({count} such edges)")
            }
            Self::Orientation { edge: [a, b], triangles: [first, second] } => write!(
                f,
                "triangles {first} and {second} run along edge {a}–{b} in the same direction: one of them is turned over"
            ),
            Self::NonManifold { edge: [a, b], count } => {
                write!(f, "{count} triangles share edge {a}–{b}; at most two can")
            }
            Self::Pieces { count, first, second } => write!(
                f,
                "the mesh has {count} separate pieces (vertices {first} and {second} are not connected); \
                 give each as a part of a compound"
            ),
            Self::Inverted { volume } => write!(
                f,
                "the mesh is inside out: its volume is {volume:e} m³; triangles have to be counter-clockwise seen from outside"
            ),
            Self::ZeroVolume { volume } => write!(f, "the mesh bounds no volume ({volume:e} m³)"),
            Self::DentedVertex { vertex, depth, size } => write!(
                f,
                "the mesh is not convex: vertex {vertex} lies {depth:.3e} m ({:.3e} of the size) under its convex hull",
                depth / size
            ),
            Self::DentedEdge { edge: [a, b], depth, size } => write!(
                f,
                "the mesh is not convex: the middle of edge {a}–{b} lies {depth:.3e} m ({:.3e} of the size) under its convex \
                 hull",
                depth / size
            ),
            Self::NotItsHull { volume, hull } => {
                write!(f, "the mesh is not convex: its volume is {volume:e} m³, that of its convex hull {hull:e} m³")
            }
            Self::NotUnit { index, value: [w, x, y, z] } => {
                write!(f, "the orientation ({w}, {x}, {y}, {z}) of {index} is not a unit quaternion")
            }
            Self::PartPosition { part, value } => write!(
                f,
                "part {part} is at {value}: coordinates have to be finite, and up to {:e} m",
                SHAPE_LIMITS.end()
            ),
            Self::Nested { part } => write!(f, "part {part} is itself a compound; list its parts instead"),
            Self::Amount { field, value } => write!(f, "{field} = {value}: has to be positive and finite"),
            Self::Moment { axis, value } => {
                write!(f, "the moment of inertia about {} is {value}: has to be positive and finite", AXES[*axis])
            }
            Self::TriangleInequality { axis, moments } => write!(
                f,
                "the moment of inertia about {} is {}, more than the sum of the two others {moments}: no mass is \
                 distributed like that",
                AXES[*axis], moments[*axis]
            ),
        }
    }
}

impl std::error::Error for ShapeError {}
