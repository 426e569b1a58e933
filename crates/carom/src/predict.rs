//! What comes next for a ball: the table of shape pairs, and the search through those near.

pub mod ball_ball;
pub mod ball_ball_accelerated;
pub mod ball_plane;
pub mod crossing;
pub mod lanes;
pub mod root;
pub mod row;

use glam::DVec3;

use self::lanes::Width;
use self::row::{Search, Soonest};
use crate::event::{Kind, Rank};
use crate::flight::Flight;
use crate::time::Time;
use crate::tolerance::{self, SAME_INSTANT};
use crate::world::cells::Face;
use crate::world::nearby::{Nearby, PlaneSet, filled_up};
use crate::world::{Domain, Partner, World};

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

/// What all predictions of a run share.
#[derive(Clone, Debug)]
pub struct Predictor {
    width: Width,
    periods: Periods,
    /// Contact distance (m), where all balls are of one size.
    contact_distance: Option<f64>,
    largest_radius: f64,
    nearest_image_reach: f64,
    /// All balls fall alike and none grows: their relative flights are straight.
    straight: bool,
    /// Times (s) less than this apart belong to one instant.
    same: f64,
    /// Room for a row of balls near, so that no prediction allocates.
    room: Vec<u32>,
}

/// A ball that looks for its next impact, with what all its pairs share.
#[derive(Clone, Copy)]
struct Seeker<'a> {
    world: &'a World,
    periods: &'a Periods,
    ball: usize,
    flight: Flight,
    radius: f64,
    contact_distance: Option<f64>,
    /// Seconds since the ball's last impact.
    age: f64,
    /// Straight relative flights, to each other's nearest images.
    plain: bool,
    nearest_image_reach: f64,
}

impl<'a> Seeker<'a> {
    #[inline(always)]
    fn new(world: &'a World, predictor: &'a Predictor, ball: usize, now: Time) -> Self {
        let flight = world.flights[ball];
        let radius = world.radii[ball];
        Self {
            world,
            periods: &predictor.periods,
            ball,
            flight,
            radius,
            contact_distance: predictor.contact_distance,
            age: now.since(flight.start()),
            plain: predictor.straight && radius + predictor.largest_radius <= predictor.nearest_image_reach,
            nearest_image_reach: predictor.nearest_image_reach,
        }
    }

    /// The ball seen from another: position (m) and velocity (m/s), and the seconds that each has flown, at the later of
    /// their last impacts. Only post-impact states enter, so that what is predicted does not depend on when it is predicted
    /// (the present only chooses the periodic image).
    #[inline(always)]
    fn seen_from(&self, other: usize) -> (DVec3, DVec3, f64) {
        let theirs = &self.world.flights[other];
        let ahead = self.flight.start().since(theirs.start());
        let (mine_flown, theirs_flown) = ((-ahead).max(0.0), ahead.max(0.0));
        let mut r = (self.flight.position() + self.flight.velocity() * mine_flown)
            - (theirs.position() + theirs.velocity() * theirs_flown);
        let mut v = self.flight.velocity() - theirs.velocity();
        let (mine, their) = (self.world.acceleration(self.ball), self.world.acceleration(other));
        if mine != DVec3::ZERO || their != DVec3::ZERO {
            r += (mine * (mine_flown * mine_flown) - their * (theirs_flown * theirs_flown)) * 0.5;
            v += mine * mine_flown - their * theirs_flown;
        }
        if self.periods.any {
            let lag = self.age - mine_flown;
            // Where they are now, for the image; their relative flight may be bent.
            let bent = if mine == their { DVec3::ZERO } else { (mine - their) * (0.5 * lag) };
            r -= self.periods.shift(r + (v + bent) * lag);
        }
        (r, v, mine_flown)
    }

    /// When the ball and `other` next touch.
    fn impact_with(&self, other: usize) -> Time {
        let (r, v, mine_flown) = self.seen_from(other);
        let start = if mine_flown > 0.0 { self.world.flights[other].start() } else { self.flight.start() };
        if !self.periods.any || self.radius + self.world.radii[other] <= self.nearest_image_reach {
            return self.meet(other, r, v, start);
        }
        // In a box so small that two balls can meet through more than one image.
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
        let largest = self.flight.position().abs().max(theirs.position().abs()).max_element();
        let speeds = self.flight.velocity().length() + theirs.velocity().length();
        resting_time(-r.dot(v) / r.length(), speeds, depth, largest.max(self.radius + world.radii[other]))
    }

    /// Considers all of a row that is filled up with the ball itself.
    #[inline(always)]
    fn consider_row(&self, width: Width, row: &[u32], first: &mut First, same: f64) {
        if self.plain {
            let soonest = self.soonest(width, row);
            if soonest.after_own_start == f64::INFINITY {
                return;
            }
            if soonest.seconds > 0.0 {
                let other = row[soonest.place];
                let theirs = self.world.flights[other as usize].start();
                let start = if self.flight.start().since(theirs) < 0.0 { theirs } else { self.flight.start() };
                first.consider(self.world.clock.after(start, soonest.seconds), Partner::ball(other), same);
                // Measured from one's own start, times err by a few ulps: those in doubt are looked at again.
                first.tied |=
                    soonest.next - soonest.after_own_start <= 2.0 * same + 8.0 * f64::EPSILON * soonest.after_own_start;
                return;
            }
        }
        for &other in row.iter().filter(|&&other| other as usize != self.ball) {
            first.consider(self.impact_with(other as usize), Partner::ball(other), same);
        }
    }

    /// The first impact with any of a row, by whatever registers this machine has.
    #[inline(always)]
    fn soonest(&self, width: Width, row: &[u32]) -> Soonest {
        match width {
            Width::Narrow(lanes) => Search { lanes, seeker: self, row }.run(),
            #[cfg(target_arch = "x86_64")]
            Width::Four(lanes) => Search { lanes, seeker: self, row }.run(),
            #[cfg(target_arch = "x86_64")]
            Width::Eight(lanes) => Search { lanes, seeker: self, row }.run(),
        }
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
                && world.flights[free].start() == start;
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
    let radius = world.radius(ball, flight.start());
    let gap = n.dot(flight.position()) - plane.offset_at(flight.start()) - radius;
    let growth = world.growth.map_or(0.0, |growth| growth.rate * world.radii[ball]);
    let speed = n.dot(flight.velocity() - plane.velocity) - growth;
    let in_contact = world.bodies[ball].last_partner == Partner::plane(row as u32);
    match ball_plane::time_of_impact(gap, speed, n.dot(world.gravity), in_contact) {
        // As `Seeker::rest`; under gravity a contact that lasts is an error of its own.
        Some(0.0)
            if !in_contact
                && world.gravity == DVec3::ZERO
                && world.restitution.of(world.bodies[ball].material, plane.material) == 0.0 =>
        {
            let speeds = flight.velocity().length() + plane.velocity.length();
            let largest = flight.position().abs().max_element().max(radius).max(plane.offset.abs());
            world.clock.after(flight.start(), resting_time(-speed, speeds, -gap, largest))
        }
        Some(seconds) => world.clock.after(flight.start(), seconds),
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
    length: DVec3,
    inverse: DVec3,
}

impl Periods {
    /// Of a domain.
    pub fn of(domain: &Domain) -> Self {
        let length = domain.periods();
        let inverse = |x: f64| if x > 0.0 { 1.0 / x } else { 0.0 };
        let inverse = DVec3::new(inverse(length.x), inverse(length.y), inverse(length.z));
        Self { any: domain.is_periodic(), length, inverse }
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

impl Predictor {
    /// For a world in which balls find each other by `nearby`.
    pub fn new(world: &World, nearby: &Nearby, width: Width) -> Self {
        let largest_radius = world.radii.iter().copied().fold(0.0, f64::max);
        let of_one_size = world.radii.iter().all(|&radius| radius == largest_radius);
        let any_fixed = (0..world.len()).any(|ball| world.is_fixed(ball));
        Self {
            width,
            periods: Periods::of(&world.domain),
            contact_distance: of_one_size.then_some(largest_radius + largest_radius),
            largest_radius,
            nearest_image_reach: nearby.nearest_image_reach(),
            straight: world.growth.is_none() && (world.gravity == DVec3::ZERO || !any_fixed),
            same: SAME_INSTANT * world.clock.span(),
            room: Vec::with_capacity(64),
        }
    }

    /// The periodic box.
    pub fn periods(&self) -> &Periods {
        &self.periods
    }

    /// The first impact of `ball` with anybody near.
    #[inline(always)]
    pub fn first_impact(&mut self, world: &World, nearby: &Nearby, ball: usize, now: Time) -> First {
        let mut first = First::from(Time::NEVER, Partner::NONE);
        for_planes(world, nearby.planes(ball), ball, |time, partner| first.consider(time, partner, self.same));
        let mut room = std::mem::take(&mut self.room);
        let row = nearby.row(world, ball, &mut room);
        let seeker = Seeker::new(world, self, ball, now);
        seeker.consider_row(self.width, row, &mut first, self.same);
        if first.tied {
            first = self.lowest_of_instant(&seeker, row, nearby.planes(ball));
        }
        self.room = room;
        first
    }

    /// After a passage through the face of a cell: the first of the impact `known` so far and those with the balls and planes
    /// newly near.
    #[inline(always)]
    pub fn first_impact_after_crossing(
        &mut self,
        world: &World,
        nearby: &Nearby,
        ball: usize,
        now: Time,
        face: Face,
        known: First,
    ) -> First {
        let Nearby::Cells(cells) = nearby else { return self.first_impact(world, nearby, ball, now) };
        let mut first = known;
        for_planes(world, nearby.planes(ball), ball, |time, partner| first.consider(time, partner, self.same));
        let mut room = std::mem::take(&mut self.room);
        room.clear();
        cells.near_after_crossing(ball, world.radii[ball], face, |other| room.push(other));
        let row = filled_up(&mut room, ball);
        Seeker::new(world, self, ball, now).consider_row(self.width, row, &mut first, self.same);
        self.room = room;
        if first.tied { self.first_impact(world, nearby, ball, now) } else { first }
    }

    /// Second look, where several impacts of a ball may belong to one instant: the one that comes first in rank.
    #[cold]
    fn lowest_of_instant(&self, seeker: &Seeker, row: &[u32], planes: PlaneSet) -> First {
        let (world, ball) = (seeker.world, seeker.ball);
        let mut found: Vec<(Time, Partner)> = Vec::new();
        for_planes(world, planes, ball, |time, partner| found.push((time, partner)));
        found.extend(
            row.iter()
                .filter(|&&other| other as usize != ball)
                .map(|&other| (seeker.impact_with(other as usize), Partner::ball(other))),
        );
        let earliest =
            found.iter().fold(Time::NEVER, |first, &(time, _)| if time.before(first) { time } else { first });
        if !earliest.is_reachable() {
            return First::from(Time::NEVER, Partner::NONE);
        }
        let end = world.clock.after(earliest, self.same);
        let of_instant = found.into_iter().filter(|(time, _)| !end.before(*time));
        let lowest = of_instant.min_by_key(|&(_, partner)| rank(world, ball, partner));
        lowest.map_or(First::from(Time::NEVER, Partner::NONE), |(time, partner)| First::from(time, partner))
    }
}

/// Calls `visit` with the impacts of a free ball with some planes.
#[inline(always)]
fn for_planes(world: &World, planes: PlaneSet, ball: usize, mut visit: impl FnMut(Time, Partner)) {
    if planes.is_empty() || world.is_fixed(ball) {
        return;
    }
    for row in 0..world.planes.len() {
        if planes.contains(row) {
            visit(ball_plane_impact(world, ball, row), Partner::plane(row as u32));
        }
    }
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
