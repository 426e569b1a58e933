//! The farthest corner of a polyhedron of many corners, found by climbing from one that is nearly the farthest.
//!
//! Directions are divided into cells, each with the corner that is farthest along its middle. From there it goes to the
//! highest neighbour until none is higher, so that which corner is found depends on the direction alone, and not on what was
//! looked for before. The triangles of the surface are convex but for rounding; along edges much shorter than a face is wide,
//! rounding could outweigh the slope of a nearly level face. So corners of one face are linked over 2, 4, 8, … others as well:
//! what is found is lower than the highest by a few ε of the size, as in the search through all.

use glam::DVec3;

use crate::shape::Polyhedron;

/// Up to so many corners, looking at all is faster than climbing (a count, measured).
pub const FEW_CORNERS: usize = 64;

/// Cells along the side of a cube's face, at most (a count).
const MOST_CELLS: usize = 64;

/// Faces with more corners have links across (a count).
const SMALL_FACE: usize = 6;

/// A way from a corner to another.
#[derive(Clone, Copy, Debug)]
struct Way {
    /// From the one to the other (m).
    along: DVec3,
    to: u32,
}

/// The ways between the corners, and where to start.
#[derive(Clone, Debug)]
pub struct Climb {
    ways: Vec<Way>,
    /// The ways from corner k are `ways[first[k]..first[k + 1]]`.
    first: Vec<u32>,
    cells: usize,
    /// Corners farthest along the middles of the cells of directions.
    starts: Vec<u32>,
    /// The faces and the edges at each corner.
    faces: Beside,
    edges: Beside,
}

/// What is at each corner: where that starts, and all of it, ascending.
#[derive(Clone, Debug, Default)]
struct Beside {
    first: Vec<u32>,
    all: Vec<u32>,
}

impl Beside {
    fn new<'a>(corners: usize, of: impl Iterator<Item = &'a [u32]>) -> Self {
        let mut pairs: Vec<(u32, u32)> =
            of.enumerate().flat_map(|(index, corners)| corners.iter().map(move |&k| (k, index as u32))).collect();
        pairs.sort_unstable();
        let first = (0..=corners as u32).map(|k| pairs.partition_point(|&(corner, _)| corner < k) as u32).collect();
        Self { first, all: pairs.into_iter().map(|(_, index)| index).collect() }
    }

    fn at(&self, corner: u32) -> &[u32] {
        &self.all[self.first[corner as usize] as usize..self.first[corner as usize + 1] as usize]
    }
}

/// Corners of a flat or nearly flat place that are gone through one by one; where there are more, all of the body are (a count).
const MOST_TIED: usize = 32;

/// Corners that are connected, and as high as each other.
pub struct Tied<'a> {
    climb: &'a Climb,
    corners: [u32; MOST_TIED],
    count: usize,
}

impl Tied<'_> {
    /// The first face whose corners are all among these.
    pub fn face(&self, polyhedron: &Polyhedron) -> Option<usize> {
        self.first(&self.climb.faces, |face| &polyhedron.faces[face].vertices)
    }

    /// The first edge whose ends are both among these.
    pub fn edge(&self, polyhedron: &Polyhedron) -> Option<usize> {
        self.first(&self.climb.edges, |edge| &polyhedron.edges[edge].vertices)
    }

    fn first<'a>(&self, beside: &Beside, corners: impl Fn(usize) -> &'a [u32]) -> Option<usize> {
        let tied = &self.corners[..self.count];
        let all_tied = |index: usize| corners(index).iter().all(|corner| tied.contains(corner));
        let beside = tied.iter().flat_map(|&corner| beside.at(corner));
        beside.map(|&index| index as usize).filter(|&index| all_tied(index)).min()
    }
}

impl Climb {
    /// Of a polyhedron.
    pub fn new(polyhedron: &Polyhedron) -> Self {
        let corners = polyhedron.vertices.len();
        let mut linked: Vec<Vec<u32>> = (0..corners as u32).map(|k| polyhedron.neighbours(k).to_vec()).collect();
        for face in polyhedron.faces.iter().filter(|face| face.vertices.len() > SMALL_FACE) {
            let count = face.vertices.len();
            for (place, &corner) in face.vertices.iter().enumerate() {
                let mut across = 2;
                while across <= count / 2 {
                    linked[corner as usize].push(face.vertices[(place + across) % count]);
                    linked[corner as usize].push(face.vertices[(place + count - across) % count]);
                    across *= 2;
                }
            }
        }
        let mut climb = Self {
            ways: Vec::new(),
            first: vec![0],
            cells: 0,
            starts: Vec::new(),
            faces: Beside::new(corners, polyhedron.faces.iter().map(|face| &face.vertices[..])),
            edges: Beside::new(corners, polyhedron.edges.iter().map(|edge| &edge.vertices[..])),
        };
        for (here, others) in linked.iter_mut().enumerate() {
            others.sort_unstable();
            others.dedup();
            let along = |to: u32| polyhedron.vertices[to as usize] - polyhedron.vertices[here];
            climb.ways.extend(others.iter().map(|&to| Way { along: along(to), to }));
            climb.first.push(climb.ways.len() as u32);
        }
        climb.cells = ((corners as f64 / 3.0).sqrt().ceil() as usize).min(MOST_CELLS);
        let cells = climb.cells;
        let middle = |cell: usize| 2.0 * (cell as f64 + 0.5) / cells as f64 - 1.0;
        climb.starts = (0..6 * cells * cells)
            .map(|cell| {
                let (side, u, v) = (cell / (cells * cells), cell / cells % cells, cell % cells);
                let mut direction = DVec3::ZERO;
                direction[side % 3] = if side < 3 { 1.0 } else { -1.0 };
                direction[(side + 1) % 3] = middle(u);
                direction[(side + 2) % 3] = middle(v);
                climb.top(polyhedron.support_vertex(direction), direction)
            })
            .collect();
        climb
    }

    /// The corner farthest along `direction` (any length but 0).
    #[inline(always)]
    pub fn farthest(&self, direction: DVec3) -> u32 {
        self.top(self.starts[self.cell(direction)], direction)
    }

    /// The corners for which `is_tied` holds: all of them, as those that are highest up to a tolerance are connected with the
    /// `highest`. Nothing if they are too many.
    pub fn tied(&self, highest: u32, is_tied: impl Fn(u32) -> bool) -> Option<Tied<'_>> {
        let mut tied = Tied { climb: self, corners: [highest; MOST_TIED], count: 1 };
        let mut looked_at = 0;
        while looked_at < tied.count {
            for way in self.ways(tied.corners[looked_at]) {
                if is_tied(way.to) && !tied.corners[..tied.count].contains(&way.to) {
                    *tied.corners.get_mut(tied.count)? = way.to;
                    tied.count += 1;
                }
            }
            looked_at += 1;
        }
        Some(tied)
    }

    #[inline(always)]
    fn ways(&self, corner: u32) -> &[Way] {
        &self.ways[self.first[corner as usize] as usize..self.first[corner as usize + 1] as usize]
    }

    /// The cell of a direction; of none, and of none that is finite, any.
    #[inline(always)]
    fn cell(&self, direction: DVec3) -> usize {
        let size = direction.abs();
        let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
        let across = [direction.y, direction.z, direction.x, direction.y];
        let scale = 0.5 * self.cells as f64 / size[axis];
        // Numbers become whole ones with NaN as 0 and the others cut off at the ends.
        let place = |x: f64| ((x * scale + 0.5 * self.cells as f64) as usize).min(self.cells - 1);
        let side = if direction[axis] < 0.0 { axis + 3 } else { axis };
        (side * self.cells + place(across[axis])) * self.cells + place(across[axis + 1])
    }

    /// Goes to the highest neighbour until there is none higher. Rises are taken along edges, not as differences of heights,
    /// which would be lost in rounding where edges are short.
    #[inline(always)]
    fn top(&self, mut corner: u32, direction: DVec3) -> u32 {
        // It takes far fewer steps; the bound is for a direction in which rounding makes everything equally high.
        for _ in 1..self.first.len() {
            let (mut highest, mut next) = (0.0, corner);
            for way in self.ways(corner) {
                let rise = direction.dot(way.along);
                (highest, next) = if rise > highest { (rise, way.to) } else { (highest, next) };
            }
            if next == corner {
                break;
            }
            corner = next;
        }
        corner
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use glam::{DMat3, DQuat};

    fn turned(points: Vec<DVec3>, random: &mut Random) -> Polyhedron {
        let [x, y, z, w] = [0; 4].map(|_| random.normal());
        let axes = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize());
        Polyhedron::from_points(&points).expect("a hull").seen_from(DVec3::ZERO, axes)
    }

    /// Pebbles, drums whose caps have thousands of corners, and a box full of corners along its edges; all turned, so that no
    /// face is flat to the last bit.
    fn bodies(random: &mut Random) -> Vec<Polyhedron> {
        let circle = |count: usize, k: usize| (std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
        let drum = |count: usize| -> Vec<DVec3> {
            let rim = |z: f64| (0..count).map(move |k| (k, z));
            let corner = |(k, z): (usize, f64)| DVec3::new(circle(count, k).1, circle(count, k).0, z);
            rim(-0.5).chain(rim(0.5)).map(corner).collect()
        };
        let pebble =
            |random: &mut Random, count: usize| (0..count).map(|_| random.normal_vector(3).normalize()).collect();
        let (small, large) = (pebble(random, 100), pebble(random, 1000));
        [small, large, drum(40), drum(1000), drum(5000)].map(|points| turned(points, random)).into()
    }

    fn highest(body: &Polyhedron, direction: DVec3) -> f64 {
        body.vertices.iter().map(|corner| corner.dot(direction)).fold(f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn climbing_finds_what_looking_at_all_finds() {
        let mut random = Random::new(5, 0);
        for body in bodies(&mut random) {
            let climb = Climb::new(&body);
            let mut directions: Vec<DVec3> = (0..2000).map(|_| random.normal_vector(3).normalize()).collect();
            directions.extend([DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z]);
            directions.extend(body.edges.iter().step_by(body.edges.len().div_ceil(500)).map(|edge| {
                (body.faces[edge.faces[0] as usize].normal + body.faces[edge.faces[1] as usize].normal).normalize()
            }));
            // Along the normal of a face all its corners tie; next to it they do nearly.
            for face in body.faces.iter().filter(|face| face.vertices.len() > 4).chain(&body.faces[..20]) {
                for tilt in [0.0, 1e-17, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-9, 1e-6] {
                    directions.extend((0..20).map(|_| (face.normal + random.normal_vector(3) * tilt).normalize()));
                }
            }
            let mut worst = 0.0_f64;
            for direction in directions {
                let found = body.vertices[climb.farthest(direction) as usize].dot(direction);
                worst = worst.max((highest(&body, direction) - found) / body.radius);
            }
            println!("{} corners: {worst:e}", body.vertices.len());
            // A tenth of the least tolerance there is, δ/2 = 4.5e-13 of the size; without the links across a face it is more.
            assert!(worst <= 4e-15, "{worst:e} with {} corners", body.vertices.len());
        }
    }

    #[test]
    fn what_ties_is_found_as_by_looking_at_all() {
        let mut random = Random::new(6, 0);
        let mut seen = [0; 3];
        for body in bodies(&mut random) {
            let climb = Climb::new(&body);
            let edges = body.edges.iter().step_by(body.edges.len().div_ceil(300));
            let of_edges = edges.map(|edge| {
                let [p, q] = edge.faces.map(|face| body.faces[face as usize].normal);
                p.lerp(q, random.uniform()).normalize()
            });
            let of_faces = body.faces.iter().step_by(body.faces.len().div_ceil(300)).map(|face| face.normal);
            let directions: Vec<DVec3> = of_edges.chain(of_faces).collect();
            for direction in directions {
                let corner = climb.farthest(direction);
                let least = body.vertices[corner as usize].dot(direction) - 1e-12 * body.radius;
                let is_tied = |k: u32| body.vertices[k as usize].dot(direction) >= least;
                let Some(tied) = climb.tied(corner, is_tied) else {
                    seen[2] += 1;
                    continue;
                };
                let all = |corners: &[u32]| corners.iter().all(|&k| is_tied(k));
                assert_eq!(tied.face(&body), body.faces.iter().position(|face| all(&face.vertices)));
                assert_eq!(tied.edge(&body), body.edges.iter().position(|edge| all(&edge.vertices)));
                seen[0] += usize::from(tied.face(&body).is_some());
                seen[1] += usize::from(tied.face(&body).is_none() && tied.edge(&body).is_some());
            }
        }
        assert!(seen.iter().all(|&count| count > 0), "{seen:?}");
    }
}
