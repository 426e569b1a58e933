//! Where a body touches several others at one instant, or two bodies of several parts do: what of it is one contact.

use glam::DVec3;

use super::contact::{Contact, ContactPoint, POINTS};
use super::motion::Body;
use super::{Memory, contact_after, contact_gap, touch};
use crate::rotation::Rotation;
use crate::tolerance::contact as contact_tolerance;

/// Contacts are in one direction if the cosine of the angle between their normals differs from 1 by no more (pure number, 8ε).
const ONE_DIRECTION: f64 = 8.0 * f64::EPSILON;

/// A pair of convex bodies that may touch.
#[derive(Clone, Debug)]
struct Candidate {
    gap: f64,
    tolerance: f64,
    contact: Contact,
}

/// The candidates of one contact; kept, so that no impact allocates.
#[derive(Clone, Debug, Default)]
pub(crate) struct Patch {
    found: Vec<Candidate>,
    points: Vec<(f64, f64, ContactPoint)>,
    outline: Vec<(f64, f64, ContactPoint)>,
}

fn tolerance_of(a: &Body<Rotation>, b: &Body<Rotation>) -> f64 {
    contact_tolerance(a.solid.reach().max(b.solid.reach()), (a.position - b.position).length())
}

impl Patch {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.found.clear();
    }

    /// Considers a part of A and one of B.
    pub fn consider(&mut self, a: &Body<Rotation>, b: &Body<Rotation>) {
        let contact = contact_after(a, b, 0.0, &Memory::default());
        self.found.push(Candidate { gap: contact_gap(a, b), tolerance: tolerance_of(a, b), contact });
    }

    /// Considers a part of A and a triangle of B, whose origin is at `offset` (m) from A's centre.
    pub fn consider_triangle(&mut self, a: &Body<Rotation>, triangle: &Body<Rotation>, offset: DVec3) {
        let tolerance = tolerance_of(a, triangle);
        let Some((gap, mut contact)) = touch(a, triangle, tolerance) else { return };
        for point in &mut contact.points {
            point.from_b = point.from_a - offset;
        }
        self.found.push(Candidate { gap, tolerance, contact });
    }

    /// Keeps the nearest, and whoever is as near up to δ.
    fn keep_nearest(&mut self) {
        let nearest = self.found.iter().map(|candidate| candidate.gap).fold(f64::INFINITY, f64::min);
        self.found.retain(|candidate| candidate.gap <= nearest.max(0.0) + candidate.tolerance);
    }

    fn fastest(&self) -> Option<Contact> {
        let faster = |best: Contact, next: Contact| {
            if next.approach_speed() > best.approach_speed() { next } else { best }
        };
        self.found.iter().map(|candidate| candidate.contact).reduce(faster)
    }

    /// The contact of bodies of several parts: the pair of parts that is nearest, with the points of all others that touch in
    /// the same direction. Those that touch in another are found again, at the same instant, after this impact.
    pub fn of_parts(&mut self) -> Option<Contact> {
        self.keep_nearest();
        let mut contact = self.fastest()?;
        let (first, features) = (contact, contact.features);
        for Candidate { tolerance, contact: other, .. } in &self.found {
            let same = other.features == features && other.points() == first.points();
            if !same && other.normal.dot(contact.normal) >= 1.0 - ONE_DIRECTION {
                contact.add_points(other.points(), 2.0 * tolerance);
            }
        }
        Some(contact)
    }

    /// The contact of a body and a mesh, as [`Self::of_parts`]; of the points, the corners of the area that they span, however
    /// many triangles it covers. A triangle that is touched only where its neighbours are has no say if they have.
    pub fn of_triangles(&mut self) -> Option<Contact> {
        self.keep_nearest();
        if self.found.iter().any(|candidate| !candidate.contact.is_beside) {
            self.found.retain(|candidate| !candidate.contact.is_beside);
        }
        let mut contact = self.fastest()?;
        let in_one_direction = |other: &Contact| other.normal.dot(contact.normal) >= 1.0 - ONE_DIRECTION;
        self.found.retain(|candidate| in_one_direction(&candidate.contact));
        if self.found.len() == 1 {
            return Some(contact);
        }
        let tolerance = 2.0 * self.found.iter().map(|candidate| candidate.tolerance).fold(0.0, f64::max);
        self.span(contact.normal, tolerance);
        contact.count = 0;
        // Of a ragged area with more corners than there is room for, every second, and so on.
        for (.., point) in self.outline.iter().step_by(self.outline.len().div_ceil(POINTS).max(1)) {
            contact.points[contact.count] = *point;
            contact.count += 1;
        }
        Some(contact)
    }

    /// The corners of the convex area that all points span, seen along `normal` (Andrew 1979). What is within `tolerance` (m) of
    /// a corner or of a side is left out.
    fn span(&mut self, normal: DVec3, tolerance: f64) {
        let (x, y) = normal.any_orthonormal_pair();
        let points = &mut self.points;
        points.clear();
        for candidate in &self.found {
            points.extend(candidate.contact.points().iter().map(|p| (p.from_a.dot(x), p.from_a.dot(y), *p)));
        }
        points.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.total_cmp(&q.1)));
        let outline = &mut self.outline;
        outline.clear();
        // The side from p to q has r on its left, by more than rounding.
        let turns_left = |p: &(f64, f64, ContactPoint), q: &(f64, f64, ContactPoint), r: &(f64, f64, ContactPoint)| {
            let (side, far) = ((q.0 - p.0, q.1 - p.1), (r.0 - p.0, r.1 - p.1));
            let length = (far.0 * far.0 + far.1 * far.1).sqrt();
            side.0 * far.1 - side.1 * far.0 > tolerance * length
        };
        for backwards in [false, true] {
            let from = outline.len();
            for k in 0..points.len() {
                let next = points[if backwards { points.len() - 1 - k } else { k }];
                while outline.len() >= from + 2
                    && !turns_left(&outline[outline.len() - 2], &outline[outline.len() - 1], &next)
                {
                    outline.pop();
                }
                let last = outline.last().filter(|_| outline.len() > from);
                if last.is_none_or(|last| (last.2.from_a - next.2.from_a).length() > tolerance) {
                    outline.push(next);
                }
            }
            // Where one chain ends the other begins.
            if outline.len() > from + 1 || backwards && from > 0 {
                outline.pop();
            }
        }
    }
}
