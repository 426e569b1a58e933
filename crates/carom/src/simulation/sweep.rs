//! Sweeps: every so often all balls that are leaving their cells are moved, in the order of memory, and meet who is newly near.
//! It is cheaper by far than an event for each passage from cell to cell; and it changes no impact.

use super::Simulation;
use super::look_ahead::Depth;
use crate::event::Alone;
use crate::predict::{First, Meeting, Newly};
use crate::prefetch::prefetch;
use crate::time::Time;
use crate::world::cells::sweep::{Strays, Sweep};
use crate::world::nearby::Nearby;

/// Of so many balls, one may leave its cell by an event of its own between two sweeps: more, and sweeps become more frequent; four
/// times fewer, and they become rarer. (What a thousand balls at packings of 0.1 and 0.3 are fastest with; 32 to 512 are as good
/// within three per cent.)
const BALLS_PER_LEAVER: u64 = 128;
/// Sweeps are at least so many times farther apart than what belongs to one instant.
const INSTANTS: f64 = 1024.0;
/// New pairs are looked at when there are so many: they and their flights are still in the cache.
const BATCH: usize = 256;
/// So many balls are looked at before those of them that have to be moved are: all of these are still in the cache.
const BLOCK: usize = 512;
/// Where there are more balls than the caches hold: so many strays ahead, what comes next for one is fetched, and its cells.
const FETCHED_EARLY: usize = 16;
const FETCHED_LATE: usize = 6;

/// When all balls are looked at next.
#[derive(Clone, Debug)]
pub(super) struct Sweeps {
    /// When; [`Time::NEVER`] where there are none.
    pub next: Time,
    /// Seconds from one to the next.
    interval: f64,
    /// Events of balls that left their cells since the last one.
    leavers: u64,
    /// Room for those that have to be moved, their new pairs, and who of them has to be foretold anew.
    strays: Vec<u32>,
    newly: Newly,
    found: Vec<Meeting>,
}

impl Sweeps {
    /// None.
    pub fn never() -> Self {
        Self {
            next: Time::NEVER,
            interval: f64::INFINITY,
            leavers: 0,
            strays: Vec::new(),
            newly: Newly::default(),
            found: Vec::new(),
        }
    }
}

impl Simulation {
    /// Begins to sweep, where it can be done: at first at an interval in which a ball of middle speed gets as far as it may.
    pub(super) fn begin_sweeps(&mut self, now: Time) {
        self.sweeps = Sweeps::never();
        let Nearby::Cells(cells) = &self.nearby else { return };
        let (world, slack) = (&self.world, cells.slack());
        if slack == 0.0 {
            return;
        }
        let squares: f64 = (0..world.len()).map(|ball| world.velocity(ball, now).length_squared()).sum();
        let speed = (squares / world.len().max(1) as f64).sqrt();
        self.plan_sweep(now, slack / speed);
    }

    fn plan_sweep(&mut self, now: Time, interval: f64) {
        let Nearby::Cells(cells) = &mut self.nearby else { return };
        let clock = self.world.clock;
        // Before events of whose instant somebody could be farther out.
        let early = 4.0 * self.predictor.same_instant();
        self.sweeps.leavers = 0;
        self.sweeps.interval = interval;
        let horizon = clock.after(now, interval);
        if interval > INSTANTS * early && horizon.is_reachable() {
            cells.hold_until(horizon);
            self.sweeps.next = clock.after(now, interval - early);
        } else {
            cells.hold_until(Time::NEVER);
            self.sweeps.next = Time::NEVER;
        }
    }

    /// Notes that a ball has left its cell by an event of its own. Where nobody had to be swept for and many do so now, sweeps
    /// begin anew.
    #[inline(always)]
    pub(super) fn note_leaver(&mut self, now: Time) {
        self.sweeps.leavers += 1;
        if !self.sweeps.next.is_reachable() && self.sweeps.leavers > 2 * self.world.len() as u64 {
            self.begin_sweeps(now);
        }
    }

    /// Whether whatever comes at `time` has to wait for a sweep.
    #[inline(always)]
    pub(super) fn sweeps_by(&self, time: Time) -> bool {
        !time.before(self.sweeps.next) && self.sweeps.next.is_reachable()
    }

    /// Moves all balls that would get too far out of their cells before the next sweep; foretells anew what for them comes sooner now.
    #[inline(never)]
    pub(super) fn sweep(&mut self) {
        let now = self.sweeps.next;
        let (balls, leavers) = (self.world.len() as u64, self.sweeps.leavers);
        let change = if leavers == 0 {
            2.0
        } else if leavers * 4 * BALLS_PER_LEAVER < balls {
            1.25
        } else if leavers * BALLS_PER_LEAVER > balls {
            0.8
        } else {
            1.0
        };
        self.plan_sweep(now, self.sweeps.interval * change);
        let sweep = Sweep { now, interval: self.sweeps.interval };
        let mut strays = std::mem::take(&mut self.sweeps.strays);
        let mut newly = std::mem::take(&mut self.sweeps.newly);
        let len = self.world.len();
        for first in (0..len).step_by(BLOCK) {
            let Nearby::Cells(cells) = &self.nearby else { break };
            let balls = first..len.min(first + BLOCK);
            self.width.run(Strays { cells, world: &self.world, sweep: &sweep, balls, found: &mut strays });
            for (k, &ball) in strays.iter().enumerate() {
                if self.look_ahead.depth == Depth::Near {
                    self.look_ahead_of_stray(&strays[k..]);
                }
                self.bring_home(ball as usize, &sweep, &mut newly);
                if newly.count() > BATCH {
                    self.meet_newly(now, &mut newly);
                }
            }
        }
        self.meet_newly(now, &mut newly);
        self.sweeps.strays = strays;
        self.sweeps.newly = newly;
        if self.is_out_of_order() {
            self.lay_out_anew(now);
        }
    }

    fn bring_home(&mut self, ball: usize, sweep: &Sweep, newly: &mut Newly) {
        let now = sweep.now;
        let known = self.upcoming[ball];
        if !known.is_impact() {
            // It leaves by an event of its own, and is where it may be until then.
            return;
        }
        let Nearby::Cells(cells) = &mut self.nearby else { return };
        let before = newly.count();
        let (passed, fast) = cells.bring_home(&self.world, ball, sweep, newly.others());
        self.counts.crossings += u64::from(passed);
        let on_finest = cells.is_on_finest_level(ball);
        if passed > 0 {
            if self.giants.any() {
                if self.predict_giant(ball, now, true) {
                    newly.others().truncate(before);
                    return;
                }
                self.giants.note(&self.world, &self.nearby, ball, now, known.time);
            }
            let plain = self.predictor.is_plain(&self.world, ball, now) && !self.world.is_fixed(ball);
            if !plain || !on_finest || !self.nearby.planes(ball).is_empty() {
                newly.others().truncate(before);
                self.predict(ball, now);
                return;
            }
            let limit = known.time.since(self.world.flights[ball].start());
            if self.look_ahead.depth == Depth::Near {
                newly.others().rows()[before..].iter().for_each(|&other| prefetch(&self.world.flights, other as usize));
            }
            // Whom it meets newly after what it foresees is not told.
            if known.alone != Alone::OVER {
                self.upcoming[ball].alone = Alone::UNKNOWN;
            }
            newly.ask(before, ball as u32, limit + (self.predictor.same_instant() + 8.0 * f64::EPSILON * limit));
        }
        if fast && self.nearby.leaves_before(&self.world, ball, now, known.time).is_some() {
            if self.is_stale(ball) {
                self.predict(ball, now);
            } else {
                self.schedule(ball, First::single(known.time, known.partner), now);
            }
        }
    }

    /// Fetches what bringing home the next few strays will look at.
    #[inline(always)]
    fn look_ahead_of_stray(&self, strays: &[u32]) {
        if let Some(&ball) = strays.get(FETCHED_EARLY) {
            prefetch(&self.upcoming, ball as usize);
        }
        if let (Some(&ball), Nearby::Cells(cells)) = (strays.get(FETCHED_LATE), &self.nearby) {
            cells.prefetch_cells(ball as usize, None);
        }
    }

    /// Foretells anew for whoever meets somebody newly near before what it foresees.
    fn meet_newly(&mut self, now: Time, newly: &mut Newly) {
        let mut found = std::mem::take(&mut self.sweeps.found);
        self.predictor.meet_newly(&self.world, now, newly, &mut found);
        for meetings in found.chunk_by(|a, b| a.ball == b.ball) {
            let ball = meetings[0].ball as usize;
            match self.predictor.first_of_meetings(&self.world, now, &self.upcoming[ball], meetings) {
                Some(first) => self.schedule(ball, first, now),
                None => self.predict(ball, now),
            }
        }
        found.clear();
        self.sweeps.found = found;
    }
}

#[cfg(test)]
pub(super) mod tests {
    use glam::DVec3;

    use super::*;
    use crate::random::Random;
    use crate::scene::{Ball, Balls, Fill, Placement, PlaneBody, RadiusDistribution, Scene};
    use crate::world::{Boundary, Domain};

    const COUNT: i64 = 300;

    /// Balls on a lattice, a third of a step off it at most, of radii up to `spread` times the smallest; every third at rest,
    /// every tenth a hundred times as fast as the others, every seventh in prescribed motion if any is.
    pub fn scene(boundary: Boundary, spacing: f64, spread: f64, any_fixed: bool, seed: u64) -> Scene {
        let mut random = Random::new(seed, 0);
        let mut uniform = || random.uniform();
        let mut balls = Balls::default();
        let side = 7.0;
        for id in 0..COUNT {
            let site = DVec3::new((id % 7) as f64, (id / 7 % 7) as f64, (id / 49) as f64);
            let jitter = DVec3::new(uniform(), uniform(), uniform()) - 0.5;
            let velocity = DVec3::new(uniform(), uniform(), uniform()) - 0.5;
            let fixed = any_fixed && id % 7 == 0;
            let speed = match id {
                _ if fixed => 0.2,
                _ if id % 3 == 0 => 0.0,
                _ if id % 10 == 1 => 100.0,
                _ => 1.0,
            };
            balls.push(
                Ball {
                    id,
                    position: (site - 0.5 * (side - 1.0)) * spacing + jitter * (0.9 * (spacing - spread)),
                    velocity: velocity * speed,
                    radius: 0.5 * (1.0 + (spread - 1.0) * uniform()),
                    mass: 1.0 + uniform(),
                    material: 0,
                    fixed,
                },
                3,
            );
        }
        let size = DVec3::splat(side * spacing + if boundary == Boundary::Walls { 0.1 } else { 0.0 });
        Scene { domain: Domain { boundary: [boundary; 3], size }, balls, ..Scene::default() }
    }

    fn start(scene: &Scene) -> Simulation {
        Simulation::new(scene.build().expect("a scene").0, true)
    }

    /// The same without sweeps: every passage from cell to cell is an event. (And very large balls look at all around.)
    fn without_sweeps(scene: &Scene) -> Simulation {
        let mut simulation = start(scene);
        simulation.sweeps = Sweeps::never();
        simulation.giants.forget();
        let Nearby::Cells(cells) = &mut simulation.nearby else { panic!("cells were expected") };
        cells.forbid_straying(&simulation.world.domain);
        simulation.predict_all();
        simulation
    }

    #[test]
    fn sweeps_change_no_bit() {
        for seed in 0..6 {
            for (boundary, spacing, spread, any_fixed, gravity) in [
                (Boundary::Periodic, 1.9, 1.0, false, 0.0),
                (Boundary::Periodic, 1.3, 1.0, false, 0.0),
                (Boundary::Periodic, 1.8, 1.3, true, 0.0),
                (Boundary::Walls, 1.7, 1.2, false, 0.0),
                (Boundary::Walls, 1.8, 1.0, false, 0.7),
                (Boundary::Walls, 2.5, 1.1, true, 0.7),
            ] {
                let mut scene = scene(boundary, spacing, spread, any_fixed, seed);
                scene.gravity = DVec3::new(0.1, 0.0, -1.0) * gravity;
                let mut swept = start(&scene);
                let bits = swept.impacts_to_the_bit(6000);
                assert!(swept.sweeps.next.is_reachable(), "{boundary:?} {spacing}: no sweeps");
                let expected = without_sweeps(&scene).impacts_to_the_bit(6000);
                assert!(bits == expected, "{boundary:?} {spacing} {spread} {any_fixed} {gravity} {seed}");
            }
        }
    }

    /// Small balls at random among large ones of several sizes, each as heavy as its volume or all alike, every third in prescribed
    /// motion if any is.
    pub fn mixture(
        (boundary, side): (Boundary, f64),
        (large, speed): (&[f64], f64),
        (small, temperature): (u64, f64),
        any_fixed: bool,
        seed: u64,
    ) -> Scene {
        let mut random = Random::new(seed, 1);
        let mut uniform = || random.uniform();
        let mut balls = Balls::default();
        let sites = (large.len() as f64).cbrt().ceil();
        for (id, &radius) in large.iter().enumerate() {
            let place = id as f64;
            let site = DVec3::new(place % sites, (place / sites).floor() % sites, (place / sites / sites).floor());
            let position = ((site + 0.5) / sites - 0.5) * side;
            let fixed = any_fixed && id % 3 == 0;
            let velocity = (DVec3::new(uniform(), uniform(), uniform()) - 0.5) * if fixed { 0.05 } else { speed };
            let mass = if seed.is_multiple_of(2) { 8.0 * radius.powi(3) } else { 1.0 };
            balls.push(Ball { id: id as i64, position, velocity, radius, mass, material: 0, fixed }, 3);
        }
        let small = Fill {
            first_id: 1000,
            placement: Placement::Random,
            count: Some(small),
            packing: None,
            radius: RadiusDistribution::Uniform { low: 0.45, high: 0.5 },
            mass: Some(1.0),
            density: None,
            temperature,
            velocity: DVec3::ZERO,
            center: None,
            size: None,
            material: 0,
        };
        let domain = Domain { boundary: [boundary; 3], size: DVec3::splat(side) };
        Scene { domain, balls, fills: vec![small], seed, ..Scene::default() }
    }

    /// Cells of several levels; also boxes of few of the largest cells, and a ball so large that thousands are near.
    #[test]
    fn sweeps_change_no_bit_in_mixtures() {
        let eight = [1.1, 2.0, 2.4, 1.6, 2.3, 1.0, 1.9, 0.8];
        for seed in 0..4 {
            for (boundary, side, large, (small, temperature), any_fixed, gravity) in [
                (Boundary::Periodic, 16.0, (&eight[..], 0.5), (900, 1.0), false, 0.0),
                (Boundary::Periodic, 16.5, (&eight[..], 0.5), (700, 1.0), true, 0.0),
                (Boundary::Periodic, 30.0, (&[2.0; 27][..], 0.5), (3000, 1.0), false, 0.0),
                (Boundary::Walls, 15.0, (&eight[..], 0.5), (700, 1.0), false, 0.3),
                (Boundary::Walls, 15.0, (&eight[..], 0.5), (500, 1.0), true, 0.3),
                (Boundary::Periodic, 34.0, (&[10.0][..], 0.5), (5000, 1.0), false, 0.0),
                (Boundary::Walls, 34.0, (&[10.0][..], 0.5), (4000, 1.0), false, 0.1),
                // Large ones into small ones at rest, which never look themselves.
                (Boundary::Periodic, 40.0, (&[2.0; 216][..], 3.0), (1000, 0.0), false, 0.0),
            ] {
                let mut scene = mixture((boundary, side), large, (small, temperature), any_fixed, seed);
                scene.gravity = DVec3::new(0.1, 0.0, -1.0) * gravity;
                let mut swept = start(&scene);
                let Nearby::Cells(cells) = &swept.nearby else { panic!("cells were expected") };
                assert!(!cells.has_one_level());
                assert!(swept.sweeps.next.is_reachable(), "{boundary:?} {side}: no sweeps");
                let mut expected = without_sweeps(&scene);
                let same = swept.impacts_to_the_bit(3 * small) == expected.impacts_to_the_bit(3 * small);
                assert!(same, "{boundary:?} {side} {any_fixed} {gravity} {seed}");
                // And from a checkpoint, where cells, sweeps and whoever is very large are found anew.
                let bytes = swept.checkpoint();
                let world = scene.build().expect("a scene").0;
                let mut resumed = Simulation::restore(world, &bytes, true).expect("a checkpoint");
                let expected = expected.impacts_to_the_bit(3 * small);
                for simulation in [&mut swept, &mut resumed] {
                    let same = simulation.impacts_to_the_bit(3 * small) == expected;
                    assert!(same, "{boundary:?} {side} {any_fixed} {gravity} {seed}, later");
                }
            }
        }
    }

    /// Nobody is farther out of its cell than it may be, at any impact, though many are outside; also where they fall.
    #[test]
    fn nobody_is_too_far_out() {
        for (boundary, gravity, seed) in
            [(Boundary::Periodic, 0.0, 1), (Boundary::Walls, 3.0, 2), (Boundary::Walls, 30.0, 3)]
        {
            let mut scene = scene(boundary, 2.2, 1.0, false, seed);
            scene.gravity = DVec3::new(0.1, 0.0, -1.0) * gravity;
            let mut simulation = start(&scene);
            let (mut outside, mut sweeps) = (0, 0);
            for _ in 0..5_000 {
                let sweep = simulation.sweeps.next;
                // Only impacts bring the time on: bookkeeping looks ahead of it.
                assert_eq!(simulation.run(Time::NEVER, 1, u64::MAX), Ok(super::super::Stop::Impacts));
                sweeps += u32::from(simulation.sweeps.next != sweep);
                let (Nearby::Cells(cells), now) = (&simulation.nearby, simulation.now) else {
                    panic!("cells were expected")
                };
                for (ball, upcoming) in simulation.upcoming.iter().enumerate() {
                    let position = simulation.world.position(ball, now);
                    // Its own event of this instant may be yet to come.
                    if !now.before(upcoming.time) {
                        continue;
                    }
                    for axis in 0..3 {
                        let Some((low, high)) = cells.bounds(ball, axis) else { continue };
                        let out = (low - position[axis]).max(position[axis] - high);
                        // Of a place some ten units from the origin, rounding leaves 1e-15 each time.
                        assert!(out < 1e-13, "{boundary:?} {gravity}: ball {ball} is {out} m too far out");
                        outside += u32::from(out > -cells.slack());
                    }
                }
            }
            assert!(outside > 10_000 && sweeps > 30, "{outside} {sweeps}");
        }
    }

    /// Also what is fetched and kept ahead; it is done for many balls only.
    #[test]
    fn looking_ahead_changes_no_bit() {
        for (spacing, spread) in [(1.9, 1.0), (1.3, 1.0), (1.05, 1.0), (1.7, 1.3)] {
            let scene = scene(Boundary::Periodic, spacing, spread, false, 9);
            let expected = start(&scene).impacts_to_the_bit(20_000);
            for depth in [Depth::Noted, Depth::Near] {
                let mut ahead = start(&scene);
                ahead.look_ahead.depth = depth;
                assert!(ahead.impacts_to_the_bit(20_000) == expected, "{spacing} {spread} {depth:?}");
            }
        }
    }

    /// A gas at rest has no sweeps; a piston sets it in motion, and they begin.
    #[test]
    fn sweeps_begin_when_balls_at_rest_are_set_in_motion() {
        let mut scene = scene(Boundary::Walls, 2.0, 1.0, false, 3);
        scene.balls.velocities.fill(DVec3::ZERO);
        let normal = DVec3::X;
        let offset = -0.5 * scene.domain.size.x;
        scene.planes.push(PlaneBody { id: 1000, normal, offset, velocity: normal * 0.02, material: 0 });
        let mut simulation = start(&scene);
        assert!(!simulation.sweeps.next.is_reachable());
        let far = simulation.world.clock.at(300.0);
        simulation.run(far, u64::MAX, u64::MAX).expect("a run");
        assert!(simulation.sweeps.next.is_reachable(), "{:?}", simulation.counts());
        // Nothing is left to happen where nothing moves: sweeps do not go on for ever.
        let mut scene = scene.clone();
        scene.planes.clear();
        let mut rest = start(&scene);
        assert_eq!(rest.run(Time::NEVER, u64::MAX, 10_000), Ok(super::super::Stop::Time));
    }
}
