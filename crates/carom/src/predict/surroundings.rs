//! When a body next touches a mesh of triangles.
//!
//! Each triangle is a flat convex body of its own, asked by the general search ([`super::turning`]), with its guarantee. Which
//! triangles are asked is found along the body's way, in pieces about as long as the body and a triangle are wide: those whose
//! boxes overlap the box swept in a piece. So it costs as much as there are triangles near the way up to the first impact.
//! A triangle's answer does not depend on the piece in which it was asked, nor does the first of all answers.

use glam::DVec3;

use super::cut_off::{CutOffs, Foreseen, Pair};
use super::solids::{Sought, first_of_parts};
use super::turning::contact::Contact;
use super::turning::motion::Body;
use super::turning::patch::Patch;
use super::turning::{Search, window};
use crate::rotation::Rotation;
use crate::shape::Bounds;
use crate::time::Time;
use crate::tolerance::{CELL_MARGIN, contact};
use crate::world::World;
use crate::world::surroundings::Surroundings;

/// Triangles of a piece and of the one before; kept, so that no prediction allocates.
#[derive(Clone, Debug, Default)]
pub(crate) struct TriangleRoom {
    near: Vec<u32>,
    before: Vec<u32>,
}

/// A piece in which more triangles are near is taken again in shorter ones, unless it is short (a count).
const MANY: usize = 16;

/// A body's way as seen from a mesh.
struct Way<'a> {
    mesh: &'a Surroundings,
    /// Of the body's centre from the mesh's origin (m), at the start, and how that changes (m/s, m/s²).
    position: DVec3,
    velocity: DVec3,
    acceleration: DVec3,
    start: Time,
    /// How far (m) the body reaches, with room for rounding.
    reach: f64,
}

impl<'a> Way<'a> {
    fn of(body: &Sought, mesh: &'a Surroundings, start: Time) -> Self {
        let position = body.position() - mesh.position_at(start);
        // Impacts are found up to δ away.
        let near = contact(body.reach().max(mesh.reach), position.length());
        Self {
            mesh,
            position,
            velocity: body.velocity() - mesh.velocity,
            acceleration: body.acceleration(),
            start,
            reach: body.reach() * (1.0 + CELL_MARGIN) + 4.0 * near,
        }
    }

    /// Position (m) and velocity (m/s) seen from the mesh's origin, world axes.
    fn after(&self, seconds: f64) -> (DVec3, DVec3) {
        let half = self.velocity + self.acceleration * (0.5 * seconds);
        (self.position + half * seconds, self.velocity + self.acceleration * seconds)
    }

    /// When the body is first near the mesh as a whole after `after` (s).
    fn window(&self, after: f64) -> Option<window::Window> {
        let reach = (self.mesh.reach + self.reach) * (1.0 + CELL_MARGIN);
        let (x, v, g) = (self.position, self.velocity, self.acceleration);
        if g == DVec3::ZERO {
            return window::of_straight_flight(x, v, reach);
        }
        window::below_zero(
            [
                (x.length() - reach) * (x.length() + reach),
                2.0 * x.dot(v),
                v.length_squared() + x.dot(g),
                v.dot(g),
                0.25 * g.length_squared(),
            ],
            after,
        )
    }

    /// The seconds from `seconds` on in which the centre goes no farther than `distance` (m), seen from the mesh's frame.
    fn time_of(&self, seconds: f64, distance: f64) -> f64 {
        let (position, velocity) = self.after(seconds);
        // While the centre is within `distance`, the frame turns it by no more than this speed.
        let turning = self.mesh.angular_velocity.length() * (position.length() + distance);
        let (speed, g) = (velocity.length() + turning, self.acceleration.length());
        let root = speed + (speed * speed + 2.0 * g * distance).sqrt();
        if root > 0.0 { 2.0 * distance / root } else { f64::INFINITY }
    }

    /// A box around all that the body covers in a piece during which its centre goes no farther than `distance` (m), in the
    /// mesh's frame.
    fn swept(&self, from: f64, to: f64, distance: f64) -> Bounds {
        let to_mesh = self.mesh.rotation.orientation_after(self.start.since(self.mesh.start) + from).inverse();
        let centre = to_mesh * self.after(from).0;
        if self.mesh.angular_velocity != DVec3::ZERO || !to.is_finite() {
            return Bounds::around([centre]).grown(distance + self.reach);
        }
        // A parabola leaves its chord by no more than g t²/8.
        let sag = 0.125 * self.acceleration.length() * (to - from) * (to - from);
        Bounds::around([centre, to_mesh * self.after(to).0]).grown(self.reach + sag)
    }
}

/// When a free body next touches a mesh, or is to be looked at again, if that is not after `limit`. The present only chooses
/// where the search begins.
pub(super) fn impact_with_mesh(
    world: &World,
    cut_offs: &mut CutOffs,
    [row, mesh]: [usize; 2],
    [now, limit]: [Time; 2],
    same: f64,
    room: &mut TriangleRoom,
) -> Foreseen {
    let pair = Pair::with_prescribed(world, row, world.meshes[mesh].id, world.flights[row].start());
    cut_offs.foresee(world, pair, [now, limit], same, |start, horizon| {
        let body = Sought::new(world, row, start, DVec3::ZERO);
        first_of_triangles(&body, &world.meshes[mesh], start, [now.since(start).max(0.0), horizon], room)
    })
}

/// The first impact of a body, as it is at `start`, and a mesh, not before `from` and within `horizon` seconds; or none, where
/// the search of a triangle was cut off before.
pub(crate) fn first_of_triangles(
    body: &Sought,
    mesh: &Surroundings,
    start: Time,
    [mut from, horizon]: [f64; 2],
    room: &mut TriangleRoom,
) -> Search {
    let way = &Way::of(body, mesh, start);
    let mut first = Search::clear(horizon);
    let mut after = 0.0;
    room.before.clear();
    while let Some((entry, exit)) = way.window(after) {
        if !(entry < first.clear_until) {
            break;
        }
        from = from.max(entry);
        search_window(way, body, (&mut from, exit), &mut first, room);
        if way.acceleration == DVec3::ZERO || !(exit < first.clear_until) || exit <= after {
            break;
        }
        after = exit;
    }
    first
}

/// Looks along the way from `from` to `exit` (s); what is found first ends it.
fn search_window(way: &Way, body: &Sought, (from, exit): (&mut f64, f64), first: &mut Search, room: &mut TriangleRoom) {
    let shortest = way.reach + way.mesh.triangle_size;
    let mut distance = shortest;
    while *from <= exit.min(first.clear_until) {
        let end = exit.min(first.clear_until);
        let mut seconds = way.time_of(*from, distance);
        if !end.is_finite() {
            // It stays where it is, seen from the mesh's origin: whatever is as far from there may come by.
            seconds = f64::INFINITY;
            distance = if way.mesh.angular_velocity == DVec3::ZERO { 0.0 } else { 2.0 * way.position.length() };
        }
        let to = (*from + seconds).min(end);
        way.mesh.mesh.gather_near(&way.swept(*from, to, distance), &mut room.near);
        if room.near.len() > MANY && distance > shortest && end.is_finite() {
            distance = shortest.max(0.25 * distance);
            continue;
        }
        for &index in &room.near {
            if room.before.binary_search(&index).is_ok() {
                continue;
            }
            let triangle = way.mesh.triangle(index);
            let placed = way.mesh.body(&triangle, way.start);
            first_of_parts(body.parts().iter().map(|part| (body.part(part), placed)), first);
        }
        std::mem::swap(&mut room.near, &mut room.before);
        if !(to > *from) {
            break;
        }
        *from = to;
        if room.before.is_empty() {
            distance *= 2.0;
        }
    }
}

/// The triangles near a body, both as they are at `now`.
pub(crate) fn gather_near(body: &Sought, mesh: &Surroundings, now: Time, near: &mut Vec<u32>) {
    let way = Way::of(body, mesh, now);
    mesh.mesh.gather_near(&way.swept(0.0, 0.0, 0.0), near);
}

/// The contact of a body and a mesh that touch at `now`; `None` if they do not. `near` and `patch` are room to work in.
pub(crate) fn contact_with_mesh(
    body: &Sought,
    mesh: &Surroundings,
    now: Time,
    near: &mut Vec<u32>,
    patch: &mut Patch,
) -> Option<Contact> {
    let offset = mesh.position_at(now) - body.position();
    patch.clear();
    gather_near(body, mesh, now, near);
    for &index in near.iter() {
        let triangle = mesh.triangle(index);
        let placed = mesh.body(&triangle, now);
        body.parts().iter().for_each(|part| patch.consider_triangle(&body.part(part), &placed, offset));
    }
    patch.of_triangles()
}

/// The gap (m) of a body and a mesh at `now`, of those triangles that are near, as `gap` has it; negative if the body crosses
/// the surface.
pub(crate) fn gap_to_mesh(
    body: &Sought,
    mesh: &Surroundings,
    now: Time,
    gap: impl Fn(&Body<Rotation>, &Body<Rotation>) -> f64,
) -> f64 {
    let mut near = Vec::new();
    gather_near(body, mesh, now, &mut near);
    let mut least = f64::INFINITY;
    for index in near {
        let triangle = mesh.triangle(index);
        let placed = mesh.body(&triangle, now);
        let gaps = body.parts().iter().map(|part| gap(&body.part(part), &placed));
        least = gaps.fold(least, f64::min);
    }
    least
}
