//! How deep two bodies overlap, for messages: nothing of a run depends on it.

use glam::DVec3;

use super::distance::Pair;
use super::motion::Pose;
use super::solid::Core;

/// More pairs of edges than this are not tried one by one.
const MOST_EDGE_PAIRS: usize = 1 << 16;
/// Directions spread over the sphere, from the best of which the climb begins.
const SPREAD: usize = 512;
/// The last step (rad) of the climb.
const FINEST: f64 = 1e-9;

impl Pair<'_> {
    /// The largest gap (m) there is: negative by the depth of an overlap. Exact for polyhedra, whose best direction is that of
    /// a face or of two edges; otherwise the end of a climb from the best of many directions.
    pub fn largest_gap(&self) -> f64 {
        let mut best = (self.gap(self.unit_offset()).0, self.unit_offset());
        let mut consider = |direction: DVec3| {
            let length = direction.length();
            let gap = if length > 0.0 { self.gap(direction / length).0 } else { f64::NEG_INFINITY };
            if gap > best.0 {
                best = (gap, direction / length);
            }
        };
        face_normals(&self.a).for_each(|n| consider(-n));
        face_normals(&self.b).for_each(&mut consider);
        let edges = [edges_of(&self.a), edges_of(&self.b)];
        if edges[0].len() * edges[1].len() <= MOST_EDGE_PAIRS {
            for p in &edges[0] {
                for q in &edges[1] {
                    let across = p.cross(*q);
                    consider(across);
                    consider(-across);
                }
            }
        }
        for k in 0..SPREAD {
            // Fibonacci's spiral.
            let z = 1.0 - (2 * k + 1) as f64 / SPREAD as f64;
            let (sine, cosine) = libm::sincos(GOLDEN_ANGLE * k as f64);
            let around = (1.0 - z * z).sqrt();
            consider(DVec3::new(around * cosine, around * sine, z));
        }
        self.climb(best)
    }

    fn unit_offset(&self) -> DVec3 {
        let length = self.offset.length();
        if length > 0.0 { self.offset / length } else { DVec3::Z }
    }

    fn climb(&self, (mut gap, mut direction): (f64, DVec3)) -> f64 {
        let mut step = 0.1;
        while step > FINEST {
            let (x, y) = direction.any_orthonormal_pair();
            let tried = [x, -x, y, -y].map(|side| (direction + side * step).normalize());
            let next = tried
                .into_iter()
                .map(|n| (self.gap(n).0, n))
                .fold((gap, direction), |best, next| if next.0 > best.0 { next } else { best });
            if next.0 > gap {
                (gap, direction) = next;
            } else {
                step *= 0.5;
            }
        }
        gap
    }
}

/// π (3 − √5), in rad.
const GOLDEN_ANGLE: f64 = 2.399963229728653;

fn face_normals(pose: &Pose) -> impl Iterator<Item = DVec3> {
    let (faces, triangle) = match &pose.solid.core {
        Core::Polyhedron(_, polyhedron) => (&polyhedron.faces[..], None),
        Core::Triangle(triangle) => (&[][..], Some(triangle.normal())),
        _ => (&[][..], None),
    };
    let both_sides = triangle.into_iter().flat_map(|normal| [normal, -normal]);
    faces.iter().map(|face| face.normal).chain(both_sides).map(|normal| pose.to_world(normal))
}

fn edges_of(pose: &Pose) -> Vec<DVec3> {
    let polyhedron = match &pose.solid.core {
        Core::Polyhedron(_, polyhedron) => polyhedron,
        Core::Triangle(triangle) => {
            let [a, b, c] = triangle.corners;
            return [b - a, c - b, a - c].map(|edge| pose.to_world(edge)).to_vec();
        }
        _ => return Vec::new(),
    };
    let ends = polyhedron.edges.iter().map(|edge| edge.vertices.map(|k| polyhedron.vertices[k as usize]));
    ends.map(|[p, q]| pose.to_world(q - p)).collect()
}
