//! From a hull of triangles to flat faces with as many corners as they have.

use glam::DVec3;

use super::exact::twice_area;
use super::hull::Hull;
use crate::ledger::VectorSum;

/// Which flat face each triangle belongs to.
pub(super) struct Flattened {
    /// The loops of the faces, counter-clockwise seen from outside.
    pub loops: Vec<Vec<u32>>,
    /// Points that are no corner: inside a face, on an edge, or too close to another corner. Sorted.
    pub dropped: Vec<u32>,
}

const NONE: u32 = u32::MAX;

/// A face is refitted to its triangles at most so often (a count). It converges in two or three: the largest triangle has a
/// good normal already.
const REFITS: usize = 8;

struct Flattener<'a> {
    points: &'a [DVec3],
    hull: &'a Hull,
    /// Twice the area of each triangle, along its normal (m²).
    areas: Vec<DVec3>,
    tolerance: f64,
    /// The face of each triangle.
    face: Vec<u32>,
}

/// Merges the triangles of a hull whose corners lie within `tolerance` (m) of a plane, from the largest triangle on. A patch
/// that is no disc, as the rim around a dome as low as the tolerance, stays as it is.
pub(super) fn flatten(points: &[DVec3], hull: &Hull, tolerance: f64) -> Flattened {
    let corners = |triangle: &[u32; 3]| triangle.map(|k| points[k as usize]);
    let areas: Vec<DVec3> = hull.triangles.iter().map(corners).map(|[a, b, c]| twice_area(a, b, c)).collect();
    let mut order: Vec<(f64, u32)> = areas.iter().enumerate().map(|(k, a)| (a.length_squared(), k as u32)).collect();
    order.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
    let count = areas.len();
    let mut flattener = Flattener { points, hull, areas, tolerance, face: vec![NONE; count] };
    let mut loops = Vec::new();
    let mut next = vec![NONE; points.len()];
    for (_, seed) in order {
        if flattener.face[seed as usize] != NONE {
            continue;
        }
        let patch = flattener.grow(seed);
        match flattener.boundary(&patch, &mut next) {
            Some(corners) => loops.push(flattener.claim(&patch, corners, loops.len())),
            None => {
                for triangle in patch {
                    let corners = hull.triangles[triangle as usize].to_vec();
                    loops.push(flattener.claim(&[triangle], corners, loops.len()));
                }
            }
        }
    }
    let dropped = dropped(points, &loops, tolerance);
    Flattened { loops, dropped }
}

impl Flattener<'_> {
    fn claim(&mut self, patch: &[u32], corners: Vec<u32>, face: usize) -> Vec<u32> {
        for &triangle in patch {
            self.face[triangle as usize] = face as u32;
        }
        corners
    }

    fn heights(&self, triangle: u32, normal: DVec3, origin: DVec3) -> [f64; 3] {
        self.hull.triangles[triangle as usize].map(|k| normal.dot(self.points[k as usize] - origin))
    }

    /// The free triangles around `seed` that lie in one plane with it. The plane is fitted to them (normal by area, half-way
    /// between the highest and the lowest corner), and they are looked for again, until they stay the same.
    fn grow(&self, seed: u32) -> Vec<u32> {
        let mut origin = self.points[self.hull.triangles[seed as usize][0] as usize];
        let mut normal = self.areas[seed as usize].normalize();
        let mut patch = self.flood(seed, normal, origin);
        for _ in 0..REFITS {
            if patch.len() == 1 {
                break;
            }
            let mut area = VectorSum::default();
            patch.iter().for_each(|&triangle| area.add(self.areas[triangle as usize]));
            normal = area.value().normalize();
            let heights = || patch.iter().flat_map(|&triangle| self.heights(triangle, normal, origin));
            let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
            origin += normal * (0.5 * (low + high));
            let again = self.flood(seed, normal, origin);
            let settled = again == patch;
            patch = again;
            if settled {
                break;
            }
        }
        patch
    }

    /// The free triangles connected with `seed` whose corners lie in the plane.
    fn flood(&self, seed: u32, normal: DVec3, origin: DVec3) -> Vec<u32> {
        let mut patch = vec![seed];
        let mut known = std::collections::BTreeSet::from([seed]);
        let mut next = 0;
        while next < patch.len() {
            for far in self.hull.neighbours[patch[next] as usize] {
                let in_plane = || {
                    let flat = self.heights(far, normal, origin).iter().all(|height| height.abs() <= self.tolerance);
                    flat && self.areas[far as usize].dot(normal) > 0.0
                };
                if self.face[far as usize] == NONE && !known.contains(&far) && in_plane() {
                    known.insert(far);
                    patch.push(far);
                }
            }
            next += 1;
        }
        patch
    }

    /// The one loop around a patch; `None` if it has none or several. `next` is scratch, NONE everywhere before and after.
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

/// Points at which fewer than three edges meet, and of corners closer than `tolerance` (m) the later.
fn dropped(points: &[DVec3], loops: &[Vec<u32>], tolerance: f64) -> Vec<u32> {
    let mut edges_at = vec![0_u32; points.len()];
    let mut close = vec![false; points.len()];
    for corners in loops {
        for (k, &a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            // Each edge is met twice, once in either direction; it is counted at its start.
            edges_at[a as usize] += 1;
            let is_short = (points[a as usize] - points[b as usize]).length() <= tolerance;
            if a < b && is_short && !close[a as usize] {
                close[b as usize] = true;
            }
        }
    }
    (0..points.len() as u32).filter(|&k| edges_at[k as usize] < 3 || close[k as usize]).collect()
}
