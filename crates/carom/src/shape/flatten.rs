//! From a hull of triangles to flat faces with as many corners as they have.

use glam::DVec3;

use super::exact::twice_area;
use super::hull::Hull;
use crate::ledger::VectorSum;

/// Flat faces of a hull.
pub(super) struct Flattened {
    /// The loops of the faces, counter-clockwise seen from outside.
    pub loops: Vec<Vec<u32>>,
    /// Points that are no corner: inside a face, on an edge, or too close to another corner. Sorted.
    pub dropped: Vec<u32>,
}

/// What becomes of a face around a point that is no corner.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Uneven {
    /// It is a face, and the point is to be dropped.
    Drop,
    /// It stays as triangles, so that the point is a corner.
    Keep,
}

const NONE: u32 = u32::MAX;

/// A face is refitted to its triangles at most so often (a count). It converges in two or three: the largest triangle
/// has a good normal already.
const REFITS: usize = 8;

/// The points with normal·(x − point) = height.
struct Plane {
    normal: DVec3,
    point: DVec3,
    height: f64,
}

struct Flattener<'a> {
    points: &'a [DVec3],
    hull: &'a Hull,
    /// Twice the area of each triangle, along its normal (m²).
    areas: Vec<DVec3>,
    tolerance: f64,
    /// Whether a triangle is in a face already.
    is_taken: Vec<bool>,
}

/// Merges the triangles of a hull whose corners lie within `tolerance` (m) of a plane, from the largest triangle on. A
/// patch that is no disc, as the rim around a dome as low as the tolerance, stays as it is.
pub(super) fn flatten(points: &[DVec3], hull: &Hull, tolerance: f64, uneven: Uneven) -> Flattened {
    let corners = |triangle: &[u32; 3]| triangle.map(|k| points[k as usize]);
    let areas: Vec<DVec3> = hull.triangles.iter().map(corners).map(|[a, b, c]| twice_area(a, b, c)).collect();
    let mut order: Vec<(f64, u32)> = areas.iter().enumerate().map(|(k, a)| (a.length_squared(), k as u32)).collect();
    order.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
    let count = areas.len();
    let mut flattener = Flattener { points, hull, areas, tolerance, is_taken: vec![false; count] };
    let mut faces = Vec::new();
    let mut next = vec![NONE; points.len()];
    for (_, seed) in order {
        if !flattener.is_taken[seed as usize] {
            let patch = flattener.take_patch(seed);
            match flattener.boundary(&patch, &mut next) {
                Some(corners) => faces.push((patch, corners)),
                None => faces.extend(flattener.separately(&patch)),
            }
        }
    }
    let dropped = no_corners(points.len(), &faces);
    if uneven == Uneven::Keep {
        let is_uneven =
            |&k: &u32| flattener.hull.triangles[k as usize].iter().any(|v| dropped.binary_search(v).is_ok());
        let (uneven, mut even): (Vec<_>, Vec<_>) =
            faces.into_iter().partition(|(patch, _)| patch.iter().any(is_uneven));
        even.extend(uneven.iter().flat_map(|(patch, _)| flattener.separately(patch)));
        return Flattened { loops: even.into_iter().map(|(_, corners)| corners).collect(), dropped: Vec::new() };
    }
    let loops: Vec<Vec<u32>> = faces.into_iter().map(|(_, corners)| corners).collect();
    // One after the other: of a cluster of points at a corner, some may be no corners, but one has to stay.
    let dropped = if dropped.is_empty() { too_close(points, &loops, tolerance) } else { dropped };
    Flattened { loops, dropped }
}

impl Flattener<'_> {
    fn take_patch(&mut self, seed: u32) -> Vec<u32> {
        let patch = self.grow(seed);
        patch.iter().for_each(|&triangle| self.is_taken[triangle as usize] = true);
        patch
    }

    /// Each triangle of a patch as a face, with its loop.
    fn separately(&self, patch: &[u32]) -> Vec<(Vec<u32>, Vec<u32>)> {
        patch.iter().map(|&k| (vec![k], self.hull.triangles[k as usize].to_vec())).collect()
    }

    /// Heights of the corners of a triangle above a plane. From a point of the plane, so that far from the origin no
    /// digits are lost.
    fn heights(&self, triangle: u32, plane: &Plane) -> [f64; 3] {
        let height = |k: u32| plane.normal.dot(self.points[k as usize] - plane.point) - plane.height;
        self.hull.triangles[triangle as usize].map(height)
    }

    /// The free triangles around `seed` that lie in one plane with it. The plane is fitted to them (normal by area,
    /// half-way between the highest and the lowest corner), and they are looked for again, until they stay the same.
    fn grow(&self, seed: u32) -> Vec<u32> {
        let point = self.points[self.hull.triangles[seed as usize][0] as usize];
        let mut plane = Plane { normal: self.areas[seed as usize].normalize(), point, height: 0.0 };
        let mut patch = self.flood(seed, &plane);
        for _ in 0..REFITS {
            if patch.len() == 1 {
                break;
            }
            let mut area = VectorSum::default();
            patch.iter().for_each(|&triangle| area.add(self.areas[triangle as usize]));
            plane = Plane { normal: area.value().normalize(), point, height: 0.0 };
            let heights = || patch.iter().flat_map(|&triangle| self.heights(triangle, &plane));
            let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
            plane.height = 0.5 * (low + high);
            let again = self.flood(seed, &plane);
            let settled = again == patch;
            patch = again;
            if settled {
                break;
            }
        }
        patch
    }

    /// The free triangles connected with `seed` whose corners lie in the plane.
    fn flood(&self, seed: u32, plane: &Plane) -> Vec<u32> {
        let mut patch = vec![seed];
        let mut known = std::collections::BTreeSet::from([seed]);
        let mut next = 0;
        while next < patch.len() {
            for far in self.hull.neighbours[patch[next] as usize] {
                let in_plane = || {
                    let flat = self.heights(far, plane).iter().all(|height| height.abs() <= self.tolerance);
                    flat && self.areas[far as usize].dot(plane.normal) > 0.0
                };
                if !self.is_taken[far as usize] && !known.contains(&far) && in_plane() {
                    known.insert(far);
                    patch.push(far);
                }
            }
            next += 1;
        }
        patch
    }

    /// The one loop around a patch; `None` if it has none or several. `next` is scratch, NONE everywhere before and
    /// after.
    fn boundary(&self, patch: &[u32], next: &mut [u32]) -> Option<Vec<u32>> {
        let inside: std::collections::BTreeSet<u32> = patch.iter().copied().collect();
        let mut edges = Vec::new();
        for &triangle in patch {
            for edge in 0..3 {
                if !inside.contains(&self.hull.neighbours[triangle as usize][edge]) {
                    let vertices = self.hull.triangles[triangle as usize];
                    edges.push([vertices[edge], vertices[(edge + 1) % 3]]);
                }
            }
        }
        let mut simple = !edges.is_empty();
        for &[from, to] in &edges {
            simple &= next[from as usize] == NONE;
            next[from as usize] = to;
        }
        let mut corners = Vec::new();
        if simple {
            let start = edges[0][0];
            let mut at = start;
            loop {
                corners.push(at);
                at = next[at as usize];
                if at == start || at == NONE || corners.len() > edges.len() {
                    break;
                }
            }
            simple = corners.len() == edges.len();
        }
        edges.iter().for_each(|&[from, _]| next[from as usize] = NONE);
        simple.then_some(corners)
    }
}

/// Points at which fewer than three edges meet, sorted.
fn no_corners(points: usize, faces: &[(Vec<u32>, Vec<u32>)]) -> Vec<u32> {
    let mut edges_at = vec![0_u32; points];
    // Each edge is in two loops, once in either direction; it is counted at its start.
    faces.iter().flat_map(|(_, corners)| corners).for_each(|&k| edges_at[k as usize] += 1);
    (0..points as u32).filter(|&k| edges_at[k as usize] < 3).collect()
}

/// Of corners that are joined by an edge of at most `tolerance` (m), the later, sorted. The other stays this time.
fn too_close(points: &[DVec3], loops: &[Vec<u32>], tolerance: f64) -> Vec<u32> {
    let mut is_settled = vec![false; points.len()];
    let mut dropped = Vec::new();
    for corners in loops {
        for (k, &a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            let is_short = (points[a as usize] - points[b as usize]).length() <= tolerance;
            if is_short && !is_settled[a as usize] && !is_settled[b as usize] {
                (is_settled[a as usize], is_settled[b as usize]) = (true, true);
                dropped.push(a.max(b));
            }
        }
    }
    dropped.sort_unstable();
    dropped
}
