//! Where two touching bodies touch: their features, the normal, and the points of the contact.

use glam::DVec3;

use super::bound::{Motion, turning_of_normal};
use super::distance::{Pair, Separation};
use super::motion::Pose;
use super::solid::{Core, Corners, Solid};
use crate::tolerance::SUNK;

/// The part of a surface that is in contact. Indices are those of the shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Feature {
    /// A flat face; of a half-space its plane, 0.
    Face(u32),
    /// The flat end of a cylinder, 0 below, 1 above.
    Cap(u32),
    /// The straight side of a capsule or cylinder.
    Side,
    /// An edge.
    Edge(u32),
    /// The rim of a cylinder, 0 below, 1 above.
    Rim(u32),
    /// The smooth surface of a ball or ellipsoid.
    Surface,
    /// A corner; of a capsule an end, 0 below, 1 above.
    Vertex(u32),
}

/// Corners of a face, or points of a rim, that are told apart. Of a face with more every second is left out, and so on.
const OUTLINE: usize = 16;

/// Points of a cap that stand for its circle.
const CAP_POINTS: usize = 8;

/// Contact points kept; faces with many corners may have more, of which the first that approach count.
pub const POINTS: usize = 16;

/// How far (m) the gap of two round bodies may be off by rounding: the direction from core to core, whose distance is the sum of
/// their radii, is known to the digits of where their points are, and goes with how far they reach. Of needles only is it above δ.
fn gap_rounding(pair: &Pair) -> f64 {
    let (a, b) = (pair.a.solid, pair.b.solid);
    let radii = a.rounding + b.rounding;
    if radii == 0.0 || b.is_half_space() {
        return 0.0;
    }
    let reach = a.reach() + b.reach();
    8.0 * f64::EPSILON * (pair.offset.length() + reach) * reach / radii
}

/// The corners of what touches, in order around a face; relative to the centre of B, world axes.
struct Outline {
    feature: Feature,
    points: [DVec3; OUTLINE],
    count: usize,
    endless: bool,
    /// Of a triangle the sides, by their bits, beyond which its plane goes on.
    seams: u8,
}

impl Outline {
    fn new(feature: Feature) -> Self {
        Self { feature, points: [DVec3::ZERO; OUTLINE], count: 0, endless: false, seams: 0 }
    }

    fn push(&mut self, point: DVec3) {
        if self.count < OUTLINE {
            self.points[self.count] = point;
            self.count += 1;
        }
    }

    fn points(&self) -> &[DVec3] {
        &self.points[..self.count]
    }

    fn shift(&mut self, by: DVec3) {
        self.points[..self.count].iter_mut().for_each(|point| *point += by);
    }

    /// Sides from corner to corner; an edge has one.
    fn sides(&self) -> impl Iterator<Item = (DVec3, DVec3)> + '_ {
        let count = if self.count == 2 { 1 } else { self.count };
        (0..count).map(move |k| (self.points[k], self.points[(k + 1) % self.count]))
    }

    /// Distance (m) of a point in this outline from its sides, or from its ends; infinite where there are none.
    fn border(&self, point: DVec3, normal: DVec3) -> f64 {
        if self.count == 2 {
            return self.points().iter().fold(f64::INFINITY, |least, end| least.min((point - end).length()));
        }
        let from = |(p, q): (DVec3, DVec3)| (normal.dot((q - p).cross(point - p)) / (q - p).length()).abs();
        let ends = self.sides().enumerate().filter(|(k, _)| k >= &8 || self.seams >> k & 1 == 0);
        if self.count < 2 { f64::INFINITY } else { ends.map(|(_, side)| from(side)).fold(f64::INFINITY, f64::min) }
    }

    /// Whether `point` lies in this outline, seen along `normal`, up to `tolerance` (m).
    fn holds(&self, point: DVec3, normal: DVec3, tolerance: f64) -> bool {
        if self.endless {
            return true;
        }
        let flat = |v: DVec3| v - normal * normal.dot(v);
        match self.count {
            0 | 1 => false,
            2 => {
                let (p, along) = (self.points[0], flat(self.points[1] - self.points[0]));
                let length = along.length();
                let direction = along / length;
                let (from, share) = (flat(point - p), direction.dot(point - p));
                (from - direction * share).length() <= tolerance && share >= -tolerance && share <= length + tolerance
            }
            _ => {
                let mut signs = [false; 2];
                for (p, q) in self.sides() {
                    let side = flat(q - p);
                    let height = normal.dot(side.cross(point - p)) / side.length();
                    signs[0] |= height > tolerance;
                    signs[1] |= height < -tolerance;
                }
                !(signs[0] && signs[1])
            }
        }
    }
}

/// What of a solid supports it in `direction` (unit vector, frame of the body), up to `tolerance` (m).
fn outline(solid: &Solid, direction: DVec3, tolerance: f64, place: &dyn Fn(DVec3) -> DVec3) -> Outline {
    let support = solid.support(direction);
    let mut result = Outline::new(Feature::Surface);
    match &solid.core {
        Core::Placed(placed) => {
            let place = |point| place(placed.to_body(point));
            return outline(&placed.solid, placed.to_solid(direction), tolerance, &place);
        }
        Core::Point | Core::Ellipsoid(_) => result.push(place(support.point)),
        Core::HalfSpace => {
            result.feature = Feature::Face(0);
            result.endless = true;
        }
        Core::Segment(half_length) => {
            if 2.0 * (half_length * direction.z).abs() <= tolerance {
                result.feature = Feature::Side;
                result.push(place(DVec3::new(0.0, 0.0, -half_length)));
                result.push(place(DVec3::new(0.0, 0.0, *half_length)));
            } else {
                result.feature = Feature::Vertex(support.index);
                result.push(place(support.point));
            }
        }
        Core::Cylinder { radius, half_length } => {
            let flat = (direction.x * direction.x + direction.y * direction.y).sqrt();
            if 2.0 * flat * radius <= tolerance {
                result.feature = Feature::Cap(support.index);
                let z = if support.index == 1 { *half_length } else { -half_length };
                for k in 0..CAP_POINTS {
                    let (sine, cosine) = libm::sincos(std::f64::consts::TAU * k as f64 / CAP_POINTS as f64);
                    result.push(place(DVec3::new(radius * cosine, radius * sine, z)));
                }
            } else if 2.0 * (half_length * direction.z).abs() <= tolerance {
                result.feature = Feature::Side;
                let p = support.point;
                result.push(place(DVec3::new(p.x, p.y, -half_length)));
                result.push(place(DVec3::new(p.x, p.y, *half_length)));
            } else {
                result.feature = Feature::Rim(support.index);
                result.push(place(support.point));
            }
        }
        Core::Triangle(triangle) => {
            let least = support.point.dot(direction) - tolerance;
            let tied = triangle.corners.map(|corner| corner.dot(direction) >= least);
            let first = support.index as usize;
            let edge = [first, (first + 2) % 3].into_iter().find(|&k| tied[k] && tied[(k + 1) % 3]);
            let corners = match edge {
                _ if tied == [true; 3] => {
                    result.feature = Feature::Face(0);
                    result.seams = (0..3).fold(0, |seams, k| seams | u8::from(triangle.goes_on_flat(k)) << k);
                    &triangle.corners[..]
                }
                Some(edge) => {
                    result.feature = Feature::Edge(edge as u32);
                    &[triangle.corners[edge], triangle.corners[(edge + 1) % 3]]
                }
                None => {
                    result.feature = Feature::Vertex(support.index);
                    &[support.point]
                }
            };
            corners.iter().for_each(|&corner| result.push(place(corner)));
        }
        Core::Polyhedron(corners, polyhedron) => {
            let corner = |k: u32| polyhedron.vertices[k as usize];
            let least = support.point.dot(direction) - tolerance;
            let tied = |k: u32| corner(k).dot(direction) >= least;
            let near = match corners {
                Corners::Many(climb) => climb.tied(support.index, tied),
                _ => None,
            };
            let face = match &near {
                Some(near) => near.face(polyhedron),
                None => polyhedron.faces.iter().position(|face| face.vertices.iter().all(|&k| tied(k))),
            };
            if let Some(face) = face {
                result.feature = Feature::Face(face as u32);
                let loop_of = &polyhedron.faces[face].vertices;
                for &k in loop_of.iter().step_by(loop_of.len().div_ceil(OUTLINE)) {
                    result.push(place(corner(k)));
                }
                return result;
            }
            let edge = match &near {
                Some(near) => near.edge(polyhedron),
                None => polyhedron.edges.iter().position(|edge| edge.vertices.iter().all(|&k| tied(k))),
            };
            match edge {
                Some(edge) => {
                    result.feature = Feature::Edge(edge as u32);
                    for k in polyhedron.edges[edge].vertices {
                        result.push(place(corner(k)));
                    }
                }
                None => {
                    result.feature = Feature::Vertex(support.index);
                    result.push(place(support.point));
                }
            }
        }
    }
    result
}

/// One point of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactPoint {
    /// Where (m), seen from the centre of B, world axes.
    pub from_b: DVec3,
    /// The same seen from the centre of A.
    pub from_a: DVec3,
    /// −(v_A − v_B)·n of the bodies' points there (m/s); > 0: they approach.
    pub approach_speed: f64,
}

/// A contact of two bodies: one normal, and the corners of the area, or the ends of the line, or the point in which they touch.
#[derive(Clone, Copy, Debug)]
pub struct Contact {
    /// Unit vector from B to A, world axes.
    pub normal: DVec3,
    /// What touches, of A and of B.
    pub features: [Feature; 2],
    /// The points.
    pub points: [ContactPoint; POINTS],
    /// How many; at least 1.
    pub count: usize,
    /// How far (m) the point that approaches fastest lies from where what touches ends: 0 where a corner meets a corner or edge.
    /// Infinite on surfaces without corners. Within rounding of it, the bodies may pass without touching.
    pub margin: f64,
    /// The smallest radius of curvature (m) of what touches, over which bodies slide: v²/R is how fast they part again. Where a
    /// rim meets an edge or rim nearly along itself it is as good as a corner: R times the square of the sine between them.
    pub curvature_radius: f64,
    /// How the normal turns (rad/s) with what touches at the point that approaches fastest.
    pub turning: DVec3,
    /// Whether B is a triangle that is touched where its neighbours are, so that the normal is theirs: see
    /// [`crate::shape::Touchable`].
    pub is_beside: bool,
    /// Whether the bodies are deeper in each other than a fresh impact can find them. What was parted gets no deeper than
    /// rounding, or than δ/2 where it was touching already; so they have met again and again without parting, as what rests does.
    pub is_sunk: bool,
}

impl Contact {
    /// The points.
    pub fn points(&self) -> &[ContactPoint] {
        &self.points[..self.count]
    }

    /// Adds points of other parts of the same bodies, as far as there is room, but for those within `tolerance` (m) of one known.
    pub fn add_points(&mut self, points: &[ContactPoint], tolerance: f64) {
        for point in points {
            let known = self.points().iter().any(|other| (other.from_b - point.from_b).length() <= tolerance);
            if !known && self.count < POINTS {
                self.points[self.count] = *point;
                self.count += 1;
            }
        }
    }

    /// The same contact with A and B exchanged.
    pub fn swapped(&self) -> Self {
        let mut result = *self;
        result.normal = -self.normal;
        result.features = [self.features[1], self.features[0]];
        for point in &mut result.points {
            (point.from_a, point.from_b) = (point.from_b, point.from_a);
        }
        result
    }

    /// The largest approach speed of the points (m/s).
    pub fn approach_speed(&self) -> f64 {
        self.points().iter().fold(f64::NEG_INFINITY, |most, point| most.max(point.approach_speed))
    }

    /// Speed (m/s) at which the bodies slide over each other at the first point, or at which the centres of curvature there pass
    /// each other if that is more: it is theirs that counts for how soon round bodies part, and a spin can hide it.
    pub fn sliding_speed(&self, pair: &Pair, motion: &Motion) -> f64 {
        let (n, point) = (self.normal, &self.points[0]);
        let across = |a: DVec3, b: DVec3| {
            let velocity = motion.velocity + pair.a.angular_velocity.cross(a) - pair.b.angular_velocity.cross(b);
            (velocity - n * n.dot(velocity)).length()
        };
        let inside = |solid: &Solid| n * if solid.sharpest().is_finite() { solid.sharpest() } else { 0.0 };
        let centres = across(point.from_a + inside(pair.a.solid), point.from_b - inside(pair.b.solid));
        across(point.from_a, point.from_b).max(centres)
    }

    /// Where bodies touch whose gap in the direction of `separation` is within `tolerance` (m).
    ///
    /// The normal is that of a face in contact (of B before A), else n = ±b × a for two edges that cross, else the separating
    /// direction itself: of a smooth surface it is the normal, and for corners that meet corners or edges, where the normal is
    /// any of a cone, it is the rule.
    pub fn of(pair: &Pair, motion: &Motion, separation: &Separation, tolerance: f64) -> Self {
        let rough = separation.normal;
        let place_a = |p| pair.offset + pair.a.to_world(p) - rough * pair.a.solid.rounding;
        let place_b = |p| pair.b.to_world(p) + rough * pair.b.solid.rounding;
        let mut a = outline(pair.a.solid, -pair.a.to_body(rough), tolerance, &place_a);
        let mut b = outline(pair.b.solid, pair.b.to_body(rough), tolerance, &place_b);
        let asked = normal(pair, &a, &b, rough);
        a.shift((rough - asked) * pair.a.solid.rounding);
        b.shift((asked - rough) * pair.b.solid.rounding);
        let normal = touchable(pair, &b, asked);
        let is_beside = normal != asked;
        let on_face = is_beside && triangle_normal(&pair.b).is_some_and(|n| n == normal || n == -normal);
        let mut contact = Self {
            normal,
            features: [a.feature, if on_face { Feature::Face(0) } else { b.feature }],
            points: [ContactPoint::default(); POINTS],
            count: 0,
            margin: f64::INFINITY,
            curvature_radius: curvature_radius(pair, &a, &b, normal),
            turning: DVec3::ZERO,
            is_beside,
            is_sunk: !is_beside && pair.gap(normal).0.max(separation.gap) < -SUNK * tolerance - gap_rounding(pair),
        };
        let mut fastest = f64::NEG_INFINITY;
        let mut add = |point: DVec3, turning: &dyn Fn() -> DVec3| {
            let known = contact.points().iter().any(|other| (other.from_b - point).length() <= 2.0 * tolerance);
            if contact.count == POINTS || known {
                return;
            }
            let from_a = point - pair.offset;
            let velocity =
                motion.velocity + pair.a.angular_velocity.cross(from_a) - pair.b.angular_velocity.cross(point);
            let approach_speed = -velocity.dot(normal);
            contact.points[contact.count] = ContactPoint { from_b: point, from_a, approach_speed };
            contact.count += 1;
            if approach_speed > fastest {
                fastest = approach_speed;
                contact.turning = turning();
            }
        };
        each_point(pair, &a, &b, normal, tolerance, separation, &mut add);
        if !pair.a.solid.is_smooth() && !pair.b.solid.is_smooth() {
            contact.margin = contact.margin_of(&a, &b).min(contact.curvature_radius);
        }
        contact
    }

    /// See [`Contact::margin`]. Where several points approach, it is half their distance, but of faces that meet in a line 0.
    fn margin_of(&self, a: &Outline, b: &Outline) -> f64 {
        let is_face = |outline: &Outline| outline.endless || outline.count > 2;
        if is_face(a) && is_face(b) && self.count < 3 {
            return 0.0;
        }
        let fastest = self.approach_speed();
        let mut approaching = self.points().iter().filter(|point| point.approach_speed >= 0.5 * fastest.abs());
        let Some(first) = approaching.next() else { return 0.0 };
        let extent = approaching.map(|point| 0.5 * (point.from_b - first.from_b).length()).fold(0.0, f64::max);
        let inside = if is_generic(a, b) {
            let point = self.points().iter().find(|point| point.approach_speed == fastest).unwrap_or(first);
            a.border(point.from_b, self.normal).min(b.border(point.from_b, self.normal))
        } else {
            0.0
        };
        extent.max(inside)
    }
}

/// See [`Contact::curvature_radius`].
fn curvature_radius(pair: &Pair, a: &Outline, b: &Outline, normal: DVec3) -> f64 {
    let along = |pose: &Pose, outline: &Outline| match outline.feature {
        Feature::Rim(_) => Some(pose.to_world.z_axis.cross(normal).normalize_or_zero()),
        _ if outline.count == 2 => Some((outline.points[1] - outline.points[0]).normalize_or_zero()),
        _ => None,
    };
    let least = pair.a.solid.sharpest().min(pair.b.solid.sharpest());
    match (along(&pair.a, a), along(&pair.b, b)) {
        (Some(along_a), Some(along_b)) if least.is_finite() => least * along_a.cross(along_b).length_squared(),
        _ => least,
    }
}

/// Whether neither a corner meets a corner, a rim or an edge.
fn is_generic(a: &Outline, b: &Outline) -> bool {
    let pointed = |outline: &Outline| matches!(outline.feature, Feature::Vertex(_) | Feature::Rim(_));
    let of = |first: &Outline, second: &Outline| match first.feature {
        Feature::Vertex(_) => !(pointed(second) || matches!(second.feature, Feature::Edge(_))),
        _ => true,
    };
    of(a, b) && of(b, a)
}

/// See [`Contact::of`].
fn normal(pair: &Pair, a: &Outline, b: &Outline, rough: DVec3) -> DVec3 {
    let face_of = |pose: &Pose, feature: Feature| match (feature, &pose.solid.core) {
        (Feature::Face(_), Core::HalfSpace) => Some(pose.to_world.z_axis),
        (Feature::Face(k), Core::Polyhedron(_, polyhedron)) => Some(pose.to_world(polyhedron.faces[k as usize].normal)),
        (Feature::Face(_), Core::Triangle(_)) => triangle_normal(pose),
        (Feature::Cap(_), Core::Placed(placed)) => Some(pose.to_world(placed.axes.z_axis)),
        (Feature::Cap(_), _) => Some(pose.to_world.z_axis),
        _ => None,
    };
    let toward_a = |n: DVec3| if n.dot(rough) < 0.0 { -n } else { n };
    if let Some(n) = face_of(&pair.b, b.feature).or_else(|| face_of(&pair.a, a.feature)) {
        return toward_a(n);
    }
    let straight = |outline: &Outline| outline.count == 2;
    if straight(a) && straight(b) {
        let (along_a, along_b) = (a.points[1] - a.points[0], b.points[1] - b.points[0]);
        let cross = along_b.cross(along_a);
        let length = cross.length();
        if length > PARALLEL * along_a.length() * along_b.length() {
            return toward_a(cross / length);
        }
    }
    between_cores(pair, a, b, rough).unwrap_or(rough)
}

/// The direction from B's core to A's where one of them is a point of it and the other a point or a line: of round bodies this
/// is the normal to rounding, while the direction of the largest gap is known to half of its digits only.
fn between_cores(pair: &Pair, a: &Outline, b: &Outline, rough: DVec3) -> Option<DVec3> {
    let [of_a, of_b] = [pair.a.solid.rounding, pair.b.solid.rounding];
    if of_a + of_b == 0.0 || pair.a.solid.is_curved() || pair.b.solid.is_curved() {
        return None;
    }
    let apart = a.points().first()? - b.points().first()? + rough * (of_a + of_b);
    let across = |line: &Outline| {
        let along = line.points[1] - line.points[0];
        apart - along * (apart.dot(along) / along.length_squared())
    };
    let direction = match (a.count, b.count) {
        (1, 1) => apart,
        (1, 2) => across(b),
        (2, 1) => across(a),
        _ => return None,
    };
    let normal = direction / direction.length();
    // Of bodies that overlap by more than their roundings there is no such direction.
    (normal.dot(rough) > 0.5).then_some(normal)
}

/// The normal of a triangle of a mesh, to its front, world axes.
fn triangle_normal(pose: &Pose) -> Option<DVec3> {
    match &pose.solid.core {
        Core::Triangle(triangle) => Some(pose.to_world(triangle.normal())),
        _ => None,
    }
}

/// The normal in which a triangle of a mesh can be touched, nearest to `asked`: see [`crate::shape::Touchable`].
fn touchable(pair: &Pair, b: &Outline, asked: DVec3) -> DVec3 {
    let Core::Triangle(triangle) = &pair.b.solid.core else { return asked };
    let (mesh, direction) = (&triangle.mesh, pair.b.to_body(asked));
    let found = match b.feature {
        Feature::Edge(k) => mesh.touchable_at_edge(triangle.index, k as usize, direction),
        Feature::Vertex(k) => mesh.touchable_at_corner(triangle.index, k as usize, direction),
        _ => return asked,
    };
    if found.as_asked { asked } else { pair.b.to_world(found.normal) }
}

/// The sine of the angle below which edges count as parallel (pure number): b × a would have fewer than half the digits.
const PARALLEL: f64 = 1.0 / (1u64 << 26) as f64;

/// Calls `add` with the corners of what A and B have in common, and how the normal turns there.
fn each_point(
    pair: &Pair,
    a: &Outline,
    b: &Outline,
    normal: DVec3,
    tolerance: f64,
    separation: &Separation,
    add: &mut dyn FnMut(DVec3, &dyn Fn() -> DVec3),
) {
    let with_a = || pair.a.angular_velocity;
    let with_b = || pair.b.angular_velocity;
    let with_links = || turning_of_normal(pair, separation);
    match (a.count, b.count) {
        (1, 1) => return add(0.5 * (a.points[0] + b.points[0]), &with_links),
        (1, 0 | 3..) => return add(a.points[0], &with_b),
        (0 | 3.., 1) => return add(b.points[0], &with_a),
        (1, 2) => return add(a.points[0], &with_links),
        (2, 1) => return add(b.points[0], &with_links),
        _ => {}
    }
    let mut any = false;
    let flat = |outline: &Outline| outline.endless || outline.count > 2;
    for &point in a.points() {
        if b.holds(point, normal, tolerance) {
            any = true;
            add(point, if flat(b) { &with_b } else { &with_links });
        }
    }
    for &point in b.points() {
        if a.holds(point, normal, tolerance) {
            any = true;
            add(point, if flat(a) { &with_a } else { &with_links });
        }
    }
    for (p, p_end) in a.sides() {
        for (q, q_end) in b.sides() {
            let (along_a, along_b) = (p_end - p, q_end - q);
            let area = normal.dot(along_a.cross(along_b));
            if area.abs() <= PARALLEL * along_a.length() * along_b.length() {
                continue;
            }
            let share_a = normal.dot((q - p).cross(along_b)) / area;
            let share_b = normal.dot((q - p).cross(along_a)) / area;
            if (0.0..=1.0).contains(&share_a) && (0.0..=1.0).contains(&share_b) {
                any = true;
                let point = 0.5 * (p + along_a * share_a + q + along_b * share_b);
                add(point, &|| turning_of_edges(pair, normal, along_a, along_b));
            }
        }
    }
    if !any && let Some(link) = separation.links().first() {
        add(pair.b.to_world(link.b.point) + normal * pair.b.solid.rounding, &with_links);
    }
}

/// How a normal turns (rad/s) that stays perpendicular to an edge of A and one of B.
fn turning_of_edges(pair: &Pair, normal: DVec3, along_a: DVec3, along_b: DVec3) -> DVec3 {
    let rate_a = normal.dot(pair.a.angular_velocity.cross(along_a));
    let rate_b = normal.dot(pair.b.angular_velocity.cross(along_b));
    let volume = normal.dot(along_a.cross(along_b));
    normal.cross((along_b.cross(normal) * rate_a + normal.cross(along_a) * rate_b) / -volume)
}
