//! When a body that turns next touches another, or a plane.

use glam::DVec3;

use super::Periods;
use super::cut_off::{CutOffs, Foreseen, Pair};
use super::turning::motion::Body;
use super::turning::solid::Solid;
use super::turning::{Memory, Search, first_impact, gap};
use crate::rotation::Rotation;
use crate::time::Time;
use crate::world::World;

/// A body of the world as the search sees it.
pub(crate) struct Sought<'a> {
    ball: Option<Solid>,
    parts: &'a [Solid],
    position: DVec3,
    velocity: DVec3,
    acceleration: DVec3,
    rotation: &'a Rotation,
    elapsed: f64,
    /// Distance (m) of its farthest point from the centre.
    reach: f64,
}

impl<'a> Sought<'a> {
    /// A body outside a world, whose parts are these, `elapsed` seconds after its rotation began.
    pub fn alone(parts: &'a [Solid], position: DVec3, velocity: DVec3, rotation: &'a Rotation, elapsed: f64) -> Self {
        let reach = parts.iter().map(Solid::reach).fold(0.0, f64::max);
        Self { ball: None, parts, position, velocity, acceleration: DVec3::ZERO, rotation, elapsed, reach }
    }

    /// The body in `row` as it is at `time`; `shift` (m) from where it is to the image that counts.
    pub fn new(world: &'a World, row: usize, time: Time, shift: DVec3) -> Self {
        let flight = &world.flights[row];
        let elapsed = time.since(flight.start());
        let acceleration = world.acceleration(row);
        let (ball, parts, rotation): (_, &[Solid], _) = match world.turning_body(row) {
            Some(body) => (None, &body.parts, &body.rotation),
            None => (Some(Solid::ball(world.radii[row])), &[], &Rotation::REST),
        };
        Self {
            ball,
            parts,
            position: flight.position_after(elapsed, acceleration) + shift,
            velocity: flight.velocity_after(elapsed, acceleration),
            acceleration,
            rotation,
            elapsed,
            reach: world.radii[row],
        }
    }

    /// Distance (m) of its farthest point from the centre.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// Where its centre is (m).
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Velocity (m/s) of the centre.
    pub fn velocity(&self) -> DVec3 {
        self.velocity
    }

    /// Acceleration (m/s²) of the centre.
    pub fn acceleration(&self) -> DVec3 {
        self.acceleration
    }

    /// Its convex parts.
    pub fn parts(&self) -> &[Solid] {
        self.ball.as_ref().map_or(self.parts, std::slice::from_ref)
    }

    /// One of them as a body.
    pub fn part<'b>(&'b self, solid: &'b Solid) -> Body<'b, Rotation> {
        Body {
            solid,
            position: self.position,
            velocity: self.velocity,
            acceleration: self.acceleration,
            rotation: self.rotation,
            elapsed: self.elapsed,
        }
    }
}

/// The half-space behind a plane as a body, at `time`.
pub(crate) fn plane_at(world: &World, row: usize, time: Time) -> Option<Body<'_, Rotation>> {
    let plane = &world.planes[row];
    let (solid, rotation) = world.turning.as_ref()?.half_space(row);
    Some(Body {
        solid,
        position: plane.normal * plane.offset_at(time),
        velocity: plane.velocity,
        acceleration: DVec3::ZERO,
        rotation,
        elapsed: 0.0,
    })
}

/// When two bodies, of which one turns or both, next touch, or are to be looked at again, if that is not after `limit`. From
/// their post-impact states alone: the present only chooses the periodic image, and takes up again what was cut off. The first
/// in the order of ids is A.
pub(super) fn impact_of_bodies(
    world: &World,
    periods: &Periods,
    cut_offs: &mut CutOffs,
    [ball, other]: [usize; 2],
    [now, limit]: [Time; 2],
    same: f64,
) -> Foreseen {
    let (a, b) = in_order(world, ball, other);
    let start = world.flights[a].start().later(world.flights[b].start());
    let shift = -periods.shift_of(world.position(a, now) - world.position(b, now));
    let pair = Pair::of_bodies(world, a, b, shift, start);
    cut_offs.foresee(world, pair, [now, limit], same, |from, horizon| {
        let (body_a, body_b) = (Sought::new(world, a, from, shift), Sought::new(world, b, from, DVec3::ZERO));
        let pairs = body_a.parts().iter().flat_map(|a| body_b.parts().iter().map(move |b| (a, b)));
        let mut first = Search::clear(horizon);
        first_of_parts(pairs.map(|(a, b)| (body_a.part(a), body_b.part(b))), &mut first);
        first
    })
}

/// When a body that turns next touches a plane, or is to be looked at again, if that is not after `limit`.
pub(super) fn impact_with_plane(
    world: &World,
    cut_offs: &mut CutOffs,
    row: usize,
    plane: usize,
    [now, limit]: [Time; 2],
    same: f64,
) -> Foreseen {
    let pair = Pair::with_prescribed(world, row, world.planes[plane].id, world.flights[row].start());
    cut_offs.foresee(world, pair, [now, limit], same, |from, horizon| {
        let body = Sought::new(world, row, from, DVec3::ZERO);
        let half_space = plane_at(world, plane, from);
        let pairs = half_space.iter().flat_map(|&plane| body.parts().iter().map(move |part| (part, plane)));
        let mut first = Search::clear(horizon);
        first_of_parts(pairs.map(|(part, plane)| (body.part(part), plane)), &mut first);
        first
    })
}

/// Makes the first impact of any of these the `first`, if it comes before; or none, where one of the searches was cut off before.
pub(super) fn first_of_parts<'a>(
    pairs: impl Iterator<Item = (Body<'a, Rotation>, Body<'a, Rotation>)>,
    first: &mut Search,
) {
    for (a, b) in pairs {
        let search = first_impact(&a, &b, first.clear_until, &mut Memory::default());
        if search.impact.is_some() || search.clear_until < first.clear_until {
            first.impact = search.impact;
            first.clear_until = search.impact.map_or(search.clear_until, |impact| impact.seconds);
        }
        first.steps += search.steps;
    }
}

/// The gap (m) of two bodies at `now`, of which one turns or both; negative if they overlap.
pub(crate) fn gap_of_bodies(world: &World, a: usize, b: usize, now: Time) -> f64 {
    let periods = Periods::of(&world.domain);
    let shift = -periods.shift_of(world.position(a, now) - world.position(b, now));
    let (body_a, body_b) = (Sought::new(world, a, now, shift), Sought::new(world, b, now, DVec3::ZERO));
    let pairs = body_a.parts().iter().flat_map(|a| body_b.parts().iter().map(move |b| (a, b)));
    pairs.map(|(a, b)| gap(&body_a.part(a), &body_b.part(b))).fold(f64::INFINITY, f64::min)
}

/// The gap (m) of a body that turns and a plane at `now`; negative if it reaches beyond.
pub(crate) fn gap_above_plane(world: &World, row: usize, plane: usize, now: Time) -> f64 {
    let body = Sought::new(world, row, now, DVec3::ZERO);
    let Some(half_space) = plane_at(world, plane, now) else { return f64::INFINITY };
    body.parts().iter().map(|part| gap(&body.part(part), &half_space)).fold(f64::INFINITY, f64::min)
}

/// The lower id first.
pub(crate) fn in_order(world: &World, ball: usize, other: usize) -> (usize, usize) {
    if world.bodies[ball].rank < world.bodies[other].rank { (ball, other) } else { (other, ball) }
}
