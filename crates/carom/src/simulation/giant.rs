//! Very large balls among small ones. After each of its many impacts such a ball would have to look at the thousands all around
//! it, though an impact with something so light hardly changes its course. So there is a course for it, the one that it was on
//! when all around were looked at last; and whoever comes close to where it is on that course, before anything else happens to
//! him or he passes into another cell, is noted when that is foretold, and looked at again when he has passed. As long as it
//! stays within a little way of its course, these are all that it can meet.

use super::Simulation;
use crate::event::Upcoming;
use crate::flight::Flight;
use crate::predict::Periods;
use crate::time::Time;
use crate::world::World;
use crate::world::nearby::{Gathered, Nearby};

/// A ball is very large if its radius is so many times that of the smallest, and so many are near.
const LEAST_RATIO: f64 = 16.0;
const FEWEST_NEAR: usize = 512;
/// Of more of them, everybody would have to be told about too many.
const MOST_GIANTS: usize = 8;
/// How far from its course a very large ball may be, in radii of the smallest ball. (More are noted if it is more; all around are
/// looked at more often if it is less. It matters little beside how far small ones fly freely.)
const MARGIN: f64 = 0.2;
/// The part of that way which is left to rounding.
const SPARE: f64 = 0.1;

/// A very large ball.
#[derive(Clone, Debug)]
struct Giant {
    ball: u32,
    /// None until all around have been looked at.
    course: Option<Flight>,
    /// Whoever came close when he was told about, and maybe does no longer.
    noted: Vec<u32>,
}

/// All very large balls.
#[derive(Clone, Debug)]
pub(super) struct Giants {
    giants: Vec<Giant>,
    periods: Periods,
    /// How far (m) they may be from their courses.
    margin: f64,
    /// How far (m) two balls come towards each other at most before one of them has left its place, and is looked at again.
    before_leaving: f64,
    /// For each ball, a bit for each of these: whether it is noted there, and whether it still comes close.
    noted: Vec<u8>,
    close: Vec<u8>,
}

impl Giants {
    /// Finds out who is very large, when it is known who is near whom.
    pub fn find(world: &World, nearby: &Nearby, room: &mut Gathered) -> Self {
        let periods = Periods::of(&world.domain);
        let mut found = Self {
            giants: Vec::new(),
            periods,
            margin: 0.0,
            before_leaving: f64::INFINITY,
            noted: Vec::new(),
            close: Vec::new(),
        };
        let smallest = world.radii.iter().fold(f64::INFINITY, f64::min);
        let [largest, _] = world.largest_radii();
        let bent = world.has_gravity() && (0..world.len()).any(|ball| world.is_fixed(ball));
        let balls_alone = world.turning.is_none() && world.meshes.is_empty();
        if largest < LEAST_RATIO * smallest || world.growth.is_some() || bent || !balls_alone {
            return found;
        }
        let is_large = |ball: &usize| world.radii[*ball] >= LEAST_RATIO * smallest;
        let large: Vec<usize> = (0..world.len()).filter(is_large).take(MOST_GIANTS + 1).collect();
        if large.len() > MOST_GIANTS {
            return found;
        }
        for ball in large {
            if nearby.row(world, ball, room).len() >= FEWEST_NEAR {
                found.giants.push(Giant { ball: ball as u32, course: None, noted: Vec::new() });
            }
        }
        found.margin = MARGIN * smallest;
        // The large one's course leads no farther than it does itself, and it is near it.
        found.before_leaving = 2.0 * (nearby.longest_way() + found.margin);
        let others = (0..world.len()).filter(|&ball| found.which(ball).is_none());
        let largest_other = others.map(|ball| world.radii[ball]).fold(0.0, f64::max);
        // They have to meet everybody but each other through the nearest image alone.
        let reach = largest + largest_other + 2.0 * found.margin;
        if reach > nearby.nearest_image_reach() {
            found.giants.clear();
        }
        if found.any() {
            found.noted = vec![0; world.len()];
            found.close = vec![0; world.len()];
        }
        found
    }

    /// Whether there are any.
    #[inline(always)]
    pub fn any(&self) -> bool {
        !self.giants.is_empty()
    }

    /// None any longer: they always look at all around.
    #[cfg(test)]
    pub fn forget(&mut self) {
        self.giants.clear();
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let noted = self.giants.iter().map(|giant| giant.noted.capacity() * size_of::<u32>());
        noted.sum::<usize>() + self.noted.len() + self.close.len()
    }

    /// Which of them a ball is.
    #[inline(always)]
    fn which(&self, ball: usize) -> Option<usize> {
        self.giants.iter().position(|giant| giant.ball as usize == ball)
    }

    /// Nothing happens to `ball` from `now` until `time`, or until it leaves its place: notes it where it comes close.
    pub fn note(&mut self, world: &World, nearby: &Nearby, ball: usize, now: Time, time: Time) {
        // They always look at each other.
        if self.which(ball).is_none() {
            (0..self.giants.len()).for_each(|k| self.note_for(k, (world, nearby), ball, now, time));
        }
    }

    #[inline(always)]
    fn note_for(&mut self, k: usize, (world, nearby): (&World, &Nearby), ball: usize, now: Time, time: Time) {
        let bit = 1 << k;
        if !self.comes_close(k, (world, nearby), ball, now, time) {
            self.close[ball] &= !bit;
            return;
        }
        self.close[ball] |= bit;
        if self.noted[ball] & bit == 0 {
            self.noted[ball] |= bit;
            self.giants[k].noted.push(ball as u32);
        }
    }

    /// Whether a ball comes so close to where a very large one is on its course, from `now` until `time` or until it leaves its
    /// place, that it touches it if that is as far from its course as it may be.
    #[inline(always)]
    fn comes_close(&self, k: usize, (world, nearby): (&World, &Nearby), ball: usize, now: Time, time: Time) -> bool {
        let Giant { ball: giant, course: Some(course), .. } = self.giants[k] else { return false };
        let (acceleration, flown) = (world.acceleration(giant as usize), now.since(course.start()));
        let r = self.periods.nearest(world.position(ball, now) - course.position_after(flown, acceleration));
        let within = world.radii[giant as usize] + world.radii[ball] + self.margin;
        let farthest = within + self.before_leaving;
        if r.length_squared() > farthest * farthest {
            return false;
        }
        let v = world.velocity(ball, now) - course.velocity_after(flown, acceleration);
        // So it does not fly so far that it could come close through another image.
        let time = nearby.moved_by(world, ball, now, time);
        let seconds = if time.is_reachable() { time.since(now) } else { f64::INFINITY };
        let approach = r.dot(v);
        let closest = if approach < 0.0 { (-approach / v.length_squared()).min(seconds) } else { 0.0 };
        // What is not a number, of speeds too small for their squares, counts as close.
        !((r + v * closest).length_squared() >= within * within)
    }

    /// Whether a very large ball stays near its course from `now` until `time`.
    fn keeps_course(&self, k: usize, world: &World, now: Time, time: Time) -> bool {
        let Giant { ball, course: Some(course), .. } = self.giants[k] else { return false };
        let (row, acceleration) = (ball as usize, world.acceleration(ball as usize));
        let aside = |time: Time| {
            let on_course = course.position_after(time.since(course.start()), acceleration);
            self.periods.nearest(world.position(row, time) - on_course).length()
        };
        // Both ways are straight to each other: it is farthest at one of the ends.
        time.is_reachable() && aside(now).max(aside(time)) < self.margin * (1.0 - SPARE)
    }

    /// Gathers whomever a very large ball can meet while it keeps its course.
    fn gather(&mut self, k: usize, room: &mut Gathered) {
        let bit = 1 << k;
        room.clear();
        self.giants.iter().enumerate().filter(|(other, _)| *other != k).for_each(|(_, giant)| room.push(giant.ball));
        let (noted, close) = (&mut self.noted, &self.close);
        self.giants[k].noted.retain(|&other| {
            let is_close = close[other as usize] & bit != 0;
            if is_close {
                room.push(other);
            } else {
                noted[other as usize] &= !bit;
            }
            is_close
        });
    }

    /// A very large ball is on its course from `now` on, and all `around` are looked at.
    fn begin_course(
        &mut self,
        k: usize,
        (world, nearby): (&World, &Nearby),
        now: Time,
        around: &[u32],
        upcoming: &[Upcoming],
    ) {
        let bit = 1 << k;
        let giant = &mut self.giants[k];
        giant.course = Some(world.flights[giant.ball as usize]);
        for other in giant.noted.drain(..) {
            self.noted[other as usize] &= !bit;
            self.close[other as usize] &= !bit;
        }
        for &other in around {
            if self.which(other as usize).is_none() {
                self.note_for(k, (world, nearby), other as usize, now, upcoming[other as usize].time);
            }
        }
    }
}

impl Simulation {
    /// Looks anew at whomever `ball` can meet, if it is very large, and tells whether it is: at those who come close to its
    /// course, as long as it keeps to it; at all around if it does not, or has left its place.
    #[inline(never)]
    pub(super) fn predict_giant(&mut self, ball: usize, now: Time, elsewhere: bool) -> bool {
        let Some(k) = self.giants.which(ball) else { return false };
        let (world, nearby, giants, room) = (&self.world, &self.nearby, &mut self.giants, &mut self.room);
        if giants.giants[k].course.is_some() && !elsewhere {
            giants.gather(k, room);
            room.retain_partners(world, ball);
            let first = self.predictor.first_impact_among(world, nearby, ball, now, room.filled_up(ball));
            if giants.keeps_course(k, world, now, first.time) {
                self.schedule(ball, first, now);
                return true;
            }
        }
        let row = nearby.row(world, ball, room);
        giants.begin_course(k, (world, nearby), now, row, &self.upcoming);
        let first = self.predictor.first_impact_among(world, nearby, ball, now, row);
        self.schedule(ball, first, now);
        true
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::random::Random;
    use crate::scene::{Ball, Balls, Fill, Placement, RadiusDistribution, Scene};
    use crate::world::{Boundary, Domain};

    /// Small balls of radius 1/2 at random among a few of radius `radius`.
    struct Mixture {
        boundary: Boundary,
        side: f64,
        giants: usize,
        radius: f64,
        /// Mass of a large ball; infinite if its motion is prescribed.
        mass: f64,
        /// Of the large balls, in every direction of space, away from their corner of the box or towards the others.
        speed: f64,
        small: u64,
        /// Of the small ones.
        temperature: f64,
        gravity: f64,
        restitution: f64,
    }

    const HEAVY: Mixture = Mixture {
        boundary: Boundary::Periodic,
        side: 34.0,
        giants: 1,
        radius: 10.0,
        mass: 8000.0,
        speed: 0.01,
        small: 9000,
        temperature: 1.0,
        gravity: 0.0,
        restitution: 1.0,
    };

    impl Mixture {
        fn scene(&self, seed: u64) -> Scene {
            let mut balls = Balls::default();
            for id in 0..self.giants {
                let site = DVec3::new((id % 2) as f64, (id / 2 % 2) as f64, (id % 2) as f64) - 0.5;
                let fixed = self.mass.is_infinite();
                let position = if self.giants == 1 { DVec3::ZERO } else { site * (0.5 * self.side) };
                let velocity = site * -self.speed;
                let mass = if fixed { 1.0 } else { self.mass };
                balls
                    .push(Ball { id: id as i64, position, velocity, radius: self.radius, mass, material: 0, fixed }, 3);
            }
            let small = Fill {
                first_id: 100,
                placement: Placement::Random,
                count: Some(self.small),
                packing: None,
                radius: RadiusDistribution::Constant(0.5),
                mass: Some(1.0),
                density: None,
                temperature: self.temperature,
                velocity: DVec3::ZERO,
                center: None,
                size: None,
                material: 0,
            };
            Scene {
                domain: Domain { boundary: [self.boundary; 3], size: DVec3::splat(self.side) },
                balls,
                fills: if self.small > 0 { vec![small] } else { Vec::new() },
                gravity: DVec3::new(0.1, 0.0, -1.0) * self.gravity,
                restitution: self.restitution,
                seed,
                ..Scene::default()
            }
        }

        fn check(&self, seed: u64, impacts: u64) {
            let (bits, expected) = both_ways(&self.scene(seed), self.giants, impacts);
            let changed = bits.iter().zip(&expected).position(|(a, b)| a != b);
            assert!(bits == expected, "{seed} {:?} {} {}: {changed:?}", self.boundary, self.side, self.mass);
        }
    }

    /// So many impacts, where the very large look at the noted alone, and where they look at all around.
    fn both_ways(scene: &Scene, giants: usize, impacts: u64) -> (Vec<u64>, Vec<u64>) {
        let world = scene.build().expect("a scene").0;
        let mut simulation = Simulation::new(world.clone(), true);
        assert_eq!(simulation.giants.giants.len(), giants);
        let mut without = Simulation::new(world, true);
        without.giants.forget();
        without.predict_all();
        (simulation.impacts_to_the_bit(impacts), without.impacts_to_the_bit(impacts))
    }

    #[test]
    fn looking_at_the_noted_alone_changes_no_bit() {
        for seed in 0..3 {
            HEAVY.check(seed, 20_000);
            // So light that it is off its course at once.
            Mixture { mass: 1.0, ..HEAVY }.check(seed, 20_000);
            Mixture { mass: 100.0, boundary: Boundary::Walls, restitution: 0.98, ..HEAVY }.check(seed, 20_000);
            Mixture { boundary: Boundary::Walls, gravity: 0.05, ..HEAVY }.check(seed, 20_000);
            Mixture { boundary: Boundary::Walls, mass: f64::INFINITY, ..HEAVY }.check(seed, 20_000);
            // Into others at rest, of whom nobody says where he is before he is met.
            Mixture { mass: 1e5, speed: 3.0, temperature: 0.0, side: 50.0, small: 30_000, ..HEAVY }.check(seed, 40_000);
            // Several, which meet each other; also where two can meet through more than one image.
            let several = Mixture { mass: 1e5, radius: 8.5, side: 44.0, small: 20_000, speed: 4.0, ..HEAVY };
            Mixture { giants: 3, ..several }.check(seed, 40_000);
            Mixture { giants: 2, side: 36.5, ..several }.check(seed, 40_000);
        }
    }

    /// Nothing ever happens to a ball at rest, so nobody is told about it: when the large one has left its cell, it looks itself.
    #[test]
    fn whoever_lies_ahead_is_found() {
        let alone = Mixture { small: 0, speed: 0.0, mass: 1e5, side: 100.0, ..HEAVY };
        // Both ways: who is told about before the large one looks is another.
        for way in [1.0, -1.0] {
            let velocity = DVec3::new(1.5, 0.3, 0.0) * way;
            let mut scene = alone.scene(0);
            scene.balls.velocities[0] = velocity;
            let mut push = |position: DVec3, velocity: DVec3| {
                let id = 100 + scene.balls.len() as i64;
                scene.balls.push(Ball { id, position, velocity, radius: 0.5, mass: 1.0, material: 0, fixed: false }, 3);
            };
            // A crowd that flies with it, behind; somebody always is about to catch it up.
            let mut random = Random::new(1, 0);
            for k in 0..12 * 25 * 25 {
                let site =
                    DVec3::new((k / 625) as f64 - 12.0, (k / 25 % 25) as f64 - 12.0, (k % 25) as f64 - 12.0) * 1.2;
                if (11.0..14.0).contains(&site.length()) {
                    push(site * way, velocity + random.normal_vector(3) * 0.3);
                }
            }
            // Ahead, on either side of its way, and beyond the faces of the box.
            for k in 0..40 {
                let (angle, ahead) = (2.4 * k as f64, 0.8 * k as f64);
                let aside = DVec3::new(0.0, angle.cos(), angle.sin()) * 8.0;
                push((DVec3::new(17.0 + ahead, 3.0, 0.0) + aside) * way, DVec3::ZERO);
                push((DVec3::new(-49.0 + ahead, 20.0, 0.0) + aside) * way, DVec3::ZERO);
            }
            let (bits, expected) = both_ways(&scene, 1, 60_000);
            assert!(bits == expected, "{way}: {:?}", bits.iter().zip(&expected).position(|(a, b)| a != b));
        }
    }
}
