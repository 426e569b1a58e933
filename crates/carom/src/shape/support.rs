//! The farthest vertex of a polyhedron along a direction.

use glam::DVec3;

use super::polyhedron::Polyhedron;

/// Up to so many vertices, looking at all is faster than climbing from one to the next (a count).
const FEW_VERTICES: usize = 32;

impl Polyhedron {
    /// The vertices connected with a vertex by an edge or by a diagonal along which a face was divided, sorted. Of
    /// these triangles the body is exactly convex, so that climbing from neighbour to neighbour leads to the top,
    /// however fine its details are.
    pub fn neighbours(&self, vertex: u32) -> &[u32] {
        let (from, to) = (self.neighbours_from[vertex as usize], self.neighbours_from[vertex as usize + 1]);
        &self.neighbours[from as usize..to as usize]
    }

    /// The point farthest along `direction` (any length): a vertex, see [`Self::support_vertex`].
    pub fn support(&self, direction: DVec3) -> DVec3 {
        self.vertices[self.support_vertex(direction) as usize]
    }

    /// The vertex farthest along `direction` (any length), to within rounding. Of several, always the same one.
    pub fn support_vertex(&self, direction: DVec3) -> u32 {
        self.support_vertex_from(self.start(direction), direction)
    }

    /// As [`Self::support_vertex`], climbing from a vertex, best one that was the farthest a moment ago. Of several
    /// that are equally far, which one it is may depend on where the climb starts.
    pub fn support_vertex_from(&self, vertex: u32, direction: DVec3) -> u32 {
        if self.vertices.len() <= FEW_VERTICES {
            return self.farthest_of_all(direction);
        }
        self.climb(vertex, direction)
    }

    /// The extreme vertex of the axis nearest to `direction`.
    fn start(&self, direction: DVec3) -> u32 {
        let axis = direction.abs().max_position();
        self.extremes[if direction[axis] > 0.0 { axis } else { axis + 3 }]
    }

    /// The vertices farthest along x, y, z and −x, −y, −z.
    pub(super) fn farthest_along_axes(&self) -> [u32; 6] {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
        axes.map(|axis| self.farthest_of_all(axis))
    }

    fn farthest_of_all(&self, direction: DVec3) -> u32 {
        let mut best = (f64::NEG_INFINITY, 0);
        for (k, vertex) in self.vertices.iter().enumerate() {
            let height = direction.dot(*vertex);
            if height > best.0 {
                best = (height, k as u32);
            }
        }
        best.1
    }

    /// Goes to the highest neighbour until there is none higher; on a convex body, that is the top. Rises are taken
    /// along edges, not as differences of heights, which would be lost in rounding where edges are short.
    fn climb(&self, mut vertex: u32, direction: DVec3) -> u32 {
        // It takes far fewer steps; the bound is for a direction in which rounding makes everything equally high.
        for _ in 0..self.vertices.len() {
            let here = self.vertices[vertex as usize];
            let mut best = (0.0, vertex);
            for &next in self.neighbours(vertex) {
                let rise = direction.dot(self.vertices[next as usize] - here);
                if rise > best.0 {
                    best = (rise, next);
                }
            }
            if best.1 == vertex {
                break;
            }
            vertex = best.1;
        }
        vertex
    }
}

/// The vertices connected with each vertex by a side of a triangle of a closed surface: where they start, and all of
/// them.
pub(super) fn neighbours(vertices: usize, triangles: &[[u32; 3]]) -> (Vec<u32>, Vec<u32>) {
    // Each side is in two triangles, once in either direction.
    let mut pairs: Vec<[u32; 2]> = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    pairs.sort_unstable();
    let mut from = vec![0; vertices + 1];
    pairs.iter().for_each(|&[a, _]| from[a as usize + 1] += 1);
    for k in 0..vertices {
        from[k + 1] += from[k];
    }
    (from, pairs.into_iter().map(|[_, b]| b).collect())
}
