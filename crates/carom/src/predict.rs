//! What comes next for a ball: the table of shape pairs, and the search through those near.

pub mod ball_ball;
pub mod ball_ball_accelerated;
pub mod ball_plane;
pub mod crossing;
mod cut_off;
pub mod lanes;
mod newly;
pub mod root;
mod row;
mod seeker;
pub(crate) mod solids;
pub(crate) mod surroundings;
pub mod turning;

use glam::DVec3;

use self::cut_off::{CutOffs, Foreseen, Next};
use self::lanes::{MOST, Width};
pub use self::newly::{Meeting, Newly};
use self::row::{Search, SearchOfBoth, Soonest};
use self::seeker::Seeker;
use self::surroundings::{TriangleRoom, impact_with_mesh};
use crate::event::{Certificate, Kind, PairKind, Rank, Upcoming};
use crate::scene::Simultaneous;
use crate::time::Time;
use crate::tolerance::{self, SAME_INSTANT};
use crate::world::lists::Lists;
use crate::world::nearby::{Gathered, Nearby, PlaneSet};
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
    /// The two largest radii (m).
    largest_radii: [f64; 2],
    nearest_image_reach: f64,
    /// All balls fall alike and none grows: their relative flights are straight.
    straight: bool,
    falling: bool,
    /// Times (s) less than this apart belong to one instant.
    same: f64,
    /// Room for triangles near, so that no prediction allocates.
    triangles: TriangleRoom,
    /// How what comes next is certified, of each row; empty where nobody turns.
    certificates: Vec<Certificate>,
    cut_offs: CutOffs,
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
                && !world.has_gravity()
                && (world.restitution.of(world.bodies[ball].material, plane.material) == 0.0
                    || world.simultaneous == Simultaneous::Reflections) =>
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

    /// The whole sizes of the box (m) in a separation, along each axis; zero where space is not periodic.
    #[inline(always)]
    pub fn shift_of(&self, separation: DVec3) -> DVec3 {
        if self.any { self.shift(separation) } else { DVec3::ZERO }
    }

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
pub(crate) const NO_FRACTION: f64 = 1.5 * (1u64 << 52) as f64;

/// To the nearest whole numbers, ties to even.
#[inline(always)]
pub(crate) fn round(v: DVec3) -> DVec3 {
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
    /// So much later (s) somebody else may be met, not before; 0 if that is not known.
    pub alone: f64,
}

impl First {
    /// None.
    pub const NEVER: Self = Self { time: Time::NEVER, partner: Partner::NONE, tied: false, alone: 0.0 };

    /// One that no other comes near.
    pub(crate) fn single(time: Time, partner: Partner) -> Self {
        Self { time, partner, tied: false, alone: 0.0 }
    }

    /// With another impact considered.
    #[inline(always)]
    fn or(self, time: Time, partner: Partner, same: f64) -> Self {
        if time.before(self.time) {
            return Self { time, partner, tied: self.time.since(time) <= same, alone: 0.0 };
        }
        let tied = time.since(self.time) <= same && partner != self.partner;
        Self { tied: self.tied | tied, ..self }
    }
}

impl Predictor {
    /// For a world in which balls find each other by `nearby`.
    pub fn new(world: &World, nearby: &Nearby, width: Width) -> Self {
        let any_fixed = (0..world.len()).any(|ball| world.is_fixed(ball));
        let falling = world.has_gravity();
        Self {
            width,
            periods: Periods::of(&world.domain),
            contact_distance: world.radii.one().map(|radius| radius + radius),
            largest_radii: world.largest_radii(),
            nearest_image_reach: nearby.nearest_image_reach(),
            straight: world.growth.is_none() && !(falling && any_fixed),
            falling,
            same: SAME_INSTANT * world.clock.span(),
            triangles: TriangleRoom::default(),
            certificates: if world.turning.is_some() { vec![Certificate::ClosedForm; world.len()] } else { Vec::new() },
            cut_offs: CutOffs::default(),
        }
    }

    /// For the same world after a change of its order in memory. What is known of bodies by their ids is kept.
    pub fn anew(&mut self, world: &World, nearby: &Nearby) -> Self {
        Self { cut_offs: std::mem::take(&mut self.cut_offs), ..Self::new(world, nearby, self.width) }
    }

    /// How the impact that was foreseen for the body in this row is certified.
    pub(crate) fn certificate(&self, row: usize) -> Certificate {
        self.certificates.get(row).copied().unwrap_or(Certificate::ClosedForm)
    }

    /// When the search for an impact of two bodies, as `search` tells it, has to go on.
    #[cfg(test)]
    pub(crate) fn foresee_pair(
        &mut self,
        world: &World,
        [a, b]: [usize; 2],
        times: [Time; 2],
        search: impl FnMut(Time, f64) -> turning::Search,
    ) -> Time {
        let pair = cut_off::Pair::of_bodies(world, a, b, DVec3::ZERO, world.flights[a].start());
        self.cut_offs.foresee(world, pair, times, self.same, search).time
    }

    /// Ids of a pair with the body in this row for which the search of an impact cannot be brought on at all.
    pub(crate) fn stuck(&self, world: &World, row: usize) -> Option<(i64, i64)> {
        self.cut_offs.stuck(world, row)
    }

    /// Times (s) less than this apart belong to one instant.
    pub(crate) fn same_instant(&self) -> f64 {
        self.same
    }

    /// The periodic box.
    pub fn periods(&self) -> &Periods {
        &self.periods
    }

    /// The first impact of `ball` with anybody near. `room` is room to gather them in, so that no prediction allocates.
    #[inline(always)]
    pub fn first_impact(
        &mut self,
        world: &World,
        nearby: &Nearby,
        ball: usize,
        now: Time,
        room: &mut Gathered,
    ) -> First {
        if let Nearby::Lists(lists) = nearby
            && self.meets_turning(world, lists, ball)
        {
            return self.first_with_turning(world, lists, ball, now);
        }
        self.first_impact_among(world, nearby, ball, now, nearby.row(world, ball, room))
    }

    /// The first impact of `ball` with anybody of a row that is filled up with the ball itself, or with a plane.
    #[inline(always)]
    pub fn first_impact_among(&self, world: &World, nearby: &Nearby, ball: usize, now: Time, row: &[u32]) -> First {
        Seeker { world, predictor: self, ball, now }.first(row, nearby.planes(ball))
    }

    /// The first impacts of both balls of an impact. Where there are lists, both search before either is foretold: so the
    /// processor works on one row while it waits for the other.
    #[inline(always)]
    pub fn first_impacts(
        &mut self,
        world: &World,
        nearby: &Nearby,
        balls: [usize; 2],
        now: Time,
        room: &mut Gathered,
    ) -> [First; 2] {
        if let Nearby::Lists(lists) = nearby
            && !balls.iter().any(|&ball| self.meets_turning(world, lists, ball))
        {
            let [a, b] = balls.map(|ball| Seeker { world, predictor: self, ball, now });
            if a.is_plain() && b.is_plain() {
                let rows = balls.map(|ball| lists.row(ball));
                let found = self.search_of_both([a, b], rows);
                let first_a = a.first_with(&found[0], rows[0], lists.planes(balls[0]));
                let first_b = b.first_with(&found[1], rows[1], lists.planes(balls[1]));
                return [first_a, first_b];
            }
        }
        // One after the other: an array's `map` would go through memory.
        let first_a = self.first_impact(world, nearby, balls[0], now, room);
        let first_b = self.first_impact(world, nearby, balls[1], now, room);
        [first_a, first_b]
    }

    /// The same for both balls of an impact.
    #[inline(always)]
    fn search_of_both(&self, [a, b]: [Seeker; 2], rows: [&[u32]; 2]) -> [Soonest; 2] {
        let fresh = a.flight().start() == a.now && b.flight().start() == b.now;
        if fresh
            && !self.falling
            && let Ok(row_a) = <&[u32; 2 * MOST]>::try_from(rows[0])
            && let Ok(row_b) = <&[u32; 2 * MOST]>::try_from(rows[1])
        {
            return self.width.run(&SearchOfBoth { seekers: [a, b], rows: [row_a, row_b] });
        }
        [self.search(a, rows[0]), self.search(b, rows[1])]
    }

    /// Searches a row by whatever registers this machine has.
    #[inline(always)]
    fn search(&self, seeker: Seeker, row: &[u32]) -> Soonest {
        // A form for each of the lengths of most lists and of most rows from cells.
        if let Ok(row) = <&[u32; 2 * MOST]>::try_from(row) {
            self.width.run(&Search { seeker, row })
        } else if let Ok(row) = <&[u32; 3 * MOST]>::try_from(row) {
            self.width.run(&Search { seeker, row })
        } else if let Ok(row) = <&[u32; 4 * MOST]>::try_from(row) {
            self.width.run(&Search { seeker, row })
        } else {
            self.width.run(&Search { seeker, row })
        }
    }

    /// Whether `ball` or somebody near turns.
    #[inline(always)]
    fn meets_turning(&self, world: &World, lists: &Lists, ball: usize) -> bool {
        world.turning.is_some()
            && (!lists.beside(ball).is_empty() || world.turning_body(ball).is_some() || !world.meshes.is_empty())
    }

    /// The first impact of `ball`, which may turn, with anybody near, of whom some may, and with meshes; with nobody, where a
    /// search that was cut off has to go on before.
    #[inline(never)]
    fn first_with_turning(&mut self, world: &World, lists: &Lists, ball: usize, now: Time) -> First {
        let turns = world.turning_body(ball).is_some();
        // Planes are for balls alone here.
        let planes = if turns { PlaneSet::NONE } else { lists.planes(ball) };
        let mut first = Seeker { world, predictor: self, ball, now }.first(lists.row(ball), planes);
        let mut certificate = Certificate::ClosedForm;
        // Nothing after the body has left its list needs to be known, nor after a search has to go on.
        let (leaves, mut again) = (lists.leaves(world, ball, now), Time::NEVER);
        let mut consider = |first: &mut First, foreseen: Foreseen, partner: Partner, same: f64| {
            let Some(how) = foreseen.certificate else {
                again = if foreseen.time.before(again) { foreseen.time } else { again };
                return;
            };
            if foreseen.time.before(first.time) {
                certificate = how;
            }
            *first = first.or(foreseen.time, partner, same);
        };
        let limit = |first: &First| if first.time.before(leaves) { first.time } else { leaves };
        for &other in lists.beside(ball) {
            let (pair, times) = ([ball, other as usize], [now, limit(&first)]);
            let foreseen = solids::impact_of_bodies(world, &self.periods, &mut self.cut_offs, pair, times, self.same);
            consider(&mut first, foreseen, Partner::ball(other), self.same);
        }
        if turns && !world.is_fixed(ball) {
            for row in 0..world.planes.len() {
                if lists.planes(ball).contains(row) {
                    let times = [now, limit(&first)];
                    let foreseen = solids::impact_with_plane(world, &mut self.cut_offs, ball, row, times, self.same);
                    consider(&mut first, foreseen, Partner::plane(row as u32), self.same);
                }
            }
        }
        if !world.is_fixed(ball) {
            for mesh in 0..world.meshes.len() {
                let (times, room) = ([now, limit(&first)], &mut self.triangles);
                let foreseen = impact_with_mesh(world, &mut self.cut_offs, [ball, mesh], times, self.same, room);
                consider(&mut first, foreseen, Partner::mesh(mesh as u32), self.same);
            }
        }
        if again.before(first.time) {
            return First { time: again, ..First::NEVER };
        }
        let next = Next { time: first.time, partner: first.partner, certificate };
        let next = if first.tied { self.lowest_with_turning(world, lists, ball, now, next) } else { next };
        self.certificates[ball] = next.certificate;
        First::single(next.time, next.partner)
    }

    /// Second look, where several impacts may belong to one instant: the one that comes first in rank.
    #[cold]
    fn lowest_with_turning(&mut self, world: &World, lists: &Lists, ball: usize, now: Time, first: Next) -> Next {
        let turns = world.turning_body(ball).is_some();
        let end = world.clock.after(first.time, 2.0 * self.same);
        let mut found: Vec<Next> = vec![first];
        // Up to the first nothing had to be looked at again.
        let mut add = |Foreseen { time, certificate }: Foreseen, partner: Partner| {
            found.extend(certificate.map(|certificate| Next { time, partner, certificate }));
        };
        for &other in lists.beside(ball) {
            let pair = [ball, other as usize];
            let foreseen =
                solids::impact_of_bodies(world, &self.periods, &mut self.cut_offs, pair, [now, end], self.same);
            add(foreseen, Partner::ball(other));
        }
        for row in 0..world.planes.len() {
            if turns && !world.is_fixed(ball) && lists.planes(ball).contains(row) {
                let foreseen = solids::impact_with_plane(world, &mut self.cut_offs, ball, row, [now, end], self.same);
                add(foreseen, Partner::plane(row as u32));
            }
        }
        for mesh in 0..world.meshes.len() {
            if !world.is_fixed(ball) {
                let room = &mut self.triangles;
                let foreseen = impact_with_mesh(world, &mut self.cut_offs, [ball, mesh], [now, end], self.same, room);
                add(foreseen, Partner::mesh(mesh as u32));
            }
        }
        if !turns {
            let seeker = Seeker { world, predictor: self, ball, now };
            let other = seeker.lowest_of_instant(lists.row(ball), lists.planes(ball));
            add(Foreseen { time: other.time, certificate: Some(Certificate::ClosedForm) }, other.partner);
        }
        let earliest =
            found.iter().fold(Time::NEVER, |first, next| if next.time.before(first) { next.time } else { first });
        let end = world.clock.after(earliest, self.same);
        let of_instant = found.iter().filter(|next| !end.before(next.time));
        of_instant.min_by_key(|next| rank(world, ball, next.partner)).copied().unwrap_or(first)
    }

    /// After the passage through the face of a cell that was foretold: the first impact with the balls newly near, the planes
    /// near, and the ball that is the first of those that were near before, if there is one.
    #[inline(never)]
    pub fn first_impact_after_crossing(
        &mut self,
        world: &World,
        nearby: &Nearby,
        ball: usize,
        now: Time,
        foretold: &Upcoming,
        room: &mut Gathered,
    ) -> First {
        let (Nearby::Cells(cells), Some(face)) = (nearby, foretold.leaves) else {
            return self.first_impact(world, nearby, ball, now, room);
        };
        room.clear();
        cells.near_after_crossing(ball, || world.radii[ball], face, room);
        if let Some(known) = foretold.partner.as_ball()
            && !room.rows().contains(&(known as u32))
        {
            room.push(known as u32);
        }
        room.retain_partners(world, ball);
        let row = room.filled_up(ball);
        let first = Seeker { world, predictor: self, ball, now }.first_unless_tied(row, nearby.planes(ball));
        if first.tied {
            return self.first_impact(world, nearby, ball, now, room);
        }
        // These are not all who are near.
        First { alone: 0.0, ..first }
    }
}

/// Calls `visit` with the impacts of a free ball with some planes.
#[inline(never)]
fn for_planes(world: &World, planes: PlaneSet, ball: usize, mut visit: impl FnMut(Time, Partner)) {
    if world.is_fixed(ball) {
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
    let id = world.id(ball);
    let (pair, other) = match (partner.as_ball(), partner.as_plane()) {
        (Some(other), _) => (PairKind::BallBall, world.id(other)),
        (None, Some(row)) => (PairKind::BallPlane, world.planes[row].id),
        (None, None) => match partner.as_mesh() {
            Some(row) => (PairKind::Turning, world.meshes[row].id),
            None => (PairKind::BallPlane, i64::MAX),
        },
    };
    let turns = |row: usize| world.turning_body(row).is_some();
    let turning = turns(ball) || partner.as_ball().is_some_and(turns);
    Rank { pair: if turning { PairKind::Turning } else { pair }, ids: (id.min(other), id.max(other)) }
}
