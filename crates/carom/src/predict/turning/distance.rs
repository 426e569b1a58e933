//! The separating direction of two convex bodies at one instant (Gilbert, Johnson and Keerthi 1988, started warm).
//!
//! With x the centre of A seen from that of B, gap(n) = n·x − h_A(−n) − h_B(n) for support functions h, and bodies are apart
//! by the largest gap(n) there is. Any n whose gap is positive separates them, so nothing here needs to be exact: a direction
//! that is worse than need be costs a step. The gap of the direction returned *is* exact, from true support points.
//!
//! The distance algorithm loses its direction where bodies touch. So they are first pulled apart by a known distance along
//! the direction last known: argmax gap(n) + σ n·n₀, a proximal point step, whose fixed points are those of gap(n), and
//! which works for bodies that touch or overlap by rounding as for others.

use glam::DVec3;

use super::motion::Pose;
use super::solid::{Core, SupportPoint, Triangle};
use crate::tolerance;

/// A point of A's core and one of B's that support them in one direction.
#[derive(Clone, Copy, Debug, Default)]
pub struct Link {
    /// On A, frame of A.
    pub a: SupportPoint,
    /// On B, frame of B.
    pub b: SupportPoint,
}

/// A direction between two bodies and what it rests on.
#[derive(Clone, Copy, Debug)]
pub struct Separation {
    /// Unit vector from B to A, world axes.
    pub normal: DVec3,
    /// gap(normal) (m).
    pub gap: f64,
    /// Between one and three links that tie in this direction.
    pub links: [Link; 3],
    /// How many.
    pub count: usize,
}

impl Separation {
    /// Knows only a direction.
    pub fn along(normal: DVec3) -> Self {
        Self { normal, gap: 0.0, links: [Link::default(); 3], count: 0 }
    }

    /// The links.
    pub fn links(&self) -> &[Link] {
        &self.links[..self.count]
    }
}

/// Two bodies at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    /// A, to which normals point.
    pub a: Pose<'a>,
    /// B.
    pub b: Pose<'a>,
    /// The centre of A seen from that of B (m).
    pub offset: DVec3,
}

/// How far apart (m) the bodies are pulled, as fractions of their size: with corners, and where a surface is curved (there the
/// algorithm converges faster the farther they are, and Newton steps follow).
const PULL: [f64; 2] = [1.0 / 1024.0, 1.0 / 16.0];

/// More rounds of the distance algorithm than ever needed for corners; curved surfaces are cut off here and polished.
const ROUNDS: usize = 48;

impl Pair<'_> {
    /// Where to look for a direction first (m): from B's centre to A's, of a triangle from its point nearest to A's centre.
    #[inline(always)]
    pub fn first_guess(&self) -> DVec3 {
        match &self.b.solid.core {
            Core::Triangle(triangle) => self.beyond_nearest(triangle),
            _ => self.offset,
        }
    }

    /// From the point of B, a triangle, that is nearest to A's centre, to that centre (m).
    fn beyond_nearest(&self, triangle: &Triangle) -> DVec3 {
        let [a, b, c] = triangle.corners.map(|corner| self.b.to_world(corner) - self.offset);
        -nearest_of_triangle(a, b, c).1
    }

    /// The support points of the two cores in the world direction `normal`.
    #[inline(always)]
    pub fn link(&self, normal: DVec3) -> Link {
        Link { a: self.a.solid.support(-self.a.to_body(normal)), b: self.b.solid.support(self.b.to_body(normal)) }
    }

    /// Point on A minus point on B (m, world axes).
    #[inline(always)]
    pub fn span(&self, link: &Link) -> DVec3 {
        self.offset + self.a.to_world(link.a.point) - self.b.to_world(link.b.point)
    }

    /// Radii (m) of the roundings together.
    #[inline(always)]
    pub fn rounding(&self) -> f64 {
        self.a.solid.rounding + self.b.solid.rounding
    }

    /// gap(normal) (m), and its links.
    #[inline(always)]
    pub fn gap(&self, normal: DVec3) -> (f64, Link) {
        let link = self.link(normal);
        (normal.dot(self.span(&link)) - self.rounding(), link)
    }

    /// A good separating direction, starting from one known for these bodies at another instant. Where the gap is at most
    /// `close` (m) it is a local best.
    pub fn separate(&self, known: &Separation, close: f64) -> Separation {
        if self.b.solid.is_half_space() {
            return self.above_plane();
        }
        let curved = self.a.solid.is_curved() || self.b.solid.is_curved();
        let size = self.a.solid.reach() + self.b.solid.reach();
        let mut pull = (PULL[usize::from(curved)] * size - self.rounding()).max(0.0);
        let mut found = self.pulled_apart(known, pull, curved);
        for _ in 0..ROUNDS {
            if curved {
                self.polish(&mut found);
            }
            if pull == 0.0 || found.gap > pull {
                break;
            }
            // Pulled far for how near they are, they may hide behind the direction known.
            let distance = self.distance_of_links(&found);
            if found.gap > 0.5 * distance || distance <= 2.0 * close {
                break;
            }
            pull = if pull > 2.0 * distance { distance } else { 0.5 * pull };
            let again = self.pulled_apart(&found, pull, curved);
            if again.gap > found.gap {
                found = again;
            } else if pull < close {
                break;
            }
        }
        found
    }

    /// The distance (m) of the links' points: that of the bodies is not larger.
    fn distance_of_links(&self, found: &Separation) -> f64 {
        let mut simplex = Simplex::new();
        for link in found.links() {
            simplex.push(*link, self.span(link));
        }
        simplex.reduce().0.length() - self.rounding()
    }

    /// Above a plane there is but one direction.
    fn above_plane(&self) -> Separation {
        let normal = self.b.to_world.z_axis;
        let (gap, link) = self.gap(normal);
        Separation { normal, gap, links: [link, Link::default(), Link::default()], count: 1 }
    }

    /// The distance algorithm with A moved by `pull` (m) along the direction known.
    #[inline(always)]
    fn pulled_apart(&self, known: &Separation, pull: f64, curved: bool) -> Separation {
        let shift = known.normal * pull;
        if known.count == 3
            && let Some(found) = self.still_the_same(known, shift)
        {
            return found;
        }
        let mut simplex = Simplex::new();
        if known.count == 0 {
            let link = self.link(known.normal);
            simplex.push(link, self.span(&link) + shift);
        }
        for link in known.links() {
            simplex.push(*link, self.span(link) + shift);
        }
        let mut best = Separation::along(known.normal);
        let mut highest = f64::NEG_INFINITY;
        let near = 4.0 * PULL[0] * (self.a.solid.reach() + self.b.solid.reach());
        let rounding = self.rounding();
        for _ in 0..ROUNDS {
            let (nearest, normal) = simplex.reduce();
            let distance = nearest.length();
            if !(distance > 0.0) {
                break;
            }
            let link = self.link(normal);
            let span = self.span(&link);
            let gap = normal.dot(span);
            let lower = gap + normal.dot(shift);
            if lower > highest {
                highest = lower;
                best.normal = normal;
                best.gap = gap - rounding;
                best.links.copy_from_slice(&simplex.links[..3]);
                best.count = simplex.count;
            }
            let settled = distance - lower <= tolerance::DIRECTION * distance;
            if settled
                || (best.gap > near && best.gap > GOOD_ENOUGH * (distance - rounding))
                || simplex.has(&link, curved)
            {
                break;
            }
            simplex.push(link, span + shift);
        }
        if best.count == 0 {
            let (gap, link) = self.gap(best.normal);
            best = Separation { normal: best.normal, gap, links: [link, link, link], count: 1 };
        }
        best
    }

    /// The separation that rests on the same three links as the one known, if it still does.
    #[inline(always)]
    fn still_the_same(&self, known: &Separation, shift: DVec3) -> Option<Separation> {
        let [a, b, c] = [0, 1, 2].map(|k| self.span(&known.links[k]));
        let (Region::Inside, _) = nearest_of_triangle(a + shift, b + shift, c + shift) else { return None };
        let cross = (b - a).cross(c - a);
        let normal = cross / cross.length();
        let normal = if normal.dot(a + shift) < 0.0 { -normal } else { normal };
        let link = self.link(normal);
        let same = |other: &Link| (other.a.index, other.b.index) == (link.a.index, link.b.index);
        let curved = self.a.solid.is_curved() || self.b.solid.is_curved();
        (!curved && known.links.iter().any(same)).then(|| Separation {
            normal,
            gap: normal.dot(a) - self.rounding(),
            ..*known
        })
    }

    /// Newton's method for the largest gap(n) where support points move with n.
    ///
    /// Links are pieces φᵢ(n) = n·wᵢ(n) with dφᵢ/dn = wᵢ and dwᵢ/dn = −Sᵢ, the curvature of both surfaces there. At the best
    /// direction the pieces are equal and some mean of the wᵢ points along n.
    fn polish(&self, found: &mut Separation) {
        for _ in 0..POLISHING {
            let mut pieces = self.pieces(found);
            let Some(normal) = self.newton_step(&mut pieces, found.normal) else { return };
            let (gap, link) = self.gap(normal);
            // At the top the gap is flat: its rounding says nothing of a step that is Newton's.
            let rounding = tolerance::DIRECTION * self.offset.length();
            if !(gap - found.gap >= -rounding) {
                return;
            }
            let moved = (normal - found.normal).length();
            if pieces.count == 1 {
                pieces.links[0] = link;
            }
            *found = Separation { normal, gap, links: pieces.links, count: pieces.count };
            if moved <= NEWTON_ENDS {
                return;
            }
        }
    }

    /// Links on the same smooth parts, near each other, are one piece.
    fn pieces(&self, found: &Separation) -> Pieces {
        let mut pieces = Pieces { links: found.links, moving: [true; 3], count: 0 };
        for link in found.links() {
            let mut fresh = true;
            for k in 0..pieces.count {
                let other = pieces.links[k];
                if (link.a.index, link.b.index) != (other.a.index, other.b.index) {
                    continue;
                }
                if self.a.solid.near_on_piece(link.a.point, other.a.point)
                    && self.b.solid.near_on_piece(link.b.point, other.b.point)
                {
                    fresh = false;
                } else {
                    pieces.moving[k] = false;
                    pieces.moving[pieces.count] = false;
                }
            }
            if fresh {
                pieces.links[pieces.count] = *link;
                pieces.count += 1;
            }
        }
        pieces
    }

    /// How a piece's span changes when the direction does: S (m) applied to `change`.
    fn curvature(&self, link: &Link, normal: DVec3, change: DVec3) -> DVec3 {
        let of = |pose: &Pose, point: DVec3, direction: DVec3| {
            pose.to_world(pose.solid.curvature(pose.to_body(direction), point, pose.to_body(change)))
        };
        of(&self.a, link.a.point, -normal) + of(&self.b, link.b.point, normal)
    }

    fn newton_step(&self, pieces: &mut Pieces, normal: DVec3) -> Option<DVec3> {
        for k in 0..pieces.count {
            if pieces.moving[k] {
                let link = &mut pieces.links[k];
                link.a = self.a.solid.support_on(link.a.index, -self.a.to_body(normal));
                link.b = self.b.solid.support_on(link.b.index, self.b.to_body(normal));
            }
        }
        let spans: [DVec3; 3] = std::array::from_fn(|k| self.span(&pieces.links[k]));
        if pieces.count == 3 {
            let cross = (spans[1] - spans[0]).cross(spans[2] - spans[0]);
            let length = cross.length();
            return (length > 0.0).then(|| cross * (cross.dot(normal).signum() / length));
        }
        let (t1, t2) = tangents(normal, if pieces.count == 2 { spans[0] - spans[1] } else { DVec3::ZERO });
        let bend = |change: DVec3, share: f64| {
            let mut total = DVec3::ZERO;
            for (k, weight) in [1.0 - share, share].into_iter().take(pieces.count).enumerate() {
                if pieces.moving[k] {
                    total += self.curvature(&pieces.links[k], normal, change) * weight;
                }
            }
            total
        };
        let gap = normal.dot(spans[0]);
        if pieces.count == 2 {
            // The tie along t1 = the direction of w1 − w2, the stationary mean along t2.
            let difference = spans[0] - spans[1];
            let along = t1.dot(difference);
            if along == 0.0 {
                return None;
            }
            let share = (t1.dot(spans[0]) / along).clamp(0.0, 1.0);
            let tie = -normal.dot(difference) / along;
            let mean = spans[0] * (1.0 - share) + spans[1] * share;
            let stiffness = t2.dot(bend(t2, share)) + gap;
            let slide = (t2.dot(mean) - t2.dot(bend(t1, share)) * tie) / stiffness;
            return (stiffness > 0.0).then(|| (normal + t1 * tie + t2 * slide).normalize());
        }
        let (s1, s2) = (bend(t1, 0.0), bend(t2, 0.0));
        let (m11, m12, m22) = (t1.dot(s1) + gap, t1.dot(s2), t2.dot(s2) + gap);
        let determinant = m11 * m22 - m12 * m12;
        let (r1, r2) = (t1.dot(spans[0]), t2.dot(spans[0]));
        let (d1, d2) = ((m22 * r1 - m12 * r2) / determinant, (m11 * r2 - m12 * r1) / determinant);
        (determinant > 0.0 && m11 > 0.0).then(|| (normal + t1 * d1 + t2 * d2).normalize())
    }
}

/// Newton steps at most; they double the digits.
const POLISHING: usize = 6;

/// A Newton step of this length (rad) is the last: what it leaves is its square.
const NEWTON_ENDS: f64 = 1.0 / (1u64 << 24) as f64;

/// Far from contact a direction whose gap is this fraction of the distance will do.
const GOOD_ENOUGH: f64 = 0.75;

/// Links as smooth pieces of gap(n).
struct Pieces {
    links: [Link; 3],
    moving: [bool; 3],
    count: usize,
}

/// Two unit vectors perpendicular to `normal` and to each other, the first along `preferred` if that is not zero.
fn tangents(normal: DVec3, preferred: DVec3) -> (DVec3, DVec3) {
    let flat = preferred - normal * normal.dot(preferred);
    let length = flat.length();
    let first = if length > 0.0 { flat / length } else { normal.any_orthonormal_vector() };
    (first, normal.cross(first))
}

/// Up to four links whose convex hull is searched for the point nearest to the origin.
struct Simplex {
    links: [Link; 4],
    spans: [DVec3; 4],
    count: usize,
}

impl Simplex {
    #[inline(always)]
    fn new() -> Self {
        Self { links: [Link::default(); 4], spans: [DVec3::ZERO; 4], count: 0 }
    }

    #[inline(always)]
    fn push(&mut self, link: Link, span: DVec3) {
        self.links[self.count] = link;
        self.spans[self.count] = span;
        self.count += 1;
    }

    /// Whether a link is there already, so that no better is left.
    #[inline(always)]
    fn has(&self, link: &Link, curved: bool) -> bool {
        self.links[..self.count].iter().any(|other| {
            (other.a.index, other.b.index) == (link.a.index, link.b.index)
                && (!curved || (other.a.point == link.a.point && other.b.point == link.b.point))
        })
    }

    /// Keeps the links with these indices, which ascend.
    #[inline(always)]
    fn keep<const N: usize>(&mut self, kept: [usize; N]) {
        for (to, from) in kept.into_iter().enumerate() {
            if to != from {
                self.links[to] = self.links[from];
                self.spans[to] = self.spans[from];
            }
        }
        self.count = N;
    }

    /// The nearest point, and the unit vector to it, of a triangle's from the plane of the triangle, which stays exact
    /// however near the point is. Only links that carry the point are kept.
    #[inline(always)]
    fn reduce(&mut self) -> (DVec3, DVec3) {
        if self.count == 4 {
            self.reduce_tetrahedron();
        }
        if self.count == 3 {
            return self.reduce_triangle();
        }
        let nearest = if self.count == 2 { self.reduce_segment() } else { self.spans[0] };
        (nearest, self.unit(nearest))
    }

    /// The direction of the nearest point, of a segment's perpendicular to it up to rounding, however near the point is.
    #[inline(always)]
    fn unit(&self, nearest: DVec3) -> DVec3 {
        let normal = nearest / nearest.length();
        if self.count != 2 {
            return normal;
        }
        let along = self.spans[1] - self.spans[0];
        let normal = normal - along * (along.dot(normal) / along.length_squared());
        normal / normal.length()
    }

    fn reduce_segment(&mut self) -> DVec3 {
        let (p, q) = (self.spans[0], self.spans[1]);
        let along = q - p;
        let (numerator, length) = (-p.dot(along), along.length_squared());
        if numerator <= 0.0 {
            self.keep([0]);
            return p;
        }
        if numerator >= length {
            self.keep([1]);
            return q;
        }
        p + along * (numerator / length)
    }

    /// Ericson, Real-Time Collision Detection (2005), 5.1.5.
    #[inline(always)]
    fn reduce_triangle(&mut self) -> (DVec3, DVec3) {
        let [a, b, c, _] = self.spans;
        let (region, nearest) = nearest_of_triangle(a, b, c);
        match region {
            Region::Corner(k) => {
                self.keep([k]);
                (nearest, self.unit(nearest))
            }
            Region::Side(i, j) => {
                self.keep([i, j]);
                (nearest, self.unit(nearest))
            }
            Region::Inside => {
                let cross = (b - a).cross(c - a);
                let normal = cross / cross.length();
                let distance = normal.dot(a);
                let (normal, distance) = if distance < 0.0 { (-normal, -distance) } else { (normal, distance) };
                (normal * distance, normal)
            }
        }
    }

    /// Keeps the nearest of the three triangles at the newest link, of those that face the origin.
    #[inline(always)]
    fn reduce_tetrahedron(&mut self) {
        let [a, b, c, d] = self.spans;
        let mut least = f64::INFINITY;
        let mut nearest = 0;
        let sides = [[a, b, c], [b, c, a], [a, c, b]];
        for (face, [p, q, opposite]) in sides.into_iter().enumerate() {
            let normal = (p - d).cross(q - d);
            if normal.dot(d) * normal.dot(opposite - d) > 0.0 {
                let square = nearest_of_triangle(p, q, d).1.length_squared();
                if square < least {
                    least = square;
                    nearest = face;
                }
            }
        }
        match nearest {
            0 => self.keep([0, 1, 3]),
            1 => self.keep([1, 2, 3]),
            _ => self.keep([0, 2, 3]),
        }
    }
}

/// Where on a triangle a point lies.
pub(super) enum Region {
    Corner(usize),
    Side(usize, usize),
    Inside,
}

/// The point of a triangle nearest to the origin.
#[inline(always)]
pub(super) fn nearest_of_triangle(a: DVec3, b: DVec3, c: DVec3) -> (Region, DVec3) {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (-ab.dot(a), -ac.dot(a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (Region::Corner(0), a);
    }
    let (d3, d4) = (-ab.dot(b), -ac.dot(b));
    if d3 >= 0.0 && d4 <= d3 {
        return (Region::Corner(1), b);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (Region::Side(0, 1), a + ab * (d1 / (d1 - d3)));
    }
    let (d5, d6) = (-ab.dot(c), -ac.dot(c));
    if d6 >= 0.0 && d5 <= d6 {
        return (Region::Corner(2), c);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (Region::Side(0, 2), a + ac * (d2 / (d2 - d6)));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return (Region::Side(1, 2), b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))));
    }
    let sum = va + vb + vc;
    (Region::Inside, a + ab * (vb / sum) + ac * (vc / sum))
}
