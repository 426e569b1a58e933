//! Convex polyhedra.

use glam::DVec3;

/// A convex polyhedron in the frame of its body.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyhedron {
    /// Corners (m).
    pub vertices: Vec<DVec3>,
    /// Flat faces, each with all its corners.
    pub faces: Vec<Face>,
    /// Where two faces meet.
    pub edges: Vec<Edge>,
    /// Distance (m) of the farthest corner from the centre of mass.
    pub radius: f64,
}

/// A flat face: normal · x = offset.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Outward unit normal.
    pub normal: DVec3,
    /// Distance (m) of its plane from the centre of mass.
    pub offset: f64,
    /// Its corners, counterclockwise seen from outside.
    pub vertices: Vec<u32>,
}

/// An edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// Its two ends.
    pub vertices: [u32; 2],
    /// The two faces that meet in it.
    pub faces: [u32; 2],
}

impl Polyhedron {
    /// From corners and the corners of each face, counterclockwise seen from outside.
    fn of_faces(vertices: Vec<DVec3>, loops: &[&[u32]]) -> Self {
        let faces: Vec<Face> = loops
            .iter()
            .map(|corners| {
                let at = |k: usize| vertices[corners[k] as usize];
                let normal = (at(1) - at(0)).cross(at(2) - at(0)).normalize();
                Face { normal, offset: normal.dot(at(0)), vertices: corners.to_vec() }
            })
            .collect();
        let mut edges: Vec<Edge> = Vec::new();
        for (f, face) in faces.iter().enumerate() {
            for k in 0..face.vertices.len() {
                let (from, to) = (face.vertices[k], face.vertices[(k + 1) % face.vertices.len()]);
                match edges.iter_mut().find(|edge| edge.vertices == [to, from]) {
                    Some(edge) => edge.faces[1] = f as u32,
                    None => edges.push(Edge { vertices: [from, to], faces: [f as u32, f as u32] }),
                }
            }
        }
        let radius = vertices.iter().fold(0.0, |largest: f64, v| largest.max(v.length()));
        Self { vertices, faces, edges, radius }
    }

    /// A box with edges `size` (m) along x, y, z.
    pub fn cuboid(size: DVec3) -> Self {
        let h = 0.5 * size;
        let vertices = (0..8)
            .map(|k| {
                let sign = |bit: u32| if k & bit != 0 { 1.0 } else { -1.0 };
                h * DVec3::new(sign(1), sign(2), sign(4))
            })
            .collect();
        let loops: [&[u32]; 6] =
            [&[1, 3, 7, 5], &[0, 4, 6, 2], &[2, 6, 7, 3], &[0, 1, 5, 4], &[4, 5, 7, 6], &[0, 2, 3, 1]];
        Self::of_faces(vertices, &loops)
    }

    /// A regular tetrahedron with edges of `edge` (m).
    pub fn tetrahedron(edge: f64) -> Self {
        let s = edge / 8.0_f64.sqrt();
        let vertices = vec![DVec3::new(s, s, s), DVec3::new(s, -s, -s), DVec3::new(-s, s, -s), DVec3::new(-s, -s, s)];
        let loops: [&[u32]; 4] = [&[0, 1, 2], &[0, 2, 3], &[0, 3, 1], &[1, 3, 2]];
        Self::of_faces(vertices, &loops)
    }
}
