//! Convex polyhedra.

use glam::{DMat3, DVec3};

use super::error::ShapeError;
use super::exact::{twice_area, twice_polygon_area};
use super::flatten::{Uneven, flatten};
use super::hull::{Flat, Hull, hull};
use super::support::neighbours;
use crate::ledger::Sum;
use crate::tolerance::{COPLANAR, FLATTENING_PASSES, MOST_POINTS, SHAPE_LIMITS, THIN};

/// A flat face.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Outward unit normal.
    pub normal: DVec3,
    /// The largest normal·vertex of its vertices (m): the face lies in the plane normal·x = offset.
    pub offset: f64,
    /// Its corners, counter-clockwise seen from outside, from the one with the smallest index on.
    pub vertices: Vec<u32>,
}

/// A straight edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// Its ends, the smaller index first.
    pub vertices: [u32; 2],
    /// The faces on its left and right, seen from outside along the edge: the loop of the first runs with it.
    pub faces: [u32; 2],
}

/// A convex polyhedron: the hull of its vertices. Faces and edges are those of the exact hull but for triangles that
/// lie in one plane to within [`COPLANAR`] of the size, which are one face. Its numbers do not depend on the order in
/// which it was given.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyhedron {
    /// Corners (m), each of at least three faces.
    pub vertices: Vec<DVec3>,
    /// Faces.
    pub faces: Vec<Face>,
    /// Edges, sorted by their vertices.
    pub edges: Vec<Edge>,
    /// Largest distance of a vertex from the origin (m).
    pub radius: f64,
    /// The neighbours of vertex k are `neighbours[neighbours_from[k]..neighbours_from[k + 1]]`, sorted.
    pub(super) neighbours_from: Vec<u32>,
    pub(super) neighbours: Vec<u32>,
    /// The vertices farthest along x, y, z and −x, −y, −z.
    pub(super) extremes: [u32; 6],
}

/// A side of a face: an edge seen from the face.
struct Side {
    /// The ends of the edge, the smaller index first.
    vertices: [u32; 2],
    face: u32,
    /// The corners of the face before and after the edge.
    beside: [u32; 2],
}

impl Polyhedron {
    /// The convex hull of points (m), given in any order, repeated or not. Points inside it, inside a face or on an
    /// edge are left out. The numbers are taken as they are: where their rounding is coarser than [`COPLANAR`], as in
    /// single precision or far from the origin, a face that was meant to be flat stays several, at tiny angles.
    ///
    /// # Errors
    /// Fewer than 4 different points, too many, infinite or NaN, all on a line or in a plane; a body thinner than
    /// [`THIN`], or with details as fine as [`COPLANAR`].
    pub fn from_points(points: &[DVec3]) -> Result<Self, ShapeError> {
        check_points(points)?;
        let points = sorted(points);
        if points.len() < 4 {
            return Err(ShapeError::TooFewPoints { count: points.len() });
        }
        let (points, triangles) = corners_of_hull(&points)?;
        Self::from_hull(points, triangles)
    }

    /// A box of these edge lengths (m), centred, its edges along the axes.
    ///
    /// # Errors
    /// An edge length that is not positive and finite, or a box thinner than [`THIN`].
    pub fn cuboid(size: DVec3) -> Result<Self, ShapeError> {
        for (field, value) in [("size x", size.x), ("size y", size.y), ("size z", size.z)] {
            check_length(field, value)?;
        }
        let corner = |k: u32| {
            let sign = |bit: u32| if k >> bit & 1 == 0 { -0.5 } else { 0.5 };
            size * DVec3::new(sign(0), sign(1), sign(2))
        };
        let corners: Vec<DVec3> = (0..8).map(corner).collect();
        Self::from_points(&corners)
    }

    /// Drops points until every one left is a corner of at least three flat faces. If details are as fine as the
    /// tolerance, so that this goes on, what is uneven then stays as triangles.
    fn from_hull(mut points: Vec<DVec3>, mut triangles: Hull) -> Result<Self, ShapeError> {
        let size = size(&points);
        check_thickness(&points, &triangles, size)?;
        let tolerance = COPLANAR * size;
        let mut left_out = Vec::new();
        for pass in 0..=FLATTENING_PASSES {
            let uneven = if pass < FLATTENING_PASSES { Uneven::Drop } else { Uneven::Keep };
            let flattened = flatten(&points, &triangles, tolerance, uneven);
            if flattened.dropped.is_empty() {
                let body = Self::from_loops(points, flattened.loops, &triangles.triangles);
                return body.check_fineness(&left_out, tolerance).map(|()| body);
            }
            let is_dropped = |k: usize| flattened.dropped.binary_search(&(k as u32)).is_ok();
            let (out, kept): (Vec<_>, Vec<_>) = points.into_iter().enumerate().partition(|&(k, _)| is_dropped(k));
            left_out.extend(out.into_iter().map(|(_, point)| point));
            let kept: Vec<DVec3> = kept.into_iter().map(|(_, point)| point).collect();
            (points, triangles) = corners_of_hull(&kept)?;
        }
        Err(ShapeError::TooFine { point: points[0], tolerance })
    }

    /// The polyhedron of these faces, which were merged from triangles.
    fn from_loops(vertices: Vec<DVec3>, mut loops: Vec<Vec<u32>>, triangles: &[[u32; 3]]) -> Self {
        for corners in &mut loops {
            let first = (0..corners.len()).min_by_key(|&k| corners[k]).unwrap_or(0);
            corners.rotate_left(first);
        }
        loops.sort();
        let edges = edges(&loops);
        let (neighbours_from, neighbours) = neighbours(vertices.len(), triangles);
        let mut polyhedron = Self {
            faces: loops.into_iter().map(|vertices| Face { normal: DVec3::ZERO, offset: 0.0, vertices }).collect(),
            vertices,
            edges,
            radius: 0.0,
            neighbours_from,
            neighbours,
            extremes: [0; 6],
        };
        polyhedron.measure();
        polyhedron
    }

    /// Normals, offsets and extremes, from the vertices.
    fn measure(&mut self) {
        for face in &mut self.faces {
            let corners: Vec<DVec3> = face.vertices.iter().map(|&k| self.vertices[k as usize]).collect();
            face.normal = twice_polygon_area(&corners).normalize();
            face.offset = corners.iter().map(|&corner| face.normal.dot(corner)).fold(f64::NEG_INFINITY, f64::max);
        }
        self.radius = self.vertices.iter().map(|v| v.length()).fold(0.0, f64::max);
        self.extremes = self.farthest_along_axes();
    }

    /// Refuses a body where merging went wrong because details are as fine as the tolerance: a corner next to a face is
    /// above its plane by more than 4 times the tolerance (m), or a point that was left out by more than 12 times
    /// (twice in each pass).
    fn check_fineness(&self, left_out: &[DVec3], tolerance: f64) -> Result<(), ShapeError> {
        let too_high = |face: u32, point: DVec3, allowed: f64| {
            if self.height_above(face, point) <= allowed {
                return Ok(());
            }
            Err(ShapeError::TooFine { point, tolerance })
        };
        let mut sides = self.sides();
        sides.sort_unstable_by_key(|side| side.vertices);
        for pair in sides.chunks_exact(2) {
            for (plane, other) in [(&pair[0], &pair[1]), (&pair[1], &pair[0])] {
                for corner in other.beside {
                    too_high(plane.face, self.vertices[corner as usize], 4.0 * tolerance)?;
                }
            }
        }
        for face in 0..self.faces.len() as u32 {
            left_out.iter().try_for_each(|&point| too_high(face, point, 12.0 * tolerance))?;
        }
        Ok(())
    }

    /// The sides of all faces.
    fn sides(&self) -> Vec<Side> {
        let side = |face: usize, k: usize| {
            let corners = &self.faces[face].vertices;
            let at = |offset: usize| corners[(k + offset) % corners.len()];
            let (a, b) = (at(1), at(2));
            Side { vertices: [a.min(b), a.max(b)], face: face as u32, beside: [at(0), at(3)] }
        };
        let of_face = |face: usize| (0..self.faces[face].vertices.len()).map(move |k| side(face, k));
        (0..self.faces.len()).flat_map(of_face).collect()
    }

    /// The height of a point above the plane of a face (m), negative inside. From a corner of the face, so that far
    /// from the origin no digits are lost as they are in an offset.
    pub fn height_above(&self, face: u32, point: DVec3) -> f64 {
        let Face { normal, vertices, .. } = &self.faces[face as usize];
        normal.dot(point - self.vertices[vertices[0] as usize])
    }

    /// The depth of a point under the surface (m): its distance from the nearest plane of a face, negative outside.
    pub fn depth(&self, point: DVec3) -> f64 {
        (0..self.faces.len() as u32).map(|face| -self.height_above(face, point)).fold(f64::INFINITY, f64::min)
    }

    /// The same body in the coordinates of a frame at `centre` (m), whose axes are the columns of `axes`. Its faces,
    /// edges and their order stay.
    pub fn seen_from(&self, centre: DVec3, axes: DMat3) -> Self {
        let mut seen = self.clone();
        let turn = axes.transpose();
        for vertex in &mut seen.vertices {
            // Zeros are positive, so that a frame that changes nothing changes no bit.
            *vertex = turn * (*vertex - centre) + DVec3::ZERO;
        }
        seen.measure();
        seen
    }

    /// Half the diagonal of the bounding box (m), which tolerances are fractions of.
    pub fn size(&self) -> f64 {
        size(&self.vertices)
    }
}

/// Each edge once, from loops in which it occurs once in either direction; sorted.
fn edges(loops: &[Vec<u32>]) -> Vec<Edge> {
    let mut sides = Vec::new();
    for (face, corners) in loops.iter().enumerate() {
        for (k, &a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            sides.push((a.min(b), a.max(b), a > b, face as u32));
        }
    }
    sides.sort_unstable();
    let edge =
        |pair: &[(u32, u32, bool, u32)]| Edge { vertices: [pair[0].0, pair[0].1], faces: [pair[0].3, pair[1].3] };
    sides.chunks_exact(2).map(edge).collect()
}

/// Refuses points that are no points, none, or too many.
pub(super) fn check_points(points: &[DVec3]) -> Result<(), ShapeError> {
    if points.is_empty() {
        return Err(ShapeError::Empty { what: "points" });
    }
    if points.len() > MOST_POINTS {
        return Err(ShapeError::TooManyPoints { count: points.len() });
    }
    for (vertex, &value) in points.iter().enumerate() {
        if !value.is_finite() {
            return Err(ShapeError::NotFinite { vertex, value });
        }
        if value.abs().max_element() > *SHAPE_LIMITS.end() {
            return Err(ShapeError::TooFar { vertex, value });
        }
    }
    Ok(())
}

/// Refuses what is no length.
pub(super) fn check_length(field: &'static str, value: f64) -> Result<(), ShapeError> {
    if SHAPE_LIMITS.contains(&value) { Ok(()) } else { Err(ShapeError::Length { field, value }) }
}

/// The different points, by x, then y, then z.
fn sorted(points: &[DVec3]) -> Vec<DVec3> {
    // -0 + 0 is 0, so that the two zeros are one place.
    let mut sorted: Vec<DVec3> = points.iter().map(|&point| point + DVec3::ZERO).collect();
    sorted.sort_unstable_by(|p, q| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z)));
    sorted.dedup();
    sorted
}

/// Half the diagonal of the bounding box (m).
pub(super) fn size(points: &[DVec3]) -> f64 {
    let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    0.5 * (high - low).length()
}

/// The hull of sorted points, and those of them that are its corners.
fn corners_of_hull(points: &[DVec3]) -> Result<(Vec<DVec3>, Hull), ShapeError> {
    match hull(points) {
        Ok(hull) => Ok(hull.with_corners_only(points)),
        Err(Flat::Line) => Err(ShapeError::Collinear { count: points.len() }),
        Err(Flat::Plane(normal)) => Err(ShapeError::Coplanar { count: points.len(), normal }),
    }
}

/// Refuses a hull that is thinner than [`THIN`]. Volume over surface is between a third of the in-radius and the
/// in-radius.
fn check_thickness(points: &[DVec3], hull: &Hull, size: f64) -> Result<(), ShapeError> {
    let (mut volume, mut surface) = (Sum::default(), Sum::default());
    for triangle in &hull.triangles {
        let [a, b, c] = triangle.map(|k| points[k as usize]);
        let area = twice_area(a, b, c);
        volume.add(area.dot(a - points[0]) / 6.0);
        surface.add(area.length() / 2.0);
    }
    let thickness = volume.value() / surface.value();
    check_length("size", size)?;
    if thickness >= THIN * size { Ok(()) } else { Err(ShapeError::TooThin { thickness, size }) }
}
