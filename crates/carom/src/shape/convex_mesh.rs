//! A convex polyhedron from a closed mesh, or where the mesh is not convex.

use glam::DVec3;

use super::error::ShapeError;
use super::exact::{side, twice_area};
use super::polyhedron::{Polyhedron, size};
use super::surface::Surface;
use crate::ledger::Sum;
use crate::tolerance::CONVEX;

/// So many dents are measured, and the deepest is named (a count); a mesh may have millions.
const DENTS_MEASURED: usize = 1000;

impl Polyhedron {
    /// The convex body that a closed mesh bounds: vertices (m) and triangles, counter-clockwise seen from outside.
    /// Vertices at the same place are one; vertices of no triangle are ignored. The body is the hull of the vertices,
    /// from which the mesh may deviate by [`CONVEX`] of its size.
    ///
    /// # Errors
    /// A mesh that is empty or too large, with coordinates that are not finite, with triangles that name vertices that
    /// do not exist or have no area, that is open, inconsistently oriented, in pieces, inside out, flat, or not convex;
    /// and those of [`Polyhedron::from_points`]. Vertices and triangles are named by their indices.
    pub fn from_mesh(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Result<Self, ShapeError> {
        let surface = Surface::new(vertices, triangles)?;
        surface.check_closed()?;
        surface.check_connected()?;
        let hull = Self::from_points(&surface.vertices)?;
        check_volume(&surface, &hull)?;
        check_dents(&surface, &hull)?;
        check_is_hull(&surface, &hull)?;
        Ok(hull)
    }
}

/// Volume (m³) inside a closed surface, by tetrahedra from `origin`.
fn volume(triangles: impl Iterator<Item = [DVec3; 3]>, origin: DVec3) -> f64 {
    let mut volume = Sum::default();
    for [a, b, c] in triangles {
        volume.add(twice_area(a, b, c).dot(a - origin) / 6.0);
    }
    volume.value()
}

fn mesh_volume(surface: &Surface) -> f64 {
    volume((0..surface.triangles.len() as u32).map(|k| surface.corners(k)), surface.vertices[0])
}

fn hull_volume(hull: &Polyhedron) -> f64 {
    let fan = |corners: &[u32]| -> Vec<[u32; 3]> {
        corners[1..].windows(2).map(|pair| [corners[0], pair[0], pair[1]]).collect()
    };
    let triangles = hull.faces.iter().flat_map(|face| fan(&face.vertices));
    volume(triangles.map(|corners| corners.map(|k| hull.vertices[k as usize])), hull.vertices[0])
}

/// The volume that a layer of [`CONVEX`] of the size around the hull would have (m³), by a surface that cannot be
/// larger than that of the ball around it.
fn least_volume(hull: &Polyhedron) -> f64 {
    let size = hull.size();
    4.0 * std::f64::consts::PI * size * size * (CONVEX * size)
}

fn check_volume(surface: &Surface, hull: &Polyhedron) -> Result<(), ShapeError> {
    let volume = mesh_volume(surface);
    // Half the hull: what is dented, not flat, has its dents named.
    if volume.abs() <= least_volume(hull).min(0.5 * hull_volume(hull)) {
        return Err(ShapeError::ZeroVolume { volume });
    }
    if volume > 0.0 { Ok(()) } else { Err(ShapeError::Inverted { volume }) }
}

/// The depth of a point under the hull (m) if it is more than `allowed`.
fn depth_beyond(hull: &Polyhedron, point: DVec3, allowed: f64) -> Option<f64> {
    let mut depth = f64::INFINITY;
    for face in 0..hull.faces.len() as u32 {
        depth = depth.min(-hull.height_above(face, point));
        if depth <= allowed {
            return None;
        }
    }
    Some(depth)
}

/// Refuses vertices, and the middles of edges whose two triangles fold inwards, that lie deep under the hull.
fn check_dents(surface: &Surface, hull: &Polyhedron) -> Result<(), ShapeError> {
    let size = size(&surface.vertices);
    let allowed = CONVEX * size;
    let dented_vertices = surface.vertices.iter().zip(&surface.names).filter_map(|(&point, &vertex)| {
        depth_beyond(hull, point, allowed).map(|depth| (depth, ShapeError::DentedVertex { vertex, depth, size }))
    });
    let dented_edges = surface.edges.iter().filter_map(|edge| {
        let [Some(left), Some(right)] = edge.triangles else { return None };
        let [a, b, c] = surface.corners(left);
        if side(a, b, c, surface.opposite(right, edge)) <= 0.0 {
            return None;
        }
        let [p, q] = edge.vertices.map(|k| surface.vertices[k as usize]);
        let depth = depth_beyond(hull, p + 0.5 * (q - p), allowed)?;
        Some((depth, ShapeError::DentedEdge { edge: surface.edge_name(edge), depth, size }))
    });
    let mut deepest = None;
    for (depth, error) in dented_vertices.take(DENTS_MEASURED).chain(dented_edges.take(DENTS_MEASURED)) {
        if deepest.as_ref().is_none_or(|&(most, _)| depth > most) {
            deepest = Some((depth, error));
        }
    }
    deepest.map_or(Ok(()), |(_, error)| Err(error))
}

/// Refuses a mesh without dents that has another volume than its hull.
fn check_is_hull(surface: &Surface, hull: &Polyhedron) -> Result<(), ShapeError> {
    let (volume, hull_volume) = (mesh_volume(surface), hull_volume(hull));
    if (volume - hull_volume).abs() <= least_volume(hull) {
        Ok(())
    } else {
        Err(ShapeError::NotItsHull { volume, hull: hull_volume })
    }
}
