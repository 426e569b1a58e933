//! The convex hull of points, with exact topology.
//!
//! Points are added one by one, each the farthest above some facet (quickhull: Barber, Dobkin, Huhdanpaa, ACM Trans.
//! Math. Softw. 22 (1996) 469). Whether a point is above a facet is decided by the exact sign of a determinant, so the
//! result is the hull of these very numbers, whatever is coplanar, collinear or nearly so. A point exactly in the plane
//! of a facet is not above it: the facets that a point sees are then one patch with one horizon, and no new facet is
//! degenerate (a horizon edge in line with the point would lie in the plane of a facet that the point sees).

use glam::DVec3;

use super::exact::{collinear, side, twice_area};

/// A closed surface of triangles, counter-clockwise seen from outside.
pub(super) struct Hull {
    /// Three points each, by index.
    pub triangles: Vec<[u32; 3]>,
    /// The triangles across the edges 0–1, 1–2 and 2–0.
    pub neighbours: Vec<[u32; 3]>,
}

impl Hull {
    /// The points that are corners, in their order, and the hull in terms of these.
    pub fn with_corners_only(mut self, points: &[DVec3]) -> (Vec<DVec3>, Self) {
        let mut number = vec![NONE; points.len()];
        self.triangles.iter().flatten().for_each(|&k| number[k as usize] = 0);
        let mut corners = Vec::new();
        for (number, &point) in number.iter_mut().zip(points) {
            if *number != NONE {
                *number = corners.len() as u32;
                corners.push(point);
            }
        }
        for vertex in self.triangles.iter_mut().flatten() {
            *vertex = number[*vertex as usize];
        }
        (corners, self)
    }
}

/// Points that have no hull in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Flat {
    /// All on one line.
    Line,
    /// All in a plane of this normal.
    Plane(DVec3),
}

const NONE: u32 = u32::MAX;

struct Facet {
    vertices: [u32; 3],
    neighbours: [u32; 3],
    /// Points above this facet that are not yet in the hull, each on the list of one facet only.
    above: Vec<u32>,
    /// The last point that looked, and whether it saw the facet.
    looked: u32,
    seen: bool,
    gone: bool,
}

/// An edge of the horizon: between a facet that the point sees and one that it does not.
struct HorizonEdge {
    /// The facet beyond.
    beyond: u32,
    /// Which of its edges it is.
    edge: usize,
    /// The ends, in the order in which the near facet has them.
    vertices: [u32; 2],
}

struct Builder {
    points: Vec<DVec3>,
    facets: Vec<Facet>,
    /// Facets that may have points above them.
    waiting: Vec<u32>,
    /// Of the facets just made, the one whose first vertex is this point.
    starting_at: Vec<u32>,
}

/// The hull of `points`, which are all different, finite and sorted (by x, then y, then z). The same points give the same
/// triangles in the same order.
///
/// # Errors
/// [`Flat`] if they lie exactly on a line or in a plane.
pub(super) fn hull(points: &[DVec3]) -> Result<Hull, Flat> {
    let points = scaled(points);
    let corners = simplex(&points)?;
    let mut builder =
        Builder { starting_at: vec![NONE; points.len()], points, facets: Vec::new(), waiting: Vec::new() };
    builder.start(corners);
    while let Some(facet) = builder.waiting.pop() {
        if let Some(point) = builder.farthest_above(facet) {
            builder.add(point, facet);
        }
    }
    Ok(builder.finish())
}

/// The points times a power of two, the largest coordinate then being about 1; what is smaller than 2^-200 becomes 0,
/// so that no product of three coordinates, nor what rounding leaves of it, can underflow.
fn scaled(points: &[DVec3]) -> Vec<DVec3> {
    let largest = points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let factor = libm::exp2(-libm::floor(libm::log2(largest)));
    let smallest = libm::exp2(-200.0);
    let coordinate = |x: f64| if x.abs() * factor < smallest { 0.0 } else { x * factor };
    points.iter().map(|p| DVec3::new(coordinate(p.x), coordinate(p.y), coordinate(p.z))).collect()
}

/// Four points that span a volume, the fourth below the plane of the first three.
fn simplex(points: &[DVec3]) -> Result<[u32; 4], Flat> {
    let (a, b) = (points[0], points[points.len() - 1]);
    // What is positive by its exact sign stays so when its size underflows.
    let measure = |is_zero: bool, size: f64| if is_zero { 0.0 } else { f64::MIN_POSITIVE + size };
    let from_line = |p: DVec3| measure(collinear(a, b, p), (b - a).cross(p - a).length_squared());
    let third = largest(points, from_line).ok_or(Flat::Line)?;
    let c = points[third];
    let normal = twice_area(a, b, c);
    let from_plane = |p: DVec3| measure(side(a, b, c, p) == 0.0, normal.dot(p - a).abs());
    let fourth = largest(points, from_plane).ok_or(Flat::Plane(normal.normalize()))?;
    let last = points.len() - 1;
    let corners = [0, last as u32, third as u32, fourth as u32];
    let [p, q, r, s] = corners;
    Ok(if side(a, b, c, points[fourth]) < 0.0 { corners } else { [q, p, r, s] })
}

/// The first of the points whose measure is largest, if that is positive.
fn largest(points: &[DVec3], measure: impl Fn(DVec3) -> f64) -> Option<usize> {
    let mut best = (0.0, None);
    for (index, &point) in points.iter().enumerate() {
        let value = measure(point);
        if value > best.0 {
            best = (value, Some(index));
        }
    }
    best.1
}

impl Builder {
    /// The tetrahedron of four corners, and every other point on the list of a facet that it is above.
    fn start(&mut self, [a, b, c, d]: [u32; 4]) {
        let faces = [([a, b, c], [1, 2, 3]), ([b, a, d], [0, 3, 2]), ([c, b, d], [0, 1, 3]), ([a, c, d], [0, 2, 1])];
        for (vertices, neighbours) in faces {
            self.facets.push(Facet { vertices, neighbours, above: Vec::new(), looked: NONE, seen: false, gone: false });
        }
        let others: Vec<u32> = (0..self.points.len() as u32).filter(|k| ![a, b, c, d].contains(k)).collect();
        self.hand_out(others, 0);
    }

    fn is_above(&self, facet: u32, point: u32) -> bool {
        let [a, b, c] = self.facets[facet as usize].vertices.map(|k| self.points[k as usize]);
        side(a, b, c, self.points[point as usize]) > 0.0
    }

    /// Puts each point on the list of the first of the newest facets (from `first` on) that it is above. A point that
    /// is above none of them is inside the hull: the way out to it, from the middle of a facet that it was above,
    /// leaves through one.
    fn hand_out(&mut self, points: Vec<u32>, first: usize) {
        for point in points {
            if let Some(facet) = (first as u32..self.facets.len() as u32).find(|&facet| self.is_above(facet, point)) {
                self.facets[facet as usize].above.push(point);
            }
        }
        for facet in first..self.facets.len() {
            if !self.facets[facet].above.is_empty() {
                self.waiting.push(facet as u32);
            }
        }
    }

    /// The point on a facet's list that is farthest from it. Any of them would do; the farthest make the fewest facets.
    fn farthest_above(&self, facet: u32) -> Option<u32> {
        let Facet { vertices, above, gone, .. } = &self.facets[facet as usize];
        if *gone {
            return None;
        }
        let [a, b, c] = vertices.map(|k| self.points[k as usize]);
        let normal = (b - a).cross(c - a);
        let mut best = (f64::NEG_INFINITY, None);
        for &point in above {
            let height = normal.dot(self.points[point as usize] - a);
            if height > best.0 {
                best = (height, Some(point));
            }
        }
        best.1
    }

    /// Replaces the facets that `point` sees, `facet` among them, by those between it and their horizon.
    fn add(&mut self, point: u32, facet: u32) {
        let (seen, horizon) = self.look(point, facet);
        let first = self.facets.len();
        for &HorizonEdge { beyond, edge, vertices: [from, to] } in &horizon {
            let new = self.facets.len() as u32;
            self.facets[beyond as usize].neighbours[edge] = new;
            self.starting_at[from as usize] = new;
            self.facets.push(Facet {
                vertices: [from, to, point],
                neighbours: [beyond, NONE, NONE],
                above: Vec::new(),
                looked: NONE,
                seen: false,
                gone: false,
            });
        }
        for new in first..self.facets.len() {
            let next = self.starting_at[self.facets[new].vertices[1] as usize];
            self.facets[new].neighbours[1] = next;
            self.facets[next as usize].neighbours[2] = new as u32;
        }
        let mut orphans = Vec::new();
        for &facet in &seen {
            let facet = &mut self.facets[facet as usize];
            facet.gone = true;
            orphans.append(&mut facet.above);
            facet.above.shrink_to_fit();
        }
        orphans.retain(|&orphan| orphan != point);
        self.hand_out(orphans, first);
    }

    /// The facets that a point sees, and their horizon.
    fn look(&mut self, point: u32, from: u32) -> (Vec<u32>, Vec<HorizonEdge>) {
        let (mut seen, mut horizon) = (vec![from], Vec::new());
        self.facets[from as usize].looked = point;
        self.facets[from as usize].seen = true;
        let mut next = 0;
        while next < seen.len() {
            let near = seen[next];
            next += 1;
            for edge in 0..3 {
                let far = self.facets[near as usize].neighbours[edge];
                if self.facets[far as usize].looked != point {
                    let sees = self.is_above(far, point);
                    self.facets[far as usize].looked = point;
                    self.facets[far as usize].seen = sees;
                    if sees {
                        seen.push(far);
                    }
                }
                if !self.facets[far as usize].seen {
                    let vertices = self.facets[near as usize].vertices;
                    let [a, b] = [vertices[edge], vertices[(edge + 1) % 3]];
                    let from_b = self.facets[far as usize].vertices.iter().position(|&v| v == b).unwrap_or(0);
                    horizon.push(HorizonEdge { beyond: far, edge: from_b, vertices: [a, b] });
                }
            }
        }
        (seen, horizon)
    }

    /// What is left, numbered anew.
    fn finish(self) -> Hull {
        let mut number = vec![NONE; self.facets.len()];
        let mut count = 0;
        for (facet, number) in self.facets.iter().zip(&mut number) {
            if !facet.gone {
                *number = count;
                count += 1;
            }
        }
        let left = || self.facets.iter().filter(|facet| !facet.gone);
        Hull {
            triangles: left().map(|facet| facet.vertices).collect(),
            neighbours: left().map(|facet| facet.neighbours.map(|k| number[k as usize])).collect(),
        }
    }
}
