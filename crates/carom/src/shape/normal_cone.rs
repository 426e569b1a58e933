//! In which directions a convex body can touch a mesh of triangles at an edge or a corner.
//!
//! What touches at a point lies in the half-space n·x ≥ 0 there, and the surface in the other. So n·d ≤ 0 for each direction d
//! from that point into the surface: at an edge, into the triangles on both sides of it; at a corner, along the edges there. A
//! triangle taken by itself can be touched at an edge or corner from more sides. Where the surface goes on flat, that edge is a
//! mere seam, and where it rises, a valley: there its neighbours are touched and not the edge. Such a normal is turned to the
//! nearest one that the surface allows, a triangle's own where that is on a seam, so that seams are not felt.

use glam::DVec3;

use super::triangle_mesh::TriangleMesh;

/// A direction in which a surface can be touched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touchable {
    /// Unit vector.
    pub normal: DVec3,
    /// Whether it is the one asked for; else it is the nearest.
    pub as_asked: bool,
}

impl Touchable {
    fn instead(normal: DVec3) -> Self {
        Self { normal, as_asked: false }
    }
}

/// Components of unit vectors up to this count as rounding of 0 when it is decided which normals a corner allows (pure number).
const ROUNDING: f64 = 1.0 / (1u64 << 40) as f64;

impl TriangleMesh {
    /// The direction nearest to the unit vector `asked` in which a body can touch the `k`-th edge of `triangle`.
    pub fn touchable_at_edge(&self, triangle: u32, k: usize, asked: DVec3) -> Touchable {
        let edge = &self.edges[self.triangles[triangle as usize].edges[k] as usize];
        let [Some(left), Some(right)] = edge.triangles else { return Touchable { normal: asked, as_asked: true } };
        let other = if left == triangle { right } else { left };
        let [from, to] = edge.vertices.map(|vertex| self.vertices[vertex as usize]);
        let along = (to - from).normalize();
        let into = |neighbour: u32| {
            let apex = self.corners(neighbour)[self.opposite(neighbour, edge.vertices)] - from;
            (apex - along * along.dot(apex)).normalize()
        };
        if asked.dot(into(other)) <= 0.0 {
            return Touchable { normal: asked, as_asked: true };
        }
        let own = self.facing(triangle, asked);
        let theirs = self.facing(other, asked);
        // Over a ridge the neighbour's face is next, in a valley and on a seam one's own.
        let next = if theirs.dot(into(triangle)) < -ROUNDING { theirs } else { own };
        Touchable::instead(next)
    }

    /// The direction nearest to the unit vector `asked` in which a body can touch the `k`-th corner of `triangle`.
    pub fn touchable_at_corner(&self, triangle: u32, k: usize, asked: DVec3) -> Touchable {
        let vertex = self.triangles[triangle as usize].vertices[k];
        let at = self.vertices[vertex as usize];
        let along = |edge: u32| {
            let [a, b] = self.edges[edge as usize].vertices;
            (self.vertices[if a == vertex { b } else { a } as usize] - at).normalize()
        };
        let edges = || self.edges_at(vertex).iter().copied();
        let allows = |normal: DVec3, by: f64| edges().all(|edge| normal.dot(along(edge)) <= by);
        if allows(asked, 0.0) {
            return Touchable { normal: asked, as_asked: true };
        }
        let mut best: Option<DVec3> = None;
        let mut consider = |normal: DVec3| {
            if allows(normal, ROUNDING) && best.is_none_or(|best| normal.dot(asked) > best.dot(asked)) {
                best = Some(normal);
            }
        };
        // One's own face first: of equals the first counts.
        consider(self.facing(triangle, asked));
        for edge in edges() {
            self.edges[edge as usize].triangles.iter().flatten().for_each(|&face| consider(self.facing(face, asked)));
            let flat = asked - along(edge) * along(edge).dot(asked);
            if flat.length() > ROUNDING {
                consider(flat.normalize());
            }
        }
        Touchable::instead(best.unwrap_or_else(|| self.facing(triangle, asked)))
    }

    /// The normal of a triangle on the side to which a direction points.
    fn facing(&self, triangle: u32, direction: DVec3) -> DVec3 {
        let normal = self.triangles[triangle as usize].normal;
        if normal.dot(direction) < 0.0 { -normal } else { normal }
    }

    /// Which corner of a triangle is not on the edge with these ends.
    fn opposite(&self, triangle: u32, ends: [u32; 2]) -> usize {
        self.triangles[triangle as usize].vertices.iter().position(|vertex| !ends.contains(vertex)).unwrap_or(0)
    }
}
