//! The five regular polyhedra.

use glam::DVec3;

use super::error::ShapeError;
use super::polyhedron::{Polyhedron, check_length};

/// A regular polyhedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Platonic {
    /// Four triangles.
    Tetrahedron,
    /// Six squares.
    Cube,
    /// Eight triangles.
    Octahedron,
    /// Twelve pentagons.
    Dodecahedron,
    /// Twenty triangles.
    Icosahedron,
}

impl Platonic {
    /// All five.
    pub const ALL: [Self; 5] = [Self::Tetrahedron, Self::Cube, Self::Octahedron, Self::Dodecahedron, Self::Icosahedron];

    /// The solid with edges of this length (m), centred.
    ///
    /// # Errors
    /// A length that is not positive and finite.
    pub fn with_edge(self, length: f64) -> Result<Polyhedron, ShapeError> {
        check_length("edge", length)?;
        self.scaled(length / self.edge())
    }

    /// The solid whose corners are this far from its centre (m), centred.
    ///
    /// # Errors
    /// A radius that is not positive and finite.
    pub fn with_circumradius(self, radius: f64) -> Result<Polyhedron, ShapeError> {
        check_length("radius", radius)?;
        self.scaled(radius / self.corners()[0].length())
    }

    fn scaled(self, factor: f64) -> Result<Polyhedron, ShapeError> {
        let corners: Vec<DVec3> = self.corners().into_iter().map(|corner| corner * factor).collect();
        Polyhedron::from_points(&corners)
    }

    /// Corners of a copy with coordinates 0, ±1, and powers of the golden ratio (Coxeter, Regular Polytopes, 3.7).
    fn corners(self) -> Vec<DVec3> {
        let golden = golden_ratio();
        let cube = || signs().map(|[x, y, z]| DVec3::new(x, y, z));
        match self {
            Self::Tetrahedron => cube().filter(|v| v.x * v.y * v.z > 0.0).collect(),
            Self::Cube => cube().collect(),
            Self::Octahedron => rotations(1.0, 0.0, 0.0),
            Self::Dodecahedron => cube().chain(rotations(0.0, 1.0 / golden, golden)).collect(),
            Self::Icosahedron => rotations(0.0, 1.0, golden),
        }
    }

    /// Edge length of that copy.
    fn edge(self) -> f64 {
        match self {
            Self::Tetrahedron => 8.0_f64.sqrt(),
            Self::Cube | Self::Icosahedron => 2.0,
            Self::Octahedron => 2.0_f64.sqrt(),
            Self::Dodecahedron => 2.0 / golden_ratio(),
        }
    }
}

/// (1 + √5)/2.
fn golden_ratio() -> f64 {
    0.5 * (1.0 + 5.0_f64.sqrt())
}

/// The eight combinations of signs.
fn signs() -> impl Iterator<Item = [f64; 3]> {
    (0..8_u32).map(|k| [0, 1, 2].map(|bit| if k >> bit & 1 == 0 { -1.0 } else { 1.0 }))
}

/// (x, y, z) with all signs and in cyclic orders, repeated where a coordinate is 0.
fn rotations(x: f64, y: f64, z: f64) -> Vec<DVec3> {
    let cyclic = [DVec3::new(x, y, z), DVec3::new(y, z, x), DVec3::new(z, x, y)];
    cyclic.into_iter().flat_map(|v| signs().map(move |[x, y, z]| v * DVec3::new(x, y, z))).collect()
}
