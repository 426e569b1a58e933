//! Impacts counted against Liouville's theorem: none missed, none invented.
//!
//! Free flight and elastic impacts keep the volume of phase space. If starts are drawn from the invariant measure, a run is
//! in it at every instant, and the mean number of impacts in a time is the flux through the surface of contact times that
//! time, whatever the dynamics and however short the time; likewise of impacts of each kind, and of grazing ones.
//! docs/explain/liouville.md derives what is expected. Contacts are looked at with geometry of this file alone: gap, kind,
//! normal, and w = n·K n.
//!
//! For `make validate`: `CAROM_LIOUVILLE_STARTS`, as many starts of each system; `CAROM_LIOUVILLE_SEED`, added to the seed of
//! each, so that the long count shares no start with the short one.
#![allow(missing_docs, clippy::unwrap_used)]

use std::f64::consts::PI;
use std::sync::Arc;

use carom::DVec3;
use carom::event::Kind;
use carom::random::Random;
use carom::record::Impact;
use carom::scene::{Scene, SolidBody};
use carom::shape::{BodyGeometry, Platonic, Shape};
use carom::simulation::Simulation;
use carom::world::Boundary;
use glam::{DMat3, DQuat};

mod support;
use support::{ball, balls, cube};

/// The standard errors that an average may be off. Of the 41 that are looked at, one is farther off by chance with a
/// probability of 0.3 %; and seeds are fixed.
const GATE: f64 = 4.0;

/// What a contact may be off (m): δ of these bodies is 4e-12 or less, and coordinates are below 10.
const CONTACT: f64 = 1e-11;

/// So near to where the kind of contact changes (m), rounding may decide which it is.
const BETWEEN_KINDS: f64 = 1e-9;

/// Impacts below which a share is too small for its scatter to be known (a count).
const FEW: f64 = 50.0;

/// What `make validate` asks for.
fn asked(name: &str) -> Option<usize> {
    std::env::var(name).ok().map(|text| text.parse().unwrap_or_else(|_| panic!("{name} is a number")))
}

fn starts(short: usize) -> usize {
    asked("CAROM_LIOUVILLE_STARTS").unwrap_or(short)
}

fn generator(seed: u64) -> Random {
    Random::new(seed + asked("CAROM_LIOUVILLE_SEED").unwrap_or(0) as u64, 0)
}

/// What was counted in each start, and what is to be expected; the scatter of starts is the measure of errors.
struct Tally {
    name: &'static str,
    rows: Vec<Row>,
    starts: usize,
    impacts: u64,
    /// Largest gap and deepest overlap (m) of an impact.
    gaps: [f64; 2],
    deepest_between: f64,
    wrong_kinds: u64,
    between_kinds: u64,
    wrong_normals: u64,
    worst_speed: f64,
    failures: Vec<String>,
    began: std::time::Instant,
}

struct Row {
    name: &'static str,
    expected: f64,
    /// Whether it is divided by the number of impacts.
    is_share: bool,
    /// Over starts, of the number and of its square; for shares, of how much more than expected there is.
    sums: [f64; 2],
    total: f64,
}

impl Tally {
    fn new(name: &'static str) -> Self {
        Self {
            name,
            rows: Vec::new(),
            starts: 0,
            impacts: 0,
            gaps: [f64::NEG_INFINITY; 2],
            deepest_between: f64::NEG_INFINITY,
            wrong_kinds: 0,
            between_kinds: 0,
            wrong_normals: 0,
            worst_speed: 0.0,
            failures: Vec::new(),
            began: std::time::Instant::now(),
        }
    }

    /// A number of each start.
    fn rate(&mut self, name: &'static str, expected: f64) {
        self.rows.push(Row { name, expected, is_share: false, sums: [0.0; 2], total: 0.0 });
    }

    /// A number of each impact.
    fn share(&mut self, name: &'static str, expected: f64) {
        self.rows.push(Row { name, expected, is_share: true, sums: [0.0; 2], total: 0.0 });
    }

    /// The sums of one start, in the order of the rows; `impacts` of them.
    fn add(&mut self, impacts: u64, seconds: f64, values: &[f64]) {
        assert_eq!(values.len(), self.rows.len());
        self.starts += 1;
        self.impacts += impacts;
        for (row, &value) in self.rows.iter_mut().zip(values) {
            // Shares: E[Σ (x - x̄)] over the impacts of a start is 0, however many there are.
            let value_of_start = if row.is_share { value - row.expected * impacts as f64 } else { value / seconds };
            row.sums[0] += value_of_start;
            row.sums[1] += value_of_start * value_of_start;
            row.total += value;
        }
    }

    fn report(&self) {
        let n = self.starts as f64;
        let of_start = self.impacts as f64 / n;
        println!("| {}: {} starts, {} impacts", self.name, self.starts, self.impacts);
        println!("took {:.1} s", self.began.elapsed().as_secs_f64());
        let mut worst = 0.0_f64;
        for row in &self.rows {
            let mean = row.sums[0] / n;
            let error = ((row.sums[1] / n - mean * mean) / (n - 1.0)).sqrt();
            let (measured, sigma, off) = if row.is_share {
                (row.total / self.impacts as f64, error / of_start, mean)
            } else {
                (mean, error, mean - row.expected)
            };
            let z = off / error;
            let too_few = row.is_share && row.expected * (self.impacts as f64) < FEW;
            worst = if too_few { worst } else { worst.max(z.abs()) };
            println!(
                "|   {:38} {:12.8} expected {:12.8} ± {:.8}  ({:+.4} %)  {}",
                row.name,
                measured,
                row.expected,
                sigma,
                100.0 * (measured / row.expected - 1.0),
                if too_few { "too few".into() } else { format!("z {z:+.2}") }
            );
        }
        println!(
            "|   gaps {:.1e} to {:.1e} m, at the ends of starts {:.1e} m or more; wrong kinds {}, normals {} \
             ({} between two kinds); speeds off by {:.1e}",
            -self.gaps[1],
            self.gaps[0],
            -self.deepest_between,
            self.wrong_kinds,
            self.wrong_normals,
            self.between_kinds,
            self.worst_speed
        );
        for failure in self.failures.iter().take(20) {
            println!("|   failed: {failure}");
        }
        assert!(self.failures.is_empty(), "{}: {} failures", self.name, self.failures.len());
        assert!(self.gaps[0] <= CONTACT && self.gaps[1] <= CONTACT && self.deepest_between <= CONTACT, "{}", self.name);
        assert!(self.worst_speed <= 1e-9, "{}", self.name);
        assert!(self.wrong_kinds == 0 && self.wrong_normals == 0, "{}", self.name);
        assert!(worst <= GATE, "{}: {worst} standard errors", self.name);
    }

    /// Looks at one contact: the gap by geometry of this file, and how far it is to where the kind changes.
    fn contact(&mut self, gap: f64, right: bool, normal_off: f64, margin: f64, tell: impl Fn() -> String) {
        self.gaps = [self.gaps[0].max(gap), self.gaps[1].max(-gap)];
        if margin < BETWEEN_KINDS {
            self.between_kinds += 1;
            return;
        }
        if !right {
            self.wrong_kinds += 1;
            self.failures.push(format!("kind {}", tell()));
        }
        // A gap of δ turns the normal of a corner by δ/R.
        if normal_off > 1e-9 {
            self.wrong_normals += 1;
            self.failures.push(format!("normal off by {normal_off:e}: {}", tell()));
        }
    }
}

fn uniform_place(random: &mut Random, side: f64) -> DVec3 {
    DVec3::new(random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5) * side
}

fn uniform_attitude(random: &mut Random) -> DQuat {
    let [x, y, z, w] = [0; 4].map(|_| random.normal());
    DQuat::from_xyzw(x, y, z, w).normalize()
}

fn quaternion(q: DQuat) -> [f64; 4] {
    [q.w, q.x, q.y, q.z]
}

fn axes([w, x, y, z]: [f64; 4]) -> DMat3 {
    DMat3::from_quat(DQuat::from_xyzw(x, y, z, w))
}

fn nearest_image(mut relative: DVec3, side: f64) -> DVec3 {
    for axis in 0..3 {
        relative[axis] -= (relative[axis] / side).round() * side;
    }
    relative
}

// --- A ball and a fixed body -----------------------------------------------------------------------------------------

#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    Face,
    Edge,
    Vertex,
}

/// A convex polyhedron from its corners, all by trying; or a segment of the z axis, with a radius.
struct Obstacle {
    faces: Vec<(DVec3, f64)>,
    edges: Vec<[DVec3; 2]>,
    radius: f64,
}

impl Obstacle {
    fn hull(corners: Vec<DVec3>) -> Self {
        let mut faces: Vec<(DVec3, f64)> = Vec::new();
        for i in 0..corners.len() {
            for j in 0..i {
                for k in 0..j {
                    let normal = (corners[i] - corners[k]).cross(corners[j] - corners[k]);
                    for normal in [normal.normalize_or_zero(), -normal.normalize_or_zero()] {
                        let offset = normal.dot(corners[k]);
                        let outside = corners.iter().any(|c| normal.dot(*c) > offset + 1e-9);
                        let known = faces.iter().any(|(other, _)| other.dot(normal) > 1.0 - 1e-9);
                        if normal != DVec3::ZERO && !outside && !known {
                            faces.push((normal, offset));
                        }
                    }
                }
            }
        }
        let on = |corner: DVec3| faces.iter().filter(move |(n, d)| (n.dot(corner) - d).abs() < 1e-9);
        let mut edges = Vec::new();
        for (i, &a) in corners.iter().enumerate() {
            for &b in &corners[..i] {
                if on(a).filter(|(n, d)| (n.dot(b) - d).abs() < 1e-9).count() == 2 {
                    edges.push([a, b]);
                }
            }
        }
        Self { faces, edges, radius: 0.0 }
    }

    fn tetrahedron(edge: f64) -> Self {
        let s = edge / 8.0_f64.sqrt();
        Self::hull(
            [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]]
                .map(|c| DVec3::from_array(c) * s)
                .to_vec(),
        )
    }

    fn cuboid(size: DVec3) -> Self {
        let sign = |bit: usize| if bit == 0 { -0.5 } else { 0.5 };
        Self::hull((0..8).map(|k| DVec3::new(sign(k & 1), sign(k & 2), sign(k & 4)) * size).collect())
    }

    fn capsule(radius: f64, half_length: f64) -> Self {
        let ends = [DVec3::Z * half_length, DVec3::NEG_Z * half_length];
        Self { faces: Vec::new(), edges: vec![ends], radius }
    }

    /// Distance of a point (negative or 0: within), the part that is nearest, the direction, and how far it is (m) to where
    /// another part is nearest.
    fn nearest(&self, point: DVec3) -> (f64, Part, DVec3, f64) {
        let mut best = (f64::INFINITY, Part::Vertex, DVec3::Z);
        let mut margin = f64::INFINITY;
        let heights = || self.faces.iter().map(|(n, d)| n.dot(point) - d);
        if !self.faces.is_empty() && heights().all(|height| height <= 0.0) {
            return (heights().fold(f64::NEG_INFINITY, f64::max), Part::Face, DVec3::Z, 0.0);
        }
        for edge in &self.edges {
            let (from, along) = (edge[0], edge[1] - edge[0]);
            let t = (point - from).dot(along) / along.length_squared();
            margin = margin.min(t.abs().min((1.0 - t).abs()) * along.length());
            let away = point - (from + along * t.clamp(0.0, 1.0));
            if away.length() < best.0 {
                let part = if t > 0.0 && t < 1.0 { Part::Edge } else { Part::Vertex };
                best = (away.length(), part, away.normalize());
            }
        }
        for (face, &(normal, offset)) in self.faces.iter().enumerate() {
            let height = normal.dot(point) - offset;
            let foot = point - normal * height;
            let within = self.faces.iter().enumerate().filter(|(k, _)| *k != face).map(|(_, (n, d))| d - n.dot(foot));
            let within = within.fold(f64::INFINITY, f64::min);
            margin = margin.min(within.abs());
            if height > 0.0 && within >= 0.0 && height <= best.0 + 1e-12 {
                best = (height, Part::Face, normal);
            }
        }
        (best.0 - self.radius, best.1, best.2, margin)
    }
}

/// A ball of speed 1 and a fixed body in a periodic box; the areas of the body inflated by the ball's radius, over faces (of
/// a capsule none), edges (its side) and corners (its ends), and its volume.
struct Billiard {
    name: &'static str,
    shape: Shape,
    obstacle: Obstacle,
    radius: f64,
    side: f64,
    areas: [f64; 3],
    excluded: f64,
    /// Whether the body stands along the axes.
    aligned: bool,
}

impl Billiard {
    /// Steiner's formulas: surface S, half the sum of edge length times exterior angle M, volume V of the fixed body.
    fn around_polyhedron(
        name: &'static str,
        (shape, obstacle): (Shape, Obstacle),
        (volume, surface, curvature): (f64, f64, f64),
        radius: f64,
        side: f64,
    ) -> Self {
        let excluded = volume + surface * radius + curvature * radius.powi(2) + 4.0 / 3.0 * PI * radius.powi(3);
        let areas = [surface, 2.0 * curvature * radius, 4.0 * PI * radius * radius];
        Self { name, shape, obstacle, radius, side, areas, excluded, aligned: false }
    }

    fn run(&self, starts: usize, impacts_of_start: f64, seed: u64) {
        let mut tally = Tally::new(self.name);
        let free = self.side.powi(3) - self.excluded;
        let rates = self.areas.map(|area| area / (4.0 * free));
        let rate: f64 = rates.iter().sum();
        let seconds = impacts_of_start / rate;
        let is_capsule = self.obstacle.radius > 0.0;
        tally.rate("impacts a second", rate);
        let parts = if is_capsule {
            ["(none)", "share: side", "share: ends"]
        } else {
            ["share: faces", "share: edges", "share: corners"]
        };
        for k in 0..3 {
            if rates[k] > 0.0 {
                tally.share(parts[k], rates[k] / rate);
            }
        }
        // Of a uniform beam through a surface, the square of the cosine of incidence is uniform in 0 … 1.
        tally.share("share: cos² of incidence < 0.01", 0.01);
        tally.share("share: cos² of incidence < 0.0001", 0.0001);
        tally.share("mean of cos² of incidence", 0.5);
        tally.share("mean of |cos| of incidence", 2.0 / 3.0);
        let geometry = Arc::new(BodyGeometry::new(&self.shape).unwrap());
        let mut random = generator(seed);
        for start in 0..starts {
            let attitude = if self.aligned { DQuat::IDENTITY } else { uniform_attitude(&mut random) };
            let at = uniform_place(&mut random, self.side);
            let turn = DMat3::from_quat(attitude);
            let place = loop {
                let place = uniform_place(&mut random, self.side);
                let relative = turn.transpose() * nearest_image(place - at, self.side);
                if self.obstacle.nearest(relative).0 > self.radius {
                    break place;
                }
            };
            let velocity = random.normal_vector(3).normalize();
            // Either may be A.
            let (id, other) = if start % 2 == 0 { (0, 1) } else { (1, 0) };
            let scene = Scene {
                domain: cube(Boundary::Periodic, self.side),
                balls: balls([ball(id, place, velocity, self.radius, 1.0)]),
                solids: vec![SolidBody {
                    id: other,
                    geometry: geometry.clone(),
                    position: at,
                    orientation: quaternion(attitude),
                    velocity: DVec3::ZERO,
                    angular_velocity: DVec3::ZERO,
                    mass: 1.0,
                    inertia: None,
                    material: 0,
                    fixed: true,
                }],
                ..Scene::default()
            };
            let mut simulation = Simulation::new(scene.build().unwrap().0, false);
            let end = simulation.world().clock.at(seconds);
            let (mut count, mut kinds, mut sums) = (0, [0.0; 3], [0.0; 4]);
            loop {
                let impact = match simulation.step(end) {
                    Ok(Some(impact)) => impact,
                    Ok(None) => break,
                    Err(error) => {
                        tally.failures.push(format!("start {start} after {count} impacts: {error}"));
                        break;
                    }
                };
                count += 1;
                let (mine, sign) = if id == 0 { (0, 1.0) } else { (1, -1.0) };
                let (center, before, after) =
                    (impact.positions[mine], impact.velocities[mine], impact.velocities[2 + mine]);
                let relative = turn.transpose() * nearest_image(center - at, self.side);
                let (distance, part, direction, margin) = self.obstacle.nearest(relative);
                let normal = impact.normal * sign;
                let recorded = match impact.kind {
                    Kind::BallFace => Some(Part::Face),
                    Kind::BallEdge | Kind::BallSide => Some(Part::Edge),
                    Kind::BallVertex => Some(Part::Vertex),
                    _ => None,
                };
                tally.contact(
                    distance - self.radius,
                    recorded == Some(part),
                    (turn * direction - normal).length(),
                    margin,
                    || {
                        format!(
                            "start {start}, impact {count}, {:?}, by this file {part:?}, margin {margin:e}",
                            impact.kind
                        )
                    },
                );
                kinds[part as usize] += 1.0;
                let cosine = -before.dot(turn * direction);
                tally.worst_speed = tally
                    .worst_speed
                    .max((after.dot(turn * direction) - cosine).abs())
                    .max((impact.approach_speed - cosine).abs());
                sums[0] += f64::from(cosine * cosine < 0.01);
                sums[1] += f64::from(cosine * cosine < 0.0001);
                sums[2] += cosine * cosine;
                sums[3] += cosine;
            }
            let row = simulation.world().row(id as usize);
            let place = simulation.world().position(row, simulation.now());
            let left = self.obstacle.nearest(turn.transpose() * nearest_image(place - at, self.side)).0;
            tally.deepest_between = tally.deepest_between.max(self.radius - left);
            let mut values = vec![count as f64];
            values.extend(kinds.iter().zip(rates).filter(|(_, rate)| *rate > 0.0).map(|(count, _)| *count));
            values.extend(sums);
            tally.add(count, seconds, &values);
        }
        tally.report();
    }
}

#[test]
fn a_ball_meets_a_fixed_tetrahedron_as_often_as_liouville_says() {
    let edge = 2.0_f64;
    let shape = Shape::from(Platonic::Tetrahedron.with_edge(edge).unwrap());
    // The exterior angle is π less the dihedral angle acos(1/3), at six edges.
    let curvature = 3.0 * edge * (PI - (1.0_f64 / 3.0).acos());
    let measures = (edge.powi(3) / 72.0_f64.sqrt(), 3.0_f64.sqrt() * edge * edge, curvature);
    let billiard = Billiard::around_polyhedron(
        "ball, fixed tetrahedron",
        (shape, Obstacle::tetrahedron(edge)),
        measures,
        0.3,
        4.7,
    );
    billiard.run(starts(5000), 5.0, 1);
}

const SIZE: DVec3 = DVec3::new(1.0, 2.0, 3.0);
const VOLUME: f64 = 6.0;
const SURFACE: f64 = 22.0;
const CURVATURE: f64 = PI * 6.0;

fn around_box(name: &'static str) -> Billiard {
    let shapes = (Shape::cuboid(SIZE).unwrap(), Obstacle::cuboid(SIZE));
    Billiard::around_polyhedron(name, shapes, (VOLUME, SURFACE, CURVATURE), 0.5, 7.2)
}

#[test]
fn a_ball_meets_a_fixed_box_as_often_as_liouville_says() {
    around_box("ball, fixed box").run(starts(5000), 5.0, 2);
}

#[test]
fn a_ball_meets_a_fixed_box_along_the_axes_as_often_as_liouville_says() {
    Billiard { aligned: true, ..around_box("ball, fixed box along the axes") }.run(starts(5000), 5.0, 3);
}

#[test]
fn a_ball_meets_a_fixed_capsule_as_often_as_liouville_says() {
    let (radius, half_length, of_ball) = (0.5, 1.0, 0.5);
    let reach = radius + of_ball;
    let billiard = Billiard {
        name: "ball, fixed capsule",
        shape: Shape::Capsule { radius, half_length },
        obstacle: Obstacle::capsule(radius, half_length),
        radius: of_ball,
        side: 6.1,
        areas: [0.0, 4.0 * PI * reach * half_length, 4.0 * PI * reach * reach],
        excluded: 2.0 * PI * reach * reach * half_length + 4.0 / 3.0 * PI * reach.powi(3),
        aligned: false,
    };
    billiard.run(starts(5000), 5.0, 4);
}

// --- Two free boxes --------------------------------------------------------------------------------------------------

/// ⟨∮ √(kT w/2π) dS⟩ of two 1 × 2 × 3 boxes of mass 1, kT = 1: corner on face, edge on edge (validation/contacts_of_boxes.py).
const FLUX: [f64; 2] = [37.820_621_282_824, 48.670_120_306_250];
/// Twice the energy of relative motion is χ² of nine degrees of freedom, and kept. Counts go as its root, whatever the
/// start, and u²/w as itself: so how far a start's energy is from the mean explains much of how far its counts are. Means of
/// √χ² and √χ²³: √2 Γ(5)/Γ(9/2) and √8 Γ(6)/Γ(9/2).
const MEAN_SPEED: f64 = 24.0 * std::f64::consts::SQRT_2 / HALF_INTEGER;
const MEAN_CUBE: f64 = 240.0 * std::f64::consts::SQRT_2 / HALF_INTEGER;
/// Γ(9/2).
const HALF_INTEGER: f64 = 11.631_728_396_567_448;
const PAIR_SIDE: f64 = 11.5;

/// The gap of two boxes by their separating axes, B's centre seen from A's; whether the best axis is an edge of each; the axis
/// to A; how much worse (m) the best of the others is.
fn gap_of_boxes(relative: DVec3, [a, b]: [&DMat3; 2]) -> (f64, bool, DVec3, f64) {
    let half = 0.5 * SIZE;
    let columns = |m: &DMat3| [m.x_axis, m.y_axis, m.z_axis];
    let reach = |m: &DMat3, d: DVec3| (0..3).map(|k| half[k] * columns(m)[k].dot(d).abs()).sum::<f64>();
    let mut best = (f64::NEG_INFINITY, false, DVec3::Z, 0.0);
    let mut look = |axis: DVec3, edges: bool| {
        let along = relative.dot(axis);
        let gap = along.abs() - reach(a, axis) - reach(b, axis);
        if gap > best.0 {
            best = (gap, edges, axis * -along.signum(), gap - best.0);
        } else {
            best.3 = best.3.min(best.0 - gap);
        }
    };
    for axis in columns(a).into_iter().chain(columns(b)) {
        look(axis, false);
    }
    for p in columns(a) {
        for q in columns(b) {
            let cross = p.cross(q);
            if cross.length() > 1e-9 {
                look(cross.normalize(), true);
            }
        }
    }
    best
}

#[test]
fn two_free_boxes_meet_as_often_as_liouville_says() {
    let excluded = 2.0 * VOLUME + SURFACE * CURVATURE / (2.0 * PI);
    let free = PAIR_SIDE.powi(3) - excluded;
    let rates = FLUX.map(|flux| flux / free);
    let rate = rates[0] + rates[1];
    let seconds = 5.0 / rate;
    let mut tally = Tally::new("two free boxes");
    tally.rate("impacts a second", rate);
    tally.rate("the same, less by the start's energy", rate);
    tally.share("share: corner on face", rates[0] / rate);
    tally.share("share: edge on edge", rates[1] / rate);
    // u/√w is Rayleigh: u²/2w has an exponential distribution.
    tally.share("share: u²/2w < 0.01", -(-0.01_f64).exp_m1());
    tally.share("share: u²/2w < 0.0001", -(-0.0001_f64).exp_m1());
    tally.share("mean of u²/w", 2.0);
    tally.share("the same, less by the start's energy", 2.0);
    tally.share("mean of |u|/√w", (PI / 2.0).sqrt());
    tally.share("the same, less by the start's energy", (PI / 2.0).sqrt());
    let geometry = Arc::new(BodyGeometry::new(&Shape::cuboid(SIZE).unwrap()).unwrap());
    let moments = (DVec3::splat(SIZE.length_squared()) - SIZE * SIZE) / 12.0;
    let mut random = generator(5);
    // Each costs twice as much.
    for start in 0..starts(5000) * 3 / 5 {
        let (places, attitudes) = loop {
            let places = [0; 2].map(|_| uniform_place(&mut random, PAIR_SIDE));
            let attitudes = [0; 2].map(|_| uniform_attitude(&mut random));
            let turns = attitudes.map(DMat3::from_quat);
            if gap_of_boxes(nearest_image(places[1] - places[0], PAIR_SIDE), [&turns[0], &turns[1]]).0 > 0.0 {
                break (places, attitudes);
            }
        };
        let velocities = [0; 2].map(|_| random.normal_vector(3));
        // √I ω along the axes.
        let spins = [0; 2].map(|_| random.normal_vector(3));
        let turning = spins[0].length_squared() + spins[1].length_squared();
        let energy = 0.5 * (velocities[0] - velocities[1]).length_squared() + turning;
        let solids = (0..2).map(|k| SolidBody {
            id: k as i64,
            geometry: geometry.clone(),
            position: places[k],
            orientation: quaternion(attitudes[k]),
            velocity: velocities[k],
            angular_velocity: attitudes[k] * (spins[k] / DVec3::from_array(moments.to_array().map(f64::sqrt))),
            mass: 1.0,
            inertia: None,
            material: 0,
            fixed: false,
        });
        let scene = Scene { domain: cube(Boundary::Periodic, PAIR_SIDE), solids: solids.collect(), ..Scene::default() };
        let mut simulation = Simulation::new(scene.build().unwrap().0, false);
        let end = simulation.world().clock.at(seconds);
        let (mut count, mut sums) = (0, [0.0; 6]);
        loop {
            let impact = match simulation.step(end) {
                Ok(Some(impact)) => impact,
                Ok(None) => break,
                Err(error) => {
                    tally.failures.push(format!("start {start} after {count} impacts: {error}"));
                    break;
                }
            };
            count += 1;
            let (world, now) = (simulation.world(), simulation.now());
            let rows = [0, 1].map(|rank| world.row(rank));
            let turns = rows.map(|row| axes(world.orientation(row, now)));
            let relative = nearest_image(impact.positions[1] - impact.positions[0], PAIR_SIDE);
            let (gap, edges, normal, margin) = gap_of_boxes(relative, [&turns[0], &turns[1]]);
            let recorded = match impact.kind {
                Kind::VertexFace => Some(false),
                Kind::EdgeEdge => Some(true),
                _ => None,
            };
            tally.contact(gap, recorded == Some(edges), (normal - impact.normal).length(), margin, || {
                format!(
                    "start {start}, impact {count}, {:?}, by this file edges: {edges}, margin {margin:e}",
                    impact.kind
                )
            });
            let (w, separation) = response(&impact, normal, &turns, moments, |k| {
                (world.velocity(rows[k], now), world.angular_velocity(rows[k], now))
            });
            tally.worst_speed = tally.worst_speed.max((separation - impact.approach_speed).abs());
            let square = separation * separation / w;
            sums[usize::from(edges)] += 1.0;
            sums[2] += f64::from(0.5 * square < 0.01);
            sums[3] += f64::from(0.5 * square < 0.0001);
            sums[4] += square;
            sums[5] += square.sqrt();
        }
        let (world, now) = (simulation.world(), simulation.now());
        let rows = [0, 1].map(|rank| world.row(rank));
        let turns = rows.map(|row| axes(world.orientation(row, now)));
        let relative = nearest_image(world.position(rows[1], now) - world.position(rows[0], now), PAIR_SIDE);
        tally.deepest_between = tally.deepest_between.max(-gap_of_boxes(relative, [&turns[0], &turns[1]]).0);
        // What the energy of this start makes more of the mean than there is in all.
        let expected = rate * seconds;
        let speed = energy.sqrt() / MEAN_SPEED;
        let more = expected * (speed - 1.0);
        let more_square = expected * 2.0 * (energy.powf(1.5) / MEAN_CUBE - speed);
        let more_root = expected * (PI / 2.0).sqrt() * (energy / 9.0 - speed);
        let [faces, edges, grazing, hardly, squares, roots] = sums;
        let all = count as f64;
        let values =
            [all, all - more, faces, edges, grazing, hardly, squares, squares - more_square, roots, roots - more_root];
        tally.add(count, seconds, &values);
    }
    tally.report();
}

/// w = n·K n and the speed of separation along n at the point of an impact, from masses, moments, attitudes and the state
/// after it.
fn response(
    impact: &Impact,
    normal: DVec3,
    turns: &[DMat3; 2],
    moments: DVec3,
    after: impl Fn(usize) -> (DVec3, DVec3),
) -> (f64, f64) {
    let (mut w, mut speed) = (0.0, 0.0);
    for (k, sign) in [(0, 1.0), (1, -1.0)] {
        let arm = impact.point - impact.positions[k];
        let moment = turns[k].transpose() * arm.cross(normal);
        w += 1.0 + (moment * moment / moments).element_sum();
        let (velocity, spin) = after(k);
        speed += sign * (velocity + spin.cross(arm)).dot(normal);
    }
    (w, speed)
}
