//! Triangles as a file has them, checked: corners welded, edges with the triangles on their two sides.

use glam::DVec3;

use super::error::ShapeError;
use super::exact::collinear;
use super::polyhedron::check_points;
use crate::tolerance::MOST_TRIANGLES;

/// An edge of a surface.
pub(super) struct SurfaceEdge {
    /// Its ends, the smaller index first.
    pub vertices: [u32; 2],
    /// The triangle that runs along it, and the one that runs against it.
    pub triangles: [Option<u32>; 2],
}

/// Triangles that meet at their edges in twos, with agreeing orientation; open or closed.
pub(super) struct Surface {
    /// Corners that triangles use, all different.
    pub vertices: Vec<DVec3>,
    /// What each is called outside: the index of the first given vertex at that place.
    pub names: Vec<u32>,
    /// Triangles, in the order given.
    pub triangles: Vec<[u32; 3]>,
    /// Edges, sorted by their vertices.
    pub edges: Vec<SurfaceEdge>,
}

impl Surface {
    /// Welds vertices that are equal bit by bit (the two zeros count as one) and leaves out those without a triangle.
    ///
    /// # Errors
    /// Nothing given, too much, coordinates that are no numbers, indices beyond the vertices, triangles without an
    /// area, edges with more than two triangles or with two of different orientation.
    pub fn new(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Result<Self, ShapeError> {
        check_points(vertices)?;
        check_triangles(vertices.len(), triangles)?;
        let first = first_at_the_same_place(vertices);
        let welded: Vec<[u32; 3]> = triangles.iter().map(|corners| corners.map(|k| first[k as usize])).collect();
        for (triangle, &[a, b, c]) in welded.iter().enumerate() {
            let given = triangles[triangle];
            if a == b || b == c || c == a {
                return Err(ShapeError::RepeatedVertex { triangle, vertices: given });
            }
            if collinear(vertices[a as usize], vertices[b as usize], vertices[c as usize]) {
                return Err(ShapeError::ZeroArea { triangle, vertices: given });
            }
        }
        let mut names: Vec<u32> = welded.iter().flatten().copied().collect();
        names.sort_unstable();
        names.dedup();
        let mut number = vec![0; vertices.len()];
        (0..).zip(&names).for_each(|(new, &name)| number[name as usize] = new);
        let triangles: Vec<[u32; 3]> = welded.iter().map(|corners| corners.map(|k| number[k as usize])).collect();
        let edges = edges(&triangles, &names)?;
        let vertices = names.iter().map(|&name| vertices[name as usize] + DVec3::ZERO).collect();
        Ok(Self { vertices, names, triangles, edges })
    }

    /// The corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|k| self.vertices[k as usize])
    }

    /// The corner of a triangle that is not on an edge.
    pub fn opposite(&self, triangle: u32, edge: &SurfaceEdge) -> DVec3 {
        let corners = self.triangles[triangle as usize];
        let apex = corners.into_iter().find(|k| !edge.vertices.contains(k)).unwrap_or(corners[0]);
        self.vertices[apex as usize]
    }

    /// An edge as it is called outside.
    pub fn edge_name(&self, edge: &SurfaceEdge) -> [u32; 2] {
        edge.vertices.map(|k| self.names[k as usize])
    }

    /// Refuses a hole.
    pub fn check_closed(&self) -> Result<(), ShapeError> {
        let mut open = self.edges.iter().filter(|edge| edge.triangles.contains(&None));
        let Some(edge) = open.next() else { return Ok(()) };
        let triangle = edge.triangles.into_iter().flatten().next().unwrap_or(0) as usize;
        Err(ShapeError::Open { edge: self.edge_name(edge), triangle, count: 1 + open.count() })
    }

    /// Refuses what is not connected.
    pub fn check_connected(&self) -> Result<(), ShapeError> {
        let mut root: Vec<u32> = (0..self.vertices.len() as u32).collect();
        fn find(root: &mut [u32], mut k: u32) -> u32 {
            while root[k as usize] != k {
                root[k as usize] = root[root[k as usize] as usize];
                k = root[k as usize];
            }
            k
        }
        for edge in &self.edges {
            let [a, b] = edge.vertices.map(|k| find(&mut root, k));
            root[a.max(b) as usize] = a.min(b);
        }
        let firsts: Vec<u32> = (0..root.len() as u32).filter(|&k| root[k as usize] == k).collect();
        match firsts[..] {
            [first, second, ..] => Err(ShapeError::Pieces {
                count: firsts.len(),
                first: self.names[first as usize],
                second: self.names[second as usize],
            }),
            _ => Ok(()),
        }
    }
}

fn check_triangles(vertices: usize, triangles: &[[u32; 3]]) -> Result<(), ShapeError> {
    if triangles.is_empty() {
        return Err(ShapeError::Empty { what: "triangles" });
    }
    if triangles.len() > MOST_TRIANGLES {
        return Err(ShapeError::TooManyTriangles { count: triangles.len() });
    }
    let outside = |&vertex: &u32| vertex as usize >= vertices;
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(vertex) = corners.iter().copied().find(outside) {
            return Err(ShapeError::NoSuchVertex { triangle, vertex, count: vertices });
        }
    }
    Ok(())
}

/// For each vertex the first one that is at the same place.
fn first_at_the_same_place(vertices: &[DVec3]) -> Vec<u32> {
    let key = |k: &u32| (vertices[*k as usize] + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    order.sort_unstable_by_key(|k| (key(k), *k));
    let mut first = vec![0; vertices.len()];
    for group in order.chunk_by(|a, b| key(a) == key(b)) {
        group.iter().for_each(|&k| first[k as usize] = group[0]);
    }
    first
}

fn edges(triangles: &[[u32; 3]], names: &[u32]) -> Result<Vec<SurfaceEdge>, ShapeError> {
    let mut sides = Vec::with_capacity(3 * triangles.len());
    for (triangle, corners) in (0_u32..).zip(triangles) {
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            sides.push(([a.min(b), a.max(b)], a > b, triangle));
        }
    }
    sides.sort_unstable();
    let mut edges = Vec::new();
    for group in sides.chunk_by(|p, q| p.0 == q.0) {
        let edge = group[0].0.map(|k| names[k as usize]);
        let mut triangles = [None; 2];
        for &(_, against, triangle) in group {
            if group.len() > 2 {
                return Err(ShapeError::NonManifold { edge, count: group.len() });
            }
            if let Some(other) = triangles[usize::from(against)].replace(triangle) {
                return Err(ShapeError::Orientation { edge, triangles: [other as usize, triangle as usize] });
            }
        }
        edges.push(SurfaceEdge { vertices: group[0].0, triangles });
    }
    Ok(edges)
}
