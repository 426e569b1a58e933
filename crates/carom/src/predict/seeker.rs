//! One ball that looks for its next impact among those near.

use glam::DVec3;

use super::row::Soonest;
use super::{First, Predictor, ball_ball, ball_ball_accelerated, for_planes, rank};
use crate::flight::Flight;
use crate::scene::Simultaneous;
use crate::time::Time;
use crate::tolerance;
use crate::world::nearby::PlaneSet;
use crate::world::{Partner, World};

/// The ball, and what all predictions share.
#[derive(Clone, Copy)]
pub(super) struct Seeker<'a> {
    pub world: &'a World,
    pub predictor: &'a Predictor,
    pub ball: usize,
    /// Only chooses the periodic images: those that are nearest now.
    pub now: Time,
}

impl Seeker<'_> {
    #[inline(always)]
    pub fn flight(&self) -> &Flight {
        &self.world.flights[self.ball]
    }

    #[inline(always)]
    pub fn radius(&self) -> f64 {
        self.world.radii[self.ball]
    }

    /// Whether all the ball's pairs are straight relative flights to each other's nearest images.
    #[inline(always)]
    pub fn is_plain(&self) -> bool {
        let Predictor { straight, largest_radii: [largest, second], nearest_image_reach, .. } = *self.predictor;
        if let Some(distance) = self.predictor.contact_distance {
            return straight && distance <= nearest_image_reach;
        }
        let radius = self.radius();
        straight && radius + if radius == largest { second } else { largest } <= nearest_image_reach
    }

    /// The first impact with anybody of a row that is filled up with the ball itself, or with a plane.
    #[inline(always)]
    pub fn first(&self, row: &[u32], planes: PlaneSet) -> First {
        let first = self.first_unless_tied(row, planes);
        if first.tied { self.lowest_of_instant(row, planes) } else { first }
    }

    /// As [`Seeker::first`], or one of the first if several may belong to one instant.
    #[inline(always)]
    pub fn first_unless_tied(&self, row: &[u32], planes: PlaneSet) -> First {
        if !self.is_plain() {
            return self.first_one_by_one(row, self.first_plane(planes));
        }
        let soonest = self.predictor.search(*self, row);
        self.considering(&soonest, row, self.first_plane(planes))
    }

    /// The first impact, given what a search through the row has found.
    #[inline(always)]
    pub fn first_with(&self, soonest: &Soonest, row: &[u32], planes: PlaneSet) -> First {
        let first = self.considering(soonest, row, self.first_plane(planes));
        if first.tied { self.lowest_of_instant(row, planes) } else { first }
    }

    #[inline(always)]
    fn first_plane(&self, planes: PlaneSet) -> First {
        if planes.is_empty() { First::NEVER } else { self.first_of_planes(planes) }
    }

    #[inline(never)]
    fn first_of_planes(&self, planes: PlaneSet) -> First {
        let mut first = First::NEVER;
        for_planes(self.world, planes, self.ball, |time, partner| {
            first = first.or(time, partner, self.predictor.same);
        });
        first
    }

    /// `first`, or what a search through the row has found, if that is sooner.
    #[inline(always)]
    pub fn considering(&self, soonest: &Soonest, row: &[u32], first: First) -> First {
        if soonest.after_own_start == f64::INFINITY {
            return first;
        }
        if soonest.seconds == 0.0 {
            // A pair that touches may rest.
            return self.first_one_by_one(row, first);
        }
        let (start, same) = (self.flight().start(), self.predictor.same);
        let other = row[soonest.place];
        let theirs = self.world.flights[other as usize].start();
        let later = if start.since(theirs) < 0.0 { theirs } else { start };
        let before = first.time;
        let first = first.or(self.world.clock.after(later, soonest.seconds), Partner::ball(other), same);
        // Measured from one's own start, times err by a few ulps: those in doubt are looked at again.
        let doubt = 2.0 * same + 8.0 * f64::EPSILON * soonest.after_own_start;
        let apart = soonest.next - soonest.after_own_start;
        let alone = (apart - doubt).min(before.since(first.time));
        First { tied: first.tied | (apart <= doubt), alone, ..first }
    }

    #[inline(never)]
    fn first_one_by_one(&self, row: &[u32], mut first: First) -> First {
        for &other in row.iter().filter(|&&other| other as usize != self.ball) {
            first = first.or(self.impact_with(other as usize), Partner::ball(other), self.predictor.same);
        }
        first
    }

    /// Second look, where several impacts of the ball may belong to one instant: the one that comes first in rank.
    #[cold]
    pub fn lowest_of_instant(&self, row: &[u32], planes: PlaneSet) -> First {
        let (world, ball) = (self.world, self.ball);
        let mut found: Vec<(Time, Partner)> = Vec::new();
        for_planes(world, planes, ball, |time, partner| found.push((time, partner)));
        let others = row.iter().filter(|&&other| other as usize != ball);
        found.extend(others.map(|&other| (self.impact_with(other as usize), Partner::ball(other))));
        let earliest =
            found.iter().fold(Time::NEVER, |first, &(time, _)| if time.before(first) { time } else { first });
        if !earliest.is_reachable() {
            return First::NEVER;
        }
        let end = world.clock.after(earliest, self.predictor.same);
        let of_instant = found.into_iter().filter(|(time, _)| !end.before(*time));
        let lowest = of_instant.min_by_key(|&(_, partner)| rank(world, ball, partner));
        lowest.map_or(First::NEVER, |(time, partner)| First::single(time, partner))
    }

    /// The ball seen from another: position (m) and velocity (m/s), and the seconds that the ball has flown, at the later of
    /// their last impacts. Only post-impact states enter, so that what is predicted does not depend on when it is predicted
    /// (the present only chooses the periodic image).
    fn seen_from(&self, other: usize) -> (DVec3, DVec3, DVec3, f64) {
        let (mine, theirs) = (self.flight(), &self.world.flights[other]);
        let ahead = mine.start().since(theirs.start());
        let (mine_flown, theirs_flown) = ((-ahead).max(0.0), ahead.max(0.0));
        let mut r =
            (mine.position() + mine.velocity() * mine_flown) - (theirs.position() + theirs.velocity() * theirs_flown);
        let mut v = mine.velocity() - theirs.velocity();
        let (my_fall, their_fall) = (self.world.acceleration(self.ball), self.world.acceleration(other));
        if self.predictor.falling {
            r += (my_fall * (mine_flown * mine_flown) - their_fall * (theirs_flown * theirs_flown)) * 0.5;
            v += my_fall * mine_flown - their_fall * theirs_flown;
        }
        let mut images = DVec3::ZERO;
        if self.predictor.periods.any {
            let lag = self.now.since(mine.start()) - mine_flown;
            // Where they are now; their relative flight may be bent.
            let bent = if my_fall == their_fall { DVec3::ZERO } else { (my_fall - their_fall) * (0.5 * lag) };
            images = self.predictor.periods.images_passed(r + (v + bent) * lag);
        }
        (r, images, v, mine_flown)
    }

    /// The contact distance (m) to another.
    #[inline(always)]
    pub fn contact_distance(&self, other: usize) -> f64 {
        match self.predictor.contact_distance {
            Some(same) => same,
            None => self.radius() + self.world.radii[other],
        }
    }

    /// When a plain ball and `other`, which are near, meet: seconds from the ball's own start, and from the later of both.
    pub fn meeting_with(&self, other: usize) -> Option<(f64, f64)> {
        let (r, images, v, mine_flown) = self.seen_from(other);
        let r = r - images * self.predictor.periods.length;
        let seconds = ball_ball::time_of_impact(r, v, self.contact_distance(other))?;
        Some((seconds + mine_flown, seconds))
    }

    /// When the ball and `other` next touch.
    fn impact_with(&self, other: usize) -> Time {
        let (r, images, v, mine_flown) = self.seen_from(other);
        let start = if mine_flown > 0.0 { self.world.flights[other].start() } else { self.flight().start() };
        let periods = &self.predictor.periods;
        if !periods.any || self.radius() + self.world.radii[other] <= self.predictor.nearest_image_reach {
            return self.meet(other, r - images * periods.length, v, start);
        }
        // In a box so small that two balls can meet through more than one image.
        let range = |axis: usize| if periods.length[axis] > 0.0 { -2..=2 } else { 0..=0 };
        let mut first = Time::NEVER;
        for x in range(0) {
            for y in range(1) {
                for z in range(2) {
                    // Counted before they are taken off: from whichever image they are counted, the bits are the same.
                    let images = images + DVec3::new(f64::from(x), f64::from(y), f64::from(z));
                    let time = self.meet(other, r - images * periods.length, v, start);
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
        let contact_distance = self.radius() + world.radii[other];
        let (fixed, other_fixed) = (world.is_fixed(self.ball), world.is_fixed(other));
        let seconds = if fixed && other_fixed {
            None
        } else if let Some(growth) = &world.growth {
            let (distance, rate) = (contact_distance * growth.factor(start), contact_distance * growth.rate);
            ball_ball::time_of_impact_growing(r, v, distance, rate)
        } else if fixed == other_fixed || !world.has_gravity() {
            ball_ball::time_of_impact(r, v, contact_distance)
                .and_then(|seconds| if seconds == 0.0 { self.rest(other, r, v) } else { Some(seconds) })
        } else {
            let (free, prescribed) = if fixed { (other, self.ball) } else { (self.ball, other) };
            let in_contact = world.bodies[free].last_partner == Partner::ball(prescribed as u32)
                && world.flights[free].start() == start
                // Through this image, not another.
                && r.length() <= contact_distance * (1.0 + tolerance::CELL_MARGIN);
            let a = if fixed { -world.gravity } else { world.gravity };
            ball_ball_accelerated::time_of_impact(r, v, a, contact_distance, in_contact)
        };
        seconds.map_or(Time::NEVER, |seconds| world.clock.after(start, seconds))
    }

    /// Seconds until an approaching pair that already touches has its impact: none, unless it rests in a contact without
    /// restitution. Rounding alone then makes it approach, so slowly that it takes long to get deeper than touching.
    #[cold]
    fn rest(&self, other: usize, r: DVec3, v: DVec3) -> Option<f64> {
        let world = self.world;
        let theirs = &world.flights[other];
        let speeds = self.flight().velocity().length() + theirs.velocity().length();
        let bounces = world.restitution.of(world.bodies[self.ball].material, world.bodies[other].material) > 0.0;
        if (bounces && world.simultaneous == Simultaneous::Pairwise)
            || -r.dot(v) / r.length() > tolerance::RESTING * speeds
        {
            return Some(0.0);
        }
        // When it is deeper than touching; if it slides, it never is.
        let distance = self.radius() + world.radii[other];
        let largest = self.flight().position().abs().max(theirs.position().abs()).max_element().max(distance);
        ball_ball::time_of_impact(r, v, distance - tolerance::touching(largest))
    }
}
