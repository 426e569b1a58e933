//! What comes next for a ball: the table of shape pairs, and the search through those near.

pub mod ball_ball;
pub mod ball_ball_accelerated;
pub mod ball_plane;
pub mod crossing;
pub mod lanes;
pub mod root;

use glam::DVec3;

use self::lanes::Lanes;
use crate::event::{Kind, Rank};
use crate::flight::Flight;
use crate::time::Time;
use crate::tolerance::{self, SAME_INSTANT};
use crate::world::cells::{Cells, Face};
use crate::world::{Partner, World};

/// The shapes there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShapeKind {
    /// A ball.
    Ball,
    /// A plane; its motion is always prescribed.
    Plane,
}

/// The table of pairs: what kind of impact two shapes can have. A pair that is not in it cannot be simulated.
pub fn kind_of_pair(a: ShapeKind, b: ShapeKind) -> Option<Kind> {
    match (a, b) {
        (ShapeKind::Ball, ShapeKind::Ball) => Some(Kind::BallBall),
        (ShapeKind::Ball, ShapeKind::Plane) | (ShapeKind::Plane, ShapeKind::Ball) => Some(Kind::BallPlane),
        (ShapeKind::Plane, ShapeKind::Plane) => None,
    }
}

/// A ball that looks for its next impact, with what all its pairs share.
#[derive(Clone, Copy)]
struct Seeker<'a> {
    world: &'a World,
    periods: &'a Periods,
    ball: usize,
    flight: Flight,
    radius: f64,
    /// Seconds since the ball's last impact.
    age: f64,
    /// Nothing but straight flights of balls that keep their size.
    plain: bool,
}

impl<'a> Seeker<'a> {
    #[inline(always)]
    fn new(world: &'a World, periods: &'a Periods, ball: usize, now: Time) -> Self {
        let flight = world.flights[ball];
        Self {
            world,
            periods,
            ball,
            flight,
            radius: world.radii[ball],
            age: now.since(flight.start),
            plain: world.gravity == DVec3::ZERO
                && world.growth.is_none()
                && world.radii[ball] + periods.largest_radius <= periods.nearest_image_reach,
        }
    }

    /// The ball seen from another: position (m) and velocity (m/s) in straight flight, and the seconds that each has
    /// flown, at the later of their last impacts. Only post-impact states enter, so that what is predicted does not depend
    /// on when it is predicted (the present only chooses the periodic image).
    #[inline(always)]
    fn seen_from(&self, other: usize) -> (DVec3, DVec3, f64, f64) {
        let theirs = &self.world.flights[other];
        let ahead = self.flight.start.since(theirs.start);
        let (mine_flown, theirs_flown) = ((-ahead).max(0.0), ahead.max(0.0));
        let mut r = (self.flight.position + self.flight.velocity * mine_flown)
            - (theirs.position + theirs.velocity * theirs_flown);
        let v = self.flight.velocity - theirs.velocity;
        if self.plain && self.periods.any {
            r -= self.periods.shift(r + v * (self.age - mine_flown));
        }
        (r, v, mine_flown, theirs_flown)
    }

    /// Which of some balls the ball can meet at all (the arithmetic of [`Seeker::seen_from`] and [`ball_ball::can_meet`],
    /// side by side): without a branch, so that loads and arithmetic overlap.
    #[inline(always)]
    fn can_meet(&self, others: [u32; Lanes::COUNT]) -> [bool; Lanes::COUNT] {
        let theirs = others.map(|other| &self.world.flights[other as usize]);
        let lanes = |of: fn(&Flight) -> f64| Lanes(theirs.map(of));
        let ahead = (Lanes::all(self.flight.start.epoch) - lanes(|f| f.start.epoch))
            + (Lanes::all(self.flight.start.offset) - lanes(|f| f.start.offset));
        let (mine_flown, theirs_flown) = ((-ahead).max_zero(), ahead.max_zero());
        let lag = Lanes::all(self.age) - mine_flown;
        let along = |axis: usize, position: fn(&Flight) -> f64, velocity: fn(&Flight) -> f64| {
            let (my_position, my_velocity) = (self.flight.position[axis], self.flight.velocity[axis]);
            let their_velocity = lanes(velocity);
            let v = Lanes::all(my_velocity) - their_velocity;
            let mut r = (Lanes::all(my_position) + Lanes::all(my_velocity) * mine_flown)
                - (lanes(position) + their_velocity * theirs_flown);
            if self.periods.any {
                let images = (r + v * lag) * Lanes::all(self.periods.inverse[axis]);
                r = r
                    - (images + Lanes::all(NO_FRACTION) - Lanes::all(NO_FRACTION))
                        * Lanes::all(self.periods.length[axis]);
            }
            (r, v)
        };
        let x = along(0, |f| f.position.x, |f| f.velocity.x);
        let y = along(1, |f| f.position.y, |f| f.velocity.y);
        let z = along(2, |f| f.position.z, |f| f.velocity.z);
        let contact_distance = Lanes::all(self.radius) + Lanes(others.map(|other| self.world.radii[other as usize]));
        ball_ball::can_meet([x.0, y.0, z.0], [x.1, y.1, z.1], contact_distance)
    }

    /// When the ball and `other` next touch.
    #[inline(always)]
    fn impact_with(&self, other: usize) -> Time {
        let (r, v, mine_flown, theirs_flown) = self.seen_from(other);
        let start = if mine_flown > 0.0 { self.world.flights[other].start } else { self.flight.start };
        if !self.plain {
            return self.special_impact_with(other, r, v, start, mine_flown, theirs_flown);
        }
        match ball_ball::time_of_impact(r, v, self.radius + self.world.radii[other]) {
            // Two bodies in prescribed motion pass through each other.
            Some(seconds) if !(self.world.is_fixed(self.ball) && self.world.is_fixed(other)) => {
                let seconds = if seconds == 0.0 { self.rest(other, r, v) } else { seconds };
                self.world.clock.after(start, seconds)
            }
            _ => Time::NEVER,
        }
    }

    /// Seconds until an approaching pair that already touches has its impact: none, unless it rests in a contact without
    /// restitution. Rounding alone then makes it approach, so slowly that it takes long to get deeper than touching.
    #[cold]
    fn rest(&self, other: usize, r: DVec3, v: DVec3) -> f64 {
        let world = self.world;
        let theirs = &world.flights[other];
        if world.restitution.of(world.bodies[self.ball].material, world.bodies[other].material) > 0.0 {
            return 0.0;
        }
        let depth = self.radius + world.radii[other] - r.length();
        let largest = self.flight.position.abs().max(theirs.position.abs()).max_element();
        let speeds = self.flight.velocity.length() + theirs.velocity.length();
        resting_time(-r.dot(v) / r.length(), speeds, depth, largest.max(self.radius + world.radii[other]))
    }

    /// Considers all of `near`. Most of them cannot meet the ball; they are sifted out first, in a loop whose loads and
    /// arithmetic the processor can overlap because nothing in it branches.
    #[inline(always)]
    fn consider_all(&self, near: &mut [u32], first: &mut First, same: f64) {
        let mut kept = near.len();
        if self.plain {
            kept = 0;
            for begin in (0..near.len()).step_by(Lanes::COUNT) {
                let last = near.len() - 1;
                let others: [u32; Lanes::COUNT] = std::array::from_fn(|lane| near[(begin + lane).min(last)]);
                let meets = self.can_meet(others);
                for lane in 0..Lanes::COUNT.min(near.len() - begin) {
                    near[kept] = others[lane];
                    kept += usize::from(meets[lane]);
                }
            }
        }
        for &other in &near[..kept] {
            first.consider(self.impact_with(other as usize), Partner::ball(other), same);
        }
    }

    /// Under gravity, with growing balls, or in a box so small that two balls can meet through more than one image.
    fn special_impact_with(
        &self,
        other: usize,
        mut r: DVec3,
        mut v: DVec3,
        start: Time,
        mine_flown: f64,
        theirs_flown: f64,
    ) -> Time {
        let (mine, theirs) = (self.world.acceleration(self.ball), self.world.acceleration(other));
        r += (mine * (mine_flown * mine_flown) - theirs * (theirs_flown * theirs_flown)) * 0.5;
        v += mine * mine_flown - theirs * theirs_flown;
        if !self.periods.any {
            return self.meet(other, r, v, start);
        }
        let lag = self.age - mine_flown;
        r -= self.periods.shift(r + (v + (mine - theirs) * (0.5 * lag)) * lag);
        if self.radius + self.world.radii[other] <= self.periods.nearest_image_reach {
            return self.meet(other, r, v, start);
        }
        let range = |axis: usize| if self.periods.length[axis] > 0.0 { -2..=2 } else { 0..=0 };
        let mut first = Time::NEVER;
        for x in range(0) {
            for y in range(1) {
                for z in range(2) {
                    let shift = DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * self.periods.length;
                    let time = self.meet(other, r + shift, v, start);
                    if time.before(first) {
                        first = time;
                    }
                }
            }
        }
        first
    }

    /// When two balls touch that are at `r` (m) and fly at `v` (m/s) to each other at `start`.
    fn meet(&self, other: usize, r: DVec3, v: DVec3, start: Time) -> Time {
        let world = self.world;
        let contact_distance = self.radius + world.radii[other];
        let (fixed, other_fixed) = (world.is_fixed(self.ball), world.is_fixed(other));
        let seconds = if fixed && other_fixed {
            None
        } else if let Some(growth) = &world.growth {
            let (distance, rate) = (contact_distance * growth.factor(start), contact_distance * growth.rate);
            ball_ball::time_of_impact_growing(r, v, distance, rate)
        } else if fixed == other_fixed || world.gravity == DVec3::ZERO {
            ball_ball::time_of_impact(r, v, contact_distance)
                .map(|seconds| if seconds == 0.0 { self.rest(other, r, v) } else { seconds })
        } else {
            let (free, prescribed) = if fixed { (other, self.ball) } else { (self.ball, other) };
            let in_contact = world.bodies[free].last_partner == Partner::ball(prescribed as u32)
                && world.flights[free].start == start;
            let a = if fixed { -world.gravity } else { world.gravity };
            ball_ball_accelerated::time_of_impact(r, v, a, contact_distance, in_contact)
        };
        seconds.map_or(Time::NEVER, |seconds| world.clock.after(start, seconds))
    }
}

/// When a free ball next touches a plane.
#[inline(always)]
pub fn ball_plane_impact(world: &World, ball: usize, row: usize) -> Time {
    let plane = &world.planes[row];
    let flight = &world.flights[ball];
    let n = plane.normal;
    let radius = world.radius(ball, flight.start);
    let gap = n.dot(flight.position) - plane.offset_at(flight.start) - radius;
    let growth = world.growth.map_or(0.0, |growth| growth.rate * world.radii[ball]);
    let speed = n.dot(flight.velocity - plane.velocity) - growth;
    let in_contact = world.bodies[ball].last_partner == Partner::plane(row as u32);
    match ball_plane::time_of_impact(gap, speed, n.dot(world.gravity), in_contact) {
        // As `Seeker::rest`; under gravity a contact that lasts is an error of its own.
        Some(0.0)
            if !in_contact
                && world.gravity == DVec3::ZERO
                && world.restitution.of(world.bodies[ball].material, plane.material) == 0.0 =>
        {
            let speeds = flight.velocity.length() + plane.velocity.length();
            let largest = flight.position.abs().max_element().max(radius).max(plane.offset.abs());
            world.clock.after(flight.start, resting_time(-speed, speeds, -gap, largest))
        }
        Some(seconds) => world.clock.after(flight.start, seconds),
        None => Time::NEVER,
    }
}

/// Seconds in which surfaces that approach at `speed` (m/s) get from `depth` (m) to deeper than touching, if the speed is
/// but rounding of `speeds` (m/s); otherwise 0.
fn resting_time(speed: f64, speeds: f64, depth: f64, largest: f64) -> f64 {
    if speed > tolerance::RESTING * speeds {
        return 0.0;
    }
    ((tolerance::touching(largest) - depth) / speed).max(0.0)
}

/// Edge lengths of the periodic box, prepared for the search.
#[derive(Clone, Copy, Debug)]
pub struct Periods {
    any: bool,
    largest_radius: f64,
    nearest_image_reach: f64,
    length: DVec3,
    inverse: DVec3,
}

impl Periods {
    /// Of a world in these cells.
    pub fn new(world: &World, cells: &Cells) -> Self {
        let length = world.domain.periods();
        let inverse = |x: f64| if x > 0.0 { 1.0 / x } else { 0.0 };
        Self {
            any: world.domain.is_periodic(),
            largest_radius: world.radii.iter().copied().fold(0.0, f64::max),
            nearest_image_reach: cells.nearest_image_reach(),
            length,
            inverse: DVec3::new(inverse(length.x), inverse(length.y), inverse(length.z)),
        }
    }
}

impl Periods {
    /// The separation (m) of the nearest of two balls' images.
    #[inline(always)]
    pub fn nearest(&self, separation: DVec3) -> DVec3 {
        if self.any { separation - self.shift(separation) } else { separation }
    }

    /// The whole sizes of the box (m) in a separation, along each axis.
    #[inline(always)]
    fn shift(&self, separation: DVec3) -> DVec3 {
        round(separation * self.inverse) * self.length
    }

    /// How many sizes of the box a position (m) lies beyond it, along each axis.
    #[inline(always)]
    pub fn images_passed(&self, position: DVec3) -> DVec3 {
        round(position * self.inverse)
    }
}

/// Added to a number below 2^51, it leaves no room for a fraction; taken away again, the nearest whole number is left.
const NO_FRACTION: f64 = 1.5 * (1u64 << 52) as f64;

/// To the nearest whole numbers, ties to even.
#[inline(always)]
fn round(v: DVec3) -> DVec3 {
    (v + NO_FRACTION) - NO_FRACTION
}

/// The first of several possible impacts of one ball. Of those that rounding cannot tell apart, the lowest in rank.
#[derive(Clone, Copy, Debug)]
pub struct First {
    /// When.
    pub time: Time,
    /// With whom.
    pub partner: Partner,
    tied: bool,
}

impl First {
    /// Starts from an impact already known ([`Time::NEVER`] for none).
    pub fn from(time: Time, partner: Partner) -> Self {
        Self { time, partner, tied: false }
    }

    #[inline(always)]
    fn consider(&mut self, time: Time, partner: Partner, same: f64) {
        if time.before(self.time) {
            self.tied = self.time.since(time) <= same;
            self.time = time;
            self.partner = partner;
        } else if time.since(self.time) <= same && partner != self.partner {
            self.tied = true;
        }
    }
}

/// The first impact of `ball` with anybody near. `near` is room to work in.
#[inline(always)]
pub fn first_impact(
    world: &World,
    cells: &Cells,
    ball: usize,
    now: Time,
    periods: &Periods,
    near: &mut Vec<u32>,
) -> First {
    let same = SAME_INSTANT * world.clock.span();
    let mut first = First::from(Time::NEVER, Partner::NONE);
    if !world.is_fixed(ball) {
        for row in 0..world.planes.len() {
            first.consider(ball_plane_impact(world, ball, row), Partner::plane(row as u32), same);
        }
    }
    let seeker = Seeker::new(world, periods, ball, now);
    near.clear();
    cells.near(ball, seeker.radius, |other| near.push(other));
    seeker.consider_all(near, &mut first, same);
    if first.tied { lowest_of_instant(world, cells, ball, now, periods, first.time) } else { first }
}

/// After a passage through `face`: the first of the impact `known` so far and those with the balls newly near.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "all parts of one simulation")]
pub fn first_impact_after_crossing(
    world: &World,
    cells: &Cells,
    ball: usize,
    now: Time,
    periods: &Periods,
    face: Face,
    known: First,
    near: &mut Vec<u32>,
) -> First {
    let same = SAME_INSTANT * world.clock.span();
    let mut first = known;
    let seeker = Seeker::new(world, periods, ball, now);
    near.clear();
    cells.near_after_crossing(ball, seeker.radius, face, |other| near.push(other));
    seeker.consider_all(near, &mut first, same);
    if first.tied { lowest_of_instant(world, cells, ball, now, periods, first.time) } else { first }
}

/// Second look, where several impacts of a ball belong to one instant: the one that comes first in rank.
#[cold]
fn lowest_of_instant(world: &World, cells: &Cells, ball: usize, now: Time, periods: &Periods, earliest: Time) -> First {
    let end = world.clock.after(earliest, SAME_INSTANT * world.clock.span());
    let mut lowest: Option<(Rank, Time, Partner)> = None;
    let mut consider = |time: Time, partner: Partner| {
        if time.is_reachable() && !end.before(time) {
            let rank = rank(world, ball, partner);
            if lowest.is_none_or(|(other, _, _)| rank < other) {
                lowest = Some((rank, time, partner));
            }
        }
    };
    if !world.is_fixed(ball) {
        for row in 0..world.planes.len() {
            consider(ball_plane_impact(world, ball, row), Partner::plane(row as u32));
        }
    }
    let seeker = Seeker::new(world, periods, ball, now);
    cells.near(ball, seeker.radius, |other| {
        consider(seeker.impact_with(other as usize), Partner::ball(other));
    });
    lowest.map_or(First::from(Time::NEVER, Partner::NONE), |(_, time, partner)| First::from(time, partner))
}

/// The rank of the impact of `ball` with `partner` among those of one instant.
pub fn rank(world: &World, ball: usize, partner: Partner) -> Rank {
    let id = world.ids[ball];
    let (kind, other) = match (partner.as_ball(), partner.as_plane()) {
        (Some(other), _) => (Kind::BallBall, world.ids[other]),
        (None, Some(row)) => (Kind::BallPlane, world.planes[row].id),
        (None, None) => (Kind::BallPlane, i64::MAX),
    };
    Rank { kind, ids: (id.min(other), id.max(other)) }
}

/// When and through which face `ball` next leaves its cell.
#[inline(always)]
pub fn next_crossing(world: &World, cells: &Cells, ball: usize, now: Time) -> (Time, Face) {
    let flight = &world.flights[ball];
    let acceleration = world.acceleration(ball);
    let elapsed = now.since(flight.start);
    let mut least = f64::INFINITY;
    let mut face = Face { axis: 0, upward: false };
    for axis in 0..3 {
        let Some((low, high)) = cells.bounds(ball, axis) else { continue };
        let (x, v, a) = (flight.position[axis], flight.velocity[axis], acceleration[axis]);
        // Without acceleration only the face ahead can be reached.
        if a != 0.0 || v > 0.0 {
            let up = crossing::time_of_passage(x, v, a, high, elapsed);
            if up < least {
                least = up;
                face = Face { axis: axis as u8, upward: true };
            }
        }
        if a != 0.0 || v < 0.0 {
            let down = crossing::time_of_passage(-x, -v, -a, -low, elapsed);
            if down < least {
                least = down;
                face = Face { axis: axis as u8, upward: false };
            }
        }
    }
    (world.clock.after(flight.start, least), face)
}
